"""The rapier job: stroke and dwells of a five-bar drive on the sley [Hong17]."""

import math
from collections.abc import Callable, Collection

from loomopt.jobs.base import Crossing, Figures, Job, Studied
from loomopt.jobs.rapier import design as designs
from loomopt.jobs.rapier import program as programs
from loomopt.jobs.rapier.scene import SCHEMA, check
from loomopt.maths.systems import FLOAT
from loomopt.model.curves import Columns
from loomopt.model.model import JobModel
from loomopt.model.program import Numbers, Program
from loomopt.model.sampling import Sampler
from loomopt.scenes.scene import Scene


class Rapier(Job):
    """A five-bar rapier drive on the sley of a four-bar, with one 2:1 gear."""

    name = "rapier"
    own_schema = SCHEMA
    open_boxes = "no global claim: boxes of 1 % round a drive's optimum do not close in any time worth waiting for"

    def check(self, scene: Scene) -> None:
        """Raise BadInput where today's machine is not one that this job can work on."""
        check(scene)

    def model(self, scene: Scene, design: Numbers | None = None) -> JobModel:
        """Return the drive with the effects the scene calls for."""
        return programs.model(scene)

    def program(self, scene: Scene, target: str) -> Program:
        """Return a target as a task. Raises BadInput."""
        return programs.program(scene, target)

    def held(self, scene: Scene, target: str, traded: Collection[str]) -> tuple[Program, Callable[[str], float]]:
        """Return what a target demands of all that is traded, and natural sizes of axes. Raises BadInput."""
        return programs.held(scene, target, traded)

    def demand(self, scene: Scene, target: str) -> None:
        """Raise BadInput where a target speaks of what the scene does not have."""
        programs.demand(scene, target)

    def design(self, program: Program, x: Numbers) -> dict[str, float]:
        """Return the design of NLP variables."""
        return designs.design(program, x)

    def values(self, program: Program, design: Numbers) -> dict[str, float]:
        """Return the NLP variables of a design."""
        return program.completed(design)

    def figures(self, scene: Scene, design: Numbers) -> dict[str, float | None]:
        """Return every figure of a design."""
        return designs.figures(scene, self.sampler(scene, design))

    def peaks(self, model: JobModel) -> dict[str, str]:
        """Return the figures that are extremes over the cycle."""
        return {name: name for name in model.quantities} | {"stroke": "S", "mu_min": "obliquity"}

    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """Return one sentence on what an optimum is worth."""
        return designs.say(scene, target, figures)

    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """Return S with three derivatives, φ3, φ6, φ63, the folded transmission angle, terms, tape force and torque."""
        front = sampler.model.kinematics.still(FLOAT, sampler.given, "front dead centre", {}).joints  # type: ignore[attr-defined]
        gap = math.atan2(front.dyad.link2.y, front.dyad.link2.x) - front.phi3
        centres = sampler.given.values["centres"]
        rear = math.pi + centres.beta_r - centres.beta
        return Columns(
            {
                "S [m]": lambda at: at.pose.q,
                "S_1 [m/rad]": lambda at: at.pose.q1,
                "S_2 [m/rad^2]": lambda at: at.pose.q2,
                "S_3 [m/rad^3]": lambda at: at.pose.q3,
                "phi3 [rad]": lambda at: at.pose.joints.phi3,
                "phi6 [rad]": lambda at: at.pose.joints.phi3 + gap + at.pose.joints.phi63(at.pose.front),
                "phi63 [rad]": lambda at: at.pose.joints.phi63(at.pose.front),
                "mu [rad]": lambda at: math.pi / 2 - abs(at.pose.joints.obliquity),
            },
            "N",
            ("Q [N]", lambda at: at.force),
            ("Md [N*m]", lambda at: at.crank_torque),
            also=(designs.read(sampler).phi_stroke, rear),
        )

    def studied(self, scene: Scene) -> Studied:
        """Return what studies read: peak acceleration, stroke, and where the head leaves its dwell."""
        peaks = {"peak_acceleration": ("peak_acceleration", False), "stroke": ("S", True)}
        leaves = Crossing("dwell_after", "S", "s_dwell") if "s_dwell" in scene.operation else None
        return Studied(("stroke-dwell",), peaks, motion="S_2", crossing=leaves)


JOB = Rapier()
