"""Stroke, dwells and turning points against root finding in 30 digits on positions from triangles alone."""

import dataclasses
import functools
import math

import mpmath
import numpy as np
import pytest
from support import slow

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.rapier import model as rapier_model
from loomopt.maths import systems, turning_points
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Node
from loomopt.physics.mechanisms import rapier_drive
from loomopt.physics.mechanisms.rapier_drive import Dimensions

MP = mpmath.MPContext()
MP.dps = 30
SCENE = lo.load("rapier")
JOB = registry.of(SCENE)
NAMES = tuple(entry.name for entry in dataclasses.fields(Dimensions))
TURN = 2 * math.pi
DEGREE = math.pi / 180


@functools.cache
def random_designs():
    """Return twenty drives that turn, around today's; seeded."""
    random, result = np.random.default_rng(17), list[dict[str, float]]()
    today = {name: SCENE.mechanism[name] for name in ("l4", "l5", "l6", "l3p", "alpha", "C0x", "C0y", "phi40")}
    widths = {"alpha": 0.3, "phi40": 0.35, "C0x": 0.05, "C0y": 0.05}
    while len(result) < 20:
        design = {name: value + random.uniform(-1, 1) * widths.get(name, 0.25 * value) for name, value in today.items()}
        if not rapier_drive.fault_of({**SCENE.mechanism, **design}):
            result.append(design)
    return result


class Drive:
    """S and S' of one design in 30 digits: law of cosines, differences of positions."""

    def __init__(self, design):
        values = {**SCENE.mechanism, **design}
        self.d = Dimensions(*(MP.mpf(values[name]) for name in NAMES))
        d = self.d
        self.A0 = d.l71 * MP.expj(d.phi30 - self.corner(d.l1 + d.l2, d.l3, d.l71))
        self.front_crank = MP.arg(d.l3 * MP.expj(d.phi30) - self.A0)
        self.front = MP.expj(self.angle(MP.mpf(0)))

    @staticmethod
    def corner(opposite, first, other):
        return MP.acos((first**2 + other**2 - opposite**2) / (2 * first * other))

    def angle(self, phi):
        d = self.d
        A = self.A0 + d.l1 * MP.expj(self.front_crank + phi)
        phi3 = MP.arg(A) + self.corner(d.l2, d.l3, abs(A))
        B2 = d.l3p * MP.expj(phi3 + d.alpha)
        C = MP.mpc(d.C0x, d.C0y) + d.l4 * MP.expj(d.phi40 - 2 * phi)
        return MP.arg(C - B2) + self.corner(d.l5, d.l6, abs(C - B2)) - phi3

    def S(self, phi):
        d = self.d
        return d.i1 * d.i2 * d.wheel / 2 * MP.arg(MP.expj(self.angle(MP.mpf(phi))) / self.front)

    def slope(self, phi):
        step = MP.mpf(10) ** -9
        return (self.S(phi + step) - self.S(phi - step)) / (2 * step)

    @functools.cached_property
    def turning(self):
        """Every crank angle in [0, 2π) where S' crosses zero, by bisection between samples 1° apart."""
        samples = [self.slope(k * MP.pi / 180) for k in range(361)]
        brackets = [k for k in range(360) if samples[k] * samples[k + 1] < 0]
        return [bisect(self.slope, k * MP.pi / 180, (k + 1) * MP.pi / 180) for k in brackets]

    def stroke(self):
        return max((self.S(phi), phi) for phi in self.turning)

    def dwell(self, room, side):
        """Return how far from front dead centre |S| first reaches `room`."""
        turned = sorted(side * phi % (2 * MP.pi) for phi in self.turning)
        angles = sorted([*turned, *(k * MP.pi / 180 for k in range(1, 361))])

        def excess(phi):
            return abs(self.S(side * phi)) - room

        low = MP.mpf(0)
        for high in angles:
            if excess(high) > 0:
                return bisect(excess, low, high)
            low = high
        return 2 * MP.pi


def bisect(function, low, high):
    rising = function(high) > 0
    for _ in range(85):
        middle = (low + high) / 2
        low, high = (low, middle) if (function(middle) > 0) == rising else (middle, high)
    return low


def designs():
    return [pytest.param(None, id="packaged"), *slow.after(6, range(20))]


def design_of(which):
    return {} if which is None else random_designs()[which]


@functools.cache
def drive(which):
    return Drive(design_of(which))


def read(design, s_dwell=None):
    scene = SCENE if s_dwell is None else SCENE.set("operation.s_dwell", f"{s_dwell!r} m")
    return rapier_model.read(JOB.sampler(scene, design))


@pytest.mark.few(3)
@pytest.mark.parametrize("which", designs())
def test_stroke_and_dwells_are_those_of_thirty_digits(which):
    result, exact = read(design_of(which)), drive(which)
    stroke, phi = exact.stroke()
    assert result.stroke == pytest.approx(float(max(stroke, 0)), abs=1e-11)
    assert result.phi_stroke == pytest.approx(float(phi), abs=1e-10)
    room = MP.mpf(SCENE.operation["s_dwell"])
    assert result.dwell_after == pytest.approx(float(exact.dwell(room, 1)), abs=1e-10)
    assert result.dwell_before == pytest.approx(float(exact.dwell(room, -1)), abs=1e-10)


@pytest.mark.parametrize("which", designs())
def test_turning_points_are_those_of_thirty_digits_the_first_onto_its_way_out(which):
    sampled = JOB.sampler(SCENE, design_of(which))
    drive_ = sampled.model.kinematics
    result = turning_points.turns(lambda phi: drive_.pose(systems.numpy(), sampled.given, Node(phi, {})).q1)
    exact = drive(which)
    assert np.sort(np.mod(result, TURN)) == pytest.approx([float(phi) for phi in exact.turning], abs=1e-10)
    assert exact.slope(result[0] + 1e-4) > 0 > exact.slope(result[0] - 1e-4)
    assert np.count_nonzero(np.diff(np.append(result, result[0])) < 0) == 1, "in the order of the turn"


def dip(side):
    """Return by how much |S| rises on one side within 40° of front dead centre and then falls again; None: never."""
    exact = drive(None)
    near = [phi if side > 0 else 2 * MP.pi - phi for phi in exact.turning]
    inner = [phi for phi in near if 1e-6 < phi < 40 * DEGREE]
    return (abs(exact.S(side * min(inner))), min(inner)) if inner else None


def test_a_travel_that_only_touches_s_dwell_stays_in_the_dwell():
    """S dips to −0.32 mm before front dead centre and comes back: |S| touches that s_dwell there."""
    height, touched = dip(-1)
    assert float(height) == pytest.approx(0.00032, abs=5e-6)
    exact = drive(None)
    for share in (1.0, 1.0 + 1e-12, 1.0 - 1e-12):
        result = read({}, float(height) * share).dwell_before
        beyond = exact.dwell(height * (1 + MP.mpf(10) ** -9), -1)
        assert result == pytest.approx(float(beyond), abs=1e-7)
        assert result > float(touched) + 0.01
    cut = read({}, float(height) * (1 - 1e-6)).dwell_before
    assert cut == pytest.approx(float(exact.dwell(height * (1 - MP.mpf(10) ** -6), -1)), abs=1e-7)
    assert cut < float(touched)


@pytest.mark.parametrize("s_dwell", [1e-9, 1e-6, 1e-4, 0.01, 0.3, 0.84])
def test_dwells_of_any_s_dwell_below_the_stroke(s_dwell):
    result = read({}, s_dwell)
    for side, dwell in ((1, result.dwell_after), (-1, result.dwell_before)):
        expected = drive(None).dwell(MP.mpf(s_dwell), side)
        assert dwell == pytest.approx(float(expected), abs=1e-10 + 1e-15 / s_dwell)


def test_an_s_dwell_beyond_the_stroke_is_a_dwell_of_the_whole_turn():
    stroke = read({}).stroke
    for s_dwell in (stroke * (1 + 1e-9), 1.0):
        result = read({}, s_dwell)
        assert (result.dwell_after, result.dwell_before) == (TURN, TURN)
    under = read({}, stroke * (1 - 1e-6))
    assert under.dwell_after < read({}).phi_stroke < TURN - under.dwell_before


def test_the_scene_without_s_dwell_has_a_stroke_and_no_dwell():
    sampled = JOB.sampler(SCENE, {})
    values = {name: value for name, value in sampled.given.values.items() if isinstance(value, float)}
    del values["s_dwell"]
    model = dataclasses.replace(sampled.model, arcs=())
    result = rapier_model.read(Sampler(model, values))
    assert result.stroke == read({}).stroke
    assert math.isnan(result.dwell_after)
    assert math.isnan(result.dwell_before)


def test_a_drive_that_locks_has_no_stroke():
    with pytest.raises(ValueError, match="does not assemble"), np.errstate(invalid="ignore"):
        read({"l5": 0.7})


def friction(design):
    return JOB.sampler(SCENE.with_effect("tape_friction"), design)


@pytest.mark.parametrize("which", designs())
def test_the_friction_switch_is_the_sign_of_the_heads_speed(which):
    sampled, exact = friction(design_of(which)), drive(which)
    for piece in range(sampled.cycle.pieces):
        for u in (0.001, 0.3, 0.999):
            phi = float(sampled.cycle.angles(np.array([piece]), np.array([u]))[0])
            if min(abs(math.remainder(phi - float(turn), TURN)) for turn in exact.turning) > 1e-6:
                assert sampled.cycle.switch(piece)["tape_friction"] == MP.sign(exact.slope(MP.mpf(phi)))
    after = Node(sampled.given.values["turns"][0] + 0.01, {})
    assert sampled.model.kinematics.pose(systems.FLOAT, sampled.given, after).q1 > 0
