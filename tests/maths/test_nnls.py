"""Non-negative least squares: SciPy's answer, and the conditions that make an answer right."""

import numpy as np
import pytest
import scipy.optimize
from hypothesis import given, settings
from hypothesis import strategies as st

from loomopt.maths.nnls import nnls

SHAPES = [(1, 1), (3, 2), (5, 5), (6, 14), (8, 3), (20, 40)]


def problem(seed, rows, columns):
    generator = np.random.default_rng(seed)
    return generator.normal(size=(rows, columns)), generator.normal(size=rows)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("seed", range(5))
def test_residual_is_the_one_scipy_finds(shape, seed):
    matrix, target = problem(seed, *shape)
    ours = np.linalg.norm(matrix @ nnls(matrix, target) - target)
    assert ours == pytest.approx(scipy.optimize.nnls(matrix, target)[1], rel=1e-10, abs=1e-10)


@settings(derandomize=True, deadline=None, database=None, max_examples=60)
@given(seed=st.integers(0, 10**6), shape=st.sampled_from(SHAPES))
def test_answer_meets_its_optimality_conditions(seed, shape):
    matrix, target = problem(seed, *shape)
    answer = nnls(matrix, target)
    slope = matrix.T @ (target - matrix @ answer)
    size = np.abs(matrix).sum()
    assert answer.min() >= 0
    assert slope.max() <= 1e-10 * size, "a column at zero would still lower the residual"
    assert np.abs(slope[answer > 0]).max(initial=0) <= 1e-10 * size, "a column in use is not at its best"


@pytest.mark.parametrize("seed", range(5))
def test_multipliers_that_built_a_vector_are_found_again(seed):
    matrix, _ = problem(seed, 9, 6)
    wanted = np.array([0.0, 2.0, 0.0, 1e-6, 3.0, 1e3])
    assert nnls(matrix, matrix @ wanted) == pytest.approx(wanted, abs=1e-9)


def test_repeated_columns_share_what_one_of_them_would_carry():
    matrix = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    answer = nnls(matrix, np.array([2.0, -1.0]))
    assert answer[0] + answer[1] == pytest.approx(2.0, abs=1e-12)
    assert answer[2] == 0.0


def test_a_target_behind_every_column_gives_nothing():
    assert nnls(np.eye(3), -np.ones(3)) == pytest.approx(np.zeros(3), abs=0)


def test_no_columns_give_no_multipliers():
    assert nnls(np.zeros((4, 0)), np.ones(4)).shape == (0,)


def test_free_signs_are_pairs_of_columns():
    """The certificate writes an equality as a column and its opposite: the difference is the multiplier."""
    matrix, _ = problem(3, 4, 2)
    plus, second, minus = nnls(np.column_stack([matrix, -matrix[:, 0]]), matrix @ np.array([-5.0, 2.0]))
    assert plus - minus == pytest.approx(-5.0, abs=1e-10)
    assert second == pytest.approx(2.0, abs=1e-10)


def test_many_multipliers_are_found_to_their_last_digits():
    """A free cam law of 256 intervals has as many in use as it has variables, but a few."""
    generator = np.random.default_rng(7)
    matrix, wanted = generator.normal(size=(130, 125)), np.zeros(125)
    used = generator.permutation(125)[:120]
    wanted[used] = generator.uniform(0.01, 2.0, size=120)
    result = nnls(matrix, matrix @ wanted)
    assert set(np.flatnonzero(result)) == set(used)
    assert result == pytest.approx(wanted, rel=1e-12)


def test_columns_that_nearly_depend_on_each_other_are_solved_to_the_residual_scipy_finds():
    generator = np.random.default_rng(3)
    matrix = generator.normal(size=(30, 60))
    matrix[:, 30:] = matrix[:, :30] + 1e-9 * generator.normal(size=(30, 30))
    target = generator.normal(size=30)
    ours = np.linalg.norm(matrix @ nnls(matrix, target) - target)
    assert ours == pytest.approx(scipy.optimize.nnls(matrix, target)[1], rel=1e-8)


@pytest.mark.parametrize("subject", ["matrix", "target"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_no_number_is_refused(subject, value):
    matrix, target = problem(0, 4, 6)
    (matrix if subject == "matrix" else target)[..., 1] = value
    with pytest.raises(ArithmeticError, match="no number"):
        nnls(matrix, target)
