"""The active set: which rows touch, and which smooth pieces an objective is made of."""

from dataclasses import replace

import pytest
from support import toy

from loomopt.model.limits import RatioLimit
from loomopt.model.sampling import Sampler
from loomopt.physics.tolerances import ACTIVE
from loomopt.solving.certificate.kkt import active_set


def active(program, x):
    return active_set(program, Sampler(program.model, x))


def limited(sign, value=1.0):
    return toy.program("x", {"f": lambda v: v["x"] ** 2}, limits=(("x", sign, value),))


@pytest.mark.parametrize(
    ("sign", "x", "touched"),
    [
        (1, 1.0, True),
        (1, 1 - 0.9 * ACTIVE, True),
        (1, 1 - 1.1 * ACTIVE, False),
        (1, 1.5, True),
        (-1, 1 + 0.9 * ACTIVE, True),
        (-1, 1 + 1.1 * ACTIVE, False),
        (-1, 0.5, True),
        (0, 5.0, True),
        (0, -5.0, True),
    ],
)
def test_a_row_that_touches_or_is_exceeded_is_active_and_an_equality_always(sign, x, touched):
    result = active(limited(sign), {"x": x})
    assert result.limits == int(touched)
    expected = 1 - x if sign < 0 else x - 1
    assert result.excess[0] == pytest.approx(abs(expected) if sign == 0 else expected, abs=1e-15)
    if touched:
        assert result.rows[0].excess == pytest.approx(expected, abs=1e-15)
        assert (result.rows[0].name, result.rows[0].reads, result.rows[0].place) == ("x", "x", 0)
        assert (result.rows[0].sign, result.rows[0].scale, result.rows[0].node) == (1.0, 1.0, None)


WAVES = {
    "a": lambda m, v, phi: v["x"] * m.cos(phi),
    "b": lambda m, v, phi: v["y"] * m.cos(2 * phi - 1),
    "c": lambda m, v, phi: 0.1 * m.cos(phi - 2) + 0 * v["x"],
}


def test_every_touching_extreme_of_a_whole_cycle_limit_is_a_row():
    program = toy.program("xy", {"f": lambda v: v["x"]}, WAVES, limits=(("a", 1, 1.0), ("b", 1, 1.0), ("c", 1, 1.0)))
    result = active(program, {"x": 1.0, "y": 1 - 2e-8})
    rows = result.rows[: result.limits]
    assert sorted(row.name for row in rows) == ["a"] * 3 + ["b"] * 4, "a at both ends of the turn and at its middle"
    assert sorted(row.sign for row in rows) == [-1.0] * 3 + [1.0] * 4
    assert all(row.excess == pytest.approx(-2e-8 if row.name == "b" else 0.0, abs=1e-12) for row in rows)
    assert active(program, {"x": 1 - 2e-7, "y": 0.5}).limits == 0


def pieces(objective, x, rows=None, waves=None):
    program = toy.program("xy", rows, waves, objectives=(objective,))
    result = active(program, x)
    return [(result.rows[k].reads, result.rows[k].sign) for k in result.levels[0]]


ROWS = {"p": lambda v: v["x"], "q": lambda v: v["y"]}


@pytest.mark.parametrize(
    ("objective", "x", "y", "expected"),
    [
        ("p", 2.0, 0.0, [("p", 1.0)]),
        ("p", -2.0, 0.0, [("p", 1.0)]),
        ("|p|", 2.0, 0.0, [("p", 1.0)]),
        ("|p|", -2.0, 0.0, [("p", -1.0)]),
        ("|p|", 5e-10, 0.0, [("p", 1.0), ("p", -1.0)]),
        ("|p|", 2e-9, 0.0, [("p", 1.0)]),
        ("p, q", 2.0, 1.0, [("p", 1.0)]),
        ("p, q", 1.0, 2.0, [("q", 1.0)]),
        ("p, q", 2.0, 2 - 5e-8, [("p", 1.0), ("q", 1.0)]),
        ("p, q", 2.0, 2 - 2e-7, [("p", 1.0)]),
        ("|p, q|", 2.0, -2.0, [("p", 1.0), ("q", -1.0)]),
        ("|p, q|", -3.0, 2.0, [("p", -1.0)]),
    ],
)
def test_an_objective_is_the_largest_of_its_pieces(objective, x, y, expected):
    assert pieces(objective, {"x": x, "y": y}, ROWS) == expected


def test_peaks_of_an_objective_compete():
    x = {"x": 1.0, "y": -1.0}
    assert {name for name, _ in pieces("peak a, b", x, waves=WAVES)} == {"a", "b"}
    assert {name for name, _ in pieces("peak a, c", x, waves=WAVES)} == {"a"}


def test_how_far_a_piece_stands_below_the_largest_is_told():
    program = toy.program("xy", ROWS, objectives=("p, q",))
    result = active(program, {"x": 2.0, "y": 2 - 5e-8})
    assert [result.rows[k].excess for k in result.levels[0]] == pytest.approx([0.0, -5e-8], abs=1e-15)


def test_a_limit_whose_weight_vanishes_keeps_its_row_from_below_only():
    program = limited(1)
    for sign, rows in ((1, 0), (-1, 1), (0, 1)):
        first = program.limits[0]
        limit = RatioLimit(first.name, sign, first.row, 0.0, first.scale, "w")
        weighed = toy.program("x", {"f": lambda v: v["x"], "w": lambda v: 0 * v["x"]})
        result = active(replace(weighed, limits=(limit,)), {"x": 0.0})
        assert result.limits == rows
        assert all(row.limit.sign == -1 for row in result.rows[:rows])


@pytest.mark.parametrize("size", [4.0, 0.25])
def test_what_touches_is_told_in_natural_sizes(size):
    sizes = {"p": size}
    for share, count in ((0.9, 2), (1.1, 1)):
        below = 2 - share * ACTIVE * size
        program = toy.program("xy", ROWS, objectives=("p, q",), sizes=sizes)
        assert len(active(program, {"x": 2.0, "y": below}).levels[0]) == count
        program = toy.program("xy", ROWS, objectives=("|p|",), sizes=sizes)
        result = active(program, {"x": share * 1e-9 * size, "y": 0.0})
        assert (len(result.levels[0]), result.zero) == (count, (count == 2,))


def test_an_objective_is_zero_where_all_its_magnitudes_are():
    program = toy.program("xy", ROWS, objectives=("|p, q|", "p, q"))
    assert active(program, {"x": 0.0, "y": 0.0}).zero == (True, False)
    assert active(program, {"x": 0.0, "y": 1.0}).zero == (False, False)


def test_what_is_off_by_just_as_much_as_touches_touches():
    assert active(limited(1, 0.0), {"x": -ACTIVE}).limits == 1
    assert pieces("p, q", {"x": 0.0, "y": -ACTIVE}, ROWS) == [("p", 1.0), ("q", 1.0)]
    level = {"w": lambda m, v, phi: -ACTIVE * (v["x"] == 0.5) + 0 * phi}
    program = toy.program("x", {}, level, limits=(("w", 1, 0.0),), objectives=("x",), signed=True)
    assert active(program, {"x": 0.5}).limits >= 1


def test_a_magnitude_of_just_a_billionth_has_both_signs():
    assert pieces("|p|", {"x": 1e-9, "y": 0.0}, ROWS) == [("p", 1.0), ("p", -1.0)]
