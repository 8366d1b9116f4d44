"""Heald frames drawn at random: the least spring is the plain reference's, certified; it grows with what loads it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import slow
from support.shedding_cases import framed

import loomopt as lo
from reference import shedding as plain
from reference.cam_force import lopsided

FRAMES = 32


def drawn(seed):
    """Return a frame: any law, angles, shape of the warp's pull, often with damping, friction, a demand, no dwell."""
    rng = np.random.default_rng(seed)

    def some(most, share=0.5):
        return float(rng.uniform(0, most)) if rng.random() < share else 0.0

    moves = rng.integers(20, 150, 2)
    far = 0 if rng.random() < 0.2 else int(rng.integers(1, 359 - moves.sum()))
    angles = int(moves[0]), far, int(moves[1]), int(360 - far - moves.sum())
    law = str(rng.choice([*plain.LAWS, "spline"]))
    return plain.Scene(
        travel=float(rng.uniform(0.002, 0.15)),
        X0=float(rng.uniform(0.005, 0.2)),
        rpm=float(rng.uniform(30, 1200)),
        M=float(rng.uniform(0.5, 90)),
        G=float(rng.uniform(-100, 900)),
        T1=some(300, 0.8),
        T2=some(300, 0.8),
        shape=str(rng.choice(["linear", "step"])),
        C=some(150),
        F=some(50),
        N_min=some(200),
        law=lopsided(int(rng.integers(5, 14))) if law == "spline" else law,
        angles=angles,
    )


@pytest.mark.few(5)
@pytest.mark.parametrize("seed", slow.after(12, range(FRAMES)))
def test_the_least_spring_of_any_frame_is_the_references(seed):
    reference = drawn(seed)
    expected = max(0.0, float(plain.least_stiffness(reference)[0]))
    answer = lo.solve(framed(reference))
    assert answer.status == "optimal", answer.message
    assert answer.certificate.passed
    assert answer.certificate.whole_cycle in ("bounded", "proven")
    assert answer.certificate.violation <= 1e-9
    assert answer.figures["K1"] == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_a_tighter_accuracy_and_more_starts_give_the_same_spring(seed):
    scene = framed(drawn(seed))
    plainly, closely = lo.solve(scene), lo.solve(scene, accuracy=1e-11, starts=4)
    assert closely.status == "optimal"
    assert closely.figures["K1"] == pytest.approx(plainly.figures["K1"], rel=1e-11)


@pytest.mark.few(1)
@pytest.mark.parametrize(("name", "most"), [("rpm", 900.0), ("M", 80.0), ("N_min", 500.0)])
@given(st.tuples(st.floats(0, 1), st.floats(0, 1)), st.sampled_from(plain.LAWS))
@settings(deadline=None, max_examples=8, derandomize=True)
def test_the_least_stiffness_grows_with_speed_mass_and_demand(name, most, shares, law):
    less, more = (lo.solve(framed(replace(plain.PAPER, law=law, **{name: 1 + most * x}))) for x in sorted(shares))
    assert less.status == more.status == "optimal"
    assert less.figures["K1"] <= more.figures["K1"] * (1 + 1e-11)
