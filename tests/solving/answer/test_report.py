"""From a judged design to what is read: limits beside their values, messages, and the words of each ending."""

from dataclasses import replace

import pytest
from support import toy

from loomopt.model.limits import BoundLimit, CycleLimit, RatioLimit
from loomopt.model.objectives import Value
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Clash, Relaxation
from loomopt.solving.certificate.records import Binding, Certificate

ROWS = {"f": lambda v: v["x"] ** 2, "p": lambda v: v["x"] + v["y"]}
WAVES = {"w": lambda m, v, phi: v["x"] * m.cos(phi)}


def evaluated(limits, x, **more):
    program = toy.program("xy", ROWS, WAVES, limits=limits, **more)
    job = toy.ToyJob(program)
    return report.evaluation(toy.scene_of(job), job, program, x)


def findings(limits, x, **more):
    """Return each limit's value, sides and verdict; the toy's own far limit left out."""
    result = evaluated(limits, x, **more).limits
    return [(item.name, item.value, item.min, item.max, item.ok) for item in result]


def test_a_design_with_its_figures():
    evaluation = evaluated((), {"x": 2.0, "y": -3.0})
    assert (evaluation.problem, evaluation.effects) == ("toy", ())
    assert evaluation.design == {"x": 2.0, "y": -3.0}
    assert evaluation.figures == pytest.approx({"x": 2.0, "y": -3.0, "f": 4.0, "p": -1.0, "w": 2.0})
    assert set(evaluation.units.values()) == {"1"}
    assert evaluation.admissible


def test_the_tightest_side_of_each_limit_is_told():
    limits = (("p", -1, 1.0), ("p", -1, 2.0), ("p", 1, 9.0), ("p", 1, 8.0))
    (p, _) = findings(limits, {"x": 2.0, "y": 3.0})
    assert p == ("p", 5.0, 2.0, 8.0, True)
    assert not findings(limits, {"x": 2.0, "y": -0.5})[0][4]
    assert not findings(limits, {"x": 4.0, "y": 4.5})[0][4]


def test_an_equality_has_both_sides():
    assert findings((("p", 0, 5.0),), {"x": 2.0, "y": 3.0})[0] == ("p", 5.0, 5.0, 5.0, True)
    assert not findings((("p", 0, 5.0),), {"x": 2.0, "y": 3.1})[0][4]
    assert not findings((("p", 0, 5.0),), {"x": 2.0, "y": 2.9})[0][4]


@pytest.mark.parametrize(("size", "excess", "ok"), [(1.0, 0.9e-9, True), (1.0, 1.1e-9, False), (100.0, 0.9e-7, True)])
def test_a_limit_holds_to_a_billionth_of_its_size(size, excess, ok):
    for sign in (1, -1):
        result = findings((("p", sign, 5.0),), {"x": 2.0, "y": 3.0 + sign * excess}, sizes={"p": size})
        assert result[0][4] == ok


def test_a_whole_cycle_limit_stands_beside_its_peak():
    assert findings((("w", 1, 2.5),), {"x": -2.0, "y": 0.0})[0] == ("w", pytest.approx(2.0), None, 2.5, True)
    assert not findings((("w", 1, 1.5),), {"x": -2.0, "y": 0.0})[0][4]


def test_a_limit_of_the_complement_is_told_as_what_is_asked():
    program = toy.program("xy", ROWS, WAVES, limits=(("w", -1, 0.25),))
    limits = tuple(replace(limit, complement=1.0) if limit.row == "w" else limit for limit in program.limits)
    assert limits[0].bound == 0.75
    job = toy.ToyJob(replace(program, limits=limits))
    result = report.evaluation(toy.scene_of(job), job, job.toy_program, {"x": 0.7, "y": 0.0}).limits[0]
    assert (result.name, result.min, result.ok) == ("w", 0.25, True)
    assert result.value == pytest.approx(0.3)


def test_a_bound_is_held_to_its_own_size_and_hidden_limits_are_not_told():
    result = findings((), {"x": 100 + 0.9e-7, "y": 0.0}, bounds={"x": (-100.0, 100.0)})
    assert result[0][2:] == (-100.0, 100.0, True)
    assert not findings((), {"x": 100 + 1.1e-7, "y": 0.0}, bounds={"x": (-100.0, 100.0)})[0][4]
    program = toy.program("xy", ROWS, limits=(("p", 1, 5.0),))
    hidden = replace(program, limits=tuple(replace(limit, hidden=True) for limit in program.limits))
    job = toy.ToyJob(hidden)
    assert report.evaluation(toy.scene_of(job), job, hidden, {"x": 2.0, "y": 9.0}).limits == ()


# Messages ---------------------------------------------------------------------------------------------------------

PASSED = Certificate(True, (), (), 0.0, 0.0, True, True)


def report_of(certificate, here=None, limits=(("p", 1, 5.0),)):
    program = toy.program("xy", ROWS, WAVES, limits=limits)
    job = toy.ToyJob(program)
    here = here or evaluated(limits, {"x": 1.0, "y": 1.0})
    return report.with_optimum(
        job, toy.scene_of(job), "least", here, certificate, {"status": "Solve_Succeeded"}, here, ""
    )


def binding(limit, worth, objective="f"):
    return Binding(limit, 1, Value(objective, objective, 1.0), worth)


def test_an_optimum_names_the_limits_that_stop_its_first_objective():
    program = toy.program("xy", ROWS, limits=(("p", 1, 5.0), ("x", -1, 1.0)))
    p, x = program.limits[:2]
    certificate = replace(PASSED, binding=(binding(p, 2.0), binding(p, 0.5), binding(x, 3.0, "p")))
    answer = report_of(certificate)
    assert (answer.status, answer.target) == ("optimal", "least")
    assert answer.message == "Least. Limits that stop f: p <= 5 (worth 2.5 per unit)."
    assert [price.limit for price in answer.binding] == ["p", "x"]
    assert answer.solver["status"] == "Solve_Succeeded"


def test_without_a_limit_that_binds_that_is_said():
    assert report_of(PASSED).message == "Least. No limit binds."


def test_what_did_not_pass_says_why():
    refused = replace(PASSED, passed=False, reasons=("one", "two"))
    answer = report_of(refused)
    assert answer.status == "uncertified"
    assert answer.message == "A design was reached but not certified: one; two. Try more starts, such as 20."
    beyond = report_of(PASSED, evaluated((("p", 1, 1.0),), {"x": 1.0, "y": 1.0}))
    assert beyond.status == "uncertified"
    assert "a limit does not hold on independent evaluation" in beyond.message


def relaxed(text, alone):
    return Relaxation("p", "max", 1.0, 2.0, alone, text)


@pytest.mark.parametrize(
    ("relaxations", "message"),
    [
        ((relaxed("a", False), relaxed("b", False)), "The least relaxation that helps: a, b."),
        ((relaxed("a", True),), "The least relaxation that helps: a."),
        (
            (relaxed("a", True), relaxed("b", True)),
            "The least relaxation that helps: a. By itself, any one of these would do too: b.",
        ),
        (
            (relaxed("a", False), relaxed("b", False), relaxed("c", True), relaxed("d", True)),
            "The least relaxation that helps: a, b. By itself, any one of these would do: c; d.",
        ),
    ],
)
def test_an_infeasible_target_says_what_clashes_and_what_helps(relaxations, message):
    here = evaluated((), {"x": 1.0, "y": 1.0})
    clash = Clash({"p <= 1": "p", "x >= 9": "x"}, relaxations)
    answer = report.without_optimum("least", here, clash, {"status": "Restoration_Failed"}, here, "Physics.")
    assert answer.status == "infeasible"
    head = "No admissible design exists near any start. Conflicting limits: p <= 1, x >= 9."
    assert answer.message == f"{head} {message} Physics."
    assert (answer.clash, answer.explanation) == (("p <= 1", "x >= 9"), "Physics.")


@pytest.mark.parametrize(
    ("status", "message"),
    [
        ("Diverging_Iterates", "The objective falls without end; bound every variable."),
        ("Never_Heard_Of", "try more starts, such as 20."),
    ],
)
def test_a_failure_passes_on_the_solvers_word_with_advice(status, message):
    here = evaluated((), {"x": 1.0, "y": 1.0})
    answer = report.without_optimum("least", here, Clash(), {"status": status}, here, "Physics.")
    assert (answer.status, answer.explanation) == ("failed", "")
    assert answer.message == f"The solver failed ({status}): {message}"


# Limits that bear another name than what they read -----------------------------------------------------------------


def named(kind, name, row, sign, value):
    """Return the findings of one limit at x = 2, y = 3, whose name is not its row's."""
    program = toy.program("xy", ROWS, WAVES)
    limit = kind(name, sign, row, value, 1.0)
    job = toy.ToyJob(replace(program, limits=(limit,)))
    result = report.evaluation(toy.scene_of(job), job, job.toy_program, {"x": 2.0, "y": 3.0}).limits
    return [(item.name, item.value, item.ok) for item in result]


def test_a_whole_cycle_limit_may_bear_its_own_name():
    assert named(CycleLimit, "top", "w", 1, 2.5) == [("top", pytest.approx(2.0), True)]


def test_a_bound_of_a_variable_that_the_design_does_not_name_is_not_told():
    assert named(BoundLimit, "helper", "x", 1, 1.0) == []
    assert named(BoundLimit, "x", "x", 1, 1.0) == [("x", 2.0, False)]


@pytest.mark.parametrize(("excess", "ok"), [(0.9e-12, True), (1.1e-12, False)])
def test_a_limit_of_a_small_quantity_is_held_to_its_size(excess, ok):
    result = findings((("p", 1, 0.0),), {"x": excess, "y": 0.0}, sizes={"p": 1e-3})
    assert result[0][4] == ok


@pytest.mark.parametrize("sign", [1, -1])
def test_a_limit_may_be_missed_by_just_a_billionth(sign):
    assert findings((("p", sign, 0.0),), {"x": sign * 1e-9, "y": 0.0})[0][4]


@pytest.mark.parametrize(("excess", "ok"), [(0.9e-9, True), (1.1e-9, False)])
def test_a_weighed_limit_is_held_to_a_billionth_of_one(excess, ok):
    program = toy.program("xy", ROWS, WAVES)
    job = toy.ToyJob(replace(program, limits=(RatioLimit("p", 1, "p", 0.0, 50.0, "y"),)))
    result = report.evaluation(toy.scene_of(job), job, job.toy_program, {"x": excess, "y": 0.0}).limits
    assert [item.ok for item in result] == [ok]
