"""Program of a press scene: variables are crank, rod and every bounded number; the peak torque is minimised."""

from loomopt.base.records import lazy
from loomopt.jobs.base import Task
from loomopt.model.model import JobModel
from loomopt.model.objectives import Objective, Peak
from loomopt_press.model import model


class PressTask(Task):
    """The slider-crank; what it may do, and what its effects ask for, is said by the scene."""

    @lazy
    def model(self) -> JobModel:
        """The slider-crank with the effects the scene calls for."""
        return model(self.scene)

    def objectives(self) -> tuple[Objective, ...]:
        """Peak crank torque, and the objectives of checks."""
        return Peak("peak_torque", "peak_torque", self.figure_size("peak_torque")), *self.least()
