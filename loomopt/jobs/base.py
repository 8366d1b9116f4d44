"""All that other packages know of a job: one object. What few jobs need has a default here."""

import abc
import functools
import importlib
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from loomopt.base.errors import BadInput
from loomopt.base.records import Frozen
from loomopt.base.units import SI_UNIT
from loomopt.jobs.task import Task
from loomopt.maths.systems import Number
from loomopt.model import drive, numbers
from loomopt.model.curves import STEPS, Columns, curves, tops
from loomopt.model.model import JobModel
from loomopt.model.program import Numbers, Program
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.cycle import Floats
from loomopt.physics.effects.kinds import Check, Event, label
from loomopt.picture.job_views import JobViews
from loomopt.scenes.scene import Scene
from loomopt.scenes.tables import SceneSchema

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

    from loomopt.model.axes import Requested, Traded
    from loomopt.model.separation import Parted
    from loomopt.scenes.scene import Scene


class Crossing(NamedTuple):
    """The first crank angle at which |quantity| passes a level: the figure that tells it, and the level's full name."""

    figure: str
    quantity: str
    level: str


class LawFamily(NamedTuple):
    """Ever finer sets of designs that a target chooses from, such as laws of more and more intervals.

    method: what its ladder is called; target, key: whose scene key says how fine; limit(scene, x): the figure that
    they tend to, SI, in many digits, x the optimum's variables; None where no closed form holds.
    """

    method: str
    target: str
    key: str
    limit: "Callable[[Scene, Mapping[str, Number]], Number | None]"


class Studied(NamedTuple):
    """What a designer reads of a job.

    targets: the optima; peaks: figure → (quantity, whether its sign counts); static: figures of one position;
    motion: what the second derivative of the output's displacement is called.
    """

    targets: tuple[str, ...]
    peaks: Mapping[str, tuple[str, bool]] = Frozen()
    static: tuple[str, ...] = ()
    motion: str = "q_2"
    crossing: Crossing | None = None
    family: LawFamily | None = None


Figures = Mapping[str, float | None]


class Job(abc.ABC):
    """A loom mechanism and what can be asked of it; all numbers SI."""

    name: str
    own_schema: SceneSchema
    """What a scene may hold, where that does not depend on the scene."""
    task: type[Task]
    """What builds the program of a scene and target, or of axes that are traded."""
    open_boxes: str = ""
    """Why branch and bound does not close on its designs, "" where it does."""
    loosening: Mapping[str, str] = MappingProxyType({})
    """Variables that only limits read, and only looser as they grow, wherever the program has another variable too."""

    # What every job says.

    @abc.abstractmethod
    def check(self, scene: Scene) -> None:
        """Raise BadInput where today's machine is not one that this job can work on."""

    @abc.abstractmethod
    def model(self, scene: Scene, design: Mapping[str, float] | None = None) -> JobModel:
        """Return the mechanism with the effects the scene calls for; design: whose own parts take the scene's place."""

    @abc.abstractmethod
    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """Return one sentence on what an optimum of the target is worth."""

    @abc.abstractmethod
    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """Return what the curves over the cycle show of the motion, and what force and torque are called."""

    # What few jobs say otherwise.

    def program(self, scene: Scene, target: str) -> Program:
        """Return a target as a task: structure and numbers. Raises BadInput."""
        return self.task(scene, target).program()

    def schema(self, document: Mapping[str, Any]) -> SceneSchema:
        """Return what a scene may hold; document: the raw scene, on which that may depend."""
        return self.own_schema

    @property
    def package(self) -> str:
        """The package of the job's own files."""
        return str(sys.modules[type(self).__module__].__package__)

    @property
    def views(self) -> JobViews:
        """The job's own pictures, equations and remarks: VIEWS of its views.py, imported when it is first asked for."""
        found: JobViews = importlib.import_module(f"{self.package}.views").VIEWS
        return found

    @property
    def resources(self) -> "Traversable":
        """The folder with the job's template.toml, and problems/ and results/ where it brings any."""
        from importlib.resources import files

        return files(self.package)

    def demand(self, scene: Scene, target: str) -> None:
        """Raise BadInput where a target speaks of what the scene does not have."""
        demand(scene, target)

    def today(self, scene: Scene) -> dict[str, float]:
        """Return today's design by full names, with every other number that the scene frees."""
        known, variables = self.numbers(scene), scene.schema.variables
        others = [scene.full(name) for name, bound in scene.bounds.items() if name not in variables and bound.free]
        return {name: known[name] for name in (*variables, *others)}

    def numbers(self, scene: Scene) -> dict[str, float]:
        """Return every number of the scene by full name."""
        return self.task(scene).known

    def numbers_of(self, scene: Scene, design: Numbers) -> dict[str, float]:
        """Return all numbers of a design, by any name of each; a number it does not name stays the scene's."""
        return self.numbers(scene) | {scene.full(name): value for name, value in design.items()}

    def sampler(self, scene: Scene, design: Numbers) -> Sampler:
        """Return a design ready to be sampled, at the speed that the scene gives its crank. Raises BadInput."""
        found = sampled(self.model(scene, design), self.numbers_of(scene, design))
        if drive.motor(found.model.effects) is None:
            return found
        from loomopt.model.crank_motion import turned

        return turned(found, scene)

    def curves(
        self, scene: Scene, design: Numbers, steps: int = STEPS, also: Sequence[float] = ()
    ) -> dict[str, Floats]:
        """Return the curves of a design over one turn, units in the column names; peaks that are figures are rows."""
        sampler = self.sampler(scene, design)
        peaks = tops(sampler, self.peaks(sampler.model).values())
        kinds = {name: figure.kind for name, figure in scene.schema.figures.items()} | drive.KINDS
        names = [name for check in sampler.model.checks for name in check.quantities]
        names += drive.KINDS if drive.motor(sampler.model.effects) else ()
        checks = {name: SI_UNIT[kinds[name]] for name in names}
        columns, parted = self.columns(scene, sampler)._replace(checks=checks), self.parted(scene, sampler)
        return (parted.curves if parted else functools.partial(curves, sampler))(columns, steps, [*peaks, *also])

    def parted(self, scene: Scene, sampler: Sampler) -> "Parted | None":
        """Return a sampled design, followed, where an effect of the scene may part its output from the mechanism."""
        if not any(isinstance(effect, Event) for effect in scene.active):
            return None
        from loomopt.model.separation import followed

        return followed(scene, sampler)

    def design(self, program: Program, x: Numbers) -> dict[str, float]:
        """Return the design a person reads, by full names, from the NLP's variables: these themselves."""
        return dict(x)

    def figures(self, scene: Scene, design: Numbers) -> dict[str, float | None]:
        """Return every figure of the job; None for one whose numbers the scene does not have."""
        sampled = self.sampler(scene, design)
        found: dict[str, float | None] = {name: sampled.figures.get(name) for name in scene.schema.figures}
        return found | {name: sampled.peak(quantity) for name, quantity in self.peaks(sampled.model).items()}

    def traded(self, scene: Scene, target: str | None, asked: "Requested") -> "tuple[Program, tuple[Traded, ...]]":
        """Return the task whose levels are axes, after what a target holds (None: nothing), and the axes.

        Raises BadInput.
        """
        from loomopt.model import axes

        bounded = [name for name, bound in scene.bounds.items() if bound.free and bound.min < bound.max]
        known = axes.requested_of(scene.schema.axes, bounded, asked, scene.origin)
        if target:
            self.demand(scene, target)
        task = self.task(scene, target or "", tuple(asked))
        return axes.with_axes(task.program(), known, asked, scene.full, task.size)

    def values(self, program: Program, design: Numbers) -> dict[str, float]:
        """Return the NLP's variables of a design."""
        return program.completed({**program.parameters, **design})

    def tidy(self, program: Program, x: Numbers) -> dict[str, float]:
        """Return the NLP's variables without what is only rounding."""
        return dict(x)

    def peaks(self, model: JobModel) -> Mapping[str, str]:
        """Return the figures that are extremes over the cycle, with their quantities."""
        return {name: name for name in model.quantities}

    def studied(self, scene: Scene) -> Studied:
        """Return what studies read: the default target, and every figure that is the largest |value| of a quantity."""
        peaks = {name: (name, False) for name in self.model(scene).quantities}
        return Studied((scene.schema.default_target,), peaks)

    def adopted(self, scene: Scene, design: Mapping[str, Any], target: str) -> tuple[Scene, str]:
        """Return the scene whose own are a design's lists, and the target whose limits it keeps."""
        return scene, target

    def sizes(self, scene: Scene) -> Mapping[str, Sequence[float]]:
        """Return the freed numbers, as a designer calls them, that come in sizes only, with those sold, ascending."""
        found: dict[str, Sequence[float]] = {}
        for check, own in _checks(scene):
            for key, sold in check.sold(own).items():
                bound = scene.bounds.get(label(check, key))
                if bound is not None and bound.free and bound.min < bound.max:
                    found[label(check, key)] = sold
        return found

    def explain(self, scene: Scene, clash: Collection[str]) -> str:
        """Return what physics says of why the limits named `clash` do; "" where it says nothing."""
        known = self.numbers(scene)
        limited = numbers.bounds(scene, known)
        told = [check.explain(known, limited, own, clash, scene.show) for check, own in _checks(scene)]
        return " ".join(text for text in told if text)


def _checks(scene: Scene) -> list[tuple[Check[Any], Any]]:
    """Return the checks that are on, each with the values of its table."""
    on = zip(scene.active, scene.effects.values(), strict=True)
    return [(effect, own) for effect, own in on if isinstance(effect, Check)]


def demand(scene: Scene, target: str) -> None:
    """Raise BadInput where the scene lacks a number or an effect that its target needs."""
    asked = scene.schema.targets[target]
    for name in asked.needs:
        if name not in scene.operation:
            raise BadInput(
                f"target {target} needs {name}",
                file=scene.origin,
                key=f"operation.{name}",
                remedy=f"Give operation.{name}, or choose another target.",
            )
    for name in asked.needs_effects:
        if name not in scene.effects:
            raise BadInput(
                f"target {target} needs the effect {name}",
                file=scene.origin,
                key=f"effects.{name}",
                remedy=f"Add the table [effects.{name}], or choose another target.",
            )
