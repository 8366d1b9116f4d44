"""The linkage job: planar linkages of one degree of freedom."""

import math
from collections.abc import Container, Mapping
from typing import TYPE_CHECKING, Any, final

import numpy as np

from loomopt.jobs import base
from loomopt.jobs.base import EVERY, Figures, InBox, Job, Studied
from loomopt.jobs.linkage import scene as scenes
from loomopt.jobs.linkage.model import OBLIQUITY, RADIUS, PeaksOf, lift_of, linkage_of, roller_peaks
from loomopt.jobs.linkage.program import LinkageTask, model
from loomopt.maths import periodic_cubic
from loomopt.maths.periodic_cubic import TURN
from loomopt.maths.systems import Number
from loomopt.model import change
from loomopt.model.change import CHANGE
from loomopt.model.curves import Columns
from loomopt.model.model import Formula, Instant, JobModel
from loomopt.model.program import Numbers
from loomopt.model.sampling import Sampler
from loomopt.physics.tolerances import FEASIBLE
from loomopt.scenes.csv_tables import Record
from loomopt.scenes.scene import Scene
from loomopt.scenes.tables import SceneSchema

if TYPE_CHECKING:
    from loomopt.model.machines import Machines

LEAST = ("x_min.", "y_min.", "radius_min.")


@final
class LinkageJob(Job):
    """A linkage described in the scene."""

    name = "linkage"
    task = LinkageTask

    def open_boxes(self, model: JobModel) -> str:
        """Boxes of a four-bar close, those of longer chains do not."""
        if linkage_of(model).four_bar:
            return ""
        return "no global claim: boxes of a chain's designs do not close in any time worth waiting for"

    def schema(self, document: Mapping[str, Any]) -> SceneSchema:
        """Schema of a scene: it depends on the scene's tables. Raises BadInput."""
        return scenes.schema(document)

    def check(self, scene: Scene) -> None:
        """Raise BadInput where today's linkage does not turn all round, or a name means nothing in it."""
        scenes.check(scene)

    def model(self, scene: Scene, design: Numbers | None = None) -> JobModel:
        """Linkage with the effects the scene calls for."""
        return model(scene, design=design)

    def figures_of(
        self, scene: Scene, sampled: "Sampler | Machines", names: Container[str] = EVERY
    ) -> dict[str, Number]:
        """Every figure of a machine, or of many, SI; None for one whose numbers the scene does not have."""
        peaks = {name: of for name, of in self.peaks(sampled.model).items() if name in names}
        pressed = {name: of for name, of in of_rollers(sampled.model).items() if name in names}
        sampled.search((*peaks.values(), *{quantity for of in pressed.values() for quantity in of.quantities}))
        figures = base.static_figures(scene, sampled, names)
        if CHANGE in figures:
            task = LinkageTask(scene)
            figures[CHANGE] = change.figure(task.changing, sampled.values, task.known, task.limited, task.weights)
        for name, of in pressed.items():
            heights: list[Number] = [0.0, *map(sampled.peak, of.quantities)]
            figures[name] = np.max(np.stack(np.broadcast_arrays(*heights)), axis=0) ** (1 / of.power)
        return figures | {name: self.read(name, sampled.peak(quantity)) for name, quantity in peaks.items()}

    def over_cycle(self, model: JobModel) -> dict[str, str]:
        """Figures that are read over the cycle; those of contacts are the largest of several quantities."""
        return {**super().over_cycle(model), **dict.fromkeys(of_rollers(model), "")}

    def read(self, name: str, peak: Number) -> Number:
        """Figure of a quantity's largest value, SI."""
        if name.startswith("mu."):
            return math.pi / 2 - peak
        return -peak if name.startswith(LEAST) else peak

    def peaks(self, model: JobModel) -> dict[str, str]:
        """Figures that are extremes over the cycle."""
        peaks = {name: name for name in model.quantities}
        of_contacts = {q for figure, of in of_rollers(model).items() if figure != RADIUS for q in of.quantities}
        of_contacts |= {lift_of(roller.name) for roller in linkage_of(model).chain.rollers}
        peaks |= {name: name for name in model.signed if name not in of_contacts}
        return peaks | {f"mu.{part}": f"{part}.{OBLIQUITY}" for part in linkage_of(model).oblique}

    def in_boxes(self, scene: Scene, model: JobModel) -> dict[str, InBox]:
        """Reading of each figure over a box of numbers."""
        ends = {name: (self.read(name, 0.0), self.read(name, 1.0)) for name in self.peaks(model)}
        peaks = {
            name: InBox(quantity=of, sign=ends[name][1] - ends[name][0], offset=ends[name][0])
            for name, of in self.peaks(model).items()
        }
        return super().in_boxes(scene, model) | peaks

    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """Sentence on an optimum; figures in SI."""
        kinds, clauses, task = scene.schema.figures, [], LinkageTask(scene, target)
        linkage, load, nearest = linkage_of(task.plain_model), "", ""
        for place, (name, sense) in enumerate(task.levels):
            value = figures.get(name)
            if name in kinds and value is not None:
                made_zero = abs(value) <= FEASIBLE * task.figure_size(name)
                text = scene.show(0.0 if made_zero else value, kinds[name].kind, 9)
                if place == 0 and name in linkage.loads:
                    load, nearest = name, "" if made_zero else text
                else:
                    clauses.append(f"the {sense} {name} is {text}")
            elif name not in kinds:
                clauses.append(f"the {sense} {name} is sought")
        rest = ", then ".join(clauses)
        if load:
            word = "force" if linkage.output.slides else "moment"
            return base.balance_sentence(
                f"the {word} of {linkage.output.name}", f"at {linkage.loads[load]}", nearest, rest
            )
        return f"{rest[:1].upper()}{rest[1:]}."

    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """Output with three derivatives, the transmission angles, the terms, force and torque."""
        linkage = linkage_of(sampler.model)
        slides = linkage.output.slides
        unit, force = ("m", "N") if slides else ("rad", "N*m")
        per = ("m/rad", "m/rad^2", "m/rad^3") if slides else ("1", "1", "1")
        motion = {f"q [{unit}]": _order(0)} | {f"q_{k} [{per[k - 1]}]": _order(k) for k in (1, 2, 3)}
        motion |= {f"mu_{part} [rad]": _mu(part) for part in linkage.oblique}
        return Columns(
            motion,
            force,
            (f"Q [{force}]", lambda at: at.force),
            ("Md [N*m]", lambda at: at.crank_torque),
            also=tuple(float(sampler.given.values[place.value]) for place in linkage.places),
        )

    def demand(self, scene: Scene, target: str) -> None:
        """Raise BadInput if a target needs a number that the scene does not have."""
        base.demand(scene, target)
        self.task(scene, target).demand_figures()

    def tables(self, scene: Scene, target: str) -> tuple[Record, ...]:
        """Remarks on the tables that are read, that of a path too."""
        return (*super().tables(scene, target), *self._path_records(scene, target), *self._match_records(scene, target))

    def _path_records(self, scene: Scene, target: str) -> list[Record]:
        name = scenes.table_target(scene, target, "point")
        if name is None:
            return []
        read = scenes.read_path(scene, name)
        count = len(read.lines)
        angles = read.columns.get("phi", tuple(TURN * k / count for k in range(count)))
        misfit = {column: periodic_cubic.misfit(angles, read.columns[column]) for column in ("x", "y")}
        return [read.record(f"targets.{name}.table", misfit, "the path to follow")]

    def _match_records(self, scene: Scene, target: str) -> list[Record]:
        name = scenes.table_target(scene, target, "match")
        if name is None:
            return []
        read = scenes.read_match(scene, name)
        misfit = {"q": periodic_cubic.misfit(read.columns["phi"], read.columns["q"])}
        return [read.record(f"targets.{name}.match", misfit, "the function of the output")]

    def studied(self, scene: Scene) -> Studied:
        """Quantities that studies show."""
        quantities = super().studied(scene)
        return quantities._replace(peaks={name: (name, False) for name in self.model(scene).quantities})


def of_rollers(model: JobModel) -> dict[str, PeaksOf]:
    """Figures that are the largest of several quantities of the rollers."""
    return roller_peaks(linkage_of(model), model.effects, model.known)


def _order(order: int) -> Formula:
    return lambda at: at.pose.order(order)


def _mu(group: str) -> Formula:
    def value(at: Instant) -> Number:
        return math.pi / 2 - abs(at.pose.joints.obliquity(group))

    return value


JOB = LinkageJob()
