"""Ranges of multipliers: what those already met show is what linear programs give, and few programs are solved."""

from unittest import mock

import numpy as np
import pytest

from loomopt.maths import linear_program
from loomopt.solving.certificate.multiplier_set import KnownMultipliers, MultiplierSet

APART = 1e-7


def shares(count):
    """Return all multipliers that are not negative and add up to 1."""
    ways = np.linalg.svd(np.ones((1, count)))[2][1:].T
    return MultiplierSet(np.full(count, 1 / count), ways, np.ones(count, dtype=bool))


def drawn(seed):
    """Return a random set whose last row has no sign and whose first has one multiplier."""
    generator = np.random.default_rng(seed)
    ways = generator.normal(size=(7, 3))
    ways[0] = 0.0
    signed = np.arange(7) < 6
    start = np.abs(generator.normal(size=7)) * (generator.random(7) < 0.7)
    return MultiplierSet(start, ways, signed)


def apart(low, high):
    """Say whether a range is more than one price; it may have no end."""
    return not np.isfinite(high - low) or high - low > APART * max(1.0, abs(high))


@pytest.mark.parametrize("seed", range(20))
def test_a_range_is_that_of_linear_programs(seed):
    every = drawn(seed)
    known = KnownMultipliers(every)
    for place in range(7):
        cost = np.eye(7)[place]
        low, high = known.range([place], APART)
        lowest, highest = every.least(cost), -every.least(-cost)
        several = apart(lowest, highest)
        assert low == pytest.approx(lowest, abs=1e-12)
        assert apart(low, high) == several
        assert high == pytest.approx(highest, abs=1e-12) or (place < 6 and several and high <= highest)


def test_of_many_ties_few_need_a_linear_program(monkeypatch):
    counted = mock.Mock(wraps=linear_program.least)
    monkeypatch.setattr(linear_program, "least", counted)
    known = KnownMultipliers(shares(24))
    assert [known.range([place], APART)[0] for place in range(24)] == [0.0] * 24
    assert 0 < counted.call_count <= 24
