"""What an accuracy study studies: one scene, its targets, and the references of everything a designer reads of it."""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from loomopt import designs, maths
from loomopt.balance import Given
from loomopt.cycle import TURN, Floats
from loomopt.jobs.tasks import TASKS, Task
from loomopt.maths import Maths, Number
from loomopt.program.program import Program
from loomopt.program.sampling import Sampler
from loomopt.solving import engine
from loomopt.solving.solution import Solution
from loomopt.studies import check, digits
from loomopt.studies.ladders import Reference

CLOSEST = 1e-11
"""Accuracy of the answers that references start from."""
TIGHTEST = 60
"""Digits of the references of closed forms: twenty more than the most that a method has."""
POSITIONS = 24
"""Crank angles, evenly over the turn, at which closed forms are compared."""
Pose = Callable[[Any, Maths, Given, Number, Sequence[Number]], Any]


@dataclass(frozen=True)
class Readings:
    """What a designer reads of a job.

    targets: the optima; peaks: figure → (quantity, whether its sign counts); static: figures of one position; motion:
    what the second derivative of the output's displacement is called; pose: the model's pose at a position.
    """

    targets: tuple[str, ...]
    peaks: Mapping[str, tuple[str, bool]]
    static: tuple[str, ...]
    motion: str
    pose: Pose


def _plain(model: Any, maths: Maths, given: Given, phi: Number, switches: Sequence[Number]) -> Any:
    return model.pose(maths, given, phi)


def _switched(model: Any, maths: Maths, given: Given, phi: Number, switches: Sequence[Number]) -> Any:
    return model.pose(maths, given, phi, switches)


READINGS = {
    "beatup": Readings(("balance",), {"peak_torque": ("peak_torque", False)}, ("M3_fdc",), "psi_2", _plain),
    "rapier": Readings(
        ("stroke-dwell",),
        {"peak_acceleration": ("peak_acceleration", False), "stroke": ("S", True)},
        (),
        "S_2",
        _plain,
    ),
    "shedding": Readings(("stiffness", "law"), {"contact_max": ("cam_force", False)}, (), "X_2", _switched),
}
"""Job → what is read of it."""


class Subject:
    """A scene under study."""

    def __init__(self, scene: Any) -> None:
        self.scene, self.readings = scene, READINGS[scene.job.name]
        self.task: Task = TASKS[scene.job.name]
        self.targets = [Target(scene, name) for name in self.readings.targets if name in check.served(scene)]

    @functools.cached_property
    def sampler(self) -> Sampler:
        """Today's machine."""
        return self.task.sampler(self.scene, self.task.today(self.scene))

    @functools.cached_property
    def peaks(self) -> dict[str, tuple[str, bool]]:
        """Peaks that today's machine has."""
        return {figure: read for figure, read in self.readings.peaks.items() if self.sampler.peak(read[0]) > 0.0}

    @functools.cached_property
    def positions(self) -> tuple[Floats, Floats]:
        """Crank angles, rad, and switches (switches, n) of the positions that are compared."""
        cycle = self.sampler.cycle
        angles = [TURN * (k + 0.5) / POSITIONS for k in range(POSITIONS)]
        nodes = [cycle.located(angle) for angle in angles]
        pieces = np.array([piece for piece, _ in nodes], dtype=np.intp)
        turned = cycle.angles(pieces, np.array([u for _, u in nodes]))
        return turned, cycle.switches[pieces].T

    def pose(self, system: Maths, given: Given, phi: Number, switches: Sequence[Number]) -> Any:
        """Return today's machine at a position, in any number system."""
        return self.readings.pose(self.sampler.model, system, given, phi, switches)

    def motion(self, system: Maths, given: Given) -> list[Any]:
        """Return the second derivative of the displacement at every position, one by one."""
        angles, switches = self.positions
        places = list(switches.T.tolist())
        return [
            self.pose(system, given, system.number(float(angle)), place).q2
            for angle, place in zip(angles, places, strict=True)
        ]

    @functools.cached_property
    def exact(self) -> digits.Precise:
        """Today's machine in more digits than any method has."""
        return digits.precise(self.sampler, TIGHTEST)

    def reference(self, quantity: str) -> Reference | None:
        """Return what a reading of today's machine truly is, in 40 digits; closed forms in 60."""
        if quantity == self.readings.motion:
            exact = self.exact
            return Reference(self.motion(exact.maths, exact.given))
        if quantity in self.readings.static:
            return Reference(self.exact.static(self.sampler.front, [quantity])[quantity])
        if quantity in self.peaks:
            return Reference(digits.peak(self.sampler, *self.peaks[quantity]))
        return None


@dataclass(frozen=True)
class Target:
    """A target of a scene with the optimum in many digits."""

    scene: Any
    name: str

    @property
    def task(self) -> Task:
        """The job at work."""
        return TASKS[self.scene.job.name]

    @functools.cached_property
    def program(self) -> Program:
        """The task as data."""
        return self.task.program(self.scene, self.name)

    @property
    def figure(self) -> str:
        """The figure of the last objective, which the earlier ones leave room for."""
        return self.program.objectives[-1].figure

    def quantity(self, what: str) -> str:
        """Return how a reading of the optimum is called in the rows."""
        return f"{self.name} {what}"

    def variables(self, answer: Solution) -> dict[str, float]:
        """Return an answer's NLP variables, SI."""
        found = self.task.values(self.program, designs.flat(answer.design))
        return {v.name: found[v.name] for v in self.program.variables}

    @functools.cached_property
    def answer(self) -> Solution:
        """The closest answer there is."""
        return engine.solve(self.scene, self.name, accuracy=CLOSEST)

    @functools.cached_property
    def optimum(self) -> digits.Optimum | None:
        """The optimum in 40 digits; None where there is no certified answer."""
        if self.answer.status != "optimal":
            return None
        return digits.optimum(self.program, self.answer.point, self.variables(self.answer))

    def reference(self, what: str) -> Reference | None:
        """Return the true optimum's figure, or its design in natural sizes; None where it is not unique."""
        found, moves = self.optimum, len(self.task.moves(self.program))
        if found is None or (what == "design" and found.flat > moves):
            return None
        if what == "design":
            return Reference(self.placed(found.x), found.design_uncertainty, 1.0)
        objective, value = self.program.objectives[-1], found.objectives[-1]
        if objective.power != 1:
            value = value ** (1 / maths.mpmath(digits.DIGITS).number(objective.power))
        return Reference(value, found.uncertainty, 0.0 if value else objective.scale)

    def placed(self, x: Mapping[str, Any]) -> list[Any]:
        """Return variables in natural sizes, apart from the moves that leave every figure unchanged."""
        number = maths.mpmath(digits.DIGITS).number
        scaled = {v.name: number(x[v.name]) / number(v.scale) for v in self.program.variables}
        for move in self.task.moves(self.program):
            if move.kind == "axis":
                scaled |= dict.fromkeys(move.along, number(0.0))
                continue
            length = sum(scaled[name] ** 2 for name in move.along) ** number(0.5)
            scaled |= {name: scaled[name] / length for name in move.along}
        return list(scaled.values())

    def merit(self, x: Mapping[str, float]) -> float:
        """Return the figure of the last objective at variables (SI), true over the whole cycle."""
        sampler = Sampler(self.program.model, {**self.program.parameters, **x})
        objective = self.program.objectives[-1]
        if objective.form == "peak":
            return sampler.peak(objective.row)
        value = {**sampler.given.values, **sampler.figures}[objective.row]
        return float(value) if objective.power == 1 else math.pow(value, 1 / objective.power)
