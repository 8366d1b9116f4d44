"""The tie-break that ends every target: least added mass, then least change from today's machine.

It uses only moves that are flat at this design: the objectives change by at most 1e-10, and every limit still holds.
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
"""Share of a variable by which a flat move is also tried beyond the design, to detect a bump."""

ROSE = 0.1
"""Share of a limit's allowed rise that it has risen half-way, if it rises with at most the third power."""

BISECTIONS, NODES = 60, 64
"""Bisections of a move (to a float's last bit), and nodes of a turn on which a curve must not change."""

Numbers = Mapping[str, float]


def apply_moves(program: Program, x: Numbers) -> tuple[dict[str, float], tuple[str, ...]]:
    """Variables x (SI) after all moves without loss, and the rules that chose."""
    rules = []
    for move in program.moves:
        preference = move.wished({**program.parameters, **x})
        goal = move.goal(preference, x) if preference else {}
        if preference is None or all(x[name] == end for name, end in goal.items()):
            continue
        move_reading = _read_move(program, x, [goal])
        if move_reading.change > UNCHANGED:
            continue
        share = _share_between(program, x, goal, *move_reading.excesses)
        sizes = [share * abs(goal[v.name] - x[v.name]) / v.scale for v in program.variables if v.name in goal]
        if max(sizes, default=0.0) > MOVED:
            rules.append(f"{move.name}: {preference.reason}")
        x = part_way(x, goal, share)
    return dict(x), tuple(rules)


def flat_directions(
    program: Program, x: Numbers, is_wanted: Callable[[Numbers], bool] = lambda direction: True, most: float = UNCHANGED
) -> list[dict[str, float]]:
    """Directions, SI, of the moves along which nothing changes at x (SI), as far as bounds allow.

    Neither an objective nor a touched limit changes, except the bounds of the moved variables. is_wanted: whether a
    direction is of interest, all without it; most: largest change, scaled, at most UNCHANGED.
    """
    directions = (
        (move, direction) for move in program.moves for direction in move.directions(x) if is_wanted(direction)
    )
    return [direction for move, direction in directions if _test_move(program, x, move, direction).change <= most]


TESTED_MOVES, TESTED_MOST = "judged moves", 64
"""Name of the tested moves in a session, and how many it keeps: curvature and least change test the same ones."""


class _TestedMove(NamedTuple):
    """Change along a move, scaled; ∞ for more than UNCHANGED.

    program: referenced while this record exists, so that no other program gets its id.
    """

    program: Program
    change: float


def _test_move(program: Program, x: Numbers, move: Move, way: Numbers) -> _TestedMove:
    key = id(program), tuple(x.items()), tuple(way.items())
    make = functools.partial(_change_along, program, x, list(move.ends(way, x)))
    return current().cached(TESTED_MOVES, TESTED_MOST, key, lambda: _TestedMove(program, make()))


def _change_along(program: Program, x: Numbers, ends: Sequence[Numbers]) -> float:
    """Change of objectives and touched limits on the way to either end, scaled."""
    try:
        move_reading = _read_move(program, x, ends)
    except (ValueError, ZeroDivisionError):
        return math.inf
    start_excess, change = move_reading.excesses[0], move_reading.change
    for end, end_excess in zip(ends, move_reading.excesses[1:], strict=True):
        # The bounds of the moved variables may be touched on the way.
        bound_places = [k for k, limit in program.bound_limits.items() if limit.row in end]
        touched = np.delete(np.abs(end_excess - start_excess), bound_places)[
            np.delete(start_excess, bound_places) >= -ACTIVE
        ]
        # A NaN counts as a change.
        change = float(np.max(touched, initial=change))
    return change if change <= UNCHANGED else math.inf


def part_way(x: Numbers, goal: Numbers, share: float) -> dict[str, float]:
    """Variables x moved by a share of the way to the goal."""
    if share == 1.0:
        return {**x, **goal}
    return {**x, **{name: x[name] + share * (end - x[name]) for name, end in goal.items()}}


class _MoveReading(NamedTuple):
    """Values along a move: change of the objectives, scaled, ∞ for more than UNCHANGED.

    excesses: (1 + goals, limits), scaled excesses of the limits at the design and at each goal.
    """

    change: float
    excesses: Floats


def _read_move(program: Program, x: Numbers, goals: Sequence[Numbers]) -> _MoveReading:
    """Values at x (SI), on the way to each goal (of the same variables), and beyond x, in one pass.

    The whole curve of a peak must stay, at nodes that move with the design.
    """
    nearby = {name: x[name] * (1 + BEYOND) for goal in goals for name in goal}
    trials = [part_way(x, goal, share) for share in (1.0, 0.5) for goal in goals] + [part_way(x, nearby, 1.0)]
    sampler = sampled(program.model, {**program.parameters, **x})
    designs = _read_batch(program, sampler, [x, *trials], nearby)
    with np.errstate(all="ignore"):
        begins = np.array([wide(start, designs.count) for start in designs.starts])
        designs.look([name for objective in program.objectives for name in objective.quantities], *sampler.grid(NODES))
        curves = np.concatenate([objective.watched(designs) / objective.scale for objective in program.objectives])
        change = float(np.abs(curves[:, 1:] - curves[:, :1]).max())
        count = 1 + len(goals)
        excesses = np.empty((count, len(program.limits)))
        for k, limit in enumerate(program.limits):
            if k not in program.cycle_limits:
                excess = plain(limit.residual(designs)) / limit.scale
                excesses[:, k] = np.broadcast_to(np.abs(excess) if limit.sign == 0 else excess, designs.count)[:count]
    cycle_places = list(program.cycle_limits)
    for row, design in zip(excesses, [x, *trials] if cycle_places else (), strict=False):
        row[cycle_places] = _excesses(program, design)[cycle_places]
    current().positions += curves.size
    # Where two corners of the cycle pass each other the nodes move: such a move counts as a change.
    same = change <= UNCHANGED and bool(np.all(np.diff(begins, axis=0) >= 0.0))
    return _MoveReading(change if same else math.inf, excesses)


def _read_batch(
    program: Program, sampler: Sampler, designs: Sequence[Numbers], differ: Collection[str]
) -> BatchReading:
    """Reading of a batch of designs (SI); sampler: sampler of one; differ: names of the numbers that differ."""
    columns = {name: np.array([x[name] for x in designs]) for name in differ}
    if sampler.hints:
        values_of_designs = [{**program.parameters, **x} for x in designs]
        hints = [program.model.hints(program.model.given(systems.FLOAT, values)) for values in values_of_designs]
        columns |= {name: np.array([design_hints[name] for design_hints in hints]) for name in sampler.hints}
    values = {**program.parameters, **designs[0], **sampler.hints, **columns}
    return BatchReading(program.model, systems.numpy(), values, sampler.cycle, sampler.stills)


def reachable_share(program: Program, x: Numbers, goal: Numbers) -> float:
    """Largest share of the way along which no limit becomes worse than allowed."""
    return _share_between(program, x, goal, _excesses(program, x), _excesses(program, {**x, **goal}))


def _share_between(program: Program, x: Numbers, goal: Numbers, start_excesses: Floats, goal_excesses: Floats) -> float:
    """The same share; here, goal_excesses: scaled excesses of the limits at x and at the goal.

    The share is 0 where a touched limit rises from the start: the allowed rise is for rounding only, and a step into it
    would leave the bounds of the design.
    """
    allowed = np.maximum(0.0, start_excesses)

    def rises(excesses: Floats, room: float) -> NDArray[np.bool_]:
        # A NaN counts as a violation.
        return np.asarray(~(excesses <= allowed + room))

    def excesses_at(share: float) -> Floats:
        return _excesses(program, part_way(x, goal, share))

    if not rises(goal_excesses, GIVES_WAY).any():
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (low, middle) if rises(excesses_at(middle), GIVES_WAY).any() else (middle, high)
    closed = rises(excesses_at(high), GIVES_WAY) & rises(excesses_at(low / 2), ROSE * GIVES_WAY)
    return 0.0 if closed.any() else low


def _excesses(program: Program, x: Numbers) -> Floats:
    """Scaled excess of every limit; the magnitude for an equality."""
    sampler = sampled(program.model, {**program.parameters, **x})
    sampler.search(limit.row for limit in program.cycle_limits.values())
    return np.array([limit.violation(sampler) for limit in program.limits])
