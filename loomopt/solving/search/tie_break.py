"""The tie-break that ends every target: least added mass, then least change from today's machine.

It uses only moves that are flat at this design: the objectives change by at most 1e-10, and every limit still holds.
"""

import contextlib
import functools
import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.maths import systems
from loomopt.maths.systems import Number
from loomopt.model.limits import CycleLimit, Limit, SingleLimit
from loomopt.model.program import Move, Preference, Program
from loomopt.model.reading import BatchReading, group_equal, plain, wide
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
    return apply_moves_in_batch([(program, x)])[0]


def apply_moves_in_batch(designs: Sequence[tuple[Program, Numbers]]) -> list[tuple[dict[str, float], tuple[str, ...]]]:
    """Variables (SI) of each design (program, x) after all moves without loss, and the rules that chose."""
    ends: list[dict[str, float]] = [dict(x) for _, x in designs]
    rules = [list[str]() for _ in designs]
    for turn in range(max((len(program.moves) for program, _ in designs), default=0)):
        wishes, paths = list[tuple[int, Preference]](), list[_Paths]()
        for k, (program, _) in enumerate(designs):
            wish = program.moves[turn].wished({**program.parameters, **ends[k]}) if turn < len(program.moves) else None
            goal = program.moves[turn].goal(wish, ends[k]) if wish else {}
            if wish and any(ends[k][name] != end for name, end in goal.items()):
                wishes.append((k, wish))
                paths.append(_Paths(program, ends[k], (goal,)))
        for (k, wish), path, reading in zip(wishes, paths, _read_paths(paths), strict=True):
            if reading.change > UNCHANGED:
                continue
            program, x, (end,) = path
            share = _admissible_share(program, x, end, *reading.excesses)
            sizes = [share * abs(end[v.name] - x[v.name]) / v.scale for v in program.variables if v.name in end]
            if max(sizes, default=0.0) > MOVED:
                rules[k].append(f"{program.moves[turn].name}: {wish.reason}")
            ends[k] = part_way(x, end, share)
    return [(x, tuple(chosen)) for x, chosen in zip(ends, rules, strict=True)]


def flat_directions(
    program: Program, x: Numbers, is_wanted: Callable[[Numbers], bool] = lambda direction: True, most: float = UNCHANGED
) -> list[dict[str, float]]:
    """Directions, SI, of the moves along which nothing changes at x (SI), as far as bounds allow.

    Neither an objective nor a touched limit changes, except the bounds of the moved variables. is_wanted: whether a
    direction is of interest, all without it; most: largest change, scaled, at most UNCHANGED.
    """
    directions = [direction for direction in _directions(program, x) if is_wanted(direction.way)]
    changes = _changes_along(directions)
    return [direction.way for direction, change in zip(directions, changes, strict=True) if change <= most]


def measure_moves(designs: Sequence[tuple[Program, Numbers]]) -> None:
    """Test the moves of several designs (program, x) in one pass, so that `flat_directions` finds the results.

    Moves of a program with limits over the cycle are left out: extremes are not computed in a batch.
    """
    _changes_along([move for program, x in designs if not program.cycle_limits for move in _directions(program, x)])


TESTED_MOVES, TESTED_MOST = "tested moves", 256
"""Name of the tested moves in a session, and how many it keeps: curvature and least change test the same ones, and a
batch of designs tests all of its moves at once."""


class _Direction(NamedTuple):
    """Direction (SI) of a move from a design x (SI)."""

    program: Program
    x: Numbers
    move: Move
    way: dict[str, float]


@dataclass
class _TestedMove:
    """Change along a move, scaled; ∞ for more than UNCHANGED, None before the test.

    program: referenced while this record exists, so that no other program gets its id.
    """

    program: Program
    change: float | None = None


def _directions(program: Program, x: Numbers) -> list[_Direction]:
    """Directions of the moves that have room at x (SI)."""
    return [_Direction(program, x, move, way) for move in program.moves for way in move.directions(x)]


def _changes_along(directions: Sequence[_Direction]) -> list[float]:
    """Change along each direction, scaled; directions that were not tested before are tested in one pass."""
    keys = [(id(of.program), tuple(of.x.items()), tuple(of.way.items())) for of in directions]
    tests = [
        current().cached(TESTED_MOVES, TESTED_MOST, key, functools.partial(_TestedMove, of.program))
        for key, of in zip(keys, directions, strict=True)
    ]
    new = [(test, of) for test, of in zip(tests, directions, strict=True) if test.change is None]
    paths = [_Paths(of.program, of.x, tuple(of.move.ends(of.way, of.x))) for _, of in new]
    for (test, _), path, reading in zip(new, paths, _read_paths(paths), strict=True):
        test.change = _largest_change(path, reading)
    return [math.inf if test.change is None else test.change for test in tests]


def _largest_change(paths: "_Paths", reading: "_PathReading") -> float:
    """Change of objectives and touched limits on the way to each goal, scaled; ∞ for more than UNCHANGED."""
    if not reading.change <= UNCHANGED:
        return math.inf
    start_excess, change = reading.excesses[0], reading.change
    for end, end_excess in zip(paths.goals, reading.excesses[1:], strict=True):
        # The bounds of the moved variables may be touched on the way.
        bound_places = [k for k, limit in paths.program.bound_limits.items() if limit.row in end]
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


class _Paths(NamedTuple):
    """Straight lines from a design x (SI) to goals (SI), which are all of the same variables."""

    program: Program
    x: Numbers
    goals: tuple[Numbers, ...]

    @property
    def designs(self) -> list[Numbers]:
        """x, the goals, the points half-way, and a design beyond x."""
        nearby = {name: self.x[name] * (1 + BEYOND) for goal in self.goals for name in goal}
        trials = [part_way(self.x, goal, share) for share in (1.0, 0.5) for goal in self.goals]
        return [self.x, *trials, part_way(self.x, nearby, 1.0)]


class _PathReading(NamedTuple):
    """Values along paths: change of the objectives, scaled, ∞ for more than UNCHANGED.

    excesses: (1 + goals, limits), scaled excesses of the limits at the design and at each goal.
    """

    change: float
    excesses: Floats


UNREADABLE = _PathReading(math.inf, np.zeros((0, 0)))
"""Reading where a formula has no value."""


def _read_paths(paths: Sequence[_Paths]) -> list[_PathReading]:
    """Values along paths; those of designs of one kind are read in one pass, and again one by one if that fails."""
    readings = [UNREADABLE] * len(paths)
    samplers = {k: sampler for k, path in enumerate(paths) if (sampler := _sampler(path))}
    places = list(samplers)
    keys = [_batch_key(samplers[k], paths[k]) for k in places] if len(places) > 1 else [None] * len(places)
    for group in group_equal(keys):
        batch = [places[k] for k in group]
        for lanes in (batch, *([k] for k in batch)):
            with contextlib.suppress(ValueError, ZeroDivisionError):
                for k, reading in zip(lanes, _read_batch(samplers[lanes[0]], [paths[k] for k in lanes]), strict=True):
                    readings[k] = reading
                if lanes is batch:
                    break
    return readings


def _batch_key(sampler: Sampler, paths: _Paths) -> Hashable:
    """Key of paths that can be read in one batch."""
    nodes = sampler.grid(NODES)[0].tobytes()
    return sampler.batch_key, nodes, paths.program.structure, tuple(map(tuple, paths.goals))


def _sampler(paths: _Paths) -> Sampler | None:
    """Sampler of the design at which paths begin; None where it has no values."""
    try:
        return sampled(paths.program.model, {**paths.program.parameters, **paths.x})
    except (ValueError, ZeroDivisionError):
        return None


def _read_batch(sampler: Sampler, batch: Sequence[_Paths]) -> list[_PathReading]:
    """Values along the paths of designs of one kind, all in one pass; sampler: of one of them.

    The whole curve of a peak must stay, at nodes that move with the design.
    """
    program, trials = batch[0].program, [paths.designs for paths in batch]
    shape = len(trials), len(trials[0])
    values = _batch_values(sampler, batch, trials)
    designs = BatchReading(program.model, systems.numpy(), values, sampler.cycle, sampler.stills)
    with np.errstate(all="ignore"):
        begins = np.array([wide(start, designs.count) for start in designs.starts]).reshape(-1, *shape)
        designs.look([name for objective in program.objectives for name in objective.quantities], *sampler.grid(NODES))
        scales = np.array([[objective.scale for objective in paths.program.objectives] for paths in batch])
        curves = np.concatenate(
            [
                objective.watched(designs).reshape(-1, *shape) / scales[:, k, None]
                for k, objective in enumerate(program.objectives)
            ]
        )
        changes = np.abs(curves[:, :, 1:] - curves[:, :, :1]).max(axis=(0, 2))
        excesses = _batch_excesses(designs, [paths.program.limits for paths in batch], shape)
    count, cycle_places = 1 + len(batch[0].goals), list(program.cycle_limits)
    for k, paths in enumerate(batch):
        for row, design in zip(excesses[k], trials[k][:count] if cycle_places else (), strict=False):
            row[cycle_places] = _excesses(paths.program, design)[cycle_places]
    current().positions += curves.size
    # Where two corners of the cycle pass each other the nodes move: such a move counts as a change.
    same = (changes <= UNCHANGED) & np.all(np.diff(begins, axis=0) >= 0.0, axis=(0, 2))
    return [
        _PathReading(change if is_same else math.inf, excess[:count])
        for change, is_same, excess in zip(changes.tolist(), same.tolist(), excesses, strict=True)
    ]


def _batch_values(sampler: Sampler, batch: Sequence[_Paths], trials: Sequence[Sequence[Numbers]]) -> dict[str, Number]:
    """Numbers of all trials of a batch, (batch · trials,) where they differ."""
    count, moved = len(trials[0]), {name for paths in batch for goal in paths.goals for name in goal}
    values = {name: np.array([x[name] for designs in trials for x in designs]) for name in moved}
    numbers = [{**paths.program.parameters, **paths.x} for paths in batch]
    if sampler.hints:
        model = sampler.model
        full = [
            {**paths.program.parameters, **x} for paths, designs in zip(batch, trials, strict=True) for x in designs
        ]
        hints = [model.hints(model.given(systems.FLOAT, design)) for design in full]
        values |= {name: np.array([design_hints[name] for design_hints in hints]) for name in sampler.hints}
    if len(batch) == 1:
        return {**numbers[0], **values}
    fixed = {name: [design[name] for design in numbers] for name in numbers[0] if name not in values}
    return {
        name: same[0] if all(value == same[0] for value in same) else np.repeat(same, count)
        for name, same in fixed.items()
    } | values


def _batch_excesses(designs: BatchReading, limits: Sequence[Sequence[Limit]], shape: tuple[int, int]) -> Floats:
    """Scaled excesses (batch, trials, limits) of all limits but those over the cycle; limits: of each design.

    Of an equality the magnitude. shape: number of designs and of trials of each.
    """
    bounds = np.array([[limit.value for limit in row] for row in limits])
    scales = np.array([[limit.scale for limit in row] for row in limits])
    same = np.all(bounds == bounds[0], axis=0).tolist()
    residuals = np.zeros((len(limits[0]), designs.count))
    for k, limit in enumerate(limits[0]):
        if isinstance(limit, SingleLimit) and not same[k]:
            residuals[k] = plain(limit.residual(designs, np.repeat(bounds[:, k], shape[1])))
        elif not isinstance(limit, CycleLimit):
            residuals[k] = plain(limit.residual(designs))
    excesses = residuals.T.reshape(*shape, len(limits[0])) / scales[:, None]
    return np.asarray(np.where([limit.sign == 0 for limit in limits[0]], np.abs(excesses), excesses))


def reachable_share(program: Program, x: Numbers, goal: Numbers) -> float:
    """Largest share of the way along which no limit becomes worse than allowed."""
    return _admissible_share(program, x, goal, _excesses(program, x), _excesses(program, {**x, **goal}))


def _admissible_share(
    program: Program, x: Numbers, goal: Numbers, start_excesses: Floats, goal_excesses: Floats
) -> float:
    """Largest share of the way from x to the goal along which no limit becomes worse than allowed.

    start_excesses, goal_excesses: scaled excesses of the limits at x and at the goal.

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
