"""The motion of a cam's follower over a turn: moves and dwells in order; what is left of the turn is a dwell.

Angles in rad. The turn falls into stretches, numbered from where the first move begins: one for each piece of the law
of each move, one for each dwell, and the dwell that is left. On each one smooth formula holds; which one is data of a
node. A move without a law is the septic through the angle and three derivatives at both its ends [VDI 2143]; one with
knots is a C3 spline of degree 4, whose third derivative is linear between its knots.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

from loomopt.base.records import lazy
from loomopt.maths.systems import Maths, Number, within_half_turn
from loomopt.physics.mechanisms.cam_laws import LAWS, TURN_LAWS, LawDerivatives

if TYPE_CHECKING:
    from loomopt.maths.turning_points import Floats

MOVE_LAWS = {**LAWS, **TURN_LAWS}
DEGREE = 7
"""Degree of the polynomial through a value and three derivatives at two ends."""


class Move(NamedTuple):
    """What selects the formula of a move.

    law: name of its law; "" for the septic, or for a spline of so many intervals; None for a dwell. back: whether the
    follower's angle counts from that at the end of the move, as in the return of a cam. open_end: whether a spline ends
    with any second derivative, with which the next one begins.
    """

    law: str | None = ""
    back: bool = False
    intervals: int = 1
    open_end: bool = False

    @property
    def breaks(self) -> tuple[Fraction, ...]:
        """Where the formula changes, in shares of the move."""
        if self.law:
            shares = MOVE_LAWS[self.law].breaks
            return tuple(1 - share for share in reversed(shares)) if self.back else shares
        return tuple(Fraction(k, self.intervals) for k in range(1, self.intervals))

    @property
    def pieces(self) -> tuple[int, ...]:
        """Numbers of the law's pieces in the order in which they are passed."""
        numbers = range(len(self.breaks) + 1)
        return tuple(reversed(numbers) if self.back else numbers)


class CamState(NamedTuple):
    """Follower's angle at an end of a move, from its angle in the first dwell, and three derivatives of it."""

    angle: Number = 0
    slope: Number = 0
    bend: Number = 0
    jerk: Number = 0


class Stretch(NamedTuple):
    """Interval with one formula: the place of its move, and the piece of the move's law."""

    move: int
    piece: int


@dataclass(frozen=True)
class CamMoves:
    """Moves with their numbers, of one number system.

    begins: crank angle at which the first one begins; turns: crank angle that each takes; ends: state at the end of
    each; jerks: of each move the third derivatives at the inner knots of its spline; reached: of each move the states
    at the knots of its spline after the first, where they are known.
    """

    moves: tuple[Move, ...]
    begins: Number
    turns: tuple[Number, ...]
    ends: tuple[CamState, ...]
    jerks: tuple[tuple[Number, ...], ...] = ()
    reached: tuple[tuple[CamState, ...], ...] = ()

    @lazy
    def edges(self) -> tuple[Number, ...]:
        """Crank angles at which the moves begin, and at which the last one ends."""
        return tuple(itertools.accumulate(self.turns, initial=self.begins))

    @lazy
    def stretches(self) -> tuple[Stretch, ...]:
        """The stretches of the moves in order; one more, the dwell that is left, follows."""
        return tuple(Stretch(k, piece) for k, move in enumerate(self.moves) for piece in move.pieces)

    def corners(self, maths: Maths) -> tuple[Number, ...]:
        """Crank angles between stretches, in order from where the first move begins."""
        angles: list[Number] = []
        for move, begin, turn in zip(self.moves, self.edges, self.turns, strict=False):
            shares = (maths.number(share.numerator) / share.denominator for share in move.breaks)
            angles += [begin, *(begin + turn * share for share in shares)]
        return (*angles, self.edges[-1])

    def level(self, k: int) -> Number:
        """Follower's angle at the begin of a move."""
        return self.ends[k - 1].angle if k else 0


def stretch(angle: float, corners: Sequence[float]) -> float:
    """Number of the stretch in which a crank angle lies; corners: as from `CamMoves.corners`, rad."""
    turned = (angle - corners[0]) % (2 * math.pi)
    return float(sum(turned >= corner - corners[0] for corner in corners[1:]))


def stretches(angles: "Floats", corners: Sequence[float]) -> "Floats":
    """Numbers of the stretches in which crank angles lie."""
    import numpy as np

    turned = np.mod(np.asarray(angles, dtype=np.float64) - corners[0], 2 * math.pi)
    return np.searchsorted(np.asarray(corners[1:]) - corners[0], turned, side="right").astype(np.float64)


@dataclass(frozen=True)
class CamMotion:
    """The follower at crank angles φ, rad, inside one stretch."""

    maths: Maths
    cam: CamMoves
    phi: Number
    stretch: Number

    def _by_stretch(self, values: Sequence[Number], left: Number) -> Number:
        """Value of the stretch, of those for each stretch of the moves; left: in the dwell that is left."""
        if isinstance(self.stretch, float):
            return (*values, left)[int(self.stretch)]
        if all(value is left or (isinstance(value, int | float) and value == left) for value in values):
            return left
        return self.maths.choose(self.stretch, (*values, left))

    @lazy
    def _share(self) -> tuple[Number, Number]:
        """Share of the law, or of the interval of a spline, that is passed, and by how much it grows with φ."""
        cam, moving, middles, grows = self.cam, list[float](), list[Number](), list[Number]()
        for k, piece in cam.stretches:
            move, begin, turn = cam.moves[k], cam.edges[k], cam.turns[k]
            if move.law is None:
                follows = k + 1 < len(cam.moves)
                begin, turn = (cam.edges[k + 1], cam.turns[k + 1]) if follows else (cam.edges[k - 1], cam.turns[k - 1])
            elif move.intervals > 1:
                turn = turn / move.intervals
                begin = begin + turn * piece
            moving.append(0.0 if move.law is None else 1.0)
            middles.append(begin + turn / 2)
            grows.append(-1 / turn if move.back else 1 / turn)
        # From the middle of the stretch nothing jumps, wherever φ is counted from: it is shorter than a turn. A dwell,
        # in which the law counts for nothing, may be longer than half a turn: there it stands in its middle.
        since = self._by_stretch(moving, 0.0) * (self.phi - self._by_stretch(middles, middles[-1]))
        grow = self._by_stretch(grows, grows[-1])
        return within_half_turn(self.maths, since) * grow + self.maths.number(0.5), grow

    @lazy
    def _base(self) -> Number:
        """Angle from which the move's own counts."""
        cam = self.cam
        return self._by_stretch([cam.ends[k].angle if cam.moves[k].back else cam.level(k) for k, _ in cam.stretches], 0)

    @lazy
    def _laws(self) -> tuple[tuple[Number, LawDerivatives], ...]:
        """Travel by each named law, 0 where it does not hold, and the law at its share."""
        cam, (share, _) = self.cam, self._share
        terms = []
        for name in dict.fromkeys(move.law for move in cam.moves if move.law):
            holds = [cam.moves[k].law == name for k, _ in cam.stretches]
            piece = [float(stretch.piece) if here else 0.0 for stretch, here in zip(cam.stretches, holds, strict=True)]
            travels = [self._travel(k) if here else 0.0 for (k, _), here in zip(cam.stretches, holds, strict=True)]
            law = MOVE_LAWS[name].formula(self.maths, share, self._by_stretch(piece, 0.0))
            terms.append((self._by_stretch(travels, 0.0), law))
        return tuple(terms)

    def _travel(self, k: int) -> Number:
        before, after, back = self.cam.level(k), self.cam.ends[k].angle, self.cam.moves[k].back
        return before - after if back else after - before

    def begin(self, k: int) -> CamState:
        """CamState at the begin of a move without a law: that in which the move before it ends."""
        level = self.cam.level(k)
        if k == 0 or self.cam.moves[k - 1].law is None:
            return CamState(level)
        return self._law_end(k - 1, 1, level) if self.cam.moves[k - 1].law else self.end(k - 1)

    def end(self, k: int) -> CamState:
        """CamState at the end of a move without a law: that in which the move after it begins."""
        level, last = self.cam.ends[k].angle, k + 1 == len(self.cam.moves)
        if last or self.cam.moves[k + 1].law is None:
            return CamState(level)
        if self.cam.moves[k + 1].law:
            return self._law_end(k + 1, 0, level)
        return (
            self.cam.ends[k]._replace(bend=self.spline(k)[-1].bend) if self.cam.moves[k].open_end else self.cam.ends[k]
        )

    def _law_end(self, k: int, share: int, level: Number) -> CamState:
        """CamState at the begin (share 0) or the end (1) of a move with a named law."""
        move, turn = self.cam.moves[k], self.cam.turns[k]
        grow, u = (-1 / turn, 1 - share) if move.back else (1 / turn, share)
        assert move.law
        piece = float(move.pieces[-1 if share else 0])
        law, travel = MOVE_LAWS[move.law].formula(self.maths, self.maths.number(float(u)), piece), self._travel(k)
        return CamState(level, travel * law.s1 * grow, travel * law.s2 * grow**2, travel * law.s3 * grow**3)

    def spline(self, k: int) -> tuple[CamState, ...]:
        """States at the knots of a spline after the first one; each follows from that before it."""
        if self.cam.reached and self.cam.reached[k]:
            return self.cam.reached[k]
        if k not in self._splines:
            states, jerks = [self.begin(k)], self._jerks(k)
            for jerk in jerks:
                states.append(self.after(k, states[-1], jerk))
            self._splines[k] = tuple(states[1:])
        return self._splines[k]

    @lazy
    def _splines(self) -> dict[int, tuple[CamState, ...]]:
        return {}

    def _jerks(self, k: int) -> tuple[Number, ...]:
        """Third derivatives at the knots of a spline after the first one."""
        last = self.cam.ends[k].jerk if self.cam.moves[k].open_end else self.end(k).jerk
        return *self.cam.jerks[k], last

    def after(self, k: int, before: CamState, jerk: Number) -> CamState:
        """CamState at the next knot of a spline, from that at a knot and the third derivative at the next one."""
        h = self.cam.turns[k] / self.cam.moves[k].intervals
        s, v, a, p = before
        return CamState(
            s + h * v + h * h * a / 2 + h**3 * (3 * p + jerk) / 24,
            v + h * a + h * h * (2 * p + jerk) / 6,
            a + h * (p + jerk) / 2,
            jerk,
        )

    def followed(self, k: int) -> tuple[CamState, ...]:
        """States at the knots of a spline after the first one, each from the known state before it."""
        known = (self.begin(k), *self.spline(k)[:-1])
        return tuple(self.after(k, before, jerk) for before, jerk in zip(known, self._jerks(k), strict=True))

    def gaps(self, k: int) -> dict[str, Number]:
        """Differences of the end of a spline from the state that it must reach, by name of the derivative."""
        reached, end = self.spline(k)[-1], self.end(k)
        names = ("angle", "slope") if self.cam.moves[k].open_end else ("angle", "slope", "bend")
        return {name: getattr(reached, name) - getattr(end, name) for name in names}

    @lazy
    def _polynomial(self) -> tuple[Number, ...]:
        """Bernstein's coefficients of the septic; () where no move is one."""
        cam, level, turn = self.cam, list[Number](), list[Number]()
        if all(move.law != "" for move in cam.moves):
            return ()
        first, last = list[CamState](), list[CamState]()
        for k, piece in cam.stretches:
            move = cam.moves[k]
            level.append(cam.level(k))
            turn.append(cam.turns[k] / move.intervals)
            if move.law != "":
                first.append(CamState(level[-1]))
                last.append(CamState(level[-1]))
                turn[-1] = 1
                continue
            knots = (self.begin(k), *self.spline(k)) if move.intervals > 1 else (self.begin(k), self.end(k))
            first.append(knots[piece])
            last.append(knots[piece + 1])
        begin, end = (
            CamState(*(self._by_stretch(column, 0) for column in zip(*states, strict=True))) for states in (first, last)
        )
        return _coefficients(begin, end, self._by_stretch(level, 0), self._by_stretch(turn, 1))

    def angle(self, order: int) -> Number:
        """Follower's angle from the first dwell, or a derivative of it."""
        share, grow = self._share
        terms = [travel * law[order] for travel, law in self._laws]
        if self._polynomial:
            terms.append(_bernstein(self._polynomial, share, order))
        total = terms[0] if len(terms) == 1 else sum(terms[1:], terms[0])
        for _ in range(order):
            total = total * grow
        return total if order else self._base + total


def _coefficients(first: CamState, last: CamState, base: Number, turn: Number) -> tuple[Number, ...]:
    """Bernstein's coefficients of the septic between two states, from `base`."""
    v0, a0, j0 = first.slope * turn / 7, first.bend * turn**2 / 42, first.jerk * turn**3 / 210
    v1, a1, j1 = last.slope * turn / 7, last.bend * turn**2 / 42, last.jerk * turn**3 / 210
    low, high = first.angle - base, last.angle - base
    return (
        low,
        low + v0,
        low + 2 * v0 + a0,
        low + 3 * v0 + 3 * a0 + j0,
        high - 3 * v1 + 3 * a1 - j1,
        high - 2 * v1 + a1,
        high - v1,
        high,
    )


def _bernstein(coefficients: Sequence[Number], share: Number, order: int) -> Number:
    """A polynomial in Bernstein's form, or a derivative of it with respect to the share."""
    factor, degree = math.perm(len(coefficients) - 1, order), len(coefficients) - 1 - order
    for _ in range(order):
        coefficients = [after - before for before, after in itertools.pairwise(coefficients)]
    rest = 1 - share
    value = coefficients[0] * rest**degree + coefficients[-1] * share**degree
    for k in range(1, degree):
        value = value + math.comb(degree, k) * coefficients[k] * share**k * rest ** (degree - k)
    return factor * value
