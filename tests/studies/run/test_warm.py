"""Where a solve ended as JSON data: a neighbour starts from it as from the answer itself."""

import json

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.solving import engine
from loomopt.studies.run import rows

SCENE = lo.load("beatup")
NEXT = SCENE.set("operation.M0", "760 N*m")


def program(scene, target="balance"):
    return registry.of(scene).program(scene, target)


@pytest.fixture(scope="module")
def answer():
    return engine.solve(SCENE, starts=1)


def test_a_start_read_from_json_leads_to_the_same_bits(answer):
    data = json.loads(json.dumps(rows.written(answer.point, program(SCENE))))
    read, direct = engine.solve(NEXT, near=[rows.read(data, program(NEXT))]), engine.solve(NEXT, near=[answer.point])
    assert read.design == direct.design
    assert read.figures == direct.figures
    assert read.message == direct.message
    assert "Solved again near" in read.message


def test_a_start_of_another_task_is_none(answer):
    data = rows.written(answer.point, program(SCENE))
    assert rows.read(data, program(NEXT)) is not None
    assert rows.read(data, program(SCENE, "torque")) is None
    assert rows.read({}, program(SCENE)) is None
