"""A body that a cam throws: where it flies and lands by SciPy's integrator, and what no flight may break."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from loomopt.physics.motion.flight import TURN, Cam, follow
from loomopt.physics.motion.free import Body, Moving, Zone

OMEGA, STROKE = 50.0, 0.04
SOFT = Zone(1500.0, 30.0)
BODIES = {
    "spring alone": Body(3.0, 0.0, 0.0, (), (SOFT,)),
    "weight alone": Body(3.0, 0.0, 0.0, (), (Zone(0.0, 90.0),)),
    "damped": Body(3.0, 25.0, 0.0, (), (SOFT,)),
    "overdamped": Body(3.0, 150.0, 0.0, (), (Zone(1000.0, 5.0),)),
    "a stiffer spring farther up": Body(3.0, 0.0, 0.0, (0.042,), (SOFT, Zone(8000.0, 30.0 - 6500.0 * 0.042))),
    "damped, stiffer farther up": Body(3.0, 8.0, 0.0, (0.041,), (SOFT, Zone(3000.0, 30.0 - 1500.0 * 0.041))),
}
every = pytest.mark.parametrize("body", BODIES.values(), ids=list(BODIES))


def face(angle):
    """Return the motion of an eccentric's face: stroke/2 (1 − cos φ)."""
    half = STROKE / 2
    return Moving(half * (1 - math.cos(angle)), half * OMEGA * math.sin(angle), half * OMEGA**2 * math.cos(angle))


def back(body, x, v):
    """Return what holds a body back, N."""
    return body.rest(sum(x > corner for corner in body.corners), x) + body.damping * v


def pushed(body, angle):
    """Return the force with which the cam pushes a body that is held on it, N."""
    at = face(angle)
    return body.mass * at.a + back(body, at.x, at.v)


def cam_of(body):
    """Return the eccentric with the stretches where it would have to pull."""
    angles = np.linspace(0, TURN, 2001)
    force = [pushed(body, angle) for angle in angles]
    ends = [k for k in range(2000) if (force[k] < 0) != (force[k + 1] < 0)]
    roots = [brentq(lambda angle: pushed(body, angle), angles[k], angles[k + 1], xtol=1e-15) for k in ends]
    pulls = tuple(zip(roots[::2], roots[1::2], strict=True))
    return Cam(OMEGA, face, STROKE / 2 * OMEGA, STROKE / 2 * OMEGA**2, STROKE, pulls)


def course(body, restitution=0.0, turns=30):
    result = follow(body, cam_of(body), restitution, turns)
    assert result.parted
    return result


def flown(body, begin):
    """Return where a body that leaves the cam at an angle lands, its relative speed there and the largest gap."""

    def slope(t, y):
        return [y[1], -back(body, *y) / body.mass]

    def gap(t, y):
        return y[0] - face(begin + OMEGA * t).x

    def parting(t, y):
        return y[1] - face(begin + OMEGA * t).v

    landing: Any = gap
    landing.terminal, landing.direction = True, -1
    t, state, largest, end = 0.0, [face(begin).x, face(begin).v], 0.0, 2 * TURN / OMEGA
    while True:
        place = sum(state[0] > corner or (state[0] == corner and state[1] > 0) for corner in body.corners)
        corners: list[Any] = [lambda t, y, at=at: y[0] - at for at in body.corners[max(place - 1, 0) : place + 1]]
        for item in corners:
            item.terminal = True
        done = solve_ivp(slope, (t, end), state, "DOP853", events=(gap, parting, *corners), rtol=1e-13, atol=1e-16)
        largest = max([largest, *(gap(at, y) for at, y in zip(done.t_events[1], done.y_events[1], strict=True))])
        t, state = done.t[-1], done.y[:, -1]
        if len(done.t_events[0]) and t > 1e-6:
            return begin + OMEGA * t, parting(t, state), largest
        assert t < end, "it does not land"
        t, state = t + 1e-12, state + 1e-12 * np.array(slope(t, state))


@every
def test_a_flight_ends_where_an_integrator_says(body):
    second_course = course(body)
    begin, end = second_course.first
    angle, speed, largest = flown(body, begin)
    assert pushed(body, begin) == pytest.approx(0.0, abs=1e-9 * body.mass * STROKE * OMEGA**2)
    assert end == pytest.approx(angle, abs=1e-9)
    assert second_course.first_landing.speed == pytest.approx(speed, rel=1e-8)
    assert second_course.gap_max == pytest.approx(largest, rel=1e-8)


@every
@pytest.mark.parametrize("restitution", [0.0, 0.4])
def test_a_body_is_never_inside_its_cam_and_never_jumps(body, restitution):
    second_course = course(body, restitution)
    landings = {landing.angle for turn in second_course.turns for landing in turn.landings}
    for turn in second_course.turns:
        assert (turn.stretches[0].begin, turn.stretches[-1].end) == (0.0, TURN)
        for stretch in turn.stretches:
            if stretch.piece:
                angles = np.linspace(stretch.begin, stretch.end, 50)
                gaps = [second_course.free(stretch, angle).x - face(angle).x for angle in angles]
                assert min(gaps) > -1e-12 * STROKE
        for item, other in itertools.pairwise(turn.stretches):
            assert item.end == other.begin
            if item.piece and other.piece:
                before, after = second_course.free(item, item.end), second_course.free(other, item.end)
                assert before.x == pytest.approx(after.x, abs=1e-12)
                if item.end not in landings:
                    assert before.v == pytest.approx(after.v, abs=1e-9)


@every
def test_on_the_cam_nothing_has_to_pull(body):
    second_course = course(body)
    largest = max(abs(pushed(body, angle)) for angle in np.linspace(0, TURN, 50))
    for stretch in (stretche for turn in second_course.turns for stretche in turn.stretches if not stretche.piece):
        forces = [pushed(body, angle) for angle in np.linspace(stretch.begin, stretch.end, 200)]
        assert min(forces) > -1e-9 * largest


@every
@pytest.mark.parametrize("restitution", [0.2, 0.6])
def test_a_landing_turns_the_relative_speed_round_by_the_restitution(body, restitution):
    second_course = course(body, restitution)
    counted = 0
    for turn in second_course.turns:
        flights = {stretch.begin: stretch for stretch in turn.stretches if stretch.piece}
        for landing in turn.landings:
            if landing.flies and landing.angle in flights:
                away = second_course.free(flights[landing.angle], landing.angle).v - face(landing.angle).v
                if away > 0.0:  # else the cam falls away from under it
                    assert away == pytest.approx(-restitution * landing.speed, rel=1e-9)
                    counted += 1
    assert counted


@pytest.mark.parametrize("name", ["spring alone", "weight alone", "a stiffer spring farther up"])
def test_without_damping_a_flight_keeps_its_energy(name):
    body = BODIES[name]
    second_course = course(body)

    def energy(at):
        stored = body.zones[0].stiffness * at.x**2 / 2 + body.zones[0].force * at.x
        beyond = [at.x - corner for corner in body.corners if at.x > corner]
        more = sum((body.zones[1].stiffness - body.zones[0].stiffness) * item**2 / 2 for item in beyond)
        return body.mass * at.v**2 / 2 + stored + more

    begin, end = second_course.first
    flights = [s for s in second_course.turns[0].stretches if s.piece and begin <= s.begin < end]
    values = [energy(second_course.free(s, angle)) for s in flights for angle in np.linspace(s.begin, s.end, 20)]
    assert values == pytest.approx([values[0]] * len(values), rel=1e-12)


def test_a_body_held_by_enough_never_leaves_and_repeats_at_once():
    body = Body(3.0, 0.0, 0.0, (), (Zone(1500.0, 1.1 * 3.0 * STROKE / 2 * OMEGA**2),))
    result = follow(body, cam_of(body), 0.0, 30)
    assert not result.parted
    assert (result.period, len(result.turns), result.first_landing) == (1, 1, None)


def test_a_harder_spring_brings_a_body_back_sooner_and_lower():
    flights = [course(Body(3.0, 0.0, 0.0, (), (Zone(k, 30.0),))) for k in (500.0, 1000.0, 1500.0)]
    begins, ends = zip(*(flight.first for flight in flights), strict=True)
    assert list(begins) == sorted(begins), "it is held on longer"
    assert list(ends) == sorted(ends, reverse=True)
    tops = [flight.gap_max for flight in flights]
    assert tops == sorted(tops, reverse=True)
