"""Free motion of a body in closed form: the force on it is linear in position and speed in each zone.

M ẍ + C ẋ + k x + f + F sgn ẋ = 0        k, f: one pair between corners of x; at rest it stays while |k x + f| <= F
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

SERIES_REACH, SERIES_TERMS = 1.0, 26
"""Time, over the shorter of period and decay, up to which a power series gives the response, and its terms: 1/25! is
1e-25. Beyond it closed forms lose no more than a digit."""


class Zone(NamedTuple):
    """Resistance between two corners of the body's position: stiffness · x + force, N/m and N."""

    stiffness: float
    force: float


@dataclass(frozen=True)
class Body:
    """Body in free motion. mass, kg; damping, N·s/m; friction, N; zones between the corners of x, m, ascending."""

    mass: float
    damping: float
    friction: float
    corners: tuple[float, ...]
    zones: tuple[Zone, ...]

    def rest(self, zone: int, x: float) -> float:
        """Force that holds the body back at rest, N."""
        return self.zones[zone].stiffness * x + self.zones[zone].force

    @property
    def quarter(self) -> float:
        """A quarter of the shortest period of oscillation, s."""
        stiffest = max(zone.stiffness for zone in self.zones)
        return math.pi / 2 * math.sqrt(self.mass / stiffest) if stiffest > 0.0 else math.inf


class Moving(NamedTuple):
    """Position, m, and its derivatives with respect to time, m/s and m/s²."""

    x: float
    v: float
    a: float


class Response(NamedTuple):
    """Response to a unit step of force per mass and to a unit speed after a time: w; s = ẇ."""

    step: float
    speed: float


def response(sigma: float, kappa: float, time: float) -> Response:
    """w, s², and s = ẇ, s, of ẅ + 2 sigma ẇ + kappa w = 1 from rest; sigma, 1/s, and kappa, 1/s², >= 0.

    Under-, over- and critically damped and without a spring, without loss of digits between them.
    """
    rate = max(2 * sigma, math.sqrt(kappa))
    if rate * time <= SERIES_REACH:
        return _series(sigma, kappa, time)
    square = sigma * sigma - kappa
    root = math.sqrt(abs(square))
    if square > 0.0 and root > sigma / 2:  # well overdamped: two decays, the slow one without cancellation
        slow, fast = -kappa / (sigma + root), -(sigma + root)
        slowly = math.expm1(slow * time) / slow if slow else time
        step = (slowly - math.expm1(fast * time) / fast) / (2 * root)
        return Response(step, math.exp(slow * time) * -math.expm1(-2 * root * time) / (2 * root))
    if square > 0.0:
        slow, fast = math.exp((root - sigma) * time), math.exp(-(root + sigma) * time)
        even, speed = (slow + fast) / 2, slow * -math.expm1(-2 * root * time) / (2 * root)
    else:
        decay = math.exp(-sigma * time)
        even, speed = decay * math.cos(root * time), decay * (math.sin(root * time) / root if root else time)
    return Response((1.0 - even - sigma * speed) / kappa, speed)


def _series(sigma: float, kappa: float, time: float) -> Response:
    """Response soon after, by its power series: where closed forms lose digits."""
    before, last = 0.0, time * time / 2
    step, speed = last, time
    for n in range(3, SERIES_TERMS):
        before, last = last, -(2 * sigma * (n - 1) * last * time + kappa * before * time * time) / (n * (n - 1))
        step, speed = step + last, speed + n * last / time if time else 0.0
    return Response(step, speed)


@dataclass(frozen=True)
class FreePiece:
    """Free motion under one formula from a turn's angle `begin`, rad, on: linear, or at rest where it sticks.

    sign: which way friction takes it to move; push: acceleration at the beginning but for damping, m/s².
    """

    begin: float
    x: float
    v: float
    zone: int
    sign: int
    sigma: float
    kappa: float
    push: float
    stuck: bool = False

    def at(self, time: float) -> Moving:
        """Motion some time, s, after the beginning."""
        if self.stuck:
            return Moving(self.x, 0.0, 0.0)
        step, speed = response(self.sigma, self.kappa, time)
        rate = 1.0 - 2 * self.sigma * speed - self.kappa * step
        moved = self.v * speed + self.push * step
        v = self.v * rate + self.push * speed
        return Moving(self.x + moved, v, self.push - 2 * self.sigma * v - self.kappa * moved)

    def jerk(self, at: Moving) -> float:
        """Third derivative, m/s³, at a motion that is this piece's."""
        return -2 * self.sigma * at.a - self.kappa * at.v


def unhindered(piece: FreePiece, at: Moving, body: Body, left: float) -> Iterator[tuple[float, str]]:
    """Yield for how long, s, the formula surely holds: until the motion turns under friction, and at each corner."""
    if piece.stuck:
        return
    bend, twist = bound(piece, at, left), math.hypot(piece.jerk(at), math.sqrt(piece.kappa) * at.a)
    if piece.sign:
        yield safe(piece.sign * at.v, piece.sign * at.a, twist), "rest"
    for place in (piece.zone - 1, piece.zone):
        if 0 <= place < len(body.corners):
            side = 1.0 if place < piece.zone else -1.0
            away, rate = side * (at.x - body.corners[place]), side * at.v
            if away <= 0.0 == rate and side * at.a > 0.0:  # it sets out from the corner itself
                yield 3 * abs(at.a) / twist if twist > 0.0 else math.inf, str(place)
            else:
                yield safe(away, rate, bend), str(place)


def bound(piece: FreePiece, at: Moving, left: float) -> float:
    """Bound of |ẍ| during the time left, s: neither ẍ² + x⃛²/kappa nor x⃛² + kappa ẍ² ever grows."""
    if piece.stuck:
        return 0.0
    jerk = piece.jerk(at)
    bounds = [abs(at.a) + math.hypot(jerk, math.sqrt(piece.kappa) * at.a) * left]
    if piece.kappa > 0.0:
        bounds.append(math.hypot(at.a, jerk / math.sqrt(piece.kappa)))
    return min(bounds)


def safe(value: float, slope: float, bend: float) -> float:
    """Time during which value + slope t − bend t²/2 is positive: 0 for a value that is not, unless it grows."""
    if value <= 0.0 and slope <= 0.0:
        return 0.0
    value = max(value, 0.0)
    root = math.sqrt(slope * slope + 2 * bend * value)
    if slope < 0.0:
        return 2 * value / (root - slope)
    return (slope + root) / bend if bend > 0.0 else math.inf
