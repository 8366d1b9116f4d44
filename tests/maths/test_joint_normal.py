"""Normal probabilities within bounds beside closed forms of orthants."""

import math

import numpy as np
import pytest

from loomopt.maths import joint_normal


def below(ways):
    count = len(ways)
    return joint_normal.within(np.asarray(ways, dtype=float), np.full(count, -np.inf), np.zeros(count))


@pytest.mark.parametrize("correlation", [-0.9, -0.3, 0.0, 0.353, 0.8])
def test_two_values(correlation):
    ways = [[1.0, 0.0], [correlation, math.sqrt(1 - correlation**2)]]
    assert below(ways) == pytest.approx(0.25 + math.asin(correlation) / (2 * math.pi), abs=1e-13)


def test_three_values():
    ways = np.array([[1.0, 0.0, 0.0], [0.3, 0.9, 0.0], [0.5, 0.2, 0.8]])
    units = ways / np.linalg.norm(ways, axis=1)[:, None]
    cosines = (units @ units.T)[np.triu_indices(3, 1)]
    assert below(ways) == pytest.approx(0.5 - np.arccos(cosines).sum() / (4 * math.pi), abs=1e-12)


@pytest.mark.parametrize(("count", "digits"), [(3, 1e-12), (4, 1e-10), (5, 1e-4), (6, 1e-4)])
def test_values_of_one_half_correlation(count, digits):
    # The first of count + 1 independent numbers is the largest.
    ways = np.hstack([np.ones((count, 1)), np.eye(count)])
    assert below(ways) == pytest.approx(1 / (count + 1), abs=digits)


def test_a_value_and_its_opposite_are_one():
    ways = np.array([[2.0], [-1.0]])
    result = joint_normal.within(ways, np.array([-np.inf, -np.inf]), np.array([2.0, 1.0]))
    assert result == pytest.approx(math.erf(1 / math.sqrt(2)), abs=1e-14)


def test_what_nothing_moves_holds_or_does_not():
    assert joint_normal.within(np.zeros((1, 2)), np.array([-1.0]), np.array([1.0])) == 1.0
    assert joint_normal.within(np.zeros((1, 2)), np.array([0.5]), np.array([1.0])) == 0.0
