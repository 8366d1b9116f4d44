"""The shedding job: the least return spring that keeps the roller on the cam [Qiu21]."""

from collections.abc import Callable, Collection, Mapping
from typing import Any

from loomopt.jobs.base import Figures, Job, Studied
from loomopt.jobs.shedding import design as designs
from loomopt.jobs.shedding import program as programs
from loomopt.jobs.shedding.model import contact, moving
from loomopt.jobs.shedding.scene import SCHEMA, LawTarget, check
from loomopt.model.curves import Columns
from loomopt.model.model import Formula, JobModel
from loomopt.model.program import Numbers, Program
from loomopt.model.sampling import Sampler
from loomopt.physics.mechanisms.cam_motion import Spline, knots
from loomopt.scenes.scene import Scene


class Shedding(Job):
    """A heald frame between its cam and its return spring."""

    name = "shedding"
    own_schema = SCHEMA

    def check(self, scene: Scene) -> None:
        """Raise BadInput where today's machine is not one that this job can work on."""
        check(scene)

    def model(self, scene: Scene, design: Numbers | None = None) -> JobModel:
        """Return the frame with the effects the scene calls for, and a design's own law where it has one."""
        own = knots(design or {})
        return programs.model(scene, Spline(len(own) - 1) if own else None)

    def program(self, scene: Scene, target: str) -> Program:
        """Return a target as a task. Raises BadInput."""
        return programs.program(scene, target)

    def held(self, scene: Scene, target: str, traded: Collection[str]) -> tuple[Program, Callable[[str], float]]:
        """Return what a target demands of all that is traded, and natural sizes of axes. Raises BadInput."""
        return programs.held(scene, target, traded)

    def demand(self, scene: Scene, target: str) -> None:
        """Raise BadInput where a target speaks of what the scene does not have, or today's frame cannot be followed."""
        programs.demand(scene, target)
        self.parted(scene, self.sampler(scene, self.today(scene)))

    def numbers(self, scene: Scene) -> dict[str, float]:
        """Return every number of the scene, the knots of a spline law included."""
        return programs.numbers(scene)

    def design(self, program: Program, x: Numbers) -> dict[str, float]:
        """Return the design of NLP variables."""
        return designs.design(program, x)

    def adopted(self, scene: Scene, design: Mapping[str, Any], target: str) -> tuple[Scene, str]:
        """Return the scene with a design's own cam law, and the target whose limits it keeps.

        Of target law the law is then given: what remains is contact, and the bound on its acceleration.
        """
        own = knots(design)
        changes: dict[str, object] = {}
        if own:
            changes = {"mechanism.law": "spline", "mechanism.law_coefficients": list(map(float, own))}
        if target == "law" and "law_acceleration" not in scene.limits:
            changes["limits.law_acceleration.max"] = scene.table(LawTarget).acceleration
        changed = scene.update(changes) if changes else scene
        return changed, "stiffness" if target == "law" else target

    def figures(self, scene: Scene, design: Numbers) -> dict[str, float | None]:
        """Return every figure of a design."""
        sampler = self.sampler(scene, design)
        parted = self.parted(scene, sampler)
        return designs.figures(scene, sampler) | (parted.figures if parted else {})

    def peaks(self, model: JobModel) -> dict[str, str]:
        """Return the figures that are extremes over the cycle."""
        return designs.peaks(model)

    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """Return one sentence on what an optimum is worth, and one on today's spring."""
        now = designs.contact(scene, self.sampler(scene, self.today(scene)))
        return designs.say(scene, now, designs.judged(self.model(scene)), target, figures)

    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """Return X with three derivatives, s'', the terms, N, the cam torque, pressure angle and curvatures."""
        after: dict[str, Formula] = {}
        if sampler.model.has_quantity("curvature"):
            after = {
                "pressure_angle [rad]": lambda at: contact(at).pressure_angle,
                "curvature [1/m]": lambda at: contact(at).curvature,
                "profile_curvature [1/m]": lambda at: contact(at).profile_curvature,
            }
        return Columns(
            {
                "X [m]": lambda at: at.pose.q,
                "X_1 [m/rad]": lambda at: at.pose.q1,
                "X_2 [m/rad^2]": lambda at: at.pose.q2,
                "X_3 [m/rad^3]": lambda at: at.pose.q3,
                "s_2 [1]": lambda at: moving(at, at.pose.law.s2),
            },
            "N",
            ("N [N]", lambda at: at.force),
            ("cam_torque [N*m]", lambda at: at.crank_torque),
            after,
        )

    def studied(self, scene: Scene) -> Studied:
        """Return what studies read: least springs, the cam force, and what a free law tends to."""
        # Points over the whole turn would read a force that is known in the dwells only.
        peaks = {} if self.model(scene).known_in else {"contact_max": ("cam_force", False)}
        return Studied(("stiffness", "law"), peaks, motion="X_2", family=designs.FAMILY)


JOB = Shedding()
