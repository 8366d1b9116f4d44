"""Newton's method on what binds, with each whole-cycle row standing on its own extreme as that moves."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from loomopt.cycle import Floats
from loomopt.jobs.sampling import Extreme, Sampler
from loomopt.nlp.calls import Calls
from loomopt.nlp.point import Point, sampler_at
from loomopt.nlp.polish import binding, met, stationary

TOUCHING, SETTLED, POLISHES, POLISH = 1e-8, 1e-8, 3, 1e-6
"""Rows this close to their bound are polished onto it, in steps up to POLISH; below SETTLED no extreme moves."""
FOLLOW, FOLLOW_ROUNDS, FOLLOW_STEPS = 0.2, 5, 8
"""Farthest that a neighbour's answer is followed along what binds, in the variables' own scales."""

Nodes = Sequence[Sequence[Extreme]]


def polish(
    calls: Calls, x: dict[str, float], extra: Floats, point: Point, peaks: Nodes
) -> tuple[dict[str, float], Nodes]:
    """Return x (SI) put exactly on what binds, and the extremes that do; x itself where that is no small, clear step.

    extra: the epigraph variables; point: the solver's answer with its multipliers; peaks: the extremes at x.
    """
    touching: Nodes = ()
    for _ in range(POLISHES):
        sampler = sampler_at(calls.program, x)
        if sampler is None:
            return x, touching
        touching = [
            [e for e in found if calls.excess(family, e, extra) >= -TOUCHING]
            for family, found in zip(calls.families, peaks, strict=True)
        ]
        reached = _newton(calls, sampler, x, extra, point, touching, POLISHES, POLISH)
        if reached is None:
            return x, touching
        flat, step, _ = reached
        x, extra = calls.design(flat), flat[len(calls.program.variables) :]
        moved = sampler_at(calls.program, x)
        if moved is None or step <= SETTLED:
            return x, touching
        peaks = calls.peaks(moved)
    return x, touching


def follow(calls: Calls, sampler: Sampler, peaks: Nodes, warm: Point) -> Point | None:
    """Return the answer near a solved neighbour where the same rows bind, by Newton's method alone; else None.

    A row that would let go, a new one that would bind, or a whole-cycle value exceeded elsewhere ends it: then the
    solver must choose again.
    """
    x, extra = dict(warm.x), np.asarray(warm.raw["extra"])
    tracked: Nodes = warm.binding
    for _ in range(FOLLOW_ROUNDS):
        tracked = [[_same(found, node) for node in old] for found, old in zip(peaks, tracked, strict=True)]
        reached = _newton(calls, sampler, x, extra, warm, tracked, FOLLOW_STEPS, FOLLOW)
        if reached is None:
            return None
        flat, step, multipliers = reached
        x, extra = calls.design(flat), flat[len(calls.program.variables) :]
        moved = sampler_at(calls.program, x)
        if moved is None:
            return None
        sampler, peaks = moved, calls.peaks(moved)
        if step > SETTLED:
            continue
        families = zip(calls.families, peaks, strict=True)
        worst = max((calls.excess(family, e, extra) for family, found in families for e in found), default=0.0)
        if multipliers is None or worst > calls.settings.excess:
            return None
        raw = {
            **warm.raw,
            "lam_g": np.concatenate([multipliers, warm.raw["lam_g"][len(multipliers) :]]),
            "extra": extra,
        }
        bound = tuple(map(tuple, tracked))
        return replace(warm, x=x, iterations=0, violation=worst, raw=raw, built=calls.built, binding=bound)
    return None


def _newton(
    calls: Calls,
    sampler: Sampler,
    x: dict[str, float],
    extra: Floats,
    point: Point,
    nodes: Nodes,
    steps: int,
    largest: float,
) -> tuple[Floats, float, Floats | None] | None:
    """Return the scaled point where the binding rows and the nodes' rows are met, the step, and their multipliers.

    None where there is no such point nearby; the multipliers of the rows before the nodes', None with a wrong sign.
    """
    nlp = calls.transcribed(sampler, max(map(len, nodes), default=0), warm=False)
    arguments = calls.arguments(nlp, sampler, x, extra, nodes)
    rows = len(arguments["ubg"]) - len(calls.families) * nlp.slots
    used = ~np.array(calls.idle_rows(nlp, nodes)[rows:], dtype=bool)
    bound = binding(point.raw["lam_x"], np.concatenate([point.raw["lam_g"][:rows], used.astype(float)]))
    flat = met(nlp.jacobian, arguments, arguments["x0"], bound, steps=steps, largest=largest)
    if flat is None:
        return None
    multipliers = stationary(nlp.gradient, nlp.jacobian, arguments, flat, bound)
    step = float(np.abs(flat - arguments["x0"]).max())
    return flat, step, None if multipliers is None else multipliers[:rows]


def _same(found: Sequence[Extreme], node: Extreme) -> Extreme:
    """Return the extreme a node has become: the nearest of its sign on its piece, itself where there is none."""
    alike = [e for e in found if e.piece == node.piece and (e.value > 0) == (node.value > 0)]
    return min(alike, key=lambda extreme: abs(extreme.u - node.u), default=node)
