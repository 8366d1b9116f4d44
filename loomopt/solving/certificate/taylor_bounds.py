"""Bounds between all points: whole-cycle rows proven on boxes of crank angle by truncated Taylor series over balls.

On a box of half-width r around c, f(c + h) = f(c) + f'(c) h + k h² with k enclosed over the whole box. Where the
bound is too coarse the box is halved. The formulas are those of the model, in Arb's ball arithmetic: rounding is
inside the balls.
"""

import functools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.maths import systems
from loomopt.maths.centred_series import CentredSeries
from loomopt.maths.systems import Number
from loomopt.model.model import Integral
from loomopt.model.program import Program
from loomopt.model.reading import Quantities, Reading
from loomopt.model.sampling import Sampler, scan_together
from loomopt.physics.cycle import Node, Where

MOST_BOXES, MEAN_BOXES = 20_000, 2048
"""Boxes of crank angle after which a bound is undecided (every packaged row takes under 2000), and boxes of a mean: the
cube of a width of 1/2048 is 1e-10."""

SHARED_BOXES = 2000
"""Boxes over which several quantities are read at once: their poses are computed once, but all series are kept."""

NEAR_TOP = 1.5
"""Widths between a box's middle and a refined top within which the box is expanded at the top, or at its end toward it.
Proofs of all packaged scenes take a tenth more readings with 0.5, tops inside a box alone; with 1 to 6 as many."""

CycleRow = tuple[str, float, Where | None]
"""A whole-cycle quantity, its scale, and the pieces where it counts."""


class CycleBound(NamedTuple):
    """Status of one row's bound: proven, violated at `angle` (rad), or undecided within the boxes allowed.

    open: crank angle, rad, up to which an undecided row is bounded, piece by piece from the first.
    """

    status: str
    boxes: int
    angle: float | None = None
    open: float | None = None


class AngleBox(NamedTuple):
    """Shares of a piece from low to high; bend: enclosure of f''/2 over it, from a box around it, if known."""

    low: float
    high: float
    bend: Number = None

    def nearest(self, tops: Sequence[float]) -> float:
        """Point of expansion: the top in the box, the end nearest to a close top, else the middle."""
        middle, width = (self.low + self.high) / 2, self.high - self.low
        top = min(tops, key=lambda u: abs(u - middle), default=math.inf)
        return min(max(top, self.low), self.high) if abs(top - middle) <= NEAR_TOP * width else middle

    def halves(self, bend: Number) -> "list[AngleBox]":
        """Both halves, the left one last; bend: their enclosure."""
        middle = (self.low + self.high) / 2
        return [AngleBox(middle, self.high, bend), AngleBox(self.low, middle, bend)]


class Boxes(Reading):
    """One design in ball arithmetic, with bounds of its rows."""

    def __init__(self, sampler: Sampler) -> None:
        system, model = systems.balls(), sampler.model
        exact = {name: system.number(value) for name, value in {**sampler.values, **sampler.hints}.items()}
        super().__init__(model, system, model.given(system, exact), sampler.cycle, sampler.stills)
        self.sampler = sampler
        # A centred series is narrowed where it is read first, so a bound depends on the order of operations.
        self._centred = Quantities(model, (system, systems.centred_balls()), self.given, record_at_once=True)
        self._read: dict[tuple[int, float, float], Number] = {}
        self._read_of = ""
        self._together: tuple[str, ...] = ()
        self._shared: dict[tuple[int, float, float], dict[str, Number]] = {}
        self._middles: dict[tuple[int, float], dict[str, Number]] = {}

    @lazy
    def _switches(self) -> list[dict[str, float]]:
        """Switches on each piece."""
        pieces = map(self.cycle.switch, range(self.cycle.pieces))
        return [{name: float(value) for name, value in switch.items()} for switch in pieces]

    def share(self, names: Iterable[str]) -> None:
        """Read these quantities together over every box, because several of them are to be bounded."""
        self._together = tuple(dict.fromkeys(self._row(name) for name in names))
        self._shared, self._middles = {}, {}

    def _row(self, name: str) -> str:
        """Row by which a quantity is bounded: its square where it has a corner at 0."""
        return self.model.square(name) or name

    def bound(
        self,
        name: str,
        sign: float,
        limit: float,
        where: Where | None = None,
        stop: Callable[[int], bool] | None = None,
    ) -> CycleBound:
        """Whether sign · quantity ≤ limit (SI) over the whole cycle, or over the pieces `where`.

        A quantity with a corner at 0 has no series there and is bounded by its square. stop(boxes): whether to stop
        undecided after that number of boxes; MOST_BOXES without it.
        """
        is_over = stop or (lambda boxes: boxes >= MOST_BOXES)
        cycle, box_count, row = self.cycle, 0, self._row(name)
        limit = limit if row == name else limit * abs(limit)
        for piece in map(int, np.flatnonzero(self.sampler.on(name, where))):
            tops = self._tops(name, sign, piece)
            boxes = [AngleBox(0.0, 1.0)]
            while boxes:
                box = boxes.pop()
                box_count += 1
                point = box.nearest(tops)
                holds, bend = box_verdict(functools.partial(self._signed, row, sign, piece), limit, box, point)
                if holds is False:
                    return CycleBound(
                        "violated",
                        box_count,
                        float(cycle.starts[piece] * (1 - point) + cycle.starts[piece + 1] * point),
                    )
                if holds is None:
                    if is_over(box_count):
                        point = cycle.starts[piece] * (1 - box.low) + cycle.starts[piece + 1] * box.low
                        return CycleBound("undecided", box_count, open=float(point))
                    boxes += box.halves(bend)
        return CycleBound("proven" if box_count else "undecided", box_count)

    def _tops(self, name: str, sign: float, piece: int) -> list[float]:
        """Places at which sign · quantity is highest on a piece, from floats: hints only."""
        extremes = [extreme for extreme in self.sampler.extremes(name) if extreme.piece == piece]
        return [extreme.u for extreme in extremes if sign * extreme.sign > 0]

    def _signed(self, name: str, sign: float, piece: int, centre: float, half: float) -> Number:
        """Series of sign · quantity around a ball; that of the last quantity is cached for its other sign."""
        if name != self._read_of:
            self._read, self._read_of = {}, name
        ball = piece, centre, half
        if ball not in self._read:
            self.sampler.session.positions += 1
            self._read[ball] = self._box_series(name, *ball) if half else self._point_series(name, piece, centre)
        return sign * self._read[ball]

    def mean(self, integral: Integral) -> Number:
        """Ball around an integral's mean over its pieces.

        On each box the Taylor polynomial is integrated, and its remainder is enclosed.
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

    def _series(self, name: str, piece: int, centre: float, half: float) -> Number:
        """Taylor series of a quantity in u, to second order, around a ball of u on a piece."""
        angle = self._angle(piece, systems.ball_series(centre, half))
        value = self.quantity(name, angle, self._switches[piece])
        return systems.ball_series(0.0, 0.0) * 0 + value

    def _point_series(self, name: str, piece: int, at: float) -> Number:
        """Taylor series at a point; one at the middle of a box over which quantities were read together is known."""
        known = self._middles.get((piece, at), {}).get(name)
        return known.middle if isinstance(known, CentredSeries) else self._series(name, piece, at, 0.0)

    def _box_series(self, name: str, piece: int, centre: float, half: float) -> Number:
        """Taylor series as `_series`, narrowed by that at the middle: three times the work, and far fewer boxes."""
        box = piece, centre, half
        if name in self._together and box not in self._shared and len(self._shared) < SHARED_BOXES:
            try:
                self._shared[box] = self._middles[piece, centre] = self._centred_series(self._together, *box)
            except (ValueError, ZeroDivisionError):  # one of them fails: each is read alone
                self._shared[box] = {}
        known = self._shared.get(box, {})
        value = known[name] if name in known else self._centred_series((name,), *box)[name]
        return value.narrowed() if isinstance(value, CentredSeries) else systems.ball_series(0.0, 0.0) * 0 + value

    def _centred_series(self, names: tuple[str, ...], piece: int, centre: float, half: float) -> dict[str, Number]:
        """Quantities over a box, as far as they depend on u with the series at its middle."""
        angle = self._angle(piece, systems.centred_ball_series(centre, half))
        return dict(zip(names, self._centred(names, Node(angle, self._switches[piece])), strict=True))

    def _angle(self, piece: int, u: Number) -> Number:
        """Crank angle, rad, of a share of a piece."""
        begin, end = self.starts[piece : piece + 2]
        return begin + (end - begin) * u


def box_verdict(
    series: Callable[[float, float], Number], limit: float, box: AngleBox, at: float
) -> tuple[bool | None, Number]:
    """Verdict on a box: True if f ≤ limit, False if f(at) exceeds it, None if open; and the enclosure of f''/2.

    series(centre, half): f's Taylor series in u, to second order, around a ball.
    """
    try:
        if box.bend is not None:
            value_series = series(at, 0.0)
            if value_series[0] > limit:
                return False, None
            if _is_below(value_series, box.bend, box, at, limit):
                return True, None
        box_series = series((box.low + box.high) / 2, (box.high - box.low) / 2)
        if box_series[0] <= limit:
            return True, None
        value_series = series(at, 0.0)
        if value_series[0] > limit:
            return False, None
        return _is_below(value_series, box_series[2], box, at, limit) or None, box_series[2]
    except (ValueError, ZeroDivisionError):
        return None, box.bend


def _is_below(here: Number, bend: Number, box: AngleBox, at: float, limit: float) -> bool:
    """Whether f(at) + f'(at) h + k h² ≤ limit over a whole box; k ≤ bend, h from low − at to high − at.

    False for what is no number.
    """
    ball = systems.balls().number
    value, slope, bend = here[0], here[1], bend.upper()
    low, high = (ball(end) - ball(at) for end in (box.low, box.high))
    if bend < 0 and not (slope + 2 * bend * low < 0 or slope + 2 * bend * high > 0):
        # The parabola's top lies in the box: a row that touches its bound from below is proven in a wide box.
        return bool(value - slope * slope / (4 * bend) <= limit)
    return all(value + h * (slope + bend * h) <= limit for h in (low, ball(0.0), high))


def peaks_verdict(sampler: Sampler, rows: Sequence[CycleRow], accuracy: float) -> str:
    """Verdict on the refined peaks of rows: "proven" if boxes bound every one, "violated" if one is exceeded.

    accuracy: allowed excess over a peak, in the row's scale. "undecided" where boxes run out, and where a formula has
    no ball arithmetic.
    """
    if not rows or not {name for name, _, _ in rows} <= sampler.model.bounded:
        return "undecided"
    boxes = Boxes(sampler)
    statuses = []
    for name, scale, where in rows:
        peak = sampler.peak(name, where) + accuracy * scale
        signs = (1.0,) if name in sampler.model.signed else (1.0, -1.0)
        statuses += [boxes.bound(name, sign, peak, where).status for sign in signs]
    return next((status for status in ("violated", "undecided") if status in statuses), "proven")


def cycle_rows(program: Program) -> list[CycleRow]:
    """Whole-cycle quantities of a program's objectives and limits, with scale and pieces."""
    rows: list[CycleRow] = [(row, o.scale, None) for o in program.objectives for row in o.quantities]
    rows += [(limit.row, limit.scale, limit.where) for limit in program.cycle_limits.values()]
    return list(dict.fromkeys(rows))


def scan_excess(sampler: Sampler, rows: Sequence[CycleRow], points: int) -> float:
    """Excess of an independent dense scan over the refined peaks, relative to the row's scale."""
    scan_together((sampler,), (name for name, _, _ in rows), points)
    excesses = ((sampler.scanned(n, points, where) - sampler.peak(n, where)) / scale for n, scale, where in rows)
    return max((excess for excess in excesses if excess > 0.0), default=0.0)
