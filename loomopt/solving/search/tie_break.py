"""The tie-break that ends every target: least added mass, then least change from today's machine.

It goes only along moves verified flat at this design: objectives unchanged to 1e-10, every limit still held.
"""

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from loomopt.model.program import Move, Program
from loomopt.model.sampling import sampled
from loomopt.model.session import current
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import ACTIVE, GIVES_WAY, MOVED

UNCHANGED = 1e-10
"""Change of an objective along a move that costs nothing: a hundredth of the usual accuracy."""

BEYOND = 1e-3
"""Share of a variable by which a flat move is tried beyond the design too: a bump at both ends of it would show."""

BISECTIONS, NODES = 60, 64
"""Halvings of a move's way (to a float's last bit), and nodes of a turn on which a curve must not change."""

Numbers = Mapping[str, float]


def moved(program: Program, x: Numbers) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return x (SI) after all moves along which nothing is lost, and what was chosen."""
    settled = []
    for move in program.moves:
        wish = move.wished({**program.parameters, **x})
        goal = move.goal(wish, x) if wish else {}
        if wish is None or all(x[name] == end for name, end in goal.items()) or not is_flat(program, x, goal):
            continue
        share = reach(program, x, goal)
        sizes = [share * abs(goal[v.name] - x[v.name]) / v.scale for v in program.variables if v.name in goal]
        if max(sizes, default=0.0) > MOVED:
            settled.append(f"{move.name}: {wish.reason}")
        x = part_way(x, goal, share)
    return dict(x), tuple(settled)


def unchanging(
    program: Program, x: Numbers, asked: Callable[[Numbers], bool] = lambda way: True
) -> list[dict[str, float]]:
    """Return the directions, SI, of the moves along which nothing changes at x (SI) as far as bounds allow.

    Neither an objective, nor a limit that is touched, but for the bounds of what moves. asked: says of a direction
    whether it is of interest, every one without it.
    """
    ways = ((move, way) for move in program.moves for way in move.directions(x) if asked(way))
    return [way for move, way in ways if _judged(program, x, move, way).same]


JUDGED, KEPT = "judged moves", 16
"""What a session calls them, and how many it keeps: curvature and least change ask for the same."""


class _Judged(NamedTuple):
    """Whether nothing changes along a move; program: held as long as this is kept, so that no other has its id."""

    program: Program
    same: bool


def _judged(program: Program, x: Numbers, move: Move, way: Numbers) -> _Judged:
    key = id(program), tuple(x.items()), tuple(way.items())
    make = functools.partial(_is_same, program, x, list(move.ends(way, x)))
    return current().kept(JUDGED, KEPT, key, lambda: _Judged(program, make()))


def _is_same(program: Program, x: Numbers, ends: Sequence[Numbers]) -> bool:
    """Say whether neither the objectives nor a limit that is touched changes on the way to either end."""
    try:
        before = _excesses(program, x)
        there = [_excesses(program, {**x, **end}) for end in ends]
        if not is_flat(program, x, *ends):
            return False
    except (ValueError, ZeroDivisionError):
        return False
    # The bounds of what moves may be touched on the way.
    bounds = program.bound_limits
    return all(
        abs(other - one) <= UNCHANGED
        for end, after in zip(ends, there, strict=True)
        for k, (one, other) in enumerate(zip(before, after, strict=True))
        if one >= -ACTIVE and not (k in bounds and bounds[k].row in end)
    )


def part_way(x: Numbers, goal: Numbers, share: float) -> dict[str, float]:
    """Return x moved a share of the way to the goal."""
    if share == 1.0:
        return {**x, **goal}
    return {**x, **{name: x[name] + share * (end - x[name]) for name, end in goal.items()}}


def is_flat(program: Program, x: Numbers, *goals: Numbers) -> bool:
    """Say whether the objectives stay the same along the way to each goal (of the same variables), and beyond x."""
    before = _objectives(program, x)
    nearby = {name: x[name] * (1 + BEYOND) for goal in goals for name in goal}
    trials = [part_way(x, goal, share) for goal in goals for share in (1.0, 0.5)] + [part_way(x, nearby, 1.0)]
    changed = (_objectives(program, trial) for trial in trials)
    # Where two corners of the cycle pass each other a turn has other nodes: something changes along such a move.
    return all(now.shape == before.shape and np.abs(now - before).max() <= UNCHANGED for now in changed)


def _objectives(program: Program, x: Numbers) -> Floats:
    """Return the objectives in their natural sizes; for a peak, the whole curve at nodes that move with the design."""
    sampler = sampled(program.model, {**program.parameters, **x})
    pieces, u = sampler.grid(NODES)
    return np.concatenate([each.watched(sampler, pieces, u) / each.scale for each in program.objectives])


def reach(program: Program, x: Numbers, goal: Numbers) -> float:
    """Return the largest share of the way along which no limit gets worse than it is allowed."""
    allowed = [max(0.0, excess) + GIVES_WAY for excess in _excesses(program, x)]

    def holds(share: float) -> bool:
        now = _excesses(program, part_way(x, goal, share))
        return all(excess <= most for excess, most in zip(now, allowed, strict=True))

    if holds(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _excesses(program: Program, x: Numbers) -> list[float]:
    """Return by how much every limit is exceeded, in its natural size; an equality how far it is missed."""
    sampler = sampled(program.model, {**program.parameters, **x})
    sampler.search(limit.row for limit in program.cycle_limits.values())
    return [limit.violation(sampler) for limit in program.limits]
