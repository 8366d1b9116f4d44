"""The press: the least crank torque of a slider-crank, its stroke kept."""

from loomopt.base.errors import BadInput
from loomopt.jobs.base import Figures, Job
from loomopt.model.curves import Columns
from loomopt.model.model import JobModel
from loomopt.model.program import Numbers
from loomopt.model.sampling import Sampler
from loomopt.scenes.scene import Scene
from loomopt_press.model import model
from loomopt_press.program import PressTask
from loomopt_press.scene import SCHEMA, fault


class Press(Job):
    """A slider-crank press."""

    name = "press"
    own_schema = SCHEMA
    task = PressTask

    def check(self, scene: Scene) -> None:
        """Raise BadInput when today's press cannot turn."""
        reason = fault(scene.mechanism, scene.show)
        if reason:
            raise BadInput(
                f"today's press cannot turn: {reason}", file=scene.origin, key="mechanism.crank, rod", remedy="Mend it."
            )

    def model(self, scene: Scene, design: Numbers | None = None) -> JobModel:
        """Slider-crank with the effects the scene calls for."""
        return model(scene)

    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """One sentence on what the optimum is worth."""
        stroke, torque = figures["stroke"] or 0.0, figures["peak_torque"] or 0.0
        return f"With a stroke of {1000 * stroke:.6g} mm the least peak crank torque is {torque:.6g} N*m."

    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """Slide's travel with its derivatives, the terms, force and torque."""
        return Columns(
            {
                "q [m]": lambda at: at.pose.q,
                "q_1 [m/rad]": lambda at: at.pose.q1,
                "q_2 [m/rad^2]": lambda at: at.pose.q2,
            },
            "N",
            ("Q [N]", lambda at: at.force),
            ("Md [N*m]", lambda at: at.crank_torque),
        )


JOB = Press()
