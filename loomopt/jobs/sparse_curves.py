"""Curves in as few rows as an accuracy asks for: coarse equal steps, and rows added where a column is largest."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from loomopt.cycle import TURN, Floats

STEPS = ((1e-3, 90), (1e-6, 180), (0.0, 360))
"""Equal steps of one turn that are begun with, by accuracy."""
ROUNDS, ROUNDING = 12, 1e-15
NEARLY = 0.8
"""Share of a column's largest magnitude above which another top may turn out higher."""


def curves(task: Any, scene: Any, design: Mapping[str, float], accuracy: float) -> tuple[dict[str, Floats], float]:
    """Return the curves (SI), and an estimate of the relative error of each column's largest magnitude.

    task: the job's functions. Rows are added at the vertex of the parabola through the highest row and its neighbours,
    until no column's largest magnitude moves by more than a hundredth of the accuracy.
    """
    steps = next(count for least, count in STEPS if accuracy >= least)
    also: list[float] = []
    columns = task.curves(scene, design, steps, also)
    highest, change = _highest(columns), np.inf
    for _ in range(ROUNDS):
        also += _vertices(columns)
        columns = task.curves(scene, design, steps, also)
        now = _highest(columns)
        change = max((abs(now[name] - highest[name]) / now[name] for name in now if now[name] > 0.0), default=0.0)
        highest = now
        if change <= max(accuracy / 100, ROUNDING):
            break
    return columns, max(change, ROUNDING)


def _highest(columns: Mapping[str, Floats]) -> dict[str, float]:
    return {name: float(np.nanmax(np.abs(values))) for name, values in columns.items() if name != "phi [rad]"}


def _vertices(columns: Mapping[str, Floats]) -> list[float]:
    """Return the angles, rad, where parabolas through each column's highest rows, and those not far below, end."""
    angles, found = columns["phi [rad]"], set()
    # The turn closes: a top may stand between the last row and the first.
    phi = np.concatenate([angles[-1:] - TURN, angles, angles[:1] + TURN])
    for name, values in columns.items():
        sizes = np.abs(np.concatenate([values[-1:], values, values[:1]]))
        if name == "phi [rad]" or not np.isfinite(sizes).any():
            continue
        middle, left, right = sizes[1:-1], sizes[:-2], sizes[2:]
        with np.errstate(invalid="ignore"):
            tops = np.flatnonzero((middle >= left) & (middle >= right) & (middle >= NEARLY * np.nanmax(sizes))) + 1
        found |= {angle for k in tops if (angle := _vertex(phi, sizes, int(k))) is not None}
    return sorted(found)


def _vertex(phi: Floats, sizes: Floats, k: int) -> float | None:
    """Return where the parabola through row k and its neighbours is highest; None at a corner or on a level."""
    before, after = phi[k] - phi[k - 1], phi[k + 1] - phi[k]
    rise, fall = sizes[k] - sizes[k - 1], sizes[k] - sizes[k + 1]
    bend = rise * after + fall * before
    if not (before > 0.0 and after > 0.0 and bend > 0.0):
        return None
    return float(phi[k] + (rise * after**2 - fall * before**2) / (2 * bend))
