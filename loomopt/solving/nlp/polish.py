"""Newton's method on what binds: the last digits of an answer.

IPOPT stops a hair inside its bounds. Where rows and bounds carry multipliers, Newton's method on just these rows
(least change, so that flat directions stay put) leaves them met to rounding, whatever path led there.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import (
    POLISH_DONE,
    POLISH_FARTHEST,
    POLISH_MET,
    POLISH_RANK,
    POLISH_STEPS,
    SETTLED,
    TOUCHING,
)
from loomopt.solving.nlp.calls import Calls
from loomopt.solving.nlp.rows import BindingRows, Multipliers

Nodes = Sequence[Sequence[Extreme]]


def polish(
    calls: Calls, x: dict[str, float], extra: Floats, multipliers: Multipliers, peaks: Nodes
) -> tuple[dict[str, float], Nodes]:
    """Return x (SI) put exactly on what binds, and the extremes that do; x itself where that is no small, clear step.

    extra: the epigraph variables; multipliers: the solver's; peaks: the extremes at x.
    """
    touching: Nodes = ()
    for _ in range(POLISH_STEPS):
        sampler = calls.sampler(x)
        if sampler is None:
            return x, touching
        touching = [
            [e for e in of if calls.excess(family, e, extra) >= -TOUCHING]
            for family, of in zip(calls.families, calls.loose(sampler, peaks), strict=True)
        ]
        met_at = _newton(calls, sampler, x, extra, multipliers, touching)
        if met_at is None:
            return x, touching
        x, extra, step = met_at
        moved = calls.sampler(x)
        if moved is None or step <= SETTLED:
            return x, touching
        peaks = calls.peaks(moved)
    return x, touching


def _newton(
    calls: Calls, sampler: Sampler, x: dict[str, float], extra: Floats, multipliers: Multipliers, nodes: Nodes
) -> tuple[dict[str, float], Floats, float] | None:
    """Return x (SI) and extra where the binding rows and the nodes' rows are met, and the step there, scaled.

    None where there is no such point nearby.
    """
    nlp = calls.transcribed(sampler, nodes, warm=False)
    arguments = calls.arguments(nlp, sampler, x, extra, nodes)
    bound = multipliers.binding(nlp.rows, list(map(len, nodes)))
    flat = met(nlp.jacobian, arguments, arguments["x0"], bound, calls.settings.farthest)
    if flat is None:
        return None
    design, extra = nlp.rows.parted(flat)
    return calls.design(design), extra, float(np.abs(flat - arguments["x0"]).max())


def met(
    jacobian: Any, arguments: Mapping[str, Any], x: Floats, bound: BindingRows, farthest: float = POLISH_FARTHEST
) -> Floats | None:
    """Return x (scaled) on its binding rows and bounds, or None where that is not a clear, small step.

    jacobian: CasADi function (x, p) → (g, dg/dx); arguments: the solver's bounds lbx, ubx, lbg, ubg and parameters p.
    """
    lower, upper = arguments["lbx"], arguments["ubx"]
    trial = np.where(bound.at_lower, lower, np.where(bound.at_upper, upper, x))
    rows = bound.rows & (arguments["ubg"] == 0.0)
    free = ~(bound.at_lower | bound.at_upper) & (lower < upper)
    if not np.all(np.isfinite(trial)):
        return None
    for _ in range(POLISH_STEPS):
        values, slopes = jacobian(trial, arguments["p"])
        residual = np.asarray(values).ravel()[rows]
        if not residual.size or not free.any() or not np.all(np.isfinite(residual)):
            break
        step = np.linalg.lstsq(np.asarray(slopes)[np.ix_(rows, free)], -residual, rcond=POLISH_RANK)[0]
        trial[free] += step
        if np.abs(step).max() <= POLISH_DONE:
            break
    values = np.asarray(jacobian(trial, arguments["p"])[0]).ravel()
    small = np.abs(trial - x).max() <= farthest
    inside = np.all(trial >= lower - POLISH_MET) and np.all(trial <= upper + POLISH_MET)
    held = np.all(values <= arguments["ubg"] + POLISH_MET) and np.all(values >= arguments["lbg"] - POLISH_MET)
    return np.clip(trial, lower, upper) if small and inside and held else None
