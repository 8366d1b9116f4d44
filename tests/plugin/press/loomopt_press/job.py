"""The press: the least crank torque of a slider-crank, its stroke kept."""

from loomopt.jobs.base import Figures, Job
from loomopt.model import numbers
from loomopt.model.curves import Columns
from loomopt.model.limits import DesignLimit
from loomopt.model.model import JobModel
from loomopt.model.objectives import Peak
from loomopt.model.program import Numbers, Program, Variable
from loomopt.model.sampling import Sampler
from loomopt.scenes.scene import Scene
from loomopt_press import model as press
from loomopt_press.scene import SCHEMA, check


class Press(Job):
    """A slider-crank press."""

    name = "press"
    own_schema = SCHEMA

    def check(self, scene: Scene) -> None:
        """Raise BadInput where the slider-crank does not turn."""
        check(scene)

    def model(self, scene: Scene, design: Numbers | None = None) -> JobModel:
        """Return the slider-crank with the effects the scene calls for."""
        return press.model(scene.active, numbers.words(scene), frozenset(numbers.numbers(scene)))

    def program(self, scene: Scene, target: str) -> Program:
        """Return the target as a task."""
        known = numbers.numbers(scene)
        limited, labels = numbers.bounds(scene, known), numbers.labels(scene)
        sampler = Sampler(self.model(scene), known)
        variables = tuple(
            Variable(name, *ends, max(abs(known[name]), *map(abs, ends)) or 1.0, ends, labels.get(name, ""))
            for name, ends in limited.items()
        )
        limits = [each for v in variables if v.called in scene.bounds for each in numbers.bound_limits(v)]
        limits += numbers.figure_limits(scene, sampler)
        limits += numbers.demanded(scene, sampler.model.checks, known, {})
        limits += [DesignLimit(press.LONGER, -1, press.LONGER, 0.0, known["rod"], relaxable=False)]
        return Program(
            sampler.model,
            variables,
            {name: value for name, value in known.items() if name not in limited},
            tuple(limits),
            (
                Peak("peak_torque", "peak_torque", sampler.peak("peak_torque") or 1.0),
                *numbers.least(sampler),
            ),
            (numbers.inside(variables, known),),
            tuple(numbers.axis_moves(scene, known, limited)),
        )

    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """Return one sentence on what the optimum is worth."""
        stroke, torque = figures["stroke"] or 0.0, figures["peak_torque"] or 0.0
        return f"With a stroke of {1000 * stroke:.6g} mm the least peak crank torque is {torque:.6g} N*m."

    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """Return the slide's travel with its derivatives, the terms, force and torque."""
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
