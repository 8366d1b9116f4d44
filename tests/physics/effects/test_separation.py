"""Separation: the reference figures by two more methods, landings, rebounds, periods, energy, and what is refused."""

import itertools
import math

import numpy as np
import pytest
from flying_frames import CASES, JOB, ON, RPM, RUBBED, SLOW, SOFT, every, figures, followed

import loomopt as lo
from loomopt.physics.effects.shedding import inertia, separation
from reference.flight import MP, Frame, flown, landed


@pytest.mark.slow
@every
def test_the_first_flight_is_that_of_the_reference(case):
    scene, _, lift, landing, speed, gap = CASES[case]
    second_figures = figures(scene)
    assert math.degrees(second_figures["lift_off"]) == pytest.approx(lift, rel=1e-12)
    assert math.degrees(second_figures["landing"]) == pytest.approx(landing, rel=1e-12)
    assert second_figures["landing_speed"] == pytest.approx(speed, rel=1e-9)
    assert second_figures["gap_max"] == pytest.approx(gap, rel=1e-9)
    mass = scene.effect_table(inertia.Parameters).M
    assert second_figures["landing_energy"] == pytest.approx(mass * speed**2 / 2, rel=1e-9)


@pytest.mark.few(2)
@every
def test_scipys_integrator_with_events_says_the_same(case):
    scene, frame, lift, *_ = CASES[case]
    result, begun = figures(scene), float(frame.lift_off(math.radians(lift)))
    landing, speed, gap = flown(frame, begun, frame.cam(begun)[1])
    assert (result["lift_off"], result["landing"]) == pytest.approx((begun, landing), rel=1e-10)
    assert (result["landing_speed"], result["gap_max"]) == pytest.approx((speed, gap), rel=1e-8)


@every
def test_roots_in_thirty_digits_say_the_same(case):
    scene, frame, lift, end, *_ = CASES[case]
    result, begun = figures(scene), frame.lift_off(math.radians(lift))
    landing, speed = landed(frame, begun, MP.mpf(end) * MP.pi / 180)
    assert result["lift_off"] == pytest.approx(float(begun), rel=1e-13)
    assert result["landing"] == pytest.approx(float(landing), rel=1e-13)
    assert result["landing_speed"] == pytest.approx(float(speed), rel=1e-10)


def test_damping_and_friction_slow_the_flight_as_scipy_says():
    frame = Frame(8029.14, 600 * RPM, C=35.0, F=20.0)
    result, begun = figures(RUBBED), float(frame.lift_off(math.radians(60.96)))
    landing, speed, gap = flown(frame, begun, frame.cam(begun)[1])
    assert (result["lift_off"], result["landing"]) == pytest.approx((begun, landing), rel=1e-10)
    assert (result["landing_speed"], result["gap_max"]) == pytest.approx((speed, gap), rel=1e-8)


def test_the_next_landings_at_200_rpm():
    turn = followed(SLOW).turns[0]
    second, third = turn.landings[1:3]
    assert math.degrees(second.angle) == pytest.approx(201.7423233641, rel=1e-12)
    assert second.speed == pytest.approx(-0.0259509742043, rel=1e-10)
    assert math.degrees(third.angle) == pytest.approx(277.4372825307, rel=1e-12)
    assert third.speed == pytest.approx(-0.947855456472, rel=1e-11)


def test_every_later_flight_is_what_scipy_makes_of_the_rebound_before_it():
    frame, turn = Frame(8029.14, 200 * RPM), followed(SLOW).turns[0]
    for before, after in zip(turn.landings[:4], turn.landings[1:5], strict=True):
        cam = frame.cam(before.angle)[1]
        landing, speed, _ = flown(frame, before.angle, cam - 0.3 * before.speed)
        assert (landing, speed) == pytest.approx((after.angle, after.speed), rel=1e-8)


def test_the_optimum_never_lifts_off():
    answer = lo.solve(ON, starts=1)
    without = lo.solve(ON.without_effect("separation"), starts=1)
    assert (answer.status, answer.design) == ("optimal", without.design)
    assert answer.design["K1"] == pytest.approx(102602.60942536, rel=1e-10)
    names = [figure.name for figure in separation.EFFECT.figures]
    assert [answer.figures[name] for name in names] == [None] * 7
    assert answer.today.figures["landing_energy"] == pytest.approx(303.3409301778, rel=1e-10)
    assert figures(ON.set("mechanism.K1", "102602.60942536 N/m"))["period"] is None, "nor does it as printed"
    assert figures(SOFT)["landings"] > 0


def test_the_papers_spring_without_restitution_lands_once_in_two_turns():
    second_figures = figures(ON.set("effects.separation.restitution", 0))
    assert (second_figures["period"], second_figures["landings"]) == (2, 1)
    assert second_figures["landing_speed"] == pytest.approx(-4.0124, abs=1e-4)
    assert second_figures["landing_energy"] == pytest.approx(303, abs=1)


def test_a_motion_that_does_not_repeat_says_so():
    scene = SLOW.update({"effects.separation.restitution": 0.99, "effects.separation.turns": 12})
    second_figures = figures(scene)
    assert (second_figures["period"], second_figures["landings"]) == (None, None)
    assert second_figures["lift_off"] is not None
    assert any("not periodic in 12 turns" in text for text in JOB.views.remarks(scene, {}))
    assert lo.simulate(scene)["phi [rad]"].max() == pytest.approx(2 * math.pi)


def energy(frame, x, v):
    """Return kinetic energy and that of spring, weight and warp: the integral of what holds the frame back."""
    half = frame.travel / 2
    stretched = frame.K1 * ((x + frame.X0) ** 2 - frame.X0**2) / 2 - frame.G * x
    warp = (frame.T1 if x < half else frame.T2) * (x - half) ** 2 / frame.travel
    return frame.M * v**2 / 2 + stretched + warp


@pytest.mark.parametrize("case", ["600 rpm", "200 rpm"])
def test_energy_stays_the_same_in_flight_without_damping(case):
    scene, frame, *_ = CASES[case]
    course, count = followed(scene), 0
    for turn in course.turns[:2]:
        flight: list[float] = []
        for stretch in turn.stretches:
            if stretch.piece:
                angles = np.linspace(stretch.begin, stretch.end, 7)
                flight += [energy(frame, *course.free(stretch, float(angle))[:2]) for angle in angles]
            if not stretch.piece or stretch.end in {landing.angle for landing in turn.landings}:
                count += bool(flight)
                assert not flight or np.ptp(flight) <= 1e-12 * max(map(abs, flight))
                flight = []
    assert count > 0


def relative(course, stretch, angle):
    return course.free(stretch, angle).v - course.cam.motion(angle).v


def test_a_landing_loses_what_the_restitution_leaves_of_its_energy():
    course = followed(SLOW)
    (turn,), e = course.turns, 0.3
    flights = {stretch.begin: stretch for stretch in turn.stretches if stretch.piece}
    for landing in turn.landings[:-1]:
        after = relative(course, flights[landing.angle], landing.angle)
        lost = course.body.mass * (landing.speed**2 - after**2) / 2
        assert lost == pytest.approx(course.body.mass * (1 - e**2) * landing.speed**2 / 2, rel=1e-12)
    last = turn.landings[-1]
    assert 0.3 * abs(last.speed) < 1e-6 * course.cam.fastest <= 0.3 * abs(turn.landings[-2].speed)


def gauss(function, begin, end, parts=24):
    nodes, weights = np.polynomial.legendre.leggauss(16)
    edges = np.linspace(begin, end, parts + 1)
    pairs = itertools.pairwise(edges)
    return sum(
        (b - a) / 2 * np.dot(weights, [function((a + b) / 2 + (b - a) / 2 * n) for n in nodes]) for a, b in pairs
    )


@pytest.mark.parametrize(
    ("scene", "frame"),
    [(SLOW, Frame(8029.14, 200 * RPM)), (RUBBED, Frame(8029.14, 600 * RPM, C=35.0, F=20.0))],
    ids=["restitution alone", "damping and friction"],
)
def test_over_a_period_the_cam_does_as_much_work_as_is_lost(scene, frame):
    """In contact N X˙_cam, at a landing the blow M (X˙⁺ − X˙⁻) X˙_cam; lost at landings, by damping and by friction."""
    course, w = followed(scene), frame.speed
    corners = [math.radians(angle) for angle in (0, 60, 120, 180, 240, 300, 360)]
    work = lost = 0.0
    for turn in course.periodic:
        for stretch in turn.stretches:
            inner = [angle for angle in corners if stretch.begin < angle < stretch.end]
            ends = [stretch.begin, *inner, stretch.end]
            for begin, end in itertools.pairwise(ends):
                if not stretch.piece:
                    work += gauss(lambda t: frame.force(t) * frame.cam(t)[1] / w, begin, end)

                def rate(angle, stretch=stretch):
                    return course.free(stretch, angle).v if stretch.piece else frame.cam(angle)[1]

                lost += gauss(lambda t: (frame.C * rate(t) ** 2 + frame.F * abs(rate(t))) / w, begin, end)
        for landing in turn.landings:
            e = 0.3 if landing.flies else 0.0
            work += frame.M * -(1 + e) * landing.speed * frame.cam(landing.angle)[1]
            lost += frame.M * (1 - e**2) * landing.speed**2 / 2
    assert work == pytest.approx(lost, rel=1e-9)


def rough(speed):
    """Return a slack frame in rough guides: friction holds it wherever it comes to rest."""
    changes = {"effects.dry_friction.F": "300 N", "mechanism.K1": "1000 N/m", "effects.weight.G": "0 N"}
    return ON.without_effect("warp_tension").update(changes | {"operation.speed": speed})


def test_the_frame_sticks_where_friction_holds_it_until_its_cam_is_back():
    course = followed(rough("60 rpm"))
    (stuck,) = [stretch for stretch in course.turns[0].stretches if stretch.piece and stretch.piece.stuck]
    assert math.degrees(stuck.begin) == pytest.approx(180, rel=1e-12)
    assert (course.free(stuck, stuck.end).x, course.period) == (0.0656, 1)
    second_figures = figures(rough("60 rpm"))
    assert math.degrees(second_figures["lift_off"]) == pytest.approx(180, rel=1e-12)
    assert math.degrees(second_figures["landing"]) == pytest.approx(480, abs=1e-3), "where the cam is down again"
    assert (second_figures["gap_max"], second_figures["landings"]) == (pytest.approx(0.0656, rel=1e-12), 1)


def test_a_frame_that_sticks_beyond_its_cam_never_lands():
    second_figures = figures(rough("200 rpm"))
    assert second_figures["gap_max"] > 0.0656
    assert (
        second_figures["landing"],
        second_figures["landing_speed"],
        second_figures["landings"],
        second_figures["period"],
    ) == (None, None, 0, 1)
    assert any("never found again" in text for text in JOB.views.remarks(rough("200 rpm"), {}))
    assert lo.simulate(rough("200 rpm"))["N [N]"].abs().max() == 0.0
