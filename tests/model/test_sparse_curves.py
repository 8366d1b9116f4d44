"""Curves of few rows: rows are added until each column's top is as close as it is said to be."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from loomopt.model.curves import ANGLE, SPARSE_MOST_ROWS, sparse_curves
from loomopt.physics.cycle import TURN

SMOOTH = {
    "one wave": (lambda phi: np.cos(phi - 0.7123), 1.0),
    "top at the turn's end": (lambda phi: 3.0 + np.cos(phi + 1e-4), 4.0),
    "least is largest": (lambda phi: -np.exp(np.cos(3 * (phi - 1.234567))), np.e),
    "narrow": (lambda phi: np.exp(-(((phi - 2.34567) / 0.05) ** 2)), 1.0),
    "two nearly alike": (lambda phi: np.cos(phi - 0.3) ** 2 * (1 + 1e-4 * np.sin(phi - 0.3 - np.pi / 2)), None),
}
BENT = {
    "corner": (lambda phi: 4 - np.abs(phi - 2.71828), 4.0),
    "nothing": (lambda phi: 0 * phi, 0.0),
    "level": (lambda phi: np.minimum(np.cos(phi), 0.25), None),
}


def sparse_curve(function, accuracy, singular=()):
    """Return the rows and the claimed error of a curve without corners of its own."""
    seen = []

    def rows(steps, also):
        phi = np.unique(np.concatenate([np.arange(steps) * TURN / steps, np.asarray(also) % TURN]))
        seen.append(len(phi))
        return {ANGLE: phi, "f [N]": function(phi)}

    even = SimpleNamespace(angles=lambda pieces, u: TURN * u)
    sampler: Any = SimpleNamespace(cycle=even, singular=singular, grid=lambda n: (np.zeros(n, int), np.arange(n) / n))
    columns, error = sparse_curves(sampler, rows, accuracy)
    assert seen == sorted(seen), "rows are only added"
    return columns[ANGLE], np.abs(columns["f [N]"]).max(), error


def top(function, exact):
    """Return the largest magnitude, by a scan where it is not known in closed form."""
    return exact if exact is not None else np.abs(function(np.linspace(0, TURN, 4_000_001))).max()


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("name", SMOOTH)
def test_the_top_is_as_close_as_asked_and_no_farther_than_claimed(name, accuracy):
    function, exact = SMOOTH[name]
    angles, result, error = sparse_curve(function, accuracy)
    missed = 1 - result / top(function, exact)
    assert missed <= accuracy
    assert missed <= error + 1e-12
    assert len(angles) < 1000, "few rows are the point"


@pytest.mark.parametrize("name", BENT)
def test_corners_levels_and_nothing_end_too(name):
    function, exact = BENT[name]
    angles, result, _ = sparse_curve(function, 1e-6)
    assert result == pytest.approx(top(function, exact), abs=1e-6)
    assert len(angles) < SPARSE_MOST_ROWS


def test_more_accuracy_takes_more_rows_and_leaves_less():
    function, _ = SMOOTH["one wave"]
    results = [sparse_curve(function, 10.0**-k) for k in (3, 6, 9)]
    rows, errors = [len(angles) for angles, _, _ in results], [error for *_, error in results]
    assert rows == sorted(rows)
    assert errors == sorted(errors, reverse=True)


def test_a_spike_beside_a_singular_position_is_found():
    place = 4.0
    _, result, _ = sparse_curve(lambda phi: 1 / np.hypot(1, (phi - place) / 1e-6), 1e-6, (place,))
    assert result == pytest.approx(1.0, abs=1e-6)
