"""KKT systems whose multipliers are plain to see."""

import numpy as np
import pytest
from support import toy

from loomopt.model.sampling import Sampler
from loomopt.physics.tolerances import POSITIVE, STATIONARY
from loomopt.solving.certificate import kkt
from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives
from loomopt.solving.certificate.kkt import LevelMultipliers, System, active_set, replaceable_rows, solve_system


def at(program, x):
    """Return the active set at x and its slopes."""
    sampler = Sampler(program.model, x)
    active = active_set(program, sampler)
    return active, MpmathDerivatives(program, x, sampler, active.rows).gradients()


def level(program, x, place=0, earlier=()):
    active, gradients = at(program, x)
    system = kkt.system(active, place, earlier)
    return active, system, kkt.solve_system(gradients, system)


XY = {"x": 0.0, "y": 0.0}
LEAN = {"f": lambda v: 3 * v["x"] + 2 * v["y"]}


def test_limits_share_a_slope_by_their_own():
    program = toy.program("xy", LEAN, limits=(("x", -1, 0.0), ("y", -1, 0.0), ("y", 1, 0.0)))
    _, system, result = level(program, XY)
    assert system.inequalities == (0, 1, 2)
    assert system.equalities == ()
    assert result.values == pytest.approx([3.0, 2.0, 0.0, 1.0])
    assert result.residual < 1e-14
    assert result.positive == {0, 1, 3}
    without = system.without(1)
    assert (without.inequalities, without.pieces) == ((0, 2), system.pieces)
    assert kkt.solve_system(at(program, XY)[1], without).residual > 0.5


def test_an_equality_may_pull_either_way_and_a_limit_may_not():
    for value in (3.0, -3.0):
        rows = {"f": lambda v, value=value: value * v["x"] + v["y"] ** 2}
        _, _, result = level(toy.program("xy", rows, limits=(("x", 0, 0.0),)), XY)
        assert result.values == pytest.approx([-value, 1.0])
    _, _, result = level(toy.program("xy", LEAN, limits=(("x", 1, 0.0), ("y", -1, 0.0))), XY)
    assert result.residual > 0.5
    assert result.values[0] == 0.0


def test_pieces_of_an_objective_share_a_multiplier_of_one():
    """max(x, −2 x + y, −y) at 0: weights 2/4, 1/4, 1/4."""
    rows = {"p": lambda v: v["x"], "q": lambda v: -2 * v["x"] + v["y"], "r": lambda v: -v["y"]}
    _, system, result = level(toy.program("xy", rows, objectives=("p, q, r",)), XY)
    assert system.pieces == (0, 1, 2)
    assert result.values == pytest.approx([0.5, 0.25, 0.25])
    assert result.residual < 1e-14


def multipliers(*of):
    return LevelMultipliers(np.array(of, dtype=float), 0.0)


TWO = {"a": lambda v: 2 * v["x"], "b": lambda v: v["x"] + v["y"] ** 2, "c": lambda v: v["x"] - v["y"]}


def test_what_binds_at_one_level_is_an_equality_at_the_next():
    program = toy.program("xy", TWO, limits=(("x", -1, 0.0), ("y", -1, 0.0)), objectives=("a", "c"))
    active, _ = at(program, XY)
    system = kkt.system(active, 1, [multipliers(2.0, 0.0, 1.0, 0.0)])
    assert (system.equalities, system.inequalities) == ((0,), (1,))
    assert system.higher_levels.tolist() == [[0, 0, 1, 0]]
    assert system.limits == (1, 0)
    faint = kkt.system(active, 1, [multipliers(0.9e-8, 0.0, 1.0, 0.0)])
    assert faint.equalities == ()


def test_a_peak_of_several_pieces_is_held_piece_by_piece():
    program = toy.program("xy", TWO, objectives=("a, b", "c"))
    active, _ = at(program, XY)
    fixed = kkt.system(active, 1, [multipliers(0.5, 0.5, 0.0)]).higher_levels
    assert fixed.tolist() == [[1, 0, 0], [0, 1, 0]]
    assert kkt.system(active, 1, [multipliers(1.0, 0.0, 0.0)]).higher_levels.tolist() == [[1, 0, 0]]


def test_both_pieces_of_a_magnitude_that_vanishes_are_held():
    active, _ = at(toy.program("xy", TWO, objectives=("|a|", "c")), XY)
    fixed = kkt.system(active, 1, [multipliers(1.0, 0.0, 0.0)]).higher_levels
    assert fixed.tolist() == [[1, 0, 0], [0, 1, 0]]


def test_a_row_binds_above_a_hundred_millionth():
    assert POSITIVE == 1e-8
    assert multipliers(POSITIVE, 1.1e-8, -1.1e-8, 0.0).positive == {1, 2}


def test_multipliers_are_normalised_to_pieces_that_weigh_one_together():
    """A slope that is left takes its share of the sum: here 0.5."""
    system = kkt.System((1, 2), (0,), (), np.zeros((0, 3)))
    assert multipliers(3.0, 0.1, 0.4).normalised(system) == pytest.approx([6.0, 0.2, 0.8])
    empty = kkt.System((1,), (0,), (), np.zeros((0, 2)))
    assert multipliers(3.0, 0.0).normalised(empty).tolist() == [3.0, 0.0], "no sum to share"


@pytest.mark.parametrize("seed", range(40))
def test_a_row_is_replaceable_where_others_can_do_without_it(seed):
    """Of rows that depend on each other some can stand for others; of independent ones none."""
    rng = np.random.default_rng(seed)
    rows, size = int(rng.integers(2, 7)), int(rng.integers(2, 6))
    slopes = rng.normal(size=(rows, size)) * 10.0 ** rng.integers(-3, 4, (rows, 1))
    prices = 10.0 ** rng.integers(-4, 2, rows)
    gradients = np.vstack([slopes, -prices @ slopes])
    first = System((rows,), tuple(range(rows)), (), np.zeros((0, rows + 1)))
    result = solve_system(gradients, first)
    named = replaceable_rows(gradients, first, result, STATIONARY)
    without = [
        k
        for k in range(rows)
        if result.values[k] > POSITIVE and solve_system(gradients, first.without(k)).residual <= STATIONARY
    ]
    assert set(without) <= set(named)
    if rows <= size and np.linalg.svd(gradients[:rows], compute_uv=False)[-1] * prices.min() > 1e-4:
        assert named == []


def test_a_row_apart_from_those_that_depend_on_each_other_is_not_replaceable():
    """Slopes (1, 0), twice that, and (0, 1): the first two can stand for each other, the third for none."""
    gradients = np.array([[1.0, 0.0], [2.0, 0.0], [0.0, 1.0], [-2.0, -1.0]])
    first = System((3,), (0, 1, 2), (), np.zeros((0, 4)))
    result = LevelMultipliers(np.array([1.0, 0.5, 1.0, 1.0]), 0.0)
    assert replaceable_rows(gradients, first, result, STATIONARY) == [0, 1]


def test_a_piece_of_an_earlier_level_that_nothing_holds_may_not_rise():
    """max(x, y) at 0 with x ≥ 0: x holds it, and −y, which would fall, is stopped by y."""
    rows = {"p": lambda v: v["x"], "q": lambda v: v["y"], "f": lambda v: -v["y"]}
    program = toy.program("xy", rows, objectives=("p, q", "f"), limits=(("x", -1, 0.0),))
    _, _, first = level(program, XY)
    assert first.values[:3] == pytest.approx([1.0, 1.0, 0.0])
    active, system, result = level(program, XY, 1, [first])
    (neighbour,) = (k for k in active.levels[0] if not first.values[k])
    assert neighbour in system.inequalities
    assert result.residual < 1e-14
    assert result.values[neighbour] == pytest.approx(1.0)


def test_a_magnitude_that_vanishes_is_balanced_by_its_own_pieces():
    slope, neighbour = np.array([0.3, -2.0, 0.5]), np.array([0.3, -2.0, 0.4])
    pieces = kkt.System((1, 2), (0,), (), np.zeros((0, 3)))
    result, least = kkt.vanishing_multipliers(pieces, 3), kkt.solve_system(np.array([neighbour, slope, -slope]), pieces)
    assert result.values == pytest.approx(least.values, abs=1e-15)
    assert least.residual == pytest.approx(result.residual, abs=1e-15)
