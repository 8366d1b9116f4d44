"""Series over boxes: value, slope and bend of a formula along the cycle, in 40 digits, lie inside, with slopes."""

import numpy as np
import pytest

from loomopt.maths import intervals, systems
from loomopt.maths.interval_series import IntervalSeries, along
from loomopt.maths.intervals import Interval, variable

M, MP = systems.box_series(), systems.mpmath()
ROOM = 1e-17
"""What differences leave."""
FORMULAS = {
    "sum": lambda m, u, x: 3 - (x + u) - (2 - u) + 1 + (u - x) + (+u) - (-u),
    "product": lambda m, u, x: 2 * u * x * 0.5 - u * u + u * (u + x),
    "quotient": lambda m, u, x: u / (x + 3) + 3 / (u + 2) + (u + x) / (u * u + 1) + x / (u + 5),
    "powers": lambda m, u, x: u**2 + (u + x) ** 3 * u**1,
    "angles": lambda m, u, x: m.sin(u * x) * m.cos(x - u) + m.sin(x),
    "root": lambda m, u, x: m.sqrt(u**2 + x**2 + m.number(0.1)) + m.sqrt(x * x + 1),
    "angle of both": lambda m, u, x: m.atan2(u + x, u * x + 3),
    "angle of one": lambda m, u, x: m.atan2(u, x + 3) + m.atan2(x * x + 1, u) + m.atan2(x, x + 4),
    "chosen": lambda m, u, x: m.choose(1.0, (u, u * x, x)) + m.choose(0.0, (x, x)) + m.pi,
}


def taylor(formula, u, x):
    """Return value, slope and half the curvature along u, by differences in 40 digits: right to 1e-18."""
    step = MP.number(1e-10)
    before, here, after = (formula(MP, u + k * step, x) for k in (-1, 0, 1))
    return here, (after - before) / (2 * step), (after - 2 * here + before) / (2 * step * step)


@pytest.mark.parametrize("name", FORMULAS)
def test_terms_hold_those_in_40_digits(name):
    rng, count = np.random.default_rng(4), 60
    half = 10.0 ** rng.uniform(-14, -1, (2, count))
    middle = rng.uniform(0.1, 1.0, (2, count))
    low, high = middle - half, middle + half
    at = low + rng.random((2, count)) * (high - low)
    for k in range(count):
        strip = along(np.array([[low[0, k]]]), np.array([[high[0, k]]]))
        result = FORMULAS[name](M, strip, variable(0, 1, low[1, k : k + 1], high[1, k : k + 1]))
        true = taylor(FORMULAS[name], *(MP.number(float(v)) for v in at[:, k]))
        there = taylor(FORMULAS[name], MP.number(float(at[0, k])), MP.number(float(middle[1, k])))
        for term, value, other in zip(result.terms, true, there, strict=True):
            v = term.v if isinstance(term, intervals.Enclosure) else term
            assert float(v.low.ravel()[0]) - ROOM <= value <= float(v.high.ravel()[0]) + ROOM
            if isinstance(term, intervals.Enclosure):
                ends = [
                    float(e.ravel()[0]) * (MP.number(float(at[1, k])) - MP.number(float(middle[1, k])))
                    for e in (term.g.low, term.g.high)
                ]
                assert min(ends) - ROOM <= value - other <= max(ends) + ROOM


def test_what_stands_beside_a_series_steps_back_for_it():
    u = along(np.array([[0.2]]), np.array([[0.3]]))
    x = variable(0, 1, np.array([1.0]), np.array([2.0]))
    for number in (x, Interval(1.0, 2.0), 1.5, 2):
        for result in (number + u, number - u, number * u, number / u, u + number, u - number, u * number, u / number):
            assert isinstance(result, IntervalSeries)
    assert not isinstance(M.sin(x), IntervalSeries)
    assert not isinstance(M.sqrt(x), IntervalSeries)
