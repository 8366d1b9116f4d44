"""Rows of a program in intervals: single values, and means over the cycle enclosed strip by strip."""

from collections.abc import Sequence

import numpy as np

from loomopt.maths import systems
from loomopt.maths.interval_series import Series, along
from loomopt.maths.intervals import Enclosure, Floats, Interval, interval
from loomopt.maths.systems import Maths, Number
from loomopt.model.model import Integral, JobModel, Stills
from loomopt.model.reading import DATUM, Quantities, Rows
from loomopt.physics.balance import Given, total
from loomopt.physics.cycle import Cycle, Node

STRIPS = ((0.1, 8), (0.03, 16), (0.0, 32))
"""Strips of a piece over which a mean is enclosed, by the width of boxes as a share of the whole: what strips leave
falls with the cube of their width (0.04 % of pulse_rms from 32), and does not count beside a wide box's own."""


def strips(widths: Floats) -> int:
    """Return how many strips are enough for boxes of such widths, shares of the whole box."""
    usual = float(np.median(widths.max(axis=0)))
    return next(count for least, count in STRIPS if usual >= least)


class OpenError(Exception):
    """Nothing can be proven of a program; the text says why."""


class BoxRows(Rows):
    """Rows over boxes, in intervals with their slopes or without.

    cycle, corners: the order they are read in; strips: of a piece, for means.
    """

    def __init__(
        self,
        model: JobModel,
        maths: Maths,
        given: Given,
        stills: Stills,
        cycle: Cycle | None = None,
        corners: Sequence[Number] = (),
        strips: int = STRIPS[-1][1],
    ) -> None:
        super().__init__(model, maths, given, stills)
        self._cycle, self._corners, self._strips = cycle, corners, strips

    def mean(self, integral: Integral) -> Number:
        """Return a mean at its own angles, or over its pieces, SI. Raises OpenError without a cycle."""
        if integral.angles:
            fixed = zip(integral.angles, integral.data, strict=True)
            number = self.maths.number
            values = [self.quantity(integral.quantity, number(a), {DATUM: number(d)}) for a, d in fixed]
            return total(values) / float(len(values))
        if self._cycle is None:
            raise OpenError(f"{integral.name} is a mean over a cycle that is not known")
        starts = self._cycle.begins(self._corners, self.maths.pi)
        pieces = [int(piece) for piece in np.flatnonzero(self._cycle.on(integral.where))]
        means = [self._mean(integral.quantity, self._cycle, starts, piece) for piece in pieces]
        if len(means) == 1:
            return means[0]
        widths = [starts[piece + 1] - starts[piece] for piece in pieces]
        return total([width * mean for width, mean in zip(widths, means, strict=True)]) / total(widths)

    def _mean(self, name: str, cycle: Cycle, starts: Sequence[Number], piece: int) -> Number:
        """Return a quantity's mean over one piece: its value at the middle of each strip, and its bend over it."""
        count = self._strips
        half = 0.5 / count
        middles: Floats = ((2 * np.arange(count, dtype=np.float64) + 1) * half)[:, None]
        begin, width, switch = starts[piece], starts[piece + 1] - starts[piece], cycle.switch(piece)
        values = self.quantity(name, begin + interval(middles) * width, switch)
        whole = along(middles - half, middles + half)
        series = Quantities(self.model, (self.maths, systems.box_series()), self.given)
        found = series((name,), Node(begin + whole * width, switch))[0]
        bends = found.terms.bend if isinstance(found, Series) else interval(0.0)
        return _summed(values * (2 * half), count) + _summed(bends * (interval(half) ** 3 * 2.0 / 3.0), count)


def _summed(number: Number, count: int) -> Number:
    """Return the sum over so many nodes, the last axis but one."""
    if isinstance(number, Enclosure):
        return Enclosure(_added(number.v, count), _added(number.g, count))
    return _added(interval(number), count)


def _added(values: Interval, count: int) -> Interval:
    """Return the sum of nodes: floats add up with an error of so many roundings of their magnitudes."""
    room = 2 * count * float(np.finfo(float).eps)

    def end(each: Floats, side: float) -> Number:
        spread = np.broadcast_to(each, (*each.shape[:-2], count, each.shape[-1]))
        return spread.sum(axis=-2, keepdims=True) + side * room * np.abs(spread).sum(axis=-2, keepdims=True)

    with np.errstate(invalid="ignore"):
        low, high = end(values.low, -1.0), end(values.high, 1.0)
    return Interval(np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high))
