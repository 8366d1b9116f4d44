"""The tie-break that ends every target: least added mass, then least change from today's machine.

It goes only along moves verified flat at this design: objectives unchanged to 1e-10, every limit still held.
"""

import functools
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.maths import systems
from loomopt.model.program import Move, Program
from loomopt.model.reading import BatchReading, plain, wide
from loomopt.model.sampling import Sampler, sampled
from loomopt.model.session import current
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import ACTIVE, GIVES_WAY, MOVED

UNCHANGED = 1e-10
"""Change of an objective along a move that costs nothing: a hundredth of the usual accuracy."""

BEYOND = 1e-3
"""Share of a variable by which a flat move is tried beyond the design too: a bump at both ends of it would show."""

ROSE = 0.1
"""Share of what a limit may give way that it has given half-way, if it rises by no more than the third power."""

BISECTIONS, NODES = 60, 64
"""Halvings of a move's way (to a float's last bit), and nodes of a turn on which a curve must not change."""

Numbers = Mapping[str, float]


def moved(program: Program, x: Numbers) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return x (SI) after all moves along which nothing is lost, and what was chosen."""
    settled = []
    for move in program.moves:
        wish = move.wished({**program.parameters, **x})
        goal = move.goal(wish, x) if wish else {}
        if wish is None or all(x[name] == end for name, end in goal.items()):
            continue
        way = _read(program, x, [goal])
        if way.change > UNCHANGED:
            continue
        share = _reached(program, x, goal, *way.excesses)
        sizes = [share * abs(goal[v.name] - x[v.name]) / v.scale for v in program.variables if v.name in goal]
        if max(sizes, default=0.0) > MOVED:
            settled.append(f"{move.name}: {wish.reason}")
        x = part_way(x, goal, share)
    return dict(x), tuple(settled)


def unchanging(
    program: Program, x: Numbers, asked: Callable[[Numbers], bool] = lambda way: True, most: float = UNCHANGED
) -> list[dict[str, float]]:
    """Return the directions, SI, of the moves along which nothing changes at x (SI) as far as bounds allow.

    Neither an objective, nor a limit that is touched, but for the bounds of what moves. asked: says of a direction
    whether it is of interest, every one without it; most: what may change, in natural sizes, at most UNCHANGED.
    """
    ways = ((move, way) for move in program.moves for way in move.directions(x) if asked(way))
    return [way for move, way in ways if _judged(program, x, move, way).change <= most]


JUDGED, KEPT = "judged moves", 64
"""What a session calls them, and how many it keeps: curvature and least change ask for the same."""


class _Judged(NamedTuple):
    """What changes along a move, in natural sizes, ∞ for more than UNCHANGED.

    program: held as long as this is kept, so that no other has its id.
    """

    program: Program
    change: float


def _judged(program: Program, x: Numbers, move: Move, way: Numbers) -> _Judged:
    key = id(program), tuple(x.items()), tuple(way.items())
    make = functools.partial(_changed, program, x, list(move.ends(way, x)))
    return current().kept(JUDGED, KEPT, key, lambda: _Judged(program, make()))


def _changed(program: Program, x: Numbers, ends: Sequence[Numbers]) -> float:
    """Return by how much objectives and limits that are touched change on the way to either end, in natural sizes."""
    try:
        way = _read(program, x, ends)
    except (ValueError, ZeroDivisionError):
        return math.inf
    before, change = way.excesses[0], way.change
    for end, after in zip(ends, way.excesses[1:], strict=True):
        # The bounds of what moves may be touched on the way.
        own = [k for k, limit in program.bound_limits.items() if limit.row in end]
        touched = np.delete(np.abs(after - before), own)[np.delete(before, own) >= -ACTIVE]
        # What is no number has changed.
        change = float(np.max(touched, initial=change))
    return change if change <= UNCHANGED else math.inf


def part_way(x: Numbers, goal: Numbers, share: float) -> dict[str, float]:
    """Return x moved a share of the way to the goal."""
    if share == 1.0:
        return {**x, **goal}
    return {**x, **{name: x[name] + share * (end - x[name]) for name, end in goal.items()}}


class _Way(NamedTuple):
    """What is read along a move: change of the objectives, in natural sizes, ∞ for more than UNCHANGED.

    excesses: (1 + goals, limits), by how much limits are exceeded at the design and at each goal, in natural sizes.
    """

    change: float
    excesses: Floats


def _read(program: Program, x: Numbers, goals: Sequence[Numbers]) -> _Way:
    """Return what is read at x (SI), along the way to each goal (of the same variables), and beyond x, all at once.

    Of a peak the whole curve must stay, at nodes that move with the design.
    """
    nearby = {name: x[name] * (1 + BEYOND) for goal in goals for name in goal}
    trials = [part_way(x, goal, share) for share in (1.0, 0.5) for goal in goals] + [part_way(x, nearby, 1.0)]
    here = sampled(program.model, {**program.parameters, **x})
    designs = _together(program, here, [x, *trials], nearby)
    with np.errstate(all="ignore"):
        begins = np.array([wide(start, designs.count) for start in designs.starts])
        designs.look([name for each in program.objectives for name in each.quantities], *here.grid(NODES))
        curves = np.concatenate([each.watched(designs) / each.scale for each in program.objectives])
        change = float(np.abs(curves[:, 1:] - curves[:, :1]).max())
        at = 1 + len(goals)
        excesses = np.empty((at, len(program.limits)))
        for k, limit in enumerate(program.limits):
            if k not in program.cycle_limits:
                excess = plain(limit.residual(designs)) / limit.scale
                excesses[:, k] = np.broadcast_to(np.abs(excess) if limit.sign == 0 else excess, designs.count)[:at]
    whole = list(program.cycle_limits)
    for row, design in zip(excesses, [x, *trials] if whole else (), strict=False):
        row[whole] = _excesses(program, design)[whole]
    current().positions += curves.size
    # Where two corners of the cycle pass each other nodes are elsewhere: something changes along such a move.
    same = change <= UNCHANGED and bool(np.all(np.diff(begins, axis=0) >= 0.0))
    return _Way(change if same else math.inf, excesses)


def _together(program: Program, here: Sampler, designs: Sequence[Numbers], differ: Collection[str]) -> BatchReading:
    """Return designs (SI) read at once; here: one of them; differ: the names of numbers in which they do."""
    own = {name: np.array([x[name] for x in designs]) for name in differ}
    if here.hints:
        known = [{**program.parameters, **x} for x in designs]
        hints = [program.model.hints(program.model.given(systems.FLOAT, values)) for values in known]
        own |= {name: np.array([of[name] for of in hints]) for name in here.hints}
    values = {**program.parameters, **designs[0], **here.hints, **own}
    return BatchReading(program.model, systems.numpy(), values, here.cycle, here.stills)


def reach(program: Program, x: Numbers, goal: Numbers) -> float:
    """Return the largest share of the way along which no limit gets worse than it is allowed."""
    return _reached(program, x, goal, _excesses(program, x), _excesses(program, {**x, **goal}))


def _reached(program: Program, x: Numbers, goal: Numbers, here: Floats, there: Floats) -> float:
    """Return that share; here, there: what limits are exceeded by at x and at the goal, in natural sizes.

    0 where a limit that is met already stops it by rising from the first: what it may give way there is room for
    rounding, and a step into it would leave the bounds that stop the design.
    """
    before = np.maximum(0.0, here)

    def rises(excesses: Floats, room: float) -> NDArray[np.bool_]:
        # What is no number holds nothing.
        return np.asarray(~(excesses <= before + room))

    def at(share: float) -> Floats:
        return _excesses(program, part_way(x, goal, share))

    if not rises(there, GIVES_WAY).any():
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if rises(at(middle), GIVES_WAY).any() else (middle, high)
    closed = rises(at(high), GIVES_WAY) & rises(at(low / 2), ROSE * GIVES_WAY)
    return 0.0 if closed.any() else low


def _excesses(program: Program, x: Numbers) -> Floats:
    """Return by how much every limit is exceeded, in its natural size; an equality how far it is missed."""
    sampler = sampled(program.model, {**program.parameters, **x})
    sampler.search(limit.row for limit in program.cycle_limits.values())
    return np.array([limit.violation(sampler) for limit in program.limits])
