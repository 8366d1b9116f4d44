"""What an answer makes worse than today's machine, of what it does not seek, is told in one line."""

import functools

import pytest

import loomopt as lo
from loomopt.interface.text import answers
from loomopt.solving.answer.solution import WORSE, UnitFormatter


@functools.cache
def answer(name):
    changes = {"beatup": {"with_effect": ("joint_forces",)}}.get(name, {})
    scene = lo.load(name)
    for do, names in changes.items():
        scene = getattr(scene, do)(*names)
    return lo.solve(scene)


NAMES = ["beatup", pytest.param("rapier", marks=pytest.mark.slow), "shedding", "sixbar-sley", "path-18"]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_what_is_worse_by_more_than_a_percent_is_told_once_and_nothing_else(name):
    second_answer = answer(name)
    today, figures = lo.evaluate(second_answer.scene).figures, second_answer.scene.schema.figures
    objectives = {level.objective for level in second_answer.certificate.levels}
    record = {item.figure: item for item in second_answer.worse}
    for figure, known in figures.items():
        then, now = today.get(figure), second_answer.figures.get(figure)
        if figure in objectives or len(known.sides) != 1 or then is None or now is None or abs(then) < 1e-6:
            assert figure not in record or abs(then) < 1e-6
            continue
        rise = (now - then) / abs(then) * (1 if known.sides == ("max",) else -1)
        assert (figure in record) == (rise > WORSE), figure
        if figure in record:
            assert record[figure].share == pytest.approx((now - then) / abs(then))


def test_it_is_one_line_in_the_terminal_and_a_list_in_json():
    second_answer = answer("beatup")
    parts = answers.solution(second_answer.result, second_answer.scene)
    (line,) = [part for part in parts if isinstance(part, str) and part.startswith("Worse than today's machine: ")]
    assert "pulse_rms 328.8 -> 335.7 N*m (+2.1 %)" in line
    assert "shaking_moment 321.7 -> 448.9 N*m (+40 %)" in line
    assert [item["figure"] for item in second_answer.as_dict()["worse"]] == [
        item.figure for item in second_answer.worse
    ]
    assert "\n" not in line


@pytest.mark.slow
def test_where_nothing_is_worse_nothing_is_said():
    second_answer = answer("sixbar-sley")
    assert UnitFormatter(second_answer.scene).worse(()) == ""
    assert ("worse" in second_answer.as_dict()) == bool(second_answer.worse)
