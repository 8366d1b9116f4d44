"""Linear programs of few dimensions: SciPy's least value, many of them with corners that several parts share."""

import numpy as np
import pytest
import scipy.optimize

from loomopt.maths.linear_program import least


def program(seed, tied):
    """Return a random program with a start inside; tied: small whole numbers, of which many sums are equal."""
    generator = np.random.default_rng(seed)
    size = int(generator.integers(3, 12))
    numbers = generator.normal(size=(size, 5))
    numbers = np.round(numbers) if tied else numbers
    # A share of the unit matrix keeps the directions independent.
    ways, start, cost = numbers[:, :3] + 10 * np.eye(size, 3), np.abs(numbers[:, 3]), np.abs(numbers[:, 4])
    signed = generator.random(size) < 0.8
    return cost * signed, start, ways, signed


@pytest.mark.parametrize("tied", [False, True])
@pytest.mark.parametrize("seed", range(60))
def test_the_least_is_the_one_scipy_finds(seed, tied):
    cost, start, ways, signed = program(seed, tied)
    result = least(cost, start, ways, signed)
    other = scipy.optimize.linprog(
        cost @ ways, A_ub=-ways[signed], b_ub=start[signed], bounds=[(None, None)] * ways.shape[1]
    )
    assert other.status == 0
    assert result is not None
    assert cost @ result == pytest.approx(cost @ start + other.fun, abs=1e-9)
    assert result[signed].min(initial=0.0) >= 0.0
    moved = np.linalg.lstsq(ways, result - start, rcond=None)[0]
    assert ways @ moved == pytest.approx(result - start, abs=1e-9)


def test_what_falls_without_end_has_no_least():
    assert least(np.array([-1.0, 0.0]), np.ones(2), np.eye(2), np.ones(2, dtype=bool)) is None


def test_what_cannot_move_is_its_own_least():
    start = np.array([0.5, -0.25])
    assert least(np.ones(2), start, np.zeros((2, 0)), np.array([True, False])) == pytest.approx(start)
