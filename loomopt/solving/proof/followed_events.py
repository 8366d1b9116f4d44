"""Crank angles that no formula gives, over a box of designs: an interval Newton step encloses each, with its slopes.

Newton's step of a box, N = m - f(X, m)/f'(X, T), holds every root in T; inside T it proves that there is exactly one
for each design of X [Moore, Kearfott and Cloud, Introduction to Interval Analysis, chapter 8; Neumaier, Interval
Methods for Systems of Equations, section 5.1]. Its slopes in the design are -f_x/f'.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from loomopt.maths.intervals import Enclosure, Floats, Interval, interval
from loomopt.maths.systems import Maths, Number
from loomopt.model.kinematics import Followed, Following
from loomopt.physics.balance import Given
from loomopt.physics.cycle import TURN
from loomopt.physics.schema import Values
from loomopt.solving.proof.task import OpenError

STEPS, WIDER, FIRST, TRIES = 2, 1.7, 2.0, 8
"""Newton's steps of a part; by how much a zone grows until its step falls inside, its first width over what the slopes
say, and how often it is tried."""
PIECES, FINEST, MOST = 256, 1e-7, 20_000
"""Pieces of the turn on which the output's slope is read, their least width, rad, and how many are read at most."""

Meant = Callable[[Number, Number, Floats], Interval]
"""meant(whole, middle, half): what a number is over parts, (1, parts), by its value and by its middle and slopes."""


@dataclass
class EventBox:
    """The events of a mechanism over a box of its numbers.

    values: of the box, with slopes; middle: of its middle; half: how far the box reaches from it, (numbers, 1). Raises
    OpenError where an event is not enclosed, or may be another on some machine of the box.
    """

    system: Maths
    following: Following
    values: Values
    middle: Values
    half: Floats
    meant: Meant
    zones: dict[str, Interval] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Enclose the events over the whole box, and prove that they are the same on every machine of it."""
        turns = [self._zone(turn, Given(self.values, {}), Given(self.middle, {})) for turn in self.following.turns]
        self._alone(turns)
        whole, middle, narrow = dict(self.values), dict(self.middle), dict[str, Interval]()
        for event in self.following.events:
            zone = self._zone(event, Given(whole, {}), Given(middle, {}))
            self.zones[event.value] = zone
            middle[event.value] = self._root(event, Given(middle, {}), zone)
            enclosure = self._followed(event, Given(whole, {}), Given(middle, {}), zone, self.half)
            whole[event.value], narrow[event.value] = enclosure, enclosure.v
        at = [
            self._followed(t, Given(whole, {}), Given(middle, {}), zone, self.half)
            for t, zone in zip(self.following.turns, turns, strict=True)
        ]
        there = [self._root(t, Given(middle, {}), zone) for t, zone in zip(self.following.turns, turns, strict=True)]
        rows = zip(
            self.following.sure(self.system, Given(whole, {}), at),
            self.following.sure(self.system, Given(middle, {}), there),
            strict=True,
        )
        for (problem, row), (_, here) in rows:
            if not (self.meant(row, here, self.half).low > 0).all():
                raise OpenError(f"on some machines within the tolerances {problem}")
        for begins, event in self.following.paths:
            self._first(begins, event, Given(whole, {}), Given(middle, {}))
        self.zones = narrow  # no event lies outside; each part of the box begins from there

    def given(self, values: Values, middle: Values, half: Floats) -> dict[str, Number]:
        """Events of parts of the box, with their slopes where the values have any."""
        whole, centre, events = dict(values), dict(middle), dict[str, Number]()
        for event in self.following.events:
            zone = self.zones[event.value]
            centre[event.value] = self._root(event, Given(centre, {}), zone)
            whole[event.value] = self._followed(event, Given(whole, {}), Given(centre, {}), zone, half)
            events[event.value] = whole[event.value]
        return events

    def points(self, values: Values) -> dict[str, Number]:
        """Events of single designs."""
        whole, events = dict(values), dict[str, Number]()
        for event in self.following.events:
            events[event.value] = whole[event.value] = self._root(event, Given(whole, {}), self.zones[event.value])
        return events

    def _root(self, event: Followed, given: Given, zone: Interval) -> Interval:
        """Crank angle of an event on single designs."""
        at = zone
        for _ in range(STEPS):
            middle = interval((at.low + at.high) / 2)
            value, slope = (
                _plain(number)
                for number in (event.rates(self.system, given, middle)[0], event.rates(self.system, given, at)[1])
            )
            at = at.meet(middle - value / slope)
        return at

    def _step(self, event: Followed, given: Given, middle: Given, at: Interval, half: Floats) -> Interval:
        """Newton step from an enclosure, for all designs of parts."""
        centre = interval((at.low + at.high) / 2)
        value = self.meant(
            event.rates(self.system, given, centre)[0], event.rates(self.system, middle, centre)[0], half
        )
        slope = _plain(event.rates(self.system, given, at)[1])
        step: Interval = centre - value / slope
        return step

    def _followed(self, event: Followed, given: Given, middle: Given, zone: Interval, half: Floats) -> Enclosure:
        """Crank angle of an event on all designs of parts, with its slopes."""
        at = zone
        for _ in range(STEPS):
            at = at.meet(self._step(event, given, middle, at, half))
        value, slope = event.rates(self.system, given, at)[:2]
        flat = interval(np.zeros((len(half), 1, 1)))
        moved = value.g if isinstance(value, Enclosure) else flat
        return Enclosure(at, -(moved / _plain(slope)))

    def _zone(self, event: Followed, given: Given, middle: Given) -> Interval:
        """Range of crank angles in which an event lies exactly once on every design of the box."""
        here = interval(np.array([[event.angle]]))
        value = event.rates(self.system, given, here)[0]
        steep = _plain(event.rates(self.system, middle, here)[1])
        reach = 0.0
        if isinstance(value, Enclosure):
            most = np.maximum(np.abs(value.g.low), np.abs(value.g.high))[:, 0, 0]
            reach = float(np.sum(most * self.half[:, 0])) / max(float(np.min(np.abs([steep.low, steep.high]))), 1e-300)
        reach = FIRST * reach + 1e-9
        for _ in range(TRIES):
            zone = Interval(here.low - reach, here.high + reach)
            step = self._step(event, given, middle, zone, self.half)
            if (step.low > zone.low).all() and (step.high < zone.high).all():
                return zone
            reach *= WIDER
        raise OpenError(f"the crank angle of {event.name} is not enclosed within the tolerances")

    def _alone(self, zones: Sequence[Interval]) -> None:
        """Prove that the output turns in the zones alone."""
        if not self.following.turns:
            return
        ends = sorted((float(zone.low.min()), float(zone.high.max())) for zone in zones)
        gaps = [(a[1], b[0]) for a, b in itertools.pairwise(ends)] + [(ends[-1][1], ends[0][0] + TURN)]
        if any(begin > end for begin, end in gaps):
            raise OpenError("two turns of the output are too close to each other to be separated within the tolerances")
        rates = self.following.turns[0].rates
        for gap in gaps:
            self._clear(
                gap,
                lambda given, phi: rates(self.system, given, phi)[0],
                Given(self.values, {}),
                Given(self.middle, {}),
                "turns elsewhere too",
                0,
            )

    def _first(self, begins: str, event: Followed, given: Given, middle: Given) -> None:
        """Prove that an event is the first at its level on the way from another."""
        (begin, end), (low, high) = (
            (float(zone.low.min()), float(zone.high.max())) for zone in (self.zones[begins], self.zones[event.value])
        )
        gap = (begin, low) if begin < low else (high, end)
        claim = f"reaches {event.name} earlier"
        self._clear(gap, lambda numbers, phi: event.rates(self.system, numbers, phi)[0], given, middle, claim, 1)

    def _clear(
        self,
        gap: tuple[float, float],
        formula: Callable[[Given, Interval], Number],
        given: Given,
        middle: Given,
        claim: str,
        sign: int,
    ) -> None:
        """Prove that a formula has no root over crank angles, rad; sign 1: that it is positive there."""
        count = max(1, math.ceil(PIECES * (gap[1] - gap[0]) / TURN))
        cuts = np.linspace(gap[0], gap[1], count + 1)
        low, high, read = cuts[:-1], cuts[1:], 0
        while len(low):
            read += len(low)
            phi = Interval(low[None], high[None])
            value = self.meant(
                formula(given, phi), formula(middle, phi), np.broadcast_to(self.half, (len(self.half), len(low)))
            )
            open_ = ~((value.low > 0) | ((value.high < 0) & (sign == 0)))[0]
            if not open_.any():
                return
            low, high = low[open_], high[open_]
            if read > MOST or (high - low).min() < FINEST:
                raise OpenError(f"it is not excluded that the output {claim} on some machines within the tolerances")
            centre = (low + high) / 2
            low, high = np.concatenate([low, centre]), np.concatenate([centre, high])


def _plain(number: Number) -> Interval:
    return number.v if isinstance(number, Enclosure) else interval(number)
