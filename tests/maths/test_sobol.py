"""Sobol's points: those of SciPy but for the shift, and evenly spread whatever the seed."""

import numpy as np
import pytest
from scipy.stats import qmc

from loomopt.maths.sobol import BITS, POLYNOMIALS, points


def unshifted(monkeypatch, count, dimensions):
    class Still:
        def integers(self, high, size, dtype):
            return np.zeros(size, dtype)

        def random(self, shape):
            return np.zeros(shape)

    monkeypatch.setattr(np.random, "default_rng", lambda seed: Still())
    return points(count, dimensions)


def test_without_the_shift_they_are_those_of_scipy(monkeypatch):
    dimensions = len(POLYNOMIALS) + 1
    ours = unshifted(monkeypatch, 256, dimensions)
    theirs = qmc.Sobol(dimensions, scramble=False, bits=BITS - 2).random(256)
    assert ours == pytest.approx(theirs, abs=2.0 ** -(BITS - 3))


@pytest.mark.parametrize("seed", range(4))
def test_each_half_quarter_and_eighth_of_each_coordinate_has_its_share(seed):
    second_points = points(512, 12, seed)
    for parts in (2, 4, 8, 512):
        shares = np.floor(second_points * parts).astype(int)
        assert all(np.all(np.bincount(column, minlength=parts) == 512 // parts) for column in shares.T)


def test_the_seed_says_which_and_each_lies_in_the_cube():
    assert np.array_equal(points(64, 5, 3), points(64, 5, 3))
    assert not np.array_equal(points(64, 5, 3), points(64, 5, 4))
    wide = points(64, 40, 1)
    assert wide.shape == (64, 40)
    assert wide.min() >= 0.0
    assert wide.max() < 1.0
    assert np.linalg.matrix_rank(wide - wide.mean(axis=0)) == 40, "coordinates beyond the sixteenth are no copies"
