"""The beat-up job: balance the reed torque of a four-bar crank-rocker within the space [Yuan24]."""

from collections.abc import Callable, Collection

import numpy as np

from loomopt.jobs.base import Figures, Job, Studied
from loomopt.jobs.beatup import design as designs
from loomopt.jobs.beatup import program as programs
from loomopt.jobs.beatup.scene import SCHEMA, check
from loomopt.model.curves import Columns
from loomopt.model.model import JobModel
from loomopt.model.numbers import bounds
from loomopt.model.program import Numbers, Program
from loomopt.model.sampling import Sampler
from loomopt.scenes.scene import Scene


class Beatup(Job):
    """A four-bar crank-rocker with the reed on its rocker."""

    name = "beatup"
    own_schema = SCHEMA
    loosening = {"r4e": "s"}  # noqa: RUF012 (never changed)

    def check(self, scene: Scene) -> None:
        """Raise BadInput where today's machine is not one that this job can work on."""
        check(scene)

    def model(self, scene: Scene, design: Numbers | None = None) -> JobModel:
        """Return the crank-rocker with the effects the scene calls for."""
        return programs.model(scene, self.numbers(scene), design)

    def program(self, scene: Scene, target: str) -> Program:
        """Return a target as a task. Raises BadInput."""
        return programs.program(scene, target)

    def held(self, scene: Scene, target: str, traded: Collection[str]) -> tuple[Program, Callable[[str], float]]:
        """Return what a target demands of all that is traded, and natural sizes of axes. Raises BadInput."""
        return programs.held(scene, target, traded)

    def demand(self, scene: Scene, target: str) -> None:
        """Raise BadInput where a target speaks of what the scene does not have."""
        programs.demand(scene, target)

    def today(self, scene: Scene) -> dict[str, float]:
        """Return today's design with every other number that the scene bounds."""
        known, variables = self.numbers(scene), scene.schema.variables
        others = [scene.full(name) for name in scene.bounds if name not in variables]
        return {name: known[name] for name in (*variables, *others)}

    def numbers(self, scene: Scene) -> dict[str, float]:
        """Return every number of the scene, today's lengths also as today.*."""
        return programs.numbers(scene)

    def design(self, program: Program, x: Numbers) -> dict[str, float]:
        """Return the design of NLP variables."""
        return designs.design(program, x)

    def values(self, program: Program, design: Numbers) -> dict[str, float]:
        """Return the NLP variables of a design."""
        return designs.values(program, design)

    def tidy(self, program: Program, x: Numbers) -> dict[str, float]:
        """Return NLP variables with a negligible counterweight taken for none."""
        return designs.tidy(program, x)

    def figures(self, scene: Scene, design: Numbers) -> dict[str, float | None]:
        """Return every figure of a design."""
        limited = bounds(scene, self.numbers(scene))
        return designs.figures(scene, self.sampler(scene, design), design, self.today(scene), limited)

    def peaks(self, model: JobModel) -> dict[str, str]:
        """Return the figures that are extremes over the cycle."""
        return {name: name for name in (*model.quantities, *model.least)} | {"mu_min": "obliquity"}

    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """Return one sentence on what an optimum is worth."""
        return designs.say(scene, target, figures)

    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """Return ψ, ψ', ψ'', the transmission angle, folded to at most 90°, the terms, M3 and Md."""
        values = sampler.given.values
        return Columns(
            {
                "psi [rad]": lambda at: -at.pose.q,
                "psi_1 [1]": lambda at: -at.pose.q1,
                "psi_2 [1]": lambda at: -at.pose.q2,
                "mu [rad]": lambda at: np.pi / 2 - abs(at.pose.joints.obliquity),
            },
            "N*m",
            ("M3 [N*m]", lambda at: at.force),
            ("Md [N*m]", lambda at: at.crank_torque),
            also=(values["beta"], np.pi + values["beta_r"]),
            closed=True,
        )

    def studied(self, scene: Scene) -> Studied:
        """Return what studies read: the balance, the peak torque, the reed torque at front dead centre."""
        return Studied(("balance",), {"peak_torque": ("peak_torque", False)}, ("M3_fdc",), "psi_2")


JOB = Beatup()
