"""Variables of a task that an accuracy study reads from an answer, under any name of the scene."""

import pytest

from loomopt.jobs import registry
from loomopt.solving import engine
from loomopt.studies.accuracy.subject import Subject

J4 = {"bounds.J4.min": "0.6 kg*m^2", "bounds.J4.max": "0.64 kg*m^2"}


@pytest.mark.few(1)
@pytest.mark.parametrize("values", [{}, J4, {"bounds.pulse.min": "28 deg", "bounds.pulse.max": "30 deg"}])
def test_variables_of_an_answer_have_their_full_names(values):
    """J4 of the design is inertia.J4 of the program."""
    scene = registry.load("beatup").update(values)
    target = Subject(scene).targets[0]
    answer = engine.solve(scene, target.name, starts=1)
    variables = target.variables(answer)
    assert set(variables) == {v.name for v in target.program.variables}
    assert {scene.full(name): value for name, value in answer.design.items()}.items() >= {
        name: value for name, value in variables.items() if name != "s"
    }.items()
    assert target.merit(variables) == pytest.approx(answer.figures[target.figure], rel=1e-9)
