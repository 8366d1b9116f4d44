"""What an accuracy study studies: one scene, its targets, and the references of everything a designer reads of it."""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from loomopt.jobs import registry
from loomopt.jobs.base import Job, Studied
from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.model.program import Program
from loomopt.model.reading import Reading
from loomopt.model.sampling import Sampler
from loomopt.physics.balance import Given
from loomopt.physics.cycle import TURN, Floats, Node, Pieces
from loomopt.physics.effects.kinds import Motion
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving import engine
from loomopt.solving.answer.solution import Solution
from loomopt.studies import check
from loomopt.studies.accuracy import reference_digits
from loomopt.studies.accuracy.ladders import LadderReference
from loomopt.studies.accuracy.reference_digits import CLOSED_DIGITS, REFERENCE_DIGITS

REFERENCE_ACCURACY = 1e-11
"""Accuracy of the answers that references start from: the finest that can be asked."""

POSITIONS = 24
"""Crank angles, evenly over the turn, at which closed forms are compared."""


class Subject:
    """A scene under study."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.job = scene, registry.of(scene)
        self.studied: Studied = self.job.studied(scene)
        self.targets = [StudiedTarget(scene, name) for name in self.studied.targets if name in check.served(scene)]

    @functools.cached_property
    def sampler(self) -> Sampler:
        """Today's machine."""
        return self.job.sampler(self.scene, self.job.today(self.scene))

    @functools.cached_property
    def peaks(self) -> dict[str, tuple[str, bool]]:
        """Peaks that today's machine has."""
        return {figure: read for figure, read in self.studied.peaks.items() if self.sampler.peak(read[0]) > 0.0}

    @functools.cached_property
    def positions(self) -> tuple[Pieces, Floats]:
        """Pieces and crank angles, rad, of the positions that are compared."""
        cycle = self.sampler.cycle
        pieces, u = cycle.located(TURN * (np.arange(POSITIONS) + 0.5) / POSITIONS)
        return pieces, cycle.angles(pieces, u)

    def output(self, system: Maths, given: Given, node: Node) -> Motion:
        """Return the output's motion of today's machine at a position, in any number system."""
        motion: Motion = self.sampler.model.instant(system, given, node).pose
        return motion

    def motion(self, system: Maths, given: Given) -> list[Number]:
        """Return the second derivative of the displacement at every position, one by one."""
        places = zip(*self.positions, strict=True)
        nodes = [Node(system.number(float(angle)), self.sampler.cycle.switch(int(k))) for k, angle in places]
        return [self.output(system, given, node).q2 for node in nodes]

    @functools.cached_property
    def exact(self) -> Reading:
        """Today's machine in more digits than any method has."""
        return reference_digits.precise(self.sampler, CLOSED_DIGITS)

    def reference(self, quantity: str) -> LadderReference | None:
        """Return what a reading of today's machine truly is, in 40 digits; closed forms in 60."""
        if quantity == self.studied.motion:
            exact = self.exact
            return LadderReference(self.motion(exact.maths, exact.given))
        if quantity in self.studied.static:
            return LadderReference(self.exact.single(quantity))
        if quantity in self.peaks:
            return LadderReference(reference_digits.peak(self.sampler, *self.peaks[quantity]))
        return None


@dataclass(frozen=True)
class StudiedTarget:
    """A target of a scene with the optimum in many digits."""

    scene: Scene
    name: str

    @property
    def job(self) -> Job:
        """The job at work."""
        return registry.of(self.scene)

    @functools.cached_property
    def program(self) -> Program:
        """The task as data."""
        return self.job.program(self.scene, self.name)

    @property
    def figure(self) -> str:
        """The figure of the last objective, which the earlier ones leave room for."""
        return self.program.objectives[-1].figure

    def quantity(self, what: str) -> str:
        """Return how a reading of the optimum is called in the rows."""
        return f"{self.name} {what}"

    def variables(self, answer: Solution) -> dict[str, float]:
        """Return an answer's NLP variables, SI."""
        found = self.job.values(self.program, designs.flat(answer.design))
        return {v.name: found[v.name] for v in self.program.variables}

    @functools.cached_property
    def answer(self) -> Solution:
        """The closest answer there is."""
        return engine.solve(self.scene, self.name, accuracy=REFERENCE_ACCURACY)

    @functools.cached_property
    def optimum(self) -> reference_digits.Optimum | None:
        """The optimum in 40 digits; None without a certified answer, or of several rows that are no peaks."""
        known = all(len(o.rows) == 1 for o in self.program.objectives)
        if self.answer.status != "optimal" or not known:
            return None
        return reference_digits.optimum(self.program, self.answer.point, self.variables(self.answer))

    def reference(self, what: str) -> LadderReference | None:
        """Return the true optimum's figure, or its design in natural sizes; None where it is not unique."""
        found, moves = self.optimum, len(self.program.moves)
        if found is None or (what == "design" and found.flat > moves):
            return None
        if what == "design":
            return LadderReference(self.placed(found.x), found.design_uncertainty, 1.0)
        objective, value = self.program.objectives[-1], found.objectives[-1]
        if objective.power != 1:
            value = value ** (1 / systems.mpmath(REFERENCE_DIGITS).number(objective.power))
        return LadderReference(value, found.uncertainty, 0.0 if value else objective.scale)

    def placed(self, x: Mapping[str, Number]) -> list[Number]:
        """Return variables in natural sizes, apart from the moves that leave every figure unchanged."""
        number = systems.mpmath(REFERENCE_DIGITS).number
        scaled = {v.name: number(x[v.name]) / number(v.scale) for v in self.program.variables}
        for move in self.program.moves:
            if move.is_apart:
                scaled |= dict.fromkeys(move.along, number(0.0))
                continue
            length = sum(scaled[name] ** 2 for name in move.along) ** number(0.5)
            scaled |= {name: scaled[name] / length for name in move.along}
        return list(scaled.values())

    def merit(self, x: Mapping[str, float]) -> float:
        """Return the figure of the last objective at variables (SI), true over the whole cycle."""
        sampler = Sampler(self.program.model, {**self.program.parameters, **x})
        objective = self.program.objectives[-1]
        value = objective.merit(sampler)
        return value if objective.power == 1 else math.pow(value, 1 / objective.power)
