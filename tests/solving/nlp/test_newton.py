"""Newton's method of least change: onto a circle, onto too many rows, and where it cannot go."""

import numpy as np
import pytest

from loomopt.solving.nlp.newton import least_norm, newton_onto_rows


def onto(read, x):
    return newton_onto_rows(read, x, steps=8, done=1e-9, rank=1e-10)


def circle(x):
    """Return the row x² + y² − 1 and its slopes."""
    return np.array([x @ x - 1.0]), 2.0 * x[None]


def test_a_point_moves_onto_a_circle_along_its_radius():
    start = np.array([0.9, 1.2])
    end = onto(circle, start)
    assert end.converged
    assert end.x == pytest.approx(start / np.linalg.norm(start), abs=1e-15)


def test_dependent_rows_are_met_as_one():
    end = onto(lambda x: tuple(np.repeat(part, 2, axis=0) for part in circle(x)), np.array([2.0, 0.0]))
    assert end.converged
    assert end.x == pytest.approx([1.0, 0.0], abs=1e-15)


def test_without_rows_nothing_moves():
    start = np.array([3.0, 4.0])
    end = onto(lambda x: (np.zeros(0), np.zeros((0, 2))), start)
    assert end.converged
    assert np.array_equal(end.x, start)


def test_rows_without_a_common_point_are_not_met():
    end = onto(lambda x: (np.array([x[0] ** 2 + 1.0]), np.array([[2.0 * x[0]]])), np.array([0.7]))
    assert not end.converged


def test_a_row_without_a_value_ends_it():
    end = onto(lambda x: (np.array([np.nan]), np.ones((1, 1))), np.array([0.5]))
    assert not end.converged
    assert end.x == [0.5]


def test_the_least_vector_is_the_shortest():
    matrix = np.array([[1.0, 1.0, 0.0]])
    assert least_norm(matrix, np.array([2.0]), 1e-10) == pytest.approx([1.0, 1.0, 0.0])
