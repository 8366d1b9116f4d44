"""The answer near a solved neighbour, by pivots alone: each whole-cycle row stands on its own extreme as that moves.

A fixed-point iteration: put nodes on the extremes, pivot to the KKT point, find the extremes there. It is the reduction
method for semi-infinite programs with a fixed number of nodes [Hettich and Kortanek, SIAM Review 35 (1993), section 7].
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import SAME_NODE, SETTLED
from loomopt.solving.nlp.calls import Calls
from loomopt.solving.nlp.pivot import reach
from loomopt.solving.nlp.point import Point
from loomopt.solving.nlp.rows import Multipliers

FOLLOW_FARTHEST, FOLLOW_ROUNDS = 0.2, 24
"""Farthest that a neighbour's answer is followed, in natural sizes, and the rounds it may take.

The experiment: a tenth of the way doubles IPOPT's iterations, ten times saves a seventh; but pivots are local, and
beyond a fifth of its size a design is another. Half the rounds do.
"""


FOLLOW_PROGRESS, FOLLOW_PATIENCE = 0.9, 5
"""Share to which the extremes' moves must shrink, and the rounds in a row in which they may fail to: with two, one of
the experiment's neighbours is left to IPOPT."""


Nodes = Sequence[Sequence[Extreme]]
"""Nodes of each family."""


class _Change(NamedTuple):
    """What binding nodes did in a round: where each stood on its piece, and how far the extreme has moved from it."""

    u: Floats
    move: Floats

    @property
    def largest(self) -> float:
        """The farthest move."""
        return float(np.abs(self.move).max(initial=0.0))


def follow(calls: Calls, warm: Point) -> Point | None:
    """Return the answer near a solved neighbour; None where pivots lead nowhere: the solver must choose what binds."""
    sampler = calls.sampler(warm.x)
    if sampler is None:
        return None
    order, point, nodes = sampler.cycle.order, warm, warm.nodes
    nearest, idle, last = math.inf, 0, None
    for _ in range(FOLLOW_ROUNDS):
        pivoted = _pivoted(calls, sampler, point, nodes)
        sampler = calls.sampler(pivoted.x) if pivoted else None
        if pivoted is None or sampler is None or sampler.cycle.order != order:
            return None
        point, extremes = pivoted, calls.peaks(sampler)
        violation = calls.violation(extremes, point.extra)
        become = [(old, _nearest(of, old)) for of, own in zip(extremes, point.binding, strict=True) for old in own]
        change = _Change(np.array([old.u for old, _ in become]), np.array([now.u - old.u for old, now in become]))
        if violation <= calls.settings.excess and change.largest <= SETTLED:
            return replace(point, iterations=0, violation=violation, built=calls.built)
        nodes = _aimed(calls.loose(sampler, extremes), [now for _, now in become], change, last)
        idle = 0 if change.largest < FOLLOW_PROGRESS * nearest else idle + 1
        if idle == FOLLOW_PATIENCE:
            return None
        nearest, last = min(nearest, change.largest), change
    return None


def _aimed(
    extremes: Nodes, binding: Sequence[Extreme], change: _Change, last: _Change | None
) -> tuple[tuple[Extreme, ...], ...]:
    """Return the extremes with those that bind moved to where the last two rounds point.

    Where the objective is nearly flat, extremes and design chase each other in circles: the secant through two rounds
    ends that [Anderson's mixing of depth 1: Walker and Ni, SIAM J. Numer. Anal. 49 (2011)].
    """
    aims: dict[int, float] = {}
    if last is not None and last.u.shape == change.u.shape and np.any(change.move != last.move):
        turned = change.move - last.move
        share = float(turned @ change.move / (turned @ turned))
        goals = change.u + change.move - share * (change.u - last.u + turned)
        aims = {id(now): min(max(float(to), 0.0), 1.0) for now, to in zip(binding, goals, strict=True)}
    return tuple(tuple(e._replace(u=aims.get(id(e), e.u)) for e in of) for of in extremes)


def _pivoted(calls: Calls, sampler: Sampler, point: Point, extremes: Nodes) -> Point | None:
    """Return the point that pivots lead to from another, with nodes on the extremes; None without one."""
    nodes = [_chosen(of, old, calls.slots) for of, old in zip(extremes, point.binding, strict=True)]
    nlp = calls.transcribed(sampler, nodes, warm=False)
    arguments = calls.arguments(nlp, sampler, point.x, point.extra, nodes)
    # Binding nodes come first in their family.
    active = point.multipliers.binding(nlp.rows, list(map(len, point.binding)))
    reached = reach(nlp, arguments, active, FOLLOW_FARTHEST)
    if reached is None:
        return None
    pairs = zip(nodes, nlp.rows.at_nodes(reached.active.rows), strict=True)
    design, extra = nlp.rows.parted(reached.x)
    return replace(
        point,
        x=calls.design(design),
        nodes=tuple(map(tuple, nodes)),
        extra=extra,
        multipliers=Multipliers(nlp.rows, reached.lam_x, reached.lam_g),
        binding=tuple(tuple(e for e, on in zip(of, flags, strict=False) if on) for of, flags in pairs),
    )


def _chosen(extremes: Sequence[Extreme], binding: Sequence[Extreme], slots: int) -> list[Extreme]:
    """Return the extremes that the binding ones have become, then others, as many as there is room for."""
    first = [_nearest(extremes, node) for node in binding]
    others = [e for e in extremes if not any(e.piece == f.piece and abs(e.u - f.u) <= SAME_NODE for f in first)]
    return first + others[: max(0, slots - len(first))]


def _nearest(extremes: Sequence[Extreme], node: Extreme) -> Extreme:
    """Return the extreme a node has become: the nearest of its sign on its piece, itself where there is none."""
    alike = [e for e in extremes if e.piece == node.piece and e.sign == node.sign]
    return min(alike, key=lambda extreme: abs(extreme.u - node.u), default=node)
