"""Newton's method on what binds, with each whole-cycle row standing on its own extreme as that moves."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from loomopt.cycle import Floats
from loomopt.nlp.calls import FIRST_SLOTS, Calls
from loomopt.nlp.pivot import bound_by, reach
from loomopt.nlp.point import Point
from loomopt.nlp.polish import BINDING, binding, met
from loomopt.program.sampling import Extreme, Sampler

TOUCHING, SETTLED, POLISHES, POLISH = 1e-8, 1e-8, 3, 1e-6
"""Rows this close to their bound are polished onto it, in steps up to POLISH; below SETTLED no extreme moves."""
FOLLOW, FOLLOW_ROUNDS, PATIENCE = 0.2, 24, 5
"""Farthest that a neighbour's answer is followed, in the variables' own scales; rounds in all, and the rounds in a
row that may leave the extremes moving as far as ever."""
ALIKE = 1e-3
"""Nodes of one piece this close in u stand for one extreme."""

Nodes = Sequence[Sequence[Extreme]]


def polish(
    calls: Calls, x: dict[str, float], extra: Floats, point: Point, peaks: Nodes
) -> tuple[dict[str, float], Nodes]:
    """Return x (SI) put exactly on what binds, and the extremes that do; x itself where that is no small, clear step.

    extra: the epigraph variables; point: the solver's answer with its multipliers; peaks: the extremes at x.
    """
    touching: Nodes = ()
    for _ in range(POLISHES):
        sampler = calls.sampler(x)
        if sampler is None:
            return x, touching
        touching = [
            [e for e in found if calls.excess(family, e, extra) >= -TOUCHING]
            for family, found in zip(calls.families, peaks, strict=True)
        ]
        reached = _newton(calls, sampler, x, extra, point, touching, POLISHES, POLISH)
        if reached is None:
            return x, touching
        flat, step = reached
        x, extra = calls.design(flat), flat[len(calls.program.variables) :]
        moved = calls.sampler(x)
        if moved is None or step <= SETTLED:
            return x, touching
        peaks = calls.peaks(moved)
    return x, touching


def follow(calls: Calls, warm: Point) -> Point | None:
    """Return the answer near a solved neighbour by pivots alone, each whole-cycle row on its own extreme.

    None where they lead nowhere: then the solver must choose what binds.
    """
    point: Point | None = warm
    found: Nodes = warm.nodes
    sampler = calls.sampler(warm.x)
    order = sampler.cycle.order if sampler else ()
    nearest, idle, last = math.inf, 0, None
    for _ in range(FOLLOW_ROUNDS):
        point = _pivoted(calls, sampler, point, found) if sampler and point else None
        sampler = calls.sampler(point.x) if point else None
        if sampler is None or point is None or sampler.cycle.order != order:
            return None
        found = tuple(map(tuple, calls.peaks(sampler)))
        pairs = [(node, _same(of, node)) for of, old in zip(found, point.binding, strict=True) for node in old]
        families = zip(calls.families, found, strict=True)
        worst = max((calls.excess(family, e, point.raw["extra"]) for family, of in families for e in of), default=0.0)
        moved = max((abs(node.u - now.u) for node, now in pairs), default=0.0)
        if worst <= calls.settings.excess and moved <= SETTLED:
            return replace(point, iterations=0, violation=worst, built=calls.built)
        found, last = _hastened(found, pairs, last)
        idle = 0 if moved < 0.9 * nearest else idle + 1
        nearest = min(nearest, moved)
        if idle == PATIENCE:
            return None
    return None


def _hastened(
    found: Nodes, pairs: Sequence[tuple[Extreme, Extreme]], last: tuple[Floats, Floats] | None
) -> tuple[Nodes, tuple[Floats, Floats]]:
    """Return the extremes with those that bind moved to where the last two rounds point, and this round's (u, move).

    Where the objective is nearly flat, extremes and design chase each other in circles: the secant through two rounds
    (Anderson's mixing) ends that.
    """
    u = np.array([node.u for node, _ in pairs])
    move = np.array([now.u - node.u for node, now in pairs])
    if last is None or last[0].shape != u.shape or not np.any(move != last[1]):
        return found, (u, move)
    turned = move - last[1]
    share = float(turned @ move / (turned @ turned))
    goal = u + move - share * (u - last[0] + turned)
    aims = {id(now): min(max(float(to), 0.0), 1.0) for (_, now), to in zip(pairs, goal, strict=True)}
    return [[replace(e, u=aims.get(id(e), e.u)) for e in of] for of in found], (u, move)


def _pivoted(calls: Calls, sampler: Sampler, point: Point, found: Nodes) -> Point | None:
    """Return the point that pivots lead to from another, with nodes on the extremes `found`; None without one."""
    variables = len(calls.program.variables)
    nodes = [_chosen(of, old) for of, old in zip(found, point.binding, strict=True)]
    nlp = calls.transcribed(sampler, max(map(len, nodes), default=0), warm=False)
    arguments = calls.arguments(nlp, sampler, point.x, np.asarray(point.raw["extra"]), nodes)
    first = len(arguments["ubg"]) - len(calls.families) * nlp.slots
    bound = [k < len(old) for old in point.binding for k in range(nlp.slots)]
    lam_g = np.concatenate([point.raw["lam_g"][:first], np.array(bound, dtype=float)])
    reached = reach(nlp, arguments, bound_by(point.raw["lam_x"], lam_g, BINDING), FOLLOW)
    if reached is None:
        return None
    rows, above, below = np.split(reached.multipliers, [len(lam_g), len(lam_g) + len(reached.x)])
    raw = {"lam_x": above - below, "lam_g": rows, "extra": reached.x[variables:]}
    flags = reached.bound[first : len(lam_g)].reshape(len(nodes), nlp.slots)
    binding = tuple(
        tuple(e for e, binds in zip(of, on, strict=False) if binds) for of, on in zip(nodes, flags, strict=True)
    )
    return replace(point, x=calls.design(reached.x), nodes=tuple(map(tuple, nodes)), raw=raw, binding=binding)


def _chosen(found: Sequence[Extreme], binding: Sequence[Extreme]) -> list[Extreme]:
    """Return the extremes that the binding ones have become, then others, as many as there is room for."""
    first = [_same(found, node) for node in binding]
    others = [e for e in found if not any(e.piece == f.piece and abs(e.u - f.u) <= ALIKE for f in first)]
    return first + others[: max(0, FIRST_SLOTS - len(first))]


def _newton(
    calls: Calls,
    sampler: Sampler,
    x: dict[str, float],
    extra: Floats,
    point: Point,
    nodes: Nodes,
    steps: int,
    largest: float,
) -> tuple[Floats, float] | None:
    """Return the scaled point where the binding rows and the nodes' rows are met, and the step there.

    None where there is no such point nearby.
    """
    nlp = calls.transcribed(sampler, max(map(len, nodes), default=0), warm=False)
    arguments = calls.arguments(nlp, sampler, x, extra, nodes)
    rows = len(arguments["ubg"]) - len(calls.families) * nlp.slots
    used = ~np.array(calls.idle_rows(nlp, nodes)[rows:], dtype=bool)
    bound = binding(point.raw["lam_x"], np.concatenate([point.raw["lam_g"][:rows], used.astype(float)]))
    flat = met(nlp.jacobian, arguments, arguments["x0"], bound, steps=steps, largest=largest)
    if flat is None:
        return None
    return flat, float(np.abs(flat - arguments["x0"]).max())


def _same(found: Sequence[Extreme], node: Extreme) -> Extreme:
    """Return the extreme a node has become: the nearest of its sign on its piece, itself where there is none."""
    alike = [e for e in found if e.piece == node.piece and e.sign == node.sign]
    return min(alike, key=lambda extreme: abs(extreme.u - node.u), default=node)
