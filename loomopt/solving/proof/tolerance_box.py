"""Largest values of figures of all machines in a box of numbers: claims proven by branch and bound.

A claim is that a function is no more than a bound all over the box. Of a whole-cycle quantity the crank angle is one
more variable: on a part of the cycle f(c + h) ≤ f(c) + f'(c) h + k h², each term enclosed over the box [as
`certificate.taylor_bounds` for one design]. A number in which f is monotone all over a part stands at that end from
then on [Ratschek and Rokne, New Computer Methods for Global Optimization, 1988, section 3.4].
"""

import abc
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from loomopt.maths import intervals, systems
from loomopt.maths.interval_series import IntervalSeries, along
from loomopt.maths.intervals import PI, Enclosure, Floats, Interval, interval
from loomopt.maths.systems import Number
from loomopt.model.kinematics import Follows
from loomopt.model.model import JobModel
from loomopt.model.reading import Quantities, Rows
from loomopt.model.sampling import Extreme, sampled
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node, Where
from loomopt.solving.proof.followed_events import EventBox
from loomopt.solving.proof.reading import NodeLayout
from loomopt.solving.proof.task import BoxRows, OpenError

BATCH = 256
"""Parts read at once: enough that a formula's own Python does not count."""
MOST_PARTS = 6000
"""Parts after which a claim is undecided: those of packaged scenes take 2400 at most, with links of ISO 2768-m."""
FIRST_PARTS = 32
"""Number of first parts of a piece of the cycle: bounds over the whole piece are too wide."""
SHARES = 16
"""Parts of 1 by which two nodes are weighted."""
ROOM = 1e-13
"""Share of the terms of a sum of floats by which it may be wrong: many roundings of two dozen terms."""
STEEP = 1e300
"""What a slope without bound counts for where the side to halve is chosen."""

Ends = Mapping[str, tuple[float, float]]


class Bounds(NamedTuple):
    """Bounds of a function over parts of a box: at most `most`, in their middles at least `here`, (parts,).

    least_slope, most_slope, moves: what its slopes are, and how much each variable moves it, (variables, parts).
    """

    most: Floats
    here: Floats
    least_slope: Floats
    most_slope: Floats
    moves: Floats


class NumberBox:
    """All machines whose numbers lie in a box.

    ends: of the numbers that differ, SI; values: all numbers of one machine in it, SI. Raises OpenError where boxes
    say nothing of such machines.
    """

    def __init__(self, model: JobModel, values: Mapping[str, float], ends: Ends) -> None:
        self.model, self.names = model, tuple(ends)
        self.low = np.array([low for low, _ in ends.values()])
        self.high = np.array([high for _, high in ends.values()])
        self.system = systems.boxes()
        self.fixed = {name: self.system.number(v) for name, v in values.items() if name not in ends}
        if names := ", ".join(state.name for state in model.states):
            raise OpenError(f"the steady state of {names} is not bounded by boxes")
        self.sampler = sampled(model, dict(values))
        self.followed = self._followed() if self.sampler.hints else None
        self.layout = NodeLayout(self.sampler)
        with np.errstate(all="ignore"):
            given = self.given(self.low[:, None], self.high[:, None])
            corners = self.model.corners(self.system, given)
            events = {name: model.event(self.system, given, name) for name in model.events_read}
            if not self.layout.certain(corners, events, 1).all():
                raise OpenError("corners of the cycle may change places within the tolerances")

    def given(self, low: Floats, high: Floats) -> Given:
        """Numbers of parts, ends (numbers, parts), SI, with derived numbers and slopes."""
        count = len(self.names)
        variables = {name: intervals.variable(k, count, low[k], high[k]) for k, name in enumerate(self.names)}
        values = {**self.fixed, **variables}
        if self.followed:
            middle = low + (high - low) / 2
            values |= self.followed.given(values, self._numbers(middle), _half(low, high))
        return self.model.given(self.system, values)

    def points(self, at: Floats) -> Given:
        """Numbers at points (numbers, parts), SI."""
        values = self._numbers(at)
        if self.followed:
            values |= self.followed.points(values)
        return self.model.given(self.system, values)

    def _numbers(self, at: Floats) -> dict[str, Number]:
        """Numbers at points (numbers, parts), SI."""
        return self.fixed | {name: interval(at[k][None]) for k, name in enumerate(self.names)}

    def _followed(self) -> EventBox:
        """Events that hints lead to, enclosed over the box. Raises OpenError."""
        kinematics = self.model.kinematics
        following = kinematics.following(self.sampler.given) if isinstance(kinematics, Follows) else None
        if following is None:
            raise OpenError("corners of the cycle are found by iteration, which boxes do not enclose")
        hints = {name: hint for name, hint in self.sampler.hints.items() if name not in following.hints}
        self.fixed |= {name: self.system.number(hint) for name, hint in hints.items()}
        low, high = self.low[:, None], self.high[:, None]
        variables = {n: intervals.variable(k, len(low), low[k], high[k]) for k, n in enumerate(self.names)}
        half, middle = _half(low, high), low + (high - low) / 2

        def meant(whole: Number, there: Number, half: Floats) -> Interval:
            return _meant(_whole(whole, half), _whole(there, half).v, half)

        with np.errstate(all="ignore"):
            return EventBox(self.system, following, {**self.fixed, **variables}, self._numbers(middle), half, meant)

    def rows(self, given: Given) -> BoxRows:
        """Rows that read single values."""
        corners = self.model.corners(self.system, given)
        return BoxRows(self.model, self.system, given, self.layout.stills, self.layout.cycle, corners)

    def starts(self, given: Given) -> Sequence[Number]:
        """Crank angles, rad, where the pieces begin."""
        return self.layout.cycle.begins(self.model.corners(self.system, given), PI)

    def pieces(self, quantity: str, where: Where | None) -> list[int]:
        """Pieces on which a quantity counts."""
        return [int(k) for k in np.flatnonzero(self.model.counted(self.layout.cycle, quantity, where))]


class Function(abc.ABC):
    """Subject of a claim: a function of the variables of the parts."""

    box: NumberBox

    @abc.abstractmethod
    def parts(self) -> tuple[Floats, Floats]:
        """First parts, each (variables, parts)."""

    @abc.abstractmethod
    def bounds(self, low: Floats, high: Floats) -> Bounds:
        """Bounds of the function over parts, ends (variables, parts)."""


class Single(Function):
    """A value of the design alone, in the number system of boxes; read(rows): it, SI."""

    def __init__(self, box: NumberBox, read: Callable[[Rows], Number]) -> None:
        self.box, self.read = box, read

    def parts(self) -> tuple[Floats, Floats]:
        """The whole box."""
        return self.box.low[:, None], self.box.high[:, None]

    def bounds(self, low: Floats, high: Floats) -> Bounds:
        """Bounds over parts: from the value, and from the middle and slopes."""
        value = _whole(self.read(self.box.rows(self.box.given(low, high))), low)
        middle = low + (high - low) / 2
        there = _whole(self.read(self.box.rows(self.box.points(middle))), low).v
        return _bounded(value, there, _half(low, high))


class AtAngle(Single):
    """A whole-cycle quantity at one crank angle, rad, times a sign."""

    def __init__(self, box: NumberBox, quantity: str, sign: float, angle: float) -> None:
        piece, _ = box.layout.cycle.place(angle)
        switch = box.layout.cycle.switch(piece)
        super().__init__(box, lambda rows: rows.quantity(quantity, interval(angle), switch) * sign)


class OverPiece(Function):
    """Whole-cycle quantity times a sign over an interval; the position in the interval is the first variable.

    ends(given): where the stretch begins, and how wide it is, rad; switch: the switches on it.
    """

    def __init__(
        self,
        box: NumberBox,
        quantity: str,
        sign: float,
        ends: Callable[[Given], tuple[Number, Number]],
        switch: Mapping[str, Number],
    ) -> None:
        self.box, self.quantity, self.sign = box, quantity, sign
        self.ends, self.switch = ends, switch
        self._both = systems.boxes(), systems.box_series()

    def parts(self) -> tuple[Floats, Floats]:
        """The box, over parts of the range of angles."""
        cuts = np.linspace(0.0, 1.0, FIRST_PARTS + 1)
        ones = np.ones(FIRST_PARTS)
        low, high = (
            np.vstack([u, end[:, None] * ones]) for u, end in ((cuts[:-1], self.box.low), (cuts[1:], self.box.high))
        )
        return low, high

    def bounds(self, low: Floats, high: Floats) -> Bounds:
        """Bounds over parts: from the value, and from a parabola in the angle with slopes in the numbers."""
        given = self.box.given(low[1:], high[1:])
        whole = self._series(given, low[:1], high[:1])
        centre, half = low[:1] + (high[:1] - low[:1]) / 2, _half(low, high)
        at = self._series(given, centre, centre)
        middle = low[1:] + (high[1:] - low[1:]) / 2
        point = self._series(self.box.points(middle), centre, centre)
        flat = low[1:]
        here = _bounded(_whole(at.value, flat), _whole(point.value, flat).v, half[1:])
        slope, bend = _meant(_whole(at.slope, flat), _whole(point.slope, flat).v, half[1:]), _whole(whole.bend, flat).v
        most = interval(here.most) + _risen(slope, bend, half[0])
        value = _whole(whole.value, flat)
        along_u = _whole(whole.slope, flat).v
        steep = np.maximum(np.abs(along_u.low), np.abs(along_u.high))
        lows, highs = (
            np.vstack([u_slope, g[:, 0]]) for u_slope, g in ((along_u.low, value.g.low), (along_u.high, value.g.high))
        )
        moves = np.vstack([np.where(np.isfinite(steep), steep, STEEP) * half[:1], here.moves])
        return Bounds(np.minimum(value.v.high[0], most.high), here.here, lows, highs, moves)

    def _series(self, given: Given, low: Floats, high: Floats) -> "_Terms":
        begin, width = self.ends(given)
        quantities = Quantities(self.box.model, self._both, given)
        value = quantities((self.quantity,), Node(begin + along(low, high) * width, self.switch))[0] * self.sign
        terms = value.terms if isinstance(value, IntervalSeries) else (value, interval(0.0), interval(0.0))
        return _Terms(*terms)


class _Terms(NamedTuple):
    value: Number
    slope: Number
    bend: Number


def over_cycle(box: NumberBox, quantity: str, sign: float, where: Where | None = None) -> list[OverPiece]:
    """A whole-cycle quantity times a sign over each piece on which it counts."""

    def stretch(piece: int) -> Callable[[Given], tuple[Number, Number]]:
        def ends(given: Given) -> tuple[Number, Number]:
            starts = box.starts(given)
            return starts[piece], starts[piece + 1] - starts[piece]

        return ends

    cycle = box.layout.cycle
    return [
        OverPiece(box, quantity, sign, stretch(piece), cycle.switch(piece)) for piece in box.pieces(quantity, where)
    ]


def over_angles(box: NumberBox, quantity: str, sign: float, angle: float) -> OverPiece:
    """A quantity that no switch changes, times a sign, from crank angle 0 to one angle, rad, of either sign."""
    switch = box.layout.cycle.switch(box.layout.cycle.place(0.0)[0])
    return OverPiece(box, quantity, sign, lambda given: (interval(0.0), interval(angle)), switch)


class Peak(Function):
    """Negative of the largest signed value of a quantity at nodes, a lower bound of its peak.

    nodes: piece, share of it and sign. Of weights that add up to 1 the largest value is at least the weighted mean,
    whose slopes cancel where two peaks tie [as the cut of `tree.with_cut`].
    """

    def __init__(self, box: NumberBox, quantity: str, nodes: Sequence[tuple[int, float, float]]) -> None:
        self.box, self.quantity = box, quantity
        spots = [Extreme(piece, u, sign) for piece, u, sign in nodes]
        self.spots = box.layout.spots(spots)
        count = len(nodes)
        rows = list(np.eye(count))
        for first, second in itertools.combinations(range(count), 2):
            for share in np.arange(1, SHARES) / SHARES:
                row = np.zeros(count)
                row[first], row[second] = share, 1 - share
                rows.append(row)
        self.weights = np.array(rows)

    def parts(self) -> tuple[Floats, Floats]:
        """The whole box."""
        return self.box.low[:, None], self.box.high[:, None]

    def bounds(self, low: Floats, high: Floats) -> Bounds:
        """Bounds over parts from their middles and slopes; no number is moved to an end, because nodes differ."""
        half, middle = _half(low, high), low + (high - low) / 2
        whole = self._at(self.box.given(low, high), low)
        there = self._at(self.box.points(middle), low).v
        room = ROOM * (self.weights @ np.abs(there.low) + self.weights @ np.abs(there.high))
        slopes = [np.einsum("rk,nkp->nrp", self.weights, end) for end in (whole.g.low, whole.g.high)]
        terms = np.einsum("rk,nkp->nrp", self.weights, np.maximum(np.abs(whole.g.low), np.abs(whole.g.high)))
        steep = (np.maximum(np.abs(slopes[0]), np.abs(slopes[1])) + ROOM * terms) * half[:, None]
        least = self.weights @ there.low - room - steep.sum(axis=0) * (1 + ROOM)
        least = np.where(np.isnan(least), -np.inf, least)
        best = least.argmax(axis=0)
        every = np.arange(low.shape[1])
        wide = (slopes[1] - slopes[0])[:, best, every] * half
        anything = np.full_like(low, np.inf)
        return Bounds(
            -least[best, every],
            np.full(low.shape[1], -np.inf),
            -anything,
            anything,
            np.where(np.isfinite(wide), wide, STEEP),
        )

    def _at(self, given: Given, like: Floats) -> Enclosure:
        corners = self.box.model.corners(self.box.system, given)
        value = self.box.rows(given).quantity(self.quantity, self.spots.angle(corners), self.spots.switches)
        return _whole(value * interval(self.spots.sign), like, self.spots.count)


# Parts of a box.


def _half(low: Floats, high: Floats) -> Floats:
    """Distances from the middles of parts to their ends, rounded upward."""
    middle = low + (high - low) / 2
    return np.asarray(np.nextafter(np.maximum(high - middle, middle - low), math.inf))


def _whole(number: Number, like: Floats, nodes: int = 1) -> Enclosure:
    """Number as an enclosure of full shape: value (nodes, parts), slopes (numbers, nodes, parts)."""
    count, parts = like.shape
    flat = interval(np.zeros((count, 1, 1)))
    value, slopes = (number.v, number.g) if isinstance(number, Enclosure) else (interval(number), flat)

    def full(of: Interval, shape: tuple[int, ...]) -> Interval:
        return Interval(
            *(
                np.nan_to_num(np.broadcast_to(end, shape), nan=lost, posinf=np.inf, neginf=-np.inf)
                for end, lost in ((of.low, -np.inf), (of.high, np.inf))
            )
        )

    return Enclosure(full(value, (nodes, parts)), full(slopes, (count, nodes, parts)))


def _meant(whole: Enclosure, middle: Interval, half: Floats) -> Interval:
    """Bounds of a number over parts, (1, parts): from the value, and from the middle and slopes."""
    steps = Interval(-half[:, None], half[:, None])
    off = whole.g * steps
    total = Interval(np.zeros_like(middle.low), np.zeros_like(middle.high))
    for k in range(len(half)):
        total = total + off[k]
    line = middle + total
    return whole.v.meet(line) if not np.isnan(line.low).any() and not np.isnan(line.high).any() else whole.v


def _bounded(whole: Enclosure, middle: Interval, half: Floats) -> Bounds:
    low, high = whole.g.low[:, 0], whole.g.high[:, 0]
    steep = np.maximum(np.abs(low), np.abs(high))
    moves = np.where(np.isfinite(steep), steep, STEEP) * half
    return Bounds(_meant(whole, middle, half).high[0], middle.low[0], low, high, moves)


def _risen(slope: Interval, bend: Interval, half: Floats) -> Interval:
    """Largest s h + k h² for |h| ≤ half, (parts,): at an end, or at the vertex of the parabola."""
    steep = interval(np.maximum(np.abs(slope.low), np.abs(slope.high))[0])
    high = bend.high[0]
    ends = steep * interval(half) + interval(high) * interval(half).square()
    with np.errstate(all="ignore"):
        top = steep.square() * interval(np.where(high < 0, -4.0 * high, 1.0)).inverse()
        inner = (high < 0) & (steep.high <= -2.0 * high * half * (1 - 1e-12))
    return Interval(np.zeros_like(high), np.where(inner, top.high, np.maximum(ends.high, 0.0)))


# Claims.


class Outcome(NamedTuple):
    """Outcome of a claim: proven, or not; parts: number of parts that were read.

    open: the middle of a part left open, or a machine that breaks the claim, SI.
    """

    proven: bool
    parts: int
    open: Floats | None = None


def at_most(function: Function, bound: float, work: int = MOST_PARTS) -> Outcome:
    """Whether a function is at most a bound on all of its parts; work: parts that may be read."""
    low, high = function.parts()
    numbers, read = slice(len(low) - len(function.box.names), None), 0
    with np.errstate(all="ignore"):
        while low.shape[1]:
            take = slice(max(low.shape[1] - BATCH, 0), None)
            batch_low, batch_high = low[:, take].copy(), high[:, take].copy()
            low, high = low[:, : take.start], high[:, : take.start]
            read += batch_low.shape[1]
            if read > work:
                return Outcome(False, read, (batch_low[numbers, 0] + batch_high[numbers, 0]) / 2)
            bounds = function.bounds(batch_low, batch_high)
            if (bounds.here > bound).any():
                place = int(np.argmax(bounds.here > bound))
                return Outcome(False, read, (batch_low[numbers, place] + batch_high[numbers, place]) / 2)
            # Written so that what is no number proves nothing.
            alive = ~(bounds.most <= bound)
            batch_low, batch_high = batch_low[:, alive], batch_high[:, alive]
            rising, falling = bounds.least_slope[:, alive] >= 0, bounds.most_slope[:, alive] <= 0
            wide = batch_high > batch_low
            batch_low = np.where(rising & wide, batch_high, batch_low)
            batch_high = np.where(falling & ~rising & wide, batch_low, batch_high)
            changed = ((rising | falling) & wide).any(axis=0)
            stuck = ~changed & ~(batch_high > batch_low).any(axis=0)
            if stuck.any():
                return Outcome(False, read, batch_low[numbers, int(np.argmax(stuck))])
            halves = _halved(batch_low[:, ~changed], batch_high[:, ~changed], bounds.moves[:, alive][:, ~changed])
            low = np.hstack([low, batch_low[:, changed], *halves[0]])
            high = np.hstack([high, batch_high[:, changed], *halves[1]])
    return Outcome(True, read)


def _halved(low: Floats, high: Floats, moves: Floats) -> tuple[list[Floats], list[Floats]]:
    """Parts halved along the variable that moves the function most."""
    side, place = np.where(high > low, moves, -1.0).argmax(axis=0), np.arange(low.shape[1])
    middle = low[side, place] + (high[side, place] - low[side, place]) / 2
    first, second = high.copy(), low.copy()
    first[side, place] = second[side, place] = middle
    return [low, second], [first, high]


def all_at_most(functions: Sequence[Function], bound: float, work: int = MOST_PARTS) -> Outcome:
    """Whether all functions are at most a bound, within the same work."""
    read = 0
    for function in functions:
        outcome = at_most(function, bound, work - read)
        read += outcome.parts
        if not outcome.proven:
            return outcome._replace(parts=read)
    return Outcome(True, read)
