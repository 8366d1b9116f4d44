"""Rounding told apart from violation: a printed design typed again, and one that is a little too far."""

import math

import pytest

import loomopt as lo
from loomopt.base.units import factor
from loomopt.interface.text import layout
from loomopt.interface.text.answers import evaluation
from loomopt.solving.answer.report import LEAST_DIGITS, digits, roundings
from loomopt.solving.answer.solution import UnitFormatter

CASES = [("beatup", "retrofit"), ("beatup-heavy", "torque"), ("rapier", "stroke-dwell"), ("shedding", "speed")]
LIGHT = lo.load("beatup-light")


@pytest.fixture(scope="module")
def answers():
    return {case: lo.solve(*case, starts=1) for case in CASES}


def retyped(answer, count, **changed):
    """Return a design as it is typed from its table: so many digits in the scene's own units, then SI."""
    design = {**answer.design, **changed}
    formatter = UnitFormatter(answer.scene)
    sizes = {name: factor(formatter.unit(name)) for name in answer.design}
    return {name: float(f"{value / sizes[name]:.{count}g}") * sizes[name] for name, value in design.items()}


@pytest.mark.parametrize("count", [5, 6, 8])
@pytest.mark.parametrize("case", CASES, ids=" ".join)
@pytest.mark.few(1)
def test_a_design_typed_again_exceeds_limits_by_rounding_only(answers, case, count):
    answer = answers[case]
    second_evaluation = lo.evaluate(answer.scene, retyped(answer, count), answer.target)
    assert all(limit.ok or limit.rounding for limit in second_evaluation.limits)
    assert not any(limit.ok and limit.rounding for limit in second_evaluation.limits)


def test_each_case_has_limits_that_rounding_exceeds(answers):
    for case, answer in answers.items():
        results = [lo.evaluate(answer.scene, retyped(answer, count), answer.target) for count in (5, 6, 8)]
        assert any(limit.rounding for item in results for limit in item.limits), case


@pytest.mark.parametrize("case", CASES, ids=" ".join)
def test_a_number_that_is_off_by_much_more_than_its_last_digit_is_a_violation(answers, case):
    """Every number in six digits, one of them 3e-4 of itself beside the optimum: on one side that is too far."""
    answer = answers[case]
    name = "K1" if case[0] == "shedding" else "l4"
    moved = [retyped(answer, 6, **{name: answer.design[name] * (1 + shift)}) for shift in (3e-4, -3e-4)]
    results = [lo.evaluate(answer.scene, design, answer.target) for design in moved]
    assert any(not limit.ok and not limit.rounding for item in results for limit in item.limits)


def test_the_same_excess_in_full_digits_is_a_violation(answers):
    """Nothing was rounded there: 1e-9 relative beyond what binds is no rounding of 16 digits."""
    answer = answers["beatup-heavy", "torque"]
    shift = math.sqrt(2) * 1e-6
    second_evaluation = lo.evaluate(answer.scene, {n: v * (1 + shift) for n, v in answer.design.items()}, answer.target)
    assert [limit for limit in second_evaluation.limits if not limit.ok]
    assert not [limit for limit in second_evaluation.limits if limit.rounding]


def test_nominal_numbers_are_meant_as_they_stand():
    """40 mm is 5 mm too much of l1, not half a unit of its one digit."""
    second_evaluation = lo.evaluate(LIGHT, {"l1": 0.04})
    assert [limit.name for limit in second_evaluation.limits if limit.rounding] == []
    assert "l1" in [limit.name for limit in second_evaluation.limits if not limit.ok]


def test_numbers_typed_into_the_scene_count_as_well(answers):
    """The scene's own text, today's machine: the same verdict as of a design."""
    answer = answers["beatup-heavy", "torque"]
    formatter = UnitFormatter(answer.scene)
    typed = {
        f"mechanism.{n}": f"{v / factor(formatter.unit(n)):.5g} {formatter.unit(n)}"
        for n, v in answer.design.items()
        if v
    }
    by_scene = lo.evaluate(answer.scene.update(typed), None, answer.target)
    by_design = lo.evaluate(answer.scene, retyped(answer, 5), answer.target)
    texts = [[(limit.name, limit.ok, limit.rounding) for limit in item.limits] for item in (by_scene, by_design)]
    assert texts[0] == texts[1]
    assert any(limit.rounding for limit in by_scene.limits)


@pytest.mark.parametrize(
    ("value", "count"), [(0.03, 1), (84.0603, 6), (-0.0840603, 6), (1e-20, 1), (1.5e30, 2), (math.pi, 17), (1 / 3, 17)]
)
def test_digits_are_those_a_number_was_written_with(value, count):
    assert digits(value) == count


@pytest.mark.parametrize("degrees", [33.1234, 146.676, 0.5])
def test_digits_in_degrees_survive_radians(degrees):
    scene = lo.load("rapier")
    step = roundings(scene, {"alpha": math.radians(degrees)})["alpha"]
    written = max(digits(degrees), LEAST_DIGITS)
    unit = 10.0 ** (math.floor(math.log10(degrees)) - written + 1)
    assert step == pytest.approx(math.radians(unit / 2), rel=1e-12)


def test_all_numbers_have_the_digits_of_the_longest_and_half_a_unit_of_the_last():
    assert roundings(LIGHT, {"l1": 0.03, "l2": 0.0840603, "m4e": 0.0}) == pytest.approx({"l1": 5e-8, "l2": 5e-8})
    assert roundings(LIGHT, {"l1": 0.03, "l2": 0.08406025074670463}) == {}
    nominal = roundings(LIGHT, {"l1": 0.03, "l4": 0.167})
    assert nominal == pytest.approx({"l1": 5e-6, "l4": 5e-5}), "as of four digits"


def test_a_reader_and_a_script_see_the_difference(answers):
    answer = answers["rapier", "stroke-dwell"]
    scene, result = answer.scene, lo.evaluate(answer.scene, retyped(answer, 6), answer.target)
    rounded = [limit.name for limit in result.limits if limit.rounding]
    shown = layout.render(evaluation(result.result, scene, None), 120)
    fixed = "all limits held, but for the rounding of the digits given"
    assert shown.startswith(f"rapier: {fixed}: {', '.join(rounded)}\n")
    assert shown.count("<- exceeded by rounding") == len(rounded)
    assert "not held" not in shown
    record = {limit["name"]: limit for limit in result.as_dict()["limits"]}
    assert {name for name, limit in record.items() if limit.get("rounding")} == set(rounded)
    assert all(list(limit) == ["name", "value", "min", "max", "ok"] for limit in record.values() if limit["ok"])
    worse = lo.evaluate(scene, {**retyped(answer, 6), "C0x": 0.39}, answer.target)
    assert layout.render(evaluation(worse.result, scene, None), 120).startswith("rapier: NOT admissible: C0x")
