"""Views of a job: drawings, equations, panels and remarks."""

import abc
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from loomopt.physics.effects.kinds import Check

if TYPE_CHECKING:
    from loomopt.model.sampling import Sampler
    from loomopt.picture.equations import Equation
    from loomopt.picture.force_arrows import ForceArrow
    from loomopt.picture.mechanism_drawing import MechanismDrawing
    from loomopt.picture.motion import MechanismMotion
    from loomopt.picture.panels import Curve, Panel
    from loomopt.picture.shapes import Drawing, Floats
    from loomopt.scenes.scene import Scene

Numbers = Mapping[str, float]


class Span(NamedTuple):
    """A stretch of the cycle, rad, that may run over angle 0: where it begins and where it ends."""

    begin: float
    end: float


Marks = Mapping[str, float | Span]
"""Name → a crank angle, rad, or a stretch of the cycle."""


def tells_forces(scene: "Scene") -> bool:
    """Whether an active effect gives forces in joints."""
    return any(isinstance(effect, Check) and effect.joints for effect in scene.active)


def force_sizes(scene: "Scene", forces: "Iterable[ForceArrow]") -> "dict[ForceArrow, str]":
    """Forces with their magnitudes in the scene's unit."""
    return {force: scene.show(force.size, "force", 4) for force in forces}


class JobViews(abc.ABC):
    """Views of a job. A design, SI, may name only some numbers; the others are today's.

    angle: what phi is; lists: part of a design that is a list → what its numbers are, "{count}" for how many.
    """

    angle: str = "crank angle"
    lists: Mapping[str, str] = {}

    @abc.abstractmethod
    def linkage(self, scene: "Scene", design: Numbers) -> "Drawing":
        """Mechanism drawn at full scale in the positions that matter. Raises BadInput."""

    @abc.abstractmethod
    def joints_csv(self, scene: "Scene", design: Numbers) -> str:
        """The drawing as CSV in its unit: joints and masses, or a profile. Raises BadInput."""

    def motion(self, scene: "Scene", design: Numbers, angles: "Floats") -> "MechanismMotion | None":
        """Mechanism at crank angles, (n,) rad, as it moves; None where a job has none. Raises BadInput."""
        return None

    @abc.abstractmethod
    def equations(self, scene: "Scene") -> "tuple[Equation, ...]":
        """Equations the scene really uses."""

    @abc.abstractmethod
    def marks(self, scene: "Scene", design: Numbers) -> Marks:
        """Crank angles and stretches of the cycle a reader looks for."""

    def panels(self, scene: "Scene", design: Numbers, columns: Sequence[str]) -> "tuple[Panel, ...]":
        """Panels of a figure of curves: by default all columns, named by `words`."""
        from loomopt.picture.panels import arrange

        return arrange(scene, design, columns, self.words())

    def words(self) -> "Mapping[str, Curve]":
        """Descriptions of the columns of the curves, by name."""
        return {}

    def remarks(self, scene: "Scene", design: Numbers) -> tuple[str, ...]:
        """Remarks on a design, sentences without a full stop: of curves and of checks."""
        from loomopt.maths.systems import FLOAT
        from loomopt.model.numbers import numbers, table_remarks
        from loomopt.physics.effects.kinds import Check, Inputs, owned

        known = numbers(scene) | {scene.full(name): value for name, value in design.items()}
        sentences = list(table_remarks(scene))
        for check in (effect for effect in scene.active if isinstance(effect, Check)):
            inputs = {key: known.get(owned(check, key)) for key in check.table.model_fields}
            sentences.append(check.remark(Inputs(FLOAT, known, inputs, None), scene.show))
        return tuple(text for text in sentences if text)

    def missing(self, scene: "Scene") -> tuple[str, ...]:
        """Keys without which the scene cannot be drawn."""
        return ()


class LinkViews(JobViews):
    """Views of a mechanism of links, drawn and moved by its `MechanismDrawing`."""

    @abc.abstractmethod
    def drawn(self, scene: "Scene", design: Numbers) -> "MechanismDrawing":
        """Mechanism of a design. Raises BadInput where it cannot be drawn."""

    @abc.abstractmethod
    def sampler(self, scene: "Scene", design: Numbers) -> "Sampler":
        """Samples of a design, for the forces in its joints."""

    def linkage(self, scene: "Scene", design: Numbers) -> "Drawing":
        """Mechanism at its events, at full scale, with the forces that active effects give. Raises BadInput."""
        from loomopt.picture import force_arrows
        from loomopt.picture.shapes import drawn_units

        drawn, forces = self.drawn(scene, design), None
        if tells_forces(scene):
            events = (drawn.force_event,) if drawn.force_event else ()
            arrows = force_arrows.joint_forces(self.sampler(scene, design), events, drawn.force_joints())
            forces = force_sizes(scene, arrows)
        return drawn.drawing(scene.name, drawn_units(scene), forces)

    def joints_csv(self, scene: "Scene", design: Numbers) -> str:
        """Joints and centres of mass as CSV. Raises BadInput."""
        from loomopt.picture.shapes import drawn_units

        return self.drawn(scene, design).skeleton.csv(drawn_units(scene))

    def motion(self, scene: "Scene", design: Numbers, angles: "Floats") -> "MechanismMotion":
        """Mechanism at crank angles, rad. Raises BadInput."""
        return self.drawn(scene, design).motion(angles)
