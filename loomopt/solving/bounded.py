"""A bound between all points: whole-cycle rows proven on boxes of crank angle, by truncated Taylor series over balls.

On a box of half-width r around c, f(c + h) = f(c) + f'(c) h + k h² with k enclosed over the whole box. Where the
bound is too coarse the box is halved. The formulas are the model's own, run in Arb's ball arithmetic: rounding is
inside the balls.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from loomopt import maths
from loomopt.cycle import Where
from loomopt.lazy import lazy
from loomopt.maths import Number
from loomopt.program.model import Integral
from loomopt.program.program import Program
from loomopt.program.reading import Reading
from loomopt.program.sampling import Sampler, Tally
from loomopt.tolerances import MEAN_BOXES, MOST_BOXES

CycleRow = tuple[str, float, Where | None]
"""A whole-cycle quantity, its natural size, and the pieces where it counts."""


@dataclass(frozen=True)
class Bound:
    """What the boxes show of one row: proven, violated at `angle` (rad), or neither within the boxes allowed."""

    status: str
    boxes: int
    angle: float | None = None


class Boxes(Reading):
    """One design read in balls, ready to be bounded."""

    def __init__(self, sampler: Sampler) -> None:
        system, model = maths.balls(), sampler.model
        exact = {name: system.number(value) for name, value in {**sampler.values, **sampler.hints}.items()}
        super().__init__(model, system, model.given(system, exact), sampler.cycle, sampler.stills)

    @lazy
    def _switches(self) -> list[dict[str, float]]:
        """The switches on each piece."""
        pieces = map(self.cycle.switch, range(self.cycle.pieces))
        return [{name: float(value) for name, value in switch.items()} for switch in pieces]

    def bound(self, name: str, sign: float, limit: float, where: Where | None = None) -> Bound:
        """Say whether sign · quantity ≤ limit (SI) all over the cycle, or over the pieces `where`."""
        cycle, used = self.cycle, 0
        for piece in map(int, np.flatnonzero(cycle.on(where))):
            boxes = [(0.0, 1.0)]
            while boxes:
                low, high = boxes.pop()
                used += 1
                Tally.positions += 2
                holds = self._judge(name, sign, limit, piece, (low + high) / 2, (high - low) / 2)
                if holds is False:
                    middle = (low + high) / 2
                    angle = cycle.starts[piece] * (1 - middle) + cycle.starts[piece + 1] * middle
                    return Bound("violated", used, float(angle))
                if holds is None:
                    if used >= MOST_BOXES:
                        return Bound("undecided", used)
                    boxes += [((low + high) / 2, high), (low, (low + high) / 2)]
        return Bound("proven" if used else "undecided", used)

    def mean(self, integral: Integral) -> Number:
        """Return a ball around an integral's mean over its pieces.

        On each box the Taylor polynomial is integrated, what is left of it enclosed.
        """
        if integral.angles:
            return super().mean(integral)
        half = 0.5 / MEAN_BOXES
        total, width = self.maths.number(0.0), self.maths.number(0.0)
        for piece in np.flatnonzero(self.cycle.on(integral.where)):
            length = self.starts[piece + 1] - self.starts[piece]
            width = width + length
            for strip in range(MEAN_BOXES):
                centre = (2 * strip + 1) * half
                value = self._series(integral.quantity, int(piece), centre, 0.0)[0]
                bend = self._series(integral.quantity, int(piece), centre, half)[2]
                total = total + length * 2 * half * (value + bend * half**2 / 3)
        return total / width

    def _judge(self, name: str, sign: float, limit: float, piece: int, centre: float, half: float) -> bool | None:
        """Return True where the box keeps the limit, False where its centre breaks it, None where that is open."""
        try:
            here, around = (self._series(name, piece, centre, radius) for radius in (0.0, half))
        except (ValueError, ZeroDivisionError):
            return None
        if sign * here[0] > limit:
            return False
        slope, bend = sign * here[1], sign * around[2]
        rise = abs(slope).upper() * half
        if bend < 0:
            # The parabola's own top, wherever it lies: what touches its bound from below is proven in a wide box.
            rise = min(rise, (slope**2 / (4 * abs(bend))).upper(), key=float)
            within = sign * here[0] + rise <= limit
        else:
            within = sign * here[0] + rise + bend.upper() * half**2 <= limit
        return True if within else None

    def _series(self, name: str, piece: int, centre: float, half: float) -> Number:
        """Return a quantity's Taylor series in u, to second order, around a ball of u on a piece."""
        u = maths.ball_series(centre, half)
        begin, end = self.starts[piece : piece + 2]
        angle = begin + (end - begin) * u
        value = self.quantity(name, angle, self._switches[piece])
        return maths.ball_series(0.0, 0.0) * 0 + value


def judged(sampler: Sampler, rows: Sequence[CycleRow], accuracy: float) -> str:
    """Return "proven" where boxes bound the refined peak of every row, "violated" where one is exceeded.

    accuracy: what a peak may be exceeded by, in the row's natural size. "undecided" where boxes run out, and where a
    formula does not run on balls.
    """
    if not rows or not {name for name, _, _ in rows} <= sampler.model.bounded:
        return "undecided"
    boxes = Boxes(sampler)
    found = []
    for name, scale, where in rows:
        peak = sampler.peak(name, where) + accuracy * scale
        signs = (1.0,) if name in sampler.model.signed else (1.0, -1.0)
        found += [boxes.bound(name, sign, peak, where).status for sign in signs]
    return next((status for status in ("violated", "undecided") if status in found), "proven")


def cycle_rows(program: Program) -> list[CycleRow]:
    """Return each whole-cycle quantity of a program that counts, with its natural size and the pieces it counts on."""
    found: list[CycleRow] = [(row, o.scale, None) for o in program.objectives if o.form == "peak" for row in o.rows]
    found += [(limit.row, limit.scale, limit.where) for limit in program.limits if limit.family == "cycle"]
    return list(dict.fromkeys(found))


def between_points(sampler: Sampler, rows: Sequence[CycleRow], points: int) -> float:
    """Return by how much an independent dense scan exceeds the refined peaks, relative to the row's size."""
    pieces, u = sampler.grid(points)
    values = sampler.together(list(dict.fromkeys(name for name, _, _ in rows)), pieces, u)
    worst = 0.0
    for name, scale, where in rows:
        on = sampler.cycle.on(where)[pieces]
        highest = float(sampler.heights(name, values[name][on]).max(initial=-np.inf))
        worst = max(worst, (highest - sampler.peak(name, where)) / scale)
    return worst
