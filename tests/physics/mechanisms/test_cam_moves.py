"""Moves of a cam: joined without a jump, equal in every number system, and equal to the short form of a cam."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.physics.mechanisms.cam_laws import LAWS, TURN_LAWS
from loomopt.physics.mechanisms.cam_moves import CamMotion, CamMoves, CamState, Move, stretch, stretches

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=40)
MP = systems.mpmath(40)
ORDERS = range(4)


def cam(*moves, begins=0.3):
    """Return a cam of (move, angle, end) with floats."""
    return CamMoves(
        tuple(move for move, *_ in moves), begins, tuple(turn for _, turn, _ in moves), tuple(end for *_, end in moves)
    )


def derivatives(moves, phi, which, maths=FLOAT):
    """Return the angle and its derivatives in a stretch."""
    motion = CamMotion(maths, moves, phi, float(which))
    return [motion.angle(order) for order in ORDERS]


def joints(moves):
    """Return pairs of derivatives on both sides of every corner, that where the first move begins included."""
    corners = moves.corners(FLOAT)
    last = len(corners) - 1
    inner = [(derivatives(moves, angle, k - 1), derivatives(moves, angle, k)) for k, angle in enumerate(corners[1:], 1)]
    return [*inner, (derivatives(moves, corners[0], last), derivatives(moves, corners[0], 0))]


TURN = cam((Move(), 1.2, CamState(0.4, 0, -0.3, 0)), (Move(), 1.1, CamState()))
SLOPED = cam(
    (Move(), 0.9, CamState(0.2, 0.35, 0.1, -0.4)),
    (Move(), 0.8, CamState(0.4)),
    (Move(None), 0.5, CamState(0.4)),
    (Move(), 1.3, CamState()),
)
PULSE = cam(
    (Move(), 1.0, CamState(0.3)),
    (Move("quarter_sine"), 0.26, CamState(0.33)),
    (Move("quarter_sine", back=True), 0.26, CamState(0.3)),
    (Move(), 1.0, CamState()),
)
HARMONIC = cam((Move("double_harmonic"), 1.2, CamState(0.4)), (Move(), 1.0, CamState()))
MIRRORED = cam((Move(), 1.2, CamState(0.4)), (Move("polynomial_3456", back=True), 1.0, CamState()))


@pytest.mark.parametrize("moves", [TURN, SLOPED, PULSE, HARMONIC, MIRRORED], ids=["U", "B", "pulse", "law", "mirror"])
def test_moves_join_without_a_jump_up_to_the_third_derivative(moves):
    smooth = 3 if moves in (TURN, SLOPED, PULSE) else 2
    for before, after in joints(moves):
        assert before[: smooth + 1] == pytest.approx(after[: smooth + 1], abs=1e-11)


def test_a_named_law_gives_its_neighbour_its_own_state():
    motion = CamMotion(FLOAT, HARMONIC, 0.0, 0.0)
    assert motion.begin(1).bend == pytest.approx(-(math.pi**2) * 0.4 / 1.2**2, rel=1e-14)


@given(share=st.floats(0, 1), which=st.integers(0, 3))
@REPEATABLE
def test_derivatives_are_those_of_the_angle(share, which):
    corners = SLOPED.corners(FLOAT)
    begin, end = corners[which], corners[which + 1]
    phi = begin + share * (end - begin)
    exact = [MP.number(value) for value in derivatives(SLOPED, MP.number(phi), which, MP)]
    step = MP.number(1) / 10**10
    for order in (1, 2, 3):
        sides = [derivatives(SLOPED, MP.number(phi) + sign * step, which, MP)[order - 1] for sign in (1, -1)]
        assert float((sides[0] - sides[1]) / (2 * step) - exact[order]) == pytest.approx(0.0, abs=1e-12)
    assert derivatives(SLOPED, phi, which) == pytest.approx([float(value) for value in exact], abs=2e-12)


def test_arrays_give_what_floats_give():
    phi = np.linspace(-1.0, 8.0, 301)
    for moves in (TURN, SLOPED, PULSE, HARMONIC, MIRRORED):
        corners = moves.corners(FLOAT)
        motion = CamMotion(systems.numpy(), moves, phi, stretches(phi, corners))
        for order in ORDERS:
            singly = [derivatives(moves, angle, stretch(angle, corners))[order] for angle in phi]
            assert np.broadcast_to(motion.angle(order), phi.shape) == pytest.approx(singly, abs=1e-13)


@pytest.mark.parametrize("law", TURN_LAWS.values(), ids=TURN_LAWS.keys())
def test_laws_up_to_a_turn_begin_at_0_and_end_at_1_with_a_turn(law):
    begin, end = (law.formula(MP, MP.number(u), 0.0) for u in (0.0, 1.0))
    assert float(begin.s) == 0.0
    assert float(end.s) == pytest.approx(1.0, abs=1e-15)
    assert float(end.s1) == pytest.approx(0.0, abs=1e-15)
    step = MP.number(1) / 10**12
    for u in (0.1, 0.5, 0.93):
        here = law.formula(MP, MP.number(u), 0.0)
        sides = [law.formula(MP, MP.number(u) + sign * step, 0.0) for sign in (1, -1)]
        for order in (1, 2, 3):
            slope = (sides[0][order - 1] - sides[1][order - 1]) / (2 * step)
            assert float(slope - here[order]) == pytest.approx(0.0, abs=1e-15)


def test_laws_up_to_a_turn_are_those_of_the_handbooks():
    for u in (0.2, 0.6, 1.0):
        x = MP.number(u)
        harmonic = (1 - MP.cos(MP.pi * x)) / 2 - (1 - MP.cos(2 * MP.pi * x)) / 8
        assert float(TURN_LAWS["double_harmonic"].formula(MP, x, 0.0).s - harmonic) == pytest.approx(0.0, abs=1e-30)
        power = 8 * x**3 - 12 * x**4 + 6 * x**5 - x**6
        assert float(TURN_LAWS["polynomial_3456"].formula(MP, x, 0.0).s - power) == pytest.approx(0.0, abs=1e-30)


def test_a_septic_without_slopes_is_the_polynomial_of_the_name():
    named = cam((Move("polynomial_4567"), 1.2, CamState(0.4)), (Move(), 1.0, CamState()))
    plain = cam((Move(), 1.2, CamState(0.4)), (Move(), 1.0, CamState()))
    for phi in np.linspace(0.3, 1.5, 41):
        assert derivatives(plain, phi, 0) == pytest.approx(derivatives(named, phi, 0), rel=1e-14, abs=1e-14)


def test_a_spline_whose_third_derivative_is_linear_is_that_polynomial():
    # Third derivative 1 − 2u of a move from rest: its angle, slope and bend at the end follow by hand.
    turn, n = 1.2, 6
    jerks = tuple(1.0 - 2.0 * k / n for k in range(1, n))
    moves = CamMoves((Move("", intervals=n),), 0.0, (turn,), (CamState(0.1),), (jerks,))
    spline = CamMotion(FLOAT, moves, 0.0, 0.0).spline(0)
    knots = [0.0, *jerks, 0.0]
    slope = bend = angle = 0.0
    h = turn / n
    for before, after in itertools.pairwise(knots):
        angle += h * slope + h * h * bend / 2 + h**3 * (3 * before + after) / 24
        slope += h * bend + h * h * (2 * before + after) / 6
        bend += h * (before + after) / 2
    assert spline[-1][:3] == pytest.approx((angle, slope, bend), abs=1e-15)
    inside = derivatives(moves, 0.5 * h, 0)
    jerk = jerks[0] / 2
    assert inside[3] == pytest.approx(jerk, abs=1e-13)
    assert inside[2] == pytest.approx(jerks[0] * h / 8, abs=1e-13)


@pytest.mark.parametrize("law", LAWS)
def test_the_pieces_of_a_return_come_in_reverse(law):
    there, back = Move(law), Move(law, back=True)
    assert back.breaks == tuple(1 - share for share in reversed(there.breaks))
    assert back.pieces == tuple(reversed(there.pieces))
