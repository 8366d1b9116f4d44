"""The cycle: pieces between corners that move with the design, and both one-sided values at each."""

import itertools
import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.beatup.model import shared_linkage
from loomopt.physics import cycle
from loomopt.physics.effects.beatup import resistance

TURN = 2 * math.pi
REPEATABLE = settings(derandomize=True, deadline=None, max_examples=100)
BEATUP = registry.load("beatup")
corner_angles = st.floats(-10, 10)


def sampler(scene):
    return registry.of(scene).sampler(scene, {})


def arc(angle, corners):
    """Return 1 from the first corner on to the second, 0 on the way back."""
    begin, end = corners
    return 1.0 if (angle - begin) % TURN < (end - begin) % TURN else 0.0


def split(first, second):
    """Return the cycle of two arcs with a switch without corners between them."""
    corners = (*first, *second)
    return cycle.split(
        corners, ("first", "plain", "second"), lambda angle: (arc(angle, first), 0.0, arc(angle, second))
    )


def far_apart(angles, least=1e-6):
    return all(abs(math.remainder(a - b, TURN)) > least for a, b in itertools.combinations(angles, 2))


@given(corner_angles, corner_angles, corner_angles, corner_angles)
@REPEATABLE
def test_pieces_cover_one_turn_and_begin_at_the_corners_in_order(a, b, c, d):
    assume(far_apart((a, b, c, d)))
    parts = split((a, b), (c, d))
    assert parts.pieces == 4
    assert np.all(np.diff(parts.starts) > 0)
    assert parts.starts[-1] - parts.starts[0] == pytest.approx(TURN, rel=1e-15)
    for angle in (a, b, c, d):
        assert np.min(np.abs((parts.starts - angle + math.pi) % TURN - math.pi)) < 1e-14
    for start, (index, turns) in zip(parts.starts, parts.order, strict=False):
        assert start == (a, b, c, d)[index] + TURN * turns


@given(corner_angles, corner_angles, corner_angles, corner_angles)
@REPEATABLE
def test_every_switch_holds_all_over_its_piece(a, b, c, d):
    assume(far_apart((a, b, c, d)))
    parts = split((a, b), (c, d))
    for piece, share in itertools.product(range(4), (1e-3, 0.3, 0.999)):
        angle = parts.starts[piece] * (1 - share) + parts.starts[piece + 1] * share
        assert tuple(parts.switches[piece]) == (arc(angle, (a, b)), 0.0, arc(angle, (c, d)))


@given(corner_angles, corner_angles, corner_angles, corner_angles, st.floats(0, 1))
@REPEATABLE
def test_a_node_is_an_affine_function_of_the_corners(a, b, c, d, u):
    """Read off at one design, it gives the angle at every design with the same order of corners."""
    assume(far_apart((a, b, c, d), 1e-2))
    corners = np.array([a, b, c, d])
    moved = corners + np.array([0.001, -0.002, 0.003, -0.001])
    result, after = split(corners[:2], corners[2:]), split(moved[:2], moved[2:])
    symbols = ca.SX.sym("corner", 4)
    for piece in range(4):
        offset, coefficients = result.coefficients(piece, u, 4)
        assert math.fsum(coefficients) == pytest.approx(1.0, rel=1e-15)
        here = float(result.angles(np.array([piece]), np.array([u]))[0])
        assert cycle.node_angle(offset, coefficients, list(corners)) == pytest.approx(here, rel=0, abs=1e-13)
        there = cycle.node_angle(offset, coefficients, ca.vertsplit(symbols))
        value = float(ca.Function("f", [symbols], [there])(moved))
        distances = [abs(math.remainder(value - x, TURN)) for x in after.angles(np.arange(4), np.full(4, u))]
        assert min(distances) < 1e-13


@given(corner_angles, corner_angles, corner_angles, corner_angles, st.lists(st.floats(-20, 20), min_size=1))
@REPEATABLE
def test_nodes_at_crank_angles_are_found_alone_and_together(a, b, c, d, angles):
    assume(far_apart((a, b, c, d)))
    parts = split((a, b), (c, d))
    pieces, u = parts.located(np.array(angles))
    assert np.all((u >= 0.0) & (u <= 1.0))
    back = parts.angles(pieces, u)
    for k, angle in enumerate(angles):
        assert math.remainder(back[k] - angle, TURN) == pytest.approx(0.0, abs=1e-13)
        assert parts.place(angle) == (pieces[k], u[k])


def test_switches_are_read_by_name_on_one_piece_or_several():
    parts = split((0.5, 2.0), (1.0, 5.0))
    assert parts.switch(0) == {"first": 1.0, "plain": 0.0, "second": 0.0}
    several = parts.switch(np.array([0, 1, 3]))
    assert {name: list(values) for name, values in several.items()} == {
        "first": [1.0, 1.0, 0.0],
        "plain": [0.0, 0.0, 0.0],
        "second": [0.0, 1.0, 0.0],
    }
    assert list(parts.on(("second", 1.0))) == [False, True, True, False]
    assert list(parts.on(None)) == [True] * 4


@given(corner_angles, corner_angles, corner_angles, corner_angles)
@REPEATABLE
def test_pieces_begin_in_another_number_system_where_they_do_in_floats(a, b, c, d):
    assume(far_apart((a, b, c, d)))
    parts = split((a, b), (c, d))
    assert parts.begins((a, b, c, d), math.pi) == pytest.approx(list(parts.starts), rel=1e-15, abs=1e-14)
    symbols = ca.SX.sym("corner", 4)
    begins = ca.Function("f", [symbols], [ca.vertcat(*parts.begins(ca.vertsplit(symbols), math.pi))])
    assert np.asarray(begins([a, b, c, d])).ravel() == pytest.approx(parts.starts, rel=1e-15, abs=1e-14)
    assert cycle.split((), (), lambda angle: ()).begins((), math.pi) == [0.0, TURN]


def test_a_corner_is_the_end_of_one_piece_and_the_start_of_the_next():
    parts = split((0.5, 2.0), (1.0, 5.0))
    ends = parts.angles(np.arange(4), np.ones(4))
    starts = parts.angles(np.arange(4), np.zeros(4))
    assert ends[:-1] == pytest.approx(starts[1:], rel=1e-15)
    assert ends[-1] == pytest.approx(starts[0] + TURN, rel=1e-15)


def test_without_corners_the_cycle_is_one_piece():
    parts = cycle.split((), ("plain",), lambda angle: (0.0,))
    assert (parts.pieces, parts.order) == (1, ())
    assert list(parts.starts) == [0.0, TURN]
    offset, coefficients = parts.coefficients(0, 0.25, 0)
    assert (offset, list(coefficients)) == (TURN / 4, [])
    assert parts.piece_before(1.0) == 0


@pytest.mark.parametrize("turns", [-2, 0, 3])
def test_the_piece_before_a_corner_ends_there_whatever_the_turn(turns):
    parts = split((0.5, 2.0), (1.0, 5.0))
    for corner in (0.5, 1.0, 2.0, 5.0):
        piece = parts.piece_before(corner + turns * TURN)
        assert math.remainder(parts.starts[piece + 1] - corner, TURN) == pytest.approx(0, abs=1e-12)
        inside = parts.piece_before(corner + 0.2 + turns * TURN)
        assert math.remainder(parts.starts[inside] - corner, TURN) == pytest.approx(0, abs=1e-12)


def test_touching_corners_leave_a_piece_of_no_width_and_no_nonsense():
    parts = split((0.5, 2.0), (2.0, 5.0))
    assert np.sort(np.diff(parts.starts))[0] == 0.0
    assert parts.pieces == 4


FRICTION = BEATUP.with_effect("bearing_friction")


def at_corners(scene, column):
    """Return {angle: (value before, value after)} of the corners of the curves."""
    curves = lo.simulate(scene)
    phi, values = curves["phi [rad]"].to_numpy(), curves[column].to_numpy()
    double = np.flatnonzero(np.diff(phi) == 0)
    return {phi[k]: (values[k], values[k + 1]) for k in double}


def test_curves_show_both_values_of_every_corner_and_friction_jumps_at_the_dead_centres():
    given_ = sampler(FRICTION).given.values
    front, rear = given_["beta"], math.pi + given_["beta_r"]
    half = math.radians(29.8) / 2
    result = at_corners(FRICTION, "M3 [N*m]")
    assert sorted(result) == pytest.approx(sorted([front - half, front, front + half, rear]), rel=1e-14)
    jumps = {angle: before - after for angle, (before, after) in result.items()}
    assert jumps.pop(min(jumps, key=lambda angle: abs(angle - front))) == pytest.approx(4.0, rel=1e-10)
    assert jumps.pop(min(jumps, key=lambda angle: abs(angle - rear))) == pytest.approx(-4.0, rel=1e-10)
    assert list(jumps.values()) == pytest.approx([0, 0], abs=1e-9)


def test_reed_torque_at_front_dead_centre_is_the_value_just_before_it():
    """There the Coulomb torque is any value in [−T_c, T_c]; on the way to the fell it is +T_c."""
    without, with_friction = (lo.evaluate(scene).figures["M3_fdc"] for scene in (BEATUP, FRICTION))
    assert with_friction - without == pytest.approx(2.0, rel=1e-12)
    front = sampler(FRICTION).given.values["beta"]
    before, after = next(v for angle, v in at_corners(FRICTION, "M3 [N*m]").items() if abs(angle - front) < 1e-12)
    assert with_friction == pytest.approx(before, rel=1e-11)
    assert with_friction == pytest.approx(after + 4.0, rel=1e-11)


WRAPPED = {
    "pulse begins before angle 0": {"effects.resistance.pulse": "150 deg"},
    "pulse ends beyond the rear dead centre": {"effects.resistance.pulse": "359 deg"},
    "front dead centre near 0": {"mechanism.l1": "20 mm", "mechanism.l2": "190 mm", "mechanism.l3": "46 mm"},
    "front dead centre near 180 deg": {"mechanism.l1": "0.2 mm", "mechanism.l2": "30 mm", "mechanism.l3": "196.7 mm"},
}


@pytest.mark.parametrize("name", WRAPPED)
def test_the_pulse_of_the_curves_is_right_across_the_ends_of_the_turn(name):
    scene = FRICTION.update(WRAPPED[name])
    given = sampler(scene).given
    curves = lo.simulate(scene)
    phi = curves["phi [rad]"].to_numpy()
    assert (phi[0], phi[-1]) == (0.0, pytest.approx(TURN))
    assert np.all(np.diff(phi) >= 0)
    pulse = scene.effect_table(resistance.Parameters).pulse
    away = np.abs((phi - given.values["beta"] + math.pi) % TURN - math.pi)
    expected = np.where(away < pulse / 2, 745.0 * np.cos(math.pi * away / pulse), 0.0)
    assert curves["M_R [N*m]"].to_numpy() == pytest.approx(expected, rel=0, abs=1e-9)
    once = np.flatnonzero((phi != 0) & (np.diff(phi, prepend=-1) > 0) & (np.diff(phi, append=9) > 0))
    psi_1 = curves["psi_1 [1]"].to_numpy()[once]
    friction = curves["bearing_friction [N*m]"].to_numpy()[once] + 0.05 * psi_1 * scene.operation["speed"]
    moving = np.abs(psi_1) > 1e-9
    assert friction[moving] == pytest.approx(-2.0 * np.sign(psi_1[moving]), rel=1e-9)
    assert lo.evaluate(scene).figures["M3_fdc"] == pytest.approx(
        745.0 + 2.0 - 0.62 * shared_linkage(given).centres.psi_2_front * scene.operation["speed"] ** 2, rel=1e-12
    )


@pytest.mark.parametrize("pulse", [0.5, 1e-2, 1e-5, 1e-8, 1e-10])
@pytest.mark.parametrize("scene", [BEATUP, FRICTION], ids=["alone", "with friction"])
def test_the_narrowest_pulse_is_felt_at_front_dead_centre(scene, pulse):
    wide = lo.evaluate(scene).figures["M3_fdc"]
    narrow = scene.set("effects.resistance.pulse", f"{pulse!r} rad")
    assert lo.evaluate(narrow).figures["M3_fdc"] == pytest.approx(wide, rel=1e-12)
    sampled = sampler(narrow)
    on = sampled.cycle.on(("resistance", 1.0))
    assert np.sum(np.diff(sampled.cycle.starts)[on]) == pytest.approx(pulse, rel=0, abs=1e-15)


def test_front_dead_centre_of_the_wrapped_scenes_is_where_their_names_say():
    betas = {name: lo.evaluate(FRICTION.update(changes)).figures["beta"] for name, changes in WRAPPED.items()}
    assert betas["front dead centre near 0"] < math.radians(15) < math.pi / 2
    assert betas["front dead centre near 180 deg"] > math.radians(165)
