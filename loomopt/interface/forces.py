"""Forces of a design's curves that have components, for the choice of bearings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from loomopt.base.errors import refusal
from loomopt.base.records import Frozen
from loomopt.base.units import factor
from loomopt.interface.study_result import Presentation
from loomopt.jobs import registry
from loomopt.model.curves import ANGLE, split
from loomopt.model.model import COMPONENTS, FRAME, heading_name
from loomopt.physics.cycle import TURN, Floats
from loomopt.physics.effects.kinds import Check
from loomopt.picture.chart import COLOURS, Axis, Chart, Charts, Series, fit_axis, heading, ticks
from loomopt.picture.table import TextTable
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    import pandas as pd

CUBIC, ROLLER = 3.0, 10.0 / 3.0
"""Exponents of the mean force in the life of ball and roller bearings [ISO 281]."""
ROOMY = 1.08
"""Half the width of a diagram over the largest force."""
FRAMED, REACTION, ACTING = "in the frame", "reaction", "on the part it acts on"
KINDS = {FRAMED: "c0", REACTION: "c2", ACTING: "c1"}
"""Axes that a force is shown in → its kind of style."""

TODAY: Mapping[str, float] = Frozen()


class TurnedForce(NamedTuple):
    """Force over the turn: crank angles, rad, ascending; components in the frame, N.

    peak, at: the largest size, N, and its crank angle, rad; mean, ball, roller: the mean size over the turn, and the
    means of its powers 3 and 10/3 that bearings' lives go by, N. headings: unit directions over the turn of the parts
    that it is between, but for the frame; the part that it comes from first.
    """

    phi: Floats
    x: Floats
    y: Floats
    headings: Mapping[str, tuple[Floats, Floats]] = Frozen()

    @property
    def size(self) -> Floats:
        """|F|, N."""
        return np.asarray(np.hypot(self.x, self.y))

    @property
    def peak(self) -> float:
        """The largest |F|, N."""
        return float(self.size.max())

    @property
    def at(self) -> float:
        """Crank angle of the peak, rad."""
        return float(self.phi[int(self.size.argmax())])

    def mean(self, power: float = 1.0) -> float:
        """Mean force (mean of |F|^power over the crank angle)^(1/power), N."""
        phi, values = np.append(self.phi, self.phi[0] + TURN), np.append(self.size, self.size[:1]) ** power
        return float((np.sum(np.diff(phi) * (values[1:] + values[:-1]) / 2) / TURN) ** (1 / power))

    @property
    def labels(self) -> list[str]:
        """Names of the axes that the force is shown in: the frame's, and those of its parts."""
        return [FRAMED, *([REACTION, ACTING][-len(self.headings) :] if self.headings else [])]

    def on(self, part: str) -> tuple[Floats, Floats]:
        """Components, N, along axes that turn with a part, x along its line."""
        cosine, sine = self.headings[part]
        return self.x * cosine + self.y * sine, self.y * cosine - self.x * sine


@dataclass(frozen=True)
class Forces(Presentation):
    """Forces of one design over the turn, by name."""

    scene: Scene
    by_name: Mapping[str, TurnedForce]
    heading = "Forces in the joints"

    def tables(self) -> list[str | TextTable]:
        """Table of forces: peak, its crank angle, and the means for bearing life."""
        lines, force, angle = [], self.scene.shown_in("force"), self.scene.shown_in("angle")
        for name, turned in self.by_name.items():
            numbers = turned.peak / factor(force), turned.at / factor(angle), *self._means(turned, factor(force))
            lines.append((name, " and ".join(turned.headings), *(f"{number:.6g}" for number in numbers)))
        sizes = f"peak\n{force}", f"at\n{angle}", f"mean\n{force}", f"p = 3\n{force}", f"p = 10/3\n{force}"
        heads = "force", "turning\nparts", *sizes
        title = "forces over the turn; p = 3 and 10/3: means for the life of ball and roller bearings"
        return [f"{self.scene.name}: {title}", TextTable("", heads, tuple(lines), tuple(range(2, 7)))]

    def charts(self) -> Charts:
        """Sizes over the turn, and of each force its components, in the frame and on the parts that turn with it."""
        title = f"{self.scene.name}: forces over the turn, in the frame and on turning parts"
        names = list(self.by_name)
        sizes = [self._sizes(names[place : place + COLOURS]) for place in range(0, len(names), COLOURS)]
        drawn = {label for force in self.by_name.values() for label in force.labels}
        key = [(kind, label) for label, kind in KINDS.items() if label in drawn]
        return Charts(title, [*sizes, *(self._diagram(name) for name in names)], key=key)

    def _means(self, force: TurnedForce, size: float) -> list[float]:
        return [force.mean(power) / size for power in (1.0, CUBIC, ROLLER)]

    def _sizes(self, names: Sequence[str]) -> Chart:
        unit, angle = self.scene.shown_in("force"), self.scene.shown_in("angle")
        kinds = {name: f"c{place}" for place, name in enumerate(names)}
        series = []
        for name, kind in kinds.items():
            phi, size = (np.append(values, values[:1]) for values in (self.by_name[name].phi, self.by_name[name].size))
            phi[-1] += TURN
            series.append(Series(phi / factor(angle), size / factor(unit), kind, name))
        name = f"{registry.of(self.scene).views.angle} phi [{angle}]"
        across = Axis(0.0, TURN / factor(angle), [k * TURN / 4 / factor(angle) for k in range(5)], name)
        upright = fit_axis([np.zeros(1), *(curve.y for curve in series)])
        key = [(kind, name) for name, kind in kinds.items()]
        return Chart(heading("size of forces", unit), across, series, key=key, cursor=True, upright=upright, wide=True)

    def _diagram(self, name: str) -> Chart:
        """Tip of a force over the turn, from its joint as the origin."""
        force, unit = self.by_name[name], self.scene.shown_in("force")
        size, row = factor(unit), int(self.by_name[name].size.argmax())
        seen = [(force.x, force.y), *map(force.on, force.headings)]
        series = [
            Series(np.append(x, x[:1]) / size, np.append(y, y[:1]) / size, KINDS[label], label)
            for (x, y), label in zip(seen, force.labels, strict=True)
        ]
        most = ROOMY * force.peak / size or 1.0
        axis = Axis(-most, most, ticks(-most, most, 4))
        shown = [self.scene.show(value * size, "force", 4) for value in (force.peak / size, *self._means(force, size))]
        key = [("dot c0", f"peak {shown[0]}, mean {shown[1]}"), ("", f"p = 3, 10/3: {shown[2]}, {shown[3]}")]
        title = heading(" on ".join(filter(None, (name, " and ".join(force.headings)))), unit)
        dots = [(force.x[row] / size, force.y[row] / size, "c0")]
        return Chart(title, axis, series, dots=dots, key=key, upright=axis, equal=True)


def from_curves(scene: Scene, curves: "pd.DataFrame", design: Mapping[str, float] = TODAY) -> Forces:
    """Forces of which a design's curves (SI) have both components. Raises BadInput without any."""
    columns = {split(str(column)): column for column in curves}
    known = {name: curves[column].to_numpy() for (name, unit), column in columns.items() if unit == "N"}
    names = [name for name in known if f"{name}_x" in known and f"{name}_y" in known]
    if not names:
        giving = [e.name for e in scene.schema.effects.values() if _tells_forces(e) and e.name not in scene.effects]
        remedy = f"Switch on one of these: {', '.join(giving)}" if giving else "No effect of this job gives them"
        raise refusal("no effect that is on gives forces by components", scene.origin, "effects", remedy=remedy)
    phi = curves[ANGLE].to_numpy()
    sampler = registry.of(scene).sampler(scene, design)
    sides, turned = sampler.model.sides, dict[str, tuple[Floats, Floats]]()
    for part in {part for name in names for part in sides.get(name, ())} - {FRAME}:
        x, y = (np.asarray(sampler.at_angles(heading_name(part, axis), phi)) for axis in COMPONENTS)
        turned[part] = x, y
    crank = {"crank": (np.cos(phi), np.sin(phi))}
    by_name = {
        name: TurnedForce(
            phi,
            known[f"{name}_x"],
            known[f"{name}_y"],
            {part: turned[part] for part in sides[name] if part in turned} if name in sides else crank,
        )
        for name in names
    }
    return Forces(scene, by_name)


def tells(scene: Scene) -> bool:
    """Whether an active effect gives forces by their components."""
    return any(map(_tells_forces, scene.active))


def _tells_forces(effect: object) -> bool:
    return isinstance(effect, Check) and bool(effect.vectors or effect.directed)
