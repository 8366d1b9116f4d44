"""The two silent levels that end every target: least added mass, then least change from today's machine.

They run only along moves verified flat at this design: objectives unchanged to 1e-10, every limit still held.
"""

from collections.abc import Callable, Mapping

import numpy as np

from loomopt.cycle import Floats
from loomopt.program.program import Move, Program, Wish
from loomopt.program.sampling import Sampler
from loomopt.solving.excess import excesses

UNCHANGED = 1e-10
SLACK, NOTICED = 1e-12, 1e-9
"""What a limit may give way, in its natural size; the least move, in the variable's scale, that is a choice."""
BISECTIONS = 60
NODES = 64


def settle(
    program: Program,
    x: Mapping[str, float],
    moves: tuple[Move, ...],
    wish: Callable[[Move, Mapping[str, float]], Wish | None],
) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return x (SI) after the silent levels, and what they settled."""
    settled = []
    for move in moves:
        wanted = wish(move, x)
        if wanted is None or not _flat(program, x, wanted.goal):
            continue
        share = _reach(program, x, wanted.goal)
        moved = [
            share * abs(wanted.goal[v.name] - x[v.name]) / v.scale for v in program.variables if v.name in wanted.goal
        ]
        if max(moved, default=0.0) > NOTICED:
            settled.append(f"{move.name}: {wanted.reason}")
        x = _part_way(x, wanted.goal, share)
    return dict(x), tuple(settled)


def _part_way(x: Mapping[str, float], goal: Mapping[str, float], share: float) -> dict[str, float]:
    """Return x moved a share of the way to the goal."""
    if share == 1.0:
        return {**x, **goal}
    return {**x, **{name: x[name] + share * (end - x[name]) for name, end in goal.items()}}


def _flat(program: Program, x: Mapping[str, float], goal: Mapping[str, float]) -> bool:
    """Say whether the objectives stay the same along the way to the goal, and a little beyond x."""
    before = _objectives(program, x)
    nearby = {name: x[name] * (1 + 1e-3) for name in goal}
    shares = [_part_way(x, goal, share) for share in (1.0, 0.5)] + [_part_way(x, nearby, 1.0)]
    return all(np.abs(_objectives(program, trial) - before).max() <= UNCHANGED for trial in shares)


def _objectives(program: Program, x: Mapping[str, float]) -> Floats:
    """Return the objectives in their natural sizes; for a peak, the whole curve at nodes that move with the design."""
    sampler = Sampler(program.model, {**program.parameters, **x})
    pieces, u = sampler.grid(NODES)
    parts = [
        (sampler.at(o.row, pieces, u) if o.form == "peak" else np.array([abs(sampler.figures[o.row])])) / o.scale
        for o in program.objectives
    ]
    return np.concatenate(parts)


def _reach(program: Program, x: Mapping[str, float], goal: Mapping[str, float]) -> float:
    """Return the largest share of the way along which no limit gets worse than it is allowed."""
    allowed = {k: max(0.0, excess) + SLACK for k, excess in _excesses(program, x).items()}

    def holds(share: float) -> bool:
        now = _excesses(program, _part_way(x, goal, share))
        return all(now[k] <= limit for k, limit in allowed.items())

    if holds(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _excesses(program: Program, x: Mapping[str, float]) -> dict[int, float]:
    """Return every limit's excess in its natural size."""
    return excesses(program, Sampler(program.model, {**program.parameters, **x}))
