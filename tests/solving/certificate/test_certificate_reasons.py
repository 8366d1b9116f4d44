"""Why a certificate is refused, from residuals that are written down, and which multipliers it is judged with."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support import toy

from loomopt.model.sampling import Sampler
from loomopt.physics.tolerances import POSITIVE, STATIONARY
from loomopt.solving.certificate import certificate, kkt, second_order
from loomopt.solving.certificate.certificate import (
    COMPLEMENTARY,
    LARGEST_PRICE,
    CertifiedLevel,
    WholeCycle,
    certify,
    certify_by,
)
from loomopt.solving.certificate.derivatives import JetDerivatives
from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives
from loomopt.solving.certificate.kkt import LevelMultipliers, active_set
from loomopt.solving.certificate.records import Level
from loomopt.solving.certificate.second_order import Curvature, Local

NONE = LevelMultipliers(np.zeros(0), 0.0)


def level_of(curvature=None, **residuals):
    level = {"objective": "f", "stationarity": 0.0, "complementarity": 0.0, "higher_levels": 0.0, **residuals}
    return CertifiedLevel(Level(**level), NONE, curvature)


def not_least(*levels):
    return [reason.split(":")[0] for reason in certificate._optimality_reasons(levels)]


# The whole cycle ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("violation", "bound", "reasons"),
    [
        (0.0, "proven", 0),
        (1e-8, "undecided", 0),
        (1.1e-8, "proven", 1),
        (float("nan"), "proven", 1),
        (0.0, "violated", 1),
        (1.0, "violated", 2),
    ],
)
def test_the_whole_cycle_is_covered_to_the_accuracy(violation, bound, reasons):
    assert len(list(certificate._cycle_reasons(WholeCycle(violation, bound), 1e-8))) == reasons


# Levels -------------------------------------------------------------------------------------------------------------


def test_residuals_may_be_as_large_as_is_allowed():
    ends = {"stationarity": STATIONARY, "complementarity": COMPLEMENTARY, "price": LARGEST_PRICE}
    assert not_least(level_of(**ends)) == []
    beyond = [level_of(**{name: end * 1.001}, dearest="x") for name, end in ends.items()]
    assert not_least(*beyond) == [
        "f can still fall",
        "a limit that is not met exactly carries a price",
        "the price of limit x is too large",
    ]
    assert len(not_least(level_of(stationarity=float("nan"), complementarity=float("nan")))) == 2


def test_the_last_level_that_falls_is_named():
    falls, fails = Curvature(higher="falls"), Curvature(minimum=False)
    assert not_least(level_of(falls)) == ["second order does not decide"]
    message = list(
        certificate._optimality_reasons([level_of(falls), level_of(falls, objective="g"), level_of(Curvature())])
    )
    assert message == ["second order does not decide: g falls along a direction without curvature"]
    assert not_least(level_of(fails), level_of()) == ["second order fails"]


# The toy x² + y² with three limits that touch at 0 ------------------------------------------------------------------


TOUCHING = (("x", -1, 0.0), ("y", -1, 0.0), ("x", 1, 0.0))


def local(objectives=("f",), limits=TOUCHING, **x):
    rows = {
        "f": lambda v: v["x"] ** 2 + v["y"] ** 2,
        "g": lambda v: v["y"],
        "slope": lambda v: 3 * v["x"] + 2 * v["y"],
    }
    program = toy.program("xy", rows, limits=limits, objectives=objectives)
    x = {"x": 0.0, "y": 0.0, **x}
    sampler = Sampler(program.model, x)
    active = active_set(program, sampler)
    exact = MpmathDerivatives(program, x, sampler, active.rows)
    return Local(program, x, sampler, active, exact, exact.gradients())


def tried(monkeypatch, of, result):
    """Return the multipliers that are kept, and the rows left out on the way; result: row -> residual, curvature."""
    left_out: list[int] = []
    worst = Curvature(minimum=False, unique=False)

    def solved(gradients, system):
        row = next(k for k in (0, 1, 2) if k not in system.inequalities)
        left_out.append(row)
        return LevelMultipliers(np.full(4, float(row)), result[row][0])

    def curved(place, level, system, multipliers):
        return worst if multipliers is first else result[int(multipliers.values[0])][1]

    first = LevelMultipliers(np.array(of), 0.0)
    monkeypatch.setattr(kkt, "solve_system", solved)
    monkeypatch.setattr(second_order, "second_order_of", curved)
    here = local()
    system = kkt.System((3,), (0, 1, 2), (), np.zeros((0, 4)))
    remaining, _ = certificate._best_multipliers(here, 0, system, first)
    return ("first" if remaining is first else int(remaining.values[0])), left_out


def test_rows_that_bind_are_left_out_in_turn_until_the_curvature_is_better(monkeypatch):
    worst, good = Curvature(minimum=False, unique=False), Curvature()
    fair = Curvature(unique=False)
    of = [2 * POSITIVE, POSITIVE, 1.0, 1.0]
    assert tried(monkeypatch, of, {0: (0.0, worst), 2: (0.0, worst)}) == ("first", [0, 2])
    assert tried(monkeypatch, of, {0: (0.0, good), 2: (0.0, good)}) == (0, [0])
    assert tried(monkeypatch, of, {0: (2 * STATIONARY, good), 2: (STATIONARY, fair)}) == (2, [0, 2])


def test_residuals_name_the_dearest_limit():
    here = local(x=-3e-8, y=2e-8)
    system = kkt.system(here.active, 0, [])
    result = certificate._residuals(here, 0, system, LevelMultipliers(np.array([0.5, -2.0, 0.25, 1.0]), 9.0), 0.125)
    assert (result.objective, result.stationarity, result.price, result.dearest) == ("f", 0.125, 2.0, "y")
    assert result.complementarity == pytest.approx(4e-8)
    assert result.higher_levels == 0.0
    bare = kkt.System((3,), (), (), np.zeros((0, 4)))
    none = certificate._residuals(here, 0, bare, LevelMultipliers(np.zeros(4), 0.0), 0.0)
    assert (none.complementarity, none.price, none.dearest) == (0.0, 0.0, "")


def test_a_later_level_tells_what_the_earlier_ones_are_held_by():
    here = local(("f", "g"))
    system = kkt.system(here.active, 1, [LevelMultipliers(np.zeros(5), 0.0)])
    result = certificate._residuals(here, 1, system, LevelMultipliers(np.array([0, 0, 0, -3.0, 1.0]), 0.0), 0.0)
    assert (result.objective, result.higher_levels) == ("g", 3.0)


def test_a_limit_is_worth_what_the_first_objective_it_moves_would_fall():
    here = local(("f", "slope"), TOUCHING[:2])
    levels = [
        CertifiedLevel(level_of().level, LevelMultipliers(np.array([0.0, POSITIVE, 1.0, 0.0]), 0.0)),
        CertifiedLevel(level_of().level, LevelMultipliers(np.array([3.0, 2.0, 0.0, 1.0]), 0.0)),
    ]
    results = [
        (price.limit.row, price.objective.figure, price.worth)
        for price in certificate._price_limits(here, levels).binding
    ]
    assert results == [("x", "slope", 3.0), ("y", "slope", 2.0)]


# Proportion ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("x", "size", "message"), [(1e8, 1.0, 0), (1.01e8, 1.0, 1), (-1.01e8, 1.0, 1), (1.01e8, 2.0, 0)]
)
def test_variables_count_in_their_own_size(x, size, message):
    made = toy.program("xy", sizes={"x": size})
    here: Any = SimpleNamespace(
        program=made, x={"x": x, "y": 0.0, "other": 1e30}, active=SimpleNamespace(excess=(0.0,))
    )
    assert len(list(certificate._design_reasons(here, 0.0))) == message


def test_the_limit_that_is_exceeded_most_is_named():
    made = toy.program("xy", limits=(("x", 1, 0.0), ("y", 1, 0.0)))
    here: Any = SimpleNamespace(program=made, x={"x": 1.0}, active=SimpleNamespace(excess=(1e-9, 2e-9, -1.0)))
    assert list(certificate._design_reasons(here, 1e-9)) == []
    assert list(certificate._design_reasons(here, 2e-9)) == ["limit y is exceeded by 2e-09 of its size"]


# What is told -------------------------------------------------------------------------------------------------------


def test_newtons_step_is_told_in_si_and_its_length_in_natural_sizes():
    made = toy.program("xy", {"f": lambda v: (v["x"] - 4) ** 2 + v["y"] ** 2}, sizes={"x": 4.0})
    second_certificate = certify(made, {"x": 4.0 + 4e-9, "y": 1e-9}, 1e-8)
    assert second_certificate.correction == pytest.approx({"x": -4e-9, "y": -1e-9}, rel=1e-6)
    assert second_certificate.step == pytest.approx(1e-9, rel=1e-6)
    there = certify(made, {"x": 4.0, "y": 0.0}, 1e-8)
    assert (there.step, there.correction) == (0.0, {})


def test_what_is_no_number_is_no_certificate():
    made = toy.program("x", formulas={"f": lambda m, v: 1 / v["x"]})
    second_certificate = certify(made, {"x": 0.0}, 1e-8)
    assert (second_certificate.passed, second_certificate.minimum, second_certificate.unique) == (False, False, False)
    assert (second_certificate.feasibility, second_certificate.violation) == (float("inf"), float("inf"))
    assert second_certificate.reasons == ("a value or a slope is not a number here (ZeroDivisionError)",)


def test_a_level_after_one_that_settles_the_design_has_no_residual():
    rows = {"f": lambda v: v["x"] ** 2 + v["y"] ** 2, "g": lambda v: 3 * v["x"]}
    second_certificate = certify(toy.program("xy", rows, objectives=("f", "g")), {"x": 0.0, "y": 0.0}, 1e-8)
    assert second_certificate.passed
    assert second_certificate.levels[1] == Level("g", 0.0, 0.0, 0.0)


@pytest.mark.parametrize(("residual", "raises"), [(STATIONARY, True), (1.001 * STATIONARY, False)])
def test_without_second_derivatives_only_a_slope_that_is_left_decides(residual, raises, monkeypatch):
    def fails(*_):
        raise ZeroDivisionError

    first = LevelMultipliers(np.zeros(4), residual)
    monkeypatch.setattr(kkt, "solve_system", lambda *_: first)
    monkeypatch.setattr(certificate, "_best_multipliers", fails)
    if raises:
        with pytest.raises(ZeroDivisionError):
            certificate._certify_level(local(), 0, [])
    else:
        result = certificate._certify_level(local(), 0, [])
        assert (result.multipliers, result.curvature, result.level.stationarity) == (first, None, residual)


@pytest.mark.parametrize(("bound", "by"), [("proven", "bounded"), ("undecided", "refined"), ("violated", "refined")])
def test_by_what_the_whole_cycle_is_covered_is_told(bound, by):
    here = local()
    levels = certificate.certify_levels(here)
    prices = certificate._price_limits(here, levels)
    assert certificate._certificate(here, WholeCycle(0.0, bound), levels, prices, 1e-8).whole_cycle == by


def test_what_floats_decide_is_judged_by_jets_and_the_rest_in_40_digits():
    """Slope 2 x of x² + y² at x: far below or above the threshold of 1e-6 jets say it, near it 40 digits do."""
    bowl = toy.program("xy", {"f": lambda v: v["x"] ** 2 + v["y"] ** 2})
    cases = (0.0, "jets", True), (2e-7, "40 digits", True), (8e-7, "40 digits", False), (1e-3, "jets", False)
    for x, by, passed in cases:
        second_certificate = certify(bowl, {"x": x, "y": 0.0}, 1e-8)
        assert (second_certificate.by, second_certificate.clear, second_certificate.passed) == (by, True, passed)


def test_where_floats_have_no_slope_40_digits_have_one():
    """√x at 0: jets have no number there; a difference of 40 digits says that it can still rise, not fall."""
    root = toy.program("x", formulas={"f": lambda m, v: m.sqrt(v["x"])})
    quick, result = certify_by(JetDerivatives, root, {"x": 0.0}, 1e-8), certify(root, {"x": 0.0}, 1e-8)
    assert (quick.passed, quick.clear, quick.by) == (False, False, "jets")
    assert "not a number" in quick.reasons[0]
    assert (result.passed, result.clear, result.by) == (False, True, "40 digits")
    assert "can still fall" in result.reasons[0]
