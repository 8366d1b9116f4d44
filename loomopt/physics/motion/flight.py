"""A body that a cam pushes: where it leaves the cam, how it flies, where it lands. Every piece is in closed form.

x: position, m, with the cam at x_c; the gap x − x_c is never negative. In flight the motion is linear piece by piece
(motion/free.py), so no equation is integrated step by step. A piece ends at a landing, at a corner of x or where the
motion reverses. Its end is located by steps that contain no root, by a bound on the second derivative. In contact the
body is at x_c, and it leaves when the contact force falls below zero.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from loomopt.maths.turning_points import crossing
from loomopt.physics.motion.free import Body, FreePiece, Moving, bound, safe, unhindered

TURN = 2 * math.pi
CHATTER = 1e-6
"""Share of the cam's largest speed below which there is no rebound: hops of 1e-9 are below the rounding of x."""
REPEATED = 1e-9
"""Share of the stroke, and of the stroke times the cam's speed, by which two states may differ and be one."""
LEAST_STEP = 1e-15
"""Share of a turn that counts as no time: rounding of the angle; hops above CHATTER take 1e-6 of a turn."""
MOST_PIECES = 100_000
"""Pieces of flight in one turn beyond which it does not end: of a restitution of 0.9999 1.4e5 hops are left."""
GAP_SAMPLES = 720
"""Samples of one turn between which the tops of the gap are refined."""


@dataclass(frozen=True)
class Cam:
    """Cam that pushes a body. omega, rad/s; motion(angle) of its surface, angle in [0, 2π].

    fastest, hardest: its largest |speed|, m/s, and |acceleration|, m/s²; stroke, m; pulls: stretches (begin, end) of
    the turn, rad, over which a body held on it would have to be pulled.
    """

    omega: float
    motion: Callable[[float], Moving]
    fastest: float
    hardest: float
    stroke: float
    pulls: tuple[tuple[float, float], ...]


class FlightState(NamedTuple):
    """Of a body in flight: position, m, and speed, m/s."""

    x: float
    v: float


class Stretch(NamedTuple):
    """Part of a turn, rad: in flight by a piece, or on the cam without one."""

    begin: float
    end: float
    piece: FreePiece | None


class Landing(NamedTuple):
    """Angle in the turn, rad, and relative speed before, m/s, negative; whether the body flies on."""

    angle: float
    speed: float
    flies: bool


@dataclass(frozen=True)
class FlightTurn:
    """Turn of the cam: intervals of contact and flight in order, separations, landings, and the state at its end."""

    stretches: tuple[Stretch, ...]
    lifts: tuple[float, ...]
    landings: tuple[Landing, ...]
    end: FlightState | None


@dataclass(frozen=True)
class Course:
    """All turns from contact at angle 0 on until the state repeats; period: in turns, None where it does not."""

    body: Body
    cam: Cam
    turns: tuple[FlightTurn, ...]
    period: int | None

    @property
    def periodic(self) -> tuple[FlightTurn, ...]:
        """Turns of one period, or the last turn if the motion is not periodic."""
        return self.turns[-(self.period or 1) :]

    @property
    def parted(self) -> bool:
        """Whether contact is ever lost."""
        return any(turn.lifts for turn in self.turns)

    @property
    def first(self) -> tuple[float, float | None]:
        """Angles where the first flight begins and ends, rad from the start; None where it never lands."""
        begun, lift = next((k, turn.lifts[0]) for k, turn in enumerate(self.turns) if turn.lifts)
        landed = ((k, landing) for k, turn in enumerate(self.turns) for landing in turn.landings)
        end = next(((k, landing) for k, landing in landed if (k, landing.angle) > (begun, lift)), None)
        return TURN * begun + lift, TURN * end[0] + end[1].angle if end else None

    @property
    def first_landing(self) -> Landing | None:
        """The landing that ends the first flight."""
        return next((landing for turn in self.turns for landing in turn.landings), None)

    @property
    def gap_max(self) -> float:
        """The largest gap of the first flight, m."""
        begin, end = self.first
        largest = 0.0
        for k, turn in enumerate(self.turns):
            for stretch in turn.stretches:
                if stretch.piece and begin <= TURN * k + (stretch.begin + stretch.end) / 2 <= (end or math.inf):
                    largest = max(largest, self._highest(stretch))
        return largest

    def _highest(self, stretch: Stretch) -> float:
        """Largest gap within a stretch of flight, m: where the gap's speed changes its sign."""

        def parting(angle: float) -> float:
            return self.free(stretch, angle).v - self.cam.motion(angle).v

        count = 2 + math.ceil((stretch.end - stretch.begin) / TURN * GAP_SAMPLES)
        angles = [stretch.begin + (stretch.end - stretch.begin) * k / count for k in range(count + 1)]
        speeds = list(map(parting, angles))
        tops = [stretch.begin, stretch.end]
        highest = [k for k in range(count) if speeds[k] > 0.0 >= speeds[k + 1]]
        tops += [crossing(lambda angle: -parting(angle), angles[k], angles[k + 1]) for k in highest]
        return max(self.free(stretch, angle).x - self.cam.motion(angle).x for angle in tops)

    def free(self, stretch: Stretch, angle: float) -> Moving:
        """Body's motion at an angle of a stretch in flight."""
        assert stretch.piece
        return stretch.piece.at((angle - stretch.piece.begin) / self.cam.omega)


def follow(body: Body, cam: Cam, restitution: float, turns: int) -> Course:
    """Motion of a body in contact at angle 0, until its state there repeats; turns: the most that are followed.

    Raises ArithmeticError where a turn does not end in a reasonable number of pieces.
    """
    states: list[FlightState | None] = [None]
    course: list[FlightTurn] = []
    rule = _Rule(body, cam, restitution)
    while len(course) < turns:
        course.append(rule.turn(states[-1]))
        end = course[-1].end
        alike = [k for k, state in enumerate(states) if _same(state, end, cam)]
        states.append(end)
        if alike:
            return Course(body, cam, tuple(course), len(course) - alike[-1])
    return Course(body, cam, tuple(course), None)


def _same(first: FlightState | None, second: FlightState | None, cam: Cam) -> bool:
    """Whether two states are equal."""
    if first is None or second is None:
        return first is second
    near = abs(first.x - second.x) <= REPEATED * cam.stroke
    return near and abs(first.v - second.v) <= REPEATED * cam.stroke * cam.omega


@dataclass
class _Rule:
    """Map of a turn: state at its beginning → turn."""

    body: Body
    cam: Cam
    restitution: float

    def turn(self, state: FlightState | None) -> FlightTurn:
        """Turn from a state, None for contact."""
        angle, stretches, lifts, landings = 0.0, list[Stretch](), list[float](), list[Landing]()
        blind = 0.0
        for _ in range(MOST_PIECES):
            if state is None:
                begin, end = self._pull(angle)
                if angle < min(begin, TURN):
                    stretches.append(Stretch(angle, min(begin, TURN), None))
                if begin >= TURN:
                    return FlightTurn(tuple(stretches), tuple(lifts), tuple(landings), None)
                angle = max(begin, angle)
                lifts.append(angle)
                there = self.cam.motion(angle)
                state, blind = FlightState(there.x, there.v), self._blind(angle, end)
            piece = self._piece(angle, state)
            time, how = self._ends(piece, blind)
            end_angle, at = min(angle + self.cam.omega * time, TURN), piece.at(time)
            end_angle = TURN if how == "turn" else end_angle
            stretches.append(Stretch(angle, end_angle, piece))
            blind = max(0.0, blind - time)
            angle, state = end_angle, FlightState(at.x, at.v)
            if how == "turn":
                return FlightTurn(tuple(stretches), tuple(lifts), tuple(landings), state)
            if how == "landing":
                state, blind, landing = self._landed(angle, state)
                landings.append(landing)
            elif how == "rest":
                state = FlightState(at.x, 0.0)
            else:
                state = FlightState(self.body.corners[int(how)], at.v)
        raise ArithmeticError(f"more than {MOST_PIECES} pieces of flight in one turn")

    def _pull(self, angle: float) -> tuple[float, float]:
        """Next stretch in which nothing holds the body on the cam; it may have begun."""
        return next((pull for pull in self.cam.pulls if pull[1] > angle), (TURN, TURN))

    def _blind(self, angle: float, end: float) -> float:
        """Time, s, after leaving without relative speed at `angle` during which no landing is possible.

        The gap g obeys M g̈ + C ġ + k g = −N, with N < 0 the force that would hold the body on the cam: it grows until N
        is positive again or, at the earliest, a quarter of a period has passed.
        """
        return min((end - angle) / self.cam.omega, self.body.quarter)

    def _landed(self, angle: float, state: FlightState) -> tuple[FlightState | None, float, Landing]:
        """State after a landing, how long no landing can follow, and the landing."""
        cam = self.cam.motion(angle)
        speed = min(state.v - cam.v, 0.0)
        rebound = -self.restitution * speed
        if rebound > CHATTER * self.cam.fastest:
            return FlightState(cam.x, cam.v + rebound), 0.0, Landing(angle, speed, True)
        begin, end = self._pull(angle)
        if begin <= angle:
            return FlightState(cam.x, cam.v), self._blind(angle, end), Landing(angle, speed, True)
        return None, 0.0, Landing(angle, speed, False)

    def _piece(self, angle: float, state: FlightState) -> FreePiece:
        """Free motion from a state."""
        body = self.body
        zone = sum(state.x > corner or (state.x == corner and state.v > 0.0) for corner in body.corners)
        back = body.rest(zone, state.x)
        stuck = state.v == 0.0 and abs(back) <= body.friction and body.friction > 0.0
        sign = int(math.copysign(1.0, state.v or -back)) if body.friction > 0.0 else 0
        push = -(back + sign * body.friction) / body.mass
        sigma, kappa = body.damping / (2 * body.mass), body.zones[zone].stiffness / body.mass
        return FreePiece(angle, state.x, state.v, zone, sign, sigma, kappa, push, stuck)

    def _ends(self, piece: FreePiece, blind: float) -> tuple[float, str]:
        """Duration of a piece, s, and its end: "landing", "rest", a corner's number, or the "turn"."""
        omega = self.cam.omega
        last, time = (TURN - piece.begin) / omega, 0.0
        least = LEAST_STEP * TURN / omega
        while time < last:
            free = piece.at(time)
            until = [(last - time, "turn"), *unhindered(piece, free, self.body, last - time)]
            if time >= blind:
                cam = self.cam.motion(min(piece.begin + omega * time, TURN))
                bend = bound(piece, free, last - time) + self.cam.hardest
                until.append((safe(free.x - cam.x, free.v - cam.v, bend), "landing"))
            else:
                until.append((blind - time, ""))
            step, how = min(until)
            if step <= least and how:
                return (last if how == "turn" else time), how
            time = min(time + max(step, least), last)
        return last, "turn"
