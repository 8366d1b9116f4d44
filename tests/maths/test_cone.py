"""The least curvature on a cone, against directions drawn by the ten thousand."""

import numpy as np
import pytest

from loomopt.maths import nnls
from loomopt.maths.nnls import least_on_cone, onto_cone


def drawn(size, seed):
    """Return a random symmetric matrix and a few slopes."""
    generator = np.random.default_rng(seed)
    square = generator.normal(size=(size, size))
    return (square + square.T) / 2, generator.normal(size=(generator.integers(1, size + 1), size))


def swept(hessian, slopes, count=40_000):
    """Return the least curvature of random unit directions inside the cone."""
    directions = np.random.default_rng(1).normal(size=(count, len(hessian)))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    inside = directions[(directions @ slopes.T <= 0).all(axis=1)]
    return float(np.einsum("ni,ij,nj->n", inside, hessian, inside).min(initial=np.inf))


@pytest.mark.few(30)
@pytest.mark.parametrize("size", [2, 3])
@pytest.mark.parametrize("seed", range(40))
def test_nothing_less_is_found_by_a_sweep(size, seed):
    hessian, slopes = drawn(size, 100 * size + seed)
    least = least_on_cone(hessian, slopes)
    assert least <= swept(hessian, slopes) + 1e-3
    assert least >= np.linalg.eigvalsh(hessian)[0] - 1e-12


@pytest.mark.parametrize("seed", [27, 130])
def test_what_falls_inside_the_cone_only_takes_many_steps(seed, monkeypatch):
    """The first step from the eigenvectors still rises here."""
    hessian, slopes = drawn(3, 300 + seed)
    assert least_on_cone(hessian, slopes) < -0.03
    monkeypatch.setattr(nnls, "CONE_STEPS", 1)
    assert least_on_cone(hessian, slopes) > 0.0


def test_without_slopes_it_is_the_least_eigenvalue():
    assert least_on_cone(np.diag([3.0, -2.0, 1.0]), np.zeros((0, 3))) == pytest.approx(-2.0)


def test_a_cone_that_is_a_tip_has_no_direction():
    assert least_on_cone(np.diag([-1.0, -1.0]), np.array([[1, 0], [-1, 0], [0, 1], [0, -1.0]])) == np.inf


def test_a_half_plane_and_a_ray():
    saddle = np.diag([1.0, -1.0])
    assert least_on_cone(saddle, np.array([[0.0, 1.0]])) == pytest.approx(-1.0)
    ray = np.array([[0.0, 1.0], [0.0, -1.0], [-1.0, 0.0]])
    assert least_on_cone(saddle, ray) == pytest.approx(1.0)


def test_the_nearest_direction_of_a_cone():
    slopes = np.array([[1.0, 0.0], [0.0, 1.0]])
    assert onto_cone(np.array([-3.0, -4.0]), slopes) == pytest.approx([-0.6, -0.8])
    assert onto_cone(np.array([3.0, -4.0]), slopes) == pytest.approx([0.0, -1.0])
    assert onto_cone(np.array([3.0, 4.0]), slopes) is None
    assert onto_cone(np.array([3.0, -1e-8]), slopes) == pytest.approx([0.0, -1.0])
    assert onto_cone(np.array([3.0, -1e-10]), slopes) is None, "no more than rounding is left"


def test_a_matrix_of_zeros_is_level():
    assert least_on_cone(np.zeros((2, 2)), np.array([[1.0, 0.0]])) == pytest.approx(0.0)


@pytest.mark.parametrize(("left", "is_open"), [(0.9e-9, True), (1.1e-9, False)])
def test_a_projection_that_leaves_more_than_a_billionth_of_slope_is_none(left, is_open, monkeypatch):
    monkeypatch.setattr(nnls, "nnls", lambda *_: np.array([1 - left]))
    assert (onto_cone(np.array([1.0, -1.0]), np.array([[1.0, 0.0]])) is not None) == is_open


@pytest.mark.parametrize(("length", "is_open"), [(0.9e-9, False), (1.1e-9, True)])
def test_a_projection_shorter_than_a_billionth_is_the_tip(length, is_open):
    """Of a direction longer than 1, a billionth of its length."""
    slopes = np.array([[1.0, 0.0]])
    assert (onto_cone(np.array([0.5, -length]), slopes) is not None) == is_open
    assert (onto_cone(np.array([8.0, -8 * length]), slopes) is not None) == is_open


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_the_least_curvature_has_the_matrix_size(size):
    hessian, slopes = drawn(3, 327)
    assert least_on_cone(size * hessian, slopes) == pytest.approx(size * least_on_cone(hessian, slopes), rel=1e-6)
