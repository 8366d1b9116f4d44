"""The bound between points: true bounds are proven, false ones refuted with the angle, the rest left undecided."""

import importlib
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import toy
from support.shedding_cases import flat, freed, plain

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Node
from loomopt.physics.mechanisms.cam_laws import LAWS
from loomopt.physics.mechanisms.cam_spline import cycloid_like
from loomopt.solving.certificate import taylor_bounds
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.certificate.taylor_bounds import Boxes, peaks_verdict

FULL = lo.load("shedding").with_effect("damping").with_effect("dry_friction")
ACCURACY = 1e-8
ROWS = ("lift", "cam_force", "law_acceleration")
JOB = registry.find("shedding")
flint = importlib.import_module("flint")


def boxed(scene, design):
    """Return a design's sampler and its boxes."""
    sampled = JOB.sampler(scene, design)
    return sampled, Boxes(sampled)


def tried(sampled, boxes, name, sign, share):
    """Return what the boxes say of a limit that stands off the true extreme by a share of the row's size, and both."""
    pieces, u = sampled.grid()
    refined = [sign * e.value for e in sampled.extremes(name)]
    ends = [*refined, *(sign * sampled.at(name, pieces, u))]
    size = max(map(abs, ends))
    limit = max(ends) + share * size
    return boxes.bound(name, sign, limit), limit


def check(sampled, boxes, name, sign=1.0):
    """Assert that a limit just above the extreme is proven, and one just below refuted at an angle that breaks it."""
    above, _ = tried(sampled, boxes, name, sign, 1e-9)
    assert (above.status, above.angle) == ("proven", None), name
    below, limit = tried(sampled, boxes, name, sign, -1e-6)
    assert below.status == "violated", name
    piece, u = sampled.cycle.place(below.angle)
    neighbours = [(piece, u), ((piece - 1) % sampled.cycle.pieces, 1.0), ((piece + 1) % sampled.cycle.pieces, 0.0)]
    places, shares = np.array([p for p, _ in neighbours]), np.array([u for _, u in neighbours])
    there = np.abs((sampled.cycle.angles(places, shares) - below.angle + math.pi) % (2 * math.pi) - math.pi) < 1e-9
    assert max(sign * sampled.at(name, places[there], shares[there])) > limit, name


@pytest.mark.parametrize("shape", ["linear", "step"])
@pytest.mark.parametrize("law", LAWS)
def test_true_bounds_of_every_law_are_proven_and_false_ones_refuted_where_they_break(law, shape):
    """With damping, friction that jumps at the dwells, and the acceleration that jumps of the harmonic law."""
    sampled, boxes = boxed(FULL.update({"mechanism.law": law, "effects.warp_tension.shape": shape}), {"K1": 90000.0})
    for name in ROWS:
        check(sampled, boxes, name)
    check(sampled, boxes, "law_acceleration", -1.0)


@pytest.mark.parametrize("angles", [(100, 70, 130, 60), (180, 0, 180, 0), (173, 90, 7, 90)])
def test_the_bound_holds_for_uneven_cams_no_dwells_and_narrow_lobes(angles):
    names = ("rise", "far_dwell", "return", "near_dwell")
    scene = FULL.update({f"mechanism.{n}": f"{a} deg" for n, a in zip(names, angles, strict=True)})
    sampled, boxes = boxed(scene, {})
    for name in ROWS:
        check(sampled, boxes, name)


@pytest.mark.parametrize("symmetric", [False, True])
def test_the_bound_holds_for_a_free_law_that_touches_at_many_places(symmetric):
    answer = freed(plain.PAPER, 8, symmetric)
    sampled, boxes = boxed(answer.scene, flat(answer.design))
    for name in ROWS:
        check(sampled, boxes, name)
    touching = [e for e in sampled.extremes("lift") if abs(e.value) < 1e-9 * answer.figures["contact_max"]]
    assert len(touching) > 4


def test_a_bound_on_some_pieces_speaks_of_these_alone():
    """By statics: the dwells (segments 1 and 3) hold; the rise between them is lower by far with this soft spring."""
    sampled, boxes = boxed(lo.load("shedding"), {"K1": 8029.14})
    inside = sampled.peak("lift", ("segment", 1.0))
    assert boxes.bound("lift", 1.0, inside + 1e-6, ("segment", 1.0)).status == "proven"
    assert boxes.bound("lift", 1.0, inside - 1e-3, ("segment", 1.0)).status == "violated"
    assert boxes.bound("lift", 1.0, inside + 1e-6, ("segment", 0.0)).status == "violated"


def test_a_bound_is_undecided_when_the_boxes_run_out(monkeypatch):
    sampled, boxes = boxed(FULL, {})
    proven, limit = tried(sampled, boxes, "lift", 1.0, 1e-9)
    assert proven.status == "proven"
    monkeypatch.setattr(taylor_bounds, "MOST_BOXES", proven.boxes // 2)
    short = boxes.bound("lift", 1.0, limit)
    assert (short.status, short.angle) == ("undecided", None)
    assert short.boxes < proven.boxes
    monkeypatch.setattr(taylor_bounds, "MOST_BOXES", 3)
    answer = lo.solve(lo.load("shedding"), starts=1)
    assert (answer.status, answer.certificate.whole_cycle) == ("optimal", "refined")


@pytest.mark.parametrize("target", ["stiffness", "force", "speed"])
@pytest.mark.parametrize("problem", ["shedding", "shedding-printed-travel"])
def test_the_certificate_of_a_cam_is_bounded(problem, target):
    certificate = lo.solve(lo.load(problem), target, starts=1).certificate
    assert (certificate.passed, certificate.whole_cycle) == (True, "bounded")


def test_the_certificate_of_a_free_law_is_bounded():
    assert freed(plain.PAPER, 8).certificate.whole_cycle == "bounded"
    assert lo.solve(lo.load("shedding-static"), starts=1).certificate.whole_cycle == "bounded"


def test_what_has_no_series_is_refined_only():
    """The linkages, whose angles need atan2, and a cam whose pressure angle is limited too."""
    answers = [lo.solve(lo.load(problem), starts=1) for problem in ("beatup", "rapier")]
    answers.append(lo.solve(lo.load("shedding").set("limits.pressure_angle_max.max", "45 deg"), starts=1))
    assert [answer.certificate.whole_cycle for answer in answers] == ["refined"] * 3
    assert all(answer.certificate.passed for answer in answers)


# A peak that every sample misses ---------------------------------------------------------------------------------

PLACE, SHARP = 1.0001, 35
"""The spike: ((1 + cos(φ − PLACE))/2) to the power 2^SHARP, about 2e-5 rad wide; samples stand 4e-4 apart."""


def smooth(m, values, phi):
    return m.cos(phi) + 0 * values["x"]


def spiked(m, values, phi):
    spike = (1 + m.cos(phi - PLACE)) / 2
    for _ in range(SHARP):
        spike = spike * spike
    return smooth(m, values, phi) + spike


def sunk(m, values, phi):
    return -spiked(m, values, phi)


def program(wave, bounded=True, signed=False):
    """Return: least x² with |wave| ≤ 1.2 all round; the wave does not depend on x.

    bounded: whether it runs on series of balls; signed: whether only its highest value counts.
    """
    square, limits = {"f": lambda v: v["x"] ** 2}, (("wave", 1, 1.2),)
    return toy.program("x", square, {"wave": wave}, limits=limits, bounded=bounded, signed=signed)


def bounds_and_certificate(wave, **kinds):
    """Return what the boxes say of the peak that was sampled, and the certificate of x = 0."""
    made = program(wave, **kinds)
    sampled = Sampler(made.model, {"x": 0.0})
    assert sampled.peak("wave") < 1.0 + 1e-6, "the spike is not missed: it stands 0.54 higher than the samples see"
    return peaks_verdict(sampled, [("wave", 1.0, None)], ACCURACY), certify(made, {"x": 0.0}, ACCURACY)


@pytest.mark.parametrize("wave", [spiked, sunk])
def test_a_spike_between_the_samples_is_refuted_and_the_certificate_says_so(wave):
    status, certificate = bounds_and_certificate(wave)
    assert status == "violated"
    assert certificate.violation <= ACCURACY, "the dense scan misses it too"
    assert not certificate.passed
    assert certificate.reasons == ("a whole-cycle limit is exceeded somewhere between refined points",)
    assert certificate.whole_cycle == "refined"


def test_the_angle_of_the_spike_is_found():
    made = program(spiked)
    bound = Boxes(Sampler(made.model, {"x": 0.0})).bound("wave", 1.0, 1.2)
    assert bound.status == "violated"
    assert bound.angle == pytest.approx(PLACE, abs=2e-5)


def test_without_the_spike_the_same_design_passes():
    status, certificate = bounds_and_certificate(smooth)
    assert (status, certificate.passed, certificate.whole_cycle) == ("proven", True, "bounded")


def test_a_spike_downward_does_not_count_where_only_the_highest_value_does():
    assert bounds_and_certificate(sunk, signed=True)[0] == "proven"
    assert bounds_and_certificate(spiked, signed=True)[0] == "violated"


def test_a_wave_that_is_not_declared_to_run_on_balls_is_left_undecided():
    status, certificate = bounds_and_certificate(spiked, bounded=False)
    assert (status, certificate.passed, certificate.whole_cycle) == ("undecided", True, "refined")


# Balls enclose ---------------------------------------------------------------------------------------------------


def lopsided():
    """Return s'' of a spline law whose halves differ: the sampled sine with a share of s'' moved to the left."""
    law = np.add(cycloid_like(8), [0, 1, 0, -1, 0, 0, 0, 0, 0])
    s, v, _ = plain.linear_maps(8, np.array([1.0]))
    assert abs(float((v @ law)[0])) < 1e-14
    return (law / (s @ law)).tolist()


SCENES = {law: FULL.set("mechanism.law", law) for law in LAWS}
SCENES["step"] = FULL.set("effects.warp_tension.shape", "step")
SCENES["spline"] = FULL.update({"mechanism.law": "spline", "mechanism.law_coefficients": lopsided()})


@pytest.mark.parametrize("name", SCENES)
@settings(max_examples=12, deadline=None, derandomize=True)
@given(data=st.data())
def test_the_balls_of_a_box_contain_the_values_at_its_points(name, data):
    """Value, and value + slope h + half the curvature h² with the curvature of the whole box."""
    scene, share = SCENES[name], st.floats(0, 1)
    physics, sampled, system = JOB.model(scene), JOB.sampler(scene, {}), systems.balls()
    values = {key: system.number(value) for key, value in {**JOB.numbers(scene), **sampled.hints}.items()}
    exact = physics.given(system, values)
    piece = data.draw(st.integers(0, sampled.cycle.pieces - 1))
    start, end = map(float, sampled.cycle.starts[piece : piece + 2])
    half = data.draw(st.floats(1e-6, 0.25)) * (end - start)
    centre = start + half + data.draw(share) * (end - start - 2 * half)
    switch = {name: float(value) for name, value in sampled.cycle.switch(piece).items()}
    nothing = systems.ball_series(0, 0) * 0
    for row in ROWS:
        wide, narrow = (
            physics.quantity(system, exact, row, Node(systems.ball_series(centre, r), switch)) + nothing
            for r in (half, 0.0)
        )
        for place in (-1.0, 1.0, *(2 * data.draw(share) - 1 for _ in range(3))):
            value = float(physics.quantity(systems.FLOAT, sampled.given, row, Node(centre + place * half, switch)))
            h = flint.arb(centre + place * half) - flint.arb(centre)
            rounding = flint.arb(0, 1e-12 * max(1.0, abs(value), sampled.peak("cam_force") * (row != ROWS[2])))
            assert (wide[0] + rounding).contains(flint.arb(value)), row
            assert (narrow[0] + narrow[1] * h + wide[2] * h * h + rounding).contains(flint.arb(value)), row
