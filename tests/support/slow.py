"""Cases of one promise of which a few are tried in every run, and the others with the slow studies."""

import pytest


def after(count, cases):
    """Return cases as parameters, those after the first so many slow; a tuple is a value of each name."""
    values = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [pytest.param(*value, marks=[pytest.mark.slow] * (place >= count)) for place, value in enumerate(values)]


def grid(first, other):
    """Return all pairs of two columns as parameters; quick are as few of them as have each value of either."""
    first, other = list(first), list(other)
    fewer = min(len(first), len(other))
    return [
        pytest.param(a, b, marks=[pytest.mark.slow] * (row % fewer != column % fewer))
        for row, a in enumerate(first)
        for column, b in enumerate(other)
    ]
