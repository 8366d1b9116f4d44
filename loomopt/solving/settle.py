"""The two silent levels that end every target: least added mass, then least change from today's machine.

They run only along moves verified flat at this design: objectives unchanged to 1e-10, every limit still held.
"""

import math
from collections.abc import Mapping

import numpy as np

from loomopt.cycle import Floats
from loomopt.program.program import Move, Program, Wish
from loomopt.program.sampling import Sampler

UNCHANGED = 1e-10
SLACK, NOTICED = 1e-12, 1e-9
"""What a limit may give way, in its natural size; the least move, in the variable's scale, that is a choice."""
BISECTIONS = 60
NODES = 64


def settle(program: Program, x: Mapping[str, float]) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return x (SI) after the silent levels, and what they settled."""
    settled = []
    for move in program.moves:
        wish = wished(program, move, x)
        goal = goal_of(move, wish, x) if wish else {}
        if wish is None or not goal or not is_flat(program, x, goal):
            continue
        share = _reach(program, x, goal)
        moved = [share * abs(goal[v.name] - x[v.name]) / v.scale for v in program.variables if v.name in goal]
        if max(moved, default=0.0) > NOTICED:
            settled.append(f"{move.name}: {wish.reason}")
        x = _part_way(x, goal, share)
    return dict(x), tuple(settled)


def wished(program: Program, move: Move, x: Mapping[str, float]) -> Wish | None:
    """Return the first wish of a move that holds at x (SI)."""
    values = {**program.parameters, **x}
    return next((wish for wish in move.wishes if not wish.when or values[wish.when] > wish.above), None)


def goal_of(move: Move, wish: Wish, x: Mapping[str, float]) -> dict[str, float]:
    """Return where a wish would go from x (SI), within the move's bounds; nothing where there is no room."""
    if move.kind == "scale":
        return _scaled(move, wish, x)
    goal = {}
    for name in move.along:
        low, high = move.bounds[name]
        if low < high:
            ends = {"least": low, "most": high, "today": min(max(move.today[name], low), high)}
            goal[name] = ends[wish.toward]
    return goal


def _scaled(move: Move, wish: Wish, x: Mapping[str, float]) -> dict[str, float]:
    """Return x scaled in common: nearest to today's, in bound widths, or as small or as large as the bounds allow."""
    widths = {name: move.bounds[name][1] - move.bounds[name][0] for name in move.along}
    scales = [sorted((move.bounds[n][0] / x[n], move.bounds[n][1] / x[n])) for n in move.along if x[n]]
    if min(widths.values()) <= 0.0 or not scales:
        return {}
    least, most = max(low for low, _ in scales), min(high for _, high in scales)
    factor = least if wish.toward == "least" else most
    if wish.toward == "today":
        pull = math.fsum(x[n] * move.today[n] / widths[n] ** 2 for n in move.along)
        factor = min(max(pull / math.fsum((x[n] / widths[n]) ** 2 for n in move.along), least), most)
    return {n: min(max(x[n] * factor, move.bounds[n][0]), move.bounds[n][1]) for n in move.along}


def _part_way(x: Mapping[str, float], goal: Mapping[str, float], share: float) -> dict[str, float]:
    """Return x moved a share of the way to the goal."""
    if share == 1.0:
        return {**x, **goal}
    return {**x, **{name: x[name] + share * (end - x[name]) for name, end in goal.items()}}


def is_flat(program: Program, x: Mapping[str, float], goal: Mapping[str, float]) -> bool:
    """Say whether the objectives stay the same along the way to the goal, and a little beyond x."""
    before = _objectives(program, x)
    nearby = {name: x[name] * (1 + 1e-3) for name in goal}
    shares = [_part_way(x, goal, share) for share in (1.0, 0.5)] + [_part_way(x, nearby, 1.0)]
    return all(np.abs(_objectives(program, trial) - before).max() <= UNCHANGED for trial in shares)


def _objectives(program: Program, x: Mapping[str, float]) -> Floats:
    """Return the objectives in their natural sizes; for a peak, the whole curve at nodes that move with the design."""
    sampler = Sampler(program.model, {**program.parameters, **x})
    pieces, u = sampler.grid(NODES)
    parts = []
    for objective in program.objectives:
        if objective.form == "peak":
            parts += [sampler.at(row, pieces, u) / objective.scale for row in objective.rows]
        else:
            parts.append(np.array([sampler.merit(objective) / objective.scale]))
    return np.concatenate(parts)


def _reach(program: Program, x: Mapping[str, float], goal: Mapping[str, float]) -> float:
    """Return the largest share of the way along which no limit gets worse than it is allowed."""
    allowed = [max(0.0, excess) + SLACK for excess in _excesses(program, x)]

    def holds(share: float) -> bool:
        now = _excesses(program, _part_way(x, goal, share))
        return all(excess <= most for excess, most in zip(now, allowed, strict=True))

    if holds(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _excesses(program: Program, x: Mapping[str, float]) -> list[float]:
    """Return by how much every limit is exceeded, in its natural size; an equality how far it is missed."""
    sampler = Sampler(program.model, {**program.parameters, **x})
    found = [(limit, sampler.excess(limit)) for limit in program.limits]
    return [abs(excess) if limit.sign == 0 else excess for limit, excess in found]
