"""What an earlier level holds by its curvature alone: later levels neither move it nor pay for it."""

import numpy as np
import pytest
from support import toy

import loomopt as lo
from loomopt.solving.certificate.certificate import certify, certify_levels
from loomopt.solving.certificate.derivatives import JetDerivatives
from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives
from loomopt.solving.certificate.kkt import active_set
from loomopt.solving.certificate.second_order import Local


def levels(first, second, names="ab", limits=(), third=None):
    rows = {"f": first, "g": second} | ({"h": third} if third else {})
    return toy.program(names, rows, limits=limits, objectives=tuple(rows))


def passed(program, **x):
    certificate = certify(program, x, 1e-8)
    assert certificate.passed, certificate.reasons
    return certificate


BOWL = levels(lambda v: v["a"] ** 2, lambda v: (v["a"] - 1) ** 2 + (v["b"] - 2) ** 2)


def test_a_later_level_moves_only_what_an_earlier_one_leaves_level():
    """f is least at a = 0 alone, with no slope there to price a step toward a = 1, which g would take."""
    result = passed(BOWL, a=0.0, b=2.0)
    assert (result.minimum, result.unique) == (True, True)
    assert result.levels[1].higher_levels == pytest.approx(0.0, abs=1e-6)
    assert not certify(BOWL, {"a": 0.0, "b": 1.9}, 1e-8).passed, "b is free for g"
    assert not certify(BOWL, {"a": 0.1, "b": 2.0}, 1e-8).passed, "f comes first"


def test_rounding_in_a_slope_gives_no_price_without_measure():
    """Where f's slope along a is 1e-10 only, g's of 2 would cost 2e10 of it."""
    result = passed(BOWL, a=5e-11, b=2.0)
    assert max(level.price for level in result.levels) < 10.0
    assert max(level.higher_levels for level in result.levels) < 10.0


@pytest.mark.parametrize("turn", [0.3, 1.1])
def test_the_closed_direction_may_be_any(turn):
    """The point of the line c a + s b = 0 nearest to (1, 0) is (s², −s c)."""
    c, s = np.cos(turn), np.sin(turn)
    turned = levels(
        lambda v: (c * v["a"] + s * v["b"]) ** 2,
        lambda v: (v["a"] - 1) ** 2 + v["b"] ** 2,
    )
    passed(turned, a=float(s * s), b=float(-s * c))


@pytest.mark.parametrize(("pull", "minimum"), [(0.9, True), (1.1, False), (-3.0, True)])
@pytest.mark.parametrize("derivatives", [JetDerivatives, MpmathDerivatives])
def test_a_later_level_follows_the_valley_of_an_earlier_one(pull, minimum, derivatives):
    """On a = b², where f is least, g = b² − p a is (1 − p) b²: its own curvature along b says 2 whatever p."""
    valley = levels(lambda v: (v["a"] - v["b"] ** 2) ** 2, lambda v: v["b"] ** 2 - pull * v["a"])
    assert certify(valley, {"a": 0.0, "b": 0.0}, 1e-8).passed == minimum


def test_the_valley_is_followed_on_what_binds():
    """On the circle r = 1, f is least where c = a² as well, a and b being free: there g = (1 − p) a²."""

    def bound(p):
        rows = {
            "f": lambda v: (v["c"] - v["a"] ** 2) ** 2 - v["r"],
            "g": lambda v: v["c"] - p * v["a"] ** 2,
            "q": lambda v: v["a"] ** 2 + v["b"] ** 2 - v["r"],
        }
        return toy.program("abcr", rows, limits=(("q", 0, 0.0), ("r", 1, 1.0)), objectives=("f", "g"))

    x = {"a": 0.0, "b": 1.0, "c": 0.0, "r": 1.0}
    assert certify(bound(0.5), x, 1e-8).passed
    assert not certify(bound(1.5), x, 1e-8).passed


@pytest.mark.parametrize(("pull", "reasons"), [(0.0, ()), (3.0, ("second order open",))])
def test_what_two_earlier_levels_close_stays_closed(pull, reasons):
    """A third level that pulls at what the second one holds would need to know how both bend: that is left open."""
    three = levels(
        lambda v: v["a"] ** 2,
        lambda v: (v["a"] - 1) ** 2 + v["b"] ** 2,
        "abc",
        third=lambda v: v["a"] + pull * v["b"] + (v["c"] - 1) ** 2,
    )
    assert certify(three, {"a": 0.0, "b": 0.0, "c": 1.0}, 1e-8).reasons == reasons
    falling = certify(three, {"a": 0.0, "b": 0.0, "c": 0.9}, 1e-8).reasons
    assert any("h can still fall" in reason for reason in falling)


def test_closed_directions_are_perpendicular_to_what_binds_and_to_each_other():
    rows = {"f": lambda v: v["a"] ** 2 + (v["c"] - v["b"]) ** 2 - 3 * v["d"], "g": lambda v: v["b"] ** 2 + v["a"]}
    program = toy.program("abcd", rows, limits=(("d", 1, 1.0),), objectives=("f", "g"))
    x = {"a": 0.0, "b": 0.0, "c": 0.0, "d": 1.0}
    sampler = toy.Sampler(program.model, x)
    active = active_set(program, sampler)
    exact = MpmathDerivatives(program, x, sampler, active.rows)
    first, second = certify_levels(Local(program, x, sampler, active, exact, exact.gradients()))
    closed = first.curvature.closed
    assert closed.directions @ closed.directions.T == pytest.approx(np.eye(2), abs=1e-12)
    assert closed.directions[:, 3] == pytest.approx(0.0, abs=1e-12)
    assert sorted(closed.bends) == pytest.approx([2.0, 4.0])
    assert second.level.stationarity < 1e-9


def test_a_solve_ends_where_curvature_alone_holds_the_first_level():
    answer = toy.solve(BOWL)
    assert answer.status == "optimal", answer.message
    assert answer.design["a"] == pytest.approx(0.0, abs=1e-8)
    assert answer.design["b"] == pytest.approx(2.0, abs=1e-6)


ROOMY = {
    "operation.M0": "100 N*m",
    "bounds.l1": {"min": "10 mm", "max": "90 mm"},
    "bounds.l2": {"min": "10 mm", "max": "520 mm"},
    "bounds.l3": {"min": "40 mm", "max": "550 mm"},
    "bounds.l4": {"min": "140 mm", "max": "550 mm"},
    "limits.theta": {"min": "1 deg", "max": "10 deg"},
    "limits.swing": {"min": "20 deg", "max": "23.4 deg"},
    "limits.mu_min.min": "5 deg",
}


@pytest.mark.slow
def test_a_reed_torque_that_curves_and_leaves_the_scale_open_has_no_price_without_measure():
    """Two limits bind and |M3| curves along what is left of the shape; the rod's inertia then asks for a small one."""
    answer = lo.solve(lo.load("beatup-light").update(ROOMY).with_effect("rod_inertia"))
    assert answer.status == "optimal", answer.message
    peak = next(level for level in answer.certificate.levels if level.objective == "peak_torque")
    assert 0.0 < peak.price < 1e3
    assert "l1" in [price.limit for price in answer.binding if "peak_torque" in price.worth]


@pytest.mark.few(1)
@pytest.mark.parametrize("least", [0.0, 0.5, 1.0])
def test_a_point_that_curvature_alone_isolates_leaves_later_levels_nothing_to_choose(least):
    """l1, l4 and theta bind; along what is left |M3| curves, but for a radius that changes nothing."""
    answer = lo.solve(lo.load("beatup-light").set("limits.theta.min", f"{least} deg"))
    assert answer.status == "optimal", answer.message
    assert {price.limit for price in answer.binding} >= {"l1", "l4", "theta"}
    if least == 0.0:
        assert abs(answer.figures["M3_fdc"]) == pytest.approx(88.530879, abs=1e-6)
