"""Forces of a design's curves that have components, for the choice of bearings."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from loomopt.base.errors import refusal
from loomopt.base.records import Frozen
from loomopt.jobs import registry
from loomopt.model.curves import ANGLE, split
from loomopt.model.model import COMPONENTS, FRAME, heading_name
from loomopt.physics.cycle import TURN, Floats
from loomopt.physics.effects.kinds import Check
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    import pandas as pd

CUBIC, ROLLER = 3.0, 10.0 / 3.0
"""Exponents of the mean force in the life of ball and roller bearings [ISO 281]."""


TODAY: Mapping[str, float] = Frozen()


class TurnedForce(NamedTuple):
    """One force over the turn: crank angles, rad, ascending; components in the frame, N.

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

    def on(self, part: str) -> tuple[Floats, Floats]:
        """Components, N, along axes that turn with a part, x along its line."""
        cosine, sine = self.headings[part]
        return self.x * cosine + self.y * sine, self.y * cosine - self.x * sine


def from_curves(scene: Scene, curves: "pd.DataFrame", design: Mapping[str, float] = TODAY) -> Mapping[str, TurnedForce]:
    """Forces, by name, of which a design's curves (SI) have both components. Raises BadInput without any."""
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
    return {
        name: TurnedForce(
            phi,
            known[f"{name}_x"],
            known[f"{name}_y"],
            {part: turned[part] for part in sides[name] if part in turned} if name in sides else crank,
        )
        for name in names
    }


def tells(scene: Scene) -> bool:
    """Whether an active effect gives forces by their components."""
    return any(map(_tells_forces, scene.active))


def _tells_forces(effect: object) -> bool:
    return isinstance(effect, Check) and any(figure.kind == "force" for figure in effect.figures)
