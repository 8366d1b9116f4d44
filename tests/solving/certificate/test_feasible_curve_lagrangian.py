"""The Lagrangian read without derivatives: objective, prices and held levels, and what counts as a fall."""

import pytest
from support import toy

from loomopt.solving.certificate.second_order import Lagrangian

ROWS = {"f": lambda v: v["y"] - 10 * v["x"], "g": lambda v: v["x"], "h": lambda v: -4 * v["x"] + v["y"]}
PROGRAM = toy.program(
    "xy", ROWS, limits=(("g", 1, 2.0), ("h", -1, 0.0)), objectives=("f", "g"), sizes={"f": 2.0, "h": 0.5}
)
X = {"x": 1.0, "y": 3.0}


def falls(slope=0.0, direction=None, prices=None, fixed=None):
    return Lagrangian(PROGRAM, X, 0, prices or {}, fixed or {}).falls(direction or {"x": 1.0}, slope)


@pytest.mark.parametrize(("price", "expected"), [(4.9, True), (5.1, False)])
def test_prices_weigh_the_limits(price, expected):
    """f / 2 falls by 5 per unit of x, g rises by 1."""
    assert falls(prices={0: price}) == expected


@pytest.mark.parametrize(("price", "expected"), [(0.6, True), (0.65, False)])
def test_limits_are_read_in_their_natural_size_and_sense(price, expected):
    """h ≥ 0: its excess is −h / 0.5, which rises by 8 per unit of x."""
    assert falls(prices={1: price}) == expected


@pytest.mark.parametrize(("fixed", "expected"), [(4.9, True), (5.1, False)])
def test_earlier_levels_are_held_by_their_multipliers(fixed, expected):
    assert falls(fixed={1: fixed}) == expected


def test_a_fall_that_the_slope_left_explains_is_none():
    assert falls(slope=0.49)
    assert not falls(slope=0.51)


def test_a_fall_of_rounding_is_none():
    rise = {"y": -1.0, "x": 0.0}
    assert falls(direction=rise)
    assert not falls(direction={name: 1e-11 * part for name, part in rise.items()})
    assert not falls(direction={"y": 1.0})


def test_both_probes_must_fall():
    wavy = toy.program("x", {"f": lambda v: v["x"] ** 2 - 5e-3 * v["x"]})
    assert not Lagrangian(wavy, {"x": 0.0}, 0, {}, {}).falls({"x": 1.0}, 0.0), "lower at 3e-3, higher at 1e-2"


def test_what_has_no_value_does_not_fall():
    root = toy.program("x", formulas={"f": lambda m, v: m.sqrt(v["x"])})
    assert not Lagrangian(root, {"x": 0.0}, 0, {}, {}).falls({"x": -1.0}, 0.0)
    assert not Lagrangian(root, {"x": -1.0}, 0, {}, {}).falls({"x": 1.0}, 0.0)


@pytest.mark.parametrize(("fall", "counts"), [(0.9e-12, False), (1.1e-12, True)])
def test_a_fall_counts_above_a_trillionth(fall, counts):
    """f / 2 falls by half the way along −y; the shorter probe is 3e-3 long."""
    assert falls(direction={"y": -2 * fall / 3e-3}) == counts


@pytest.mark.parametrize(("turn", "expected"), [(2.9e-3, False), (3.1e-3, True), (9.9e-3, True)])
def test_the_shorter_probe_is_three_thousandths_long(turn, expected):
    """The objective lies low up to a turn, and at a hundredth again."""
    early = toy.program("x", {"f": lambda v: -1.0 if 0.0 < v["x"] < turn or v["x"] > 9.95e-3 else 0.0})
    assert Lagrangian(early, {"x": 0.0}, 0, {}, {}).falls({"x": 1.0}, 0.0) == expected


@pytest.mark.parametrize(("end", "expected"), [(9.9e-3, False), (1.01e-2, True)])
def test_the_longer_probe_is_a_hundredth_long(end, expected):
    pit = toy.program("x", {"f": lambda v: -1.0 if 0.0 < v["x"] < end else 0.0})
    assert Lagrangian(pit, {"x": 0.0}, 0, {}, {}).falls({"x": 1.0}, 0.0) == expected
