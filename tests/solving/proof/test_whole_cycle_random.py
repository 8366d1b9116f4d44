"""Proofs of random machines: above their true peak they hold, below it they are refuted."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from proofs import FULL, cam_force, dense, proof_of, solved
from support.shedding_cases import framed

import loomopt as lo
from loomopt.base.errors import BadInput
from reference import shedding as plain
from reference.beatup import Machine
from reference.cam_force import RPM, lopsided, softest
from reference.rapier import Drive

near = st.floats(-0.05, 0.05)
PEAK_ACCELERATION = "limits.peak_acceleration.max", "m/rad^2"


def edged(scene, key, unit, value, design, name):
    """Assert that a limit a millionth below a true peak is refuted, one a millionth above it proven."""
    for share, status in ((-1e-6, "violated"), (1e-6, "proven")):
        proof = proof_of(lo.prove(scene.set(key, f"{value * (1 + share)!r} {unit}"), design), name)
        assert proof.status == status
        yield proof, value * (1 + share)


@pytest.mark.slow
@settings(max_examples=10)
@given(data=st.data())
def test_random_beat_ups_are_proven_above_their_peak_and_refuted_below(data):
    scene = data.draw(st.sampled_from([lo.load("beatup"), FULL]))
    design = {name: scene.mechanism[name] * (1 + data.draw(near)) for name in ("l1", "l2", "l3", "l4")}
    design |= {"m4e": data.draw(st.floats(0, 12.4)), "r4e": data.draw(st.floats(0, 0.08))}
    machine = Machine(scene)
    offsets = machine.grid(design, 100_000)
    torques = np.abs(machine.torques(design, offsets)[1])
    peak = float(torques.max())
    for proof, limit in edged(scene, "limits.peak_torque.max", "N*m", peak, design, "peak_torque"):
        if proof.angle is not None:
            assert abs(machine.torques(design, np.array([proof.angle]))[1][0]) > limit * (1 - 1e-9)


@pytest.mark.slow
@settings(max_examples=3)
@given(data=st.data())
def test_random_rapiers_are_proven_above_their_peak_and_refuted_below(data):
    scene = lo.load("rapier")
    design = {name: value * (1 + data.draw(near)) for name, value in solved("rapier").design.items()}
    try:
        lo.evaluate(scene, design)
    except BadInput:
        assume(False)
    drive = Drive(scene, design)
    for proof, limit in edged(scene, *PEAK_ACCELERATION, float(drive.peak(2)), design, "peak_acceleration"):
        if proof.angle is not None:
            assert abs(dense(drive, 2, np.array([proof.angle]))[0]) > limit * (1 - 1e-9)


@pytest.mark.slow
@settings(max_examples=14)
@given(data=st.data())
def test_random_frames_are_proven_with_their_softest_spring_and_refuted_below(data):
    law = data.draw(st.sampled_from([*plain.FIRST_HALF, lopsided()]))
    paper, turn = plain.PAPER, (1 + data.draw(near), 1 + data.draw(near))
    case = replace(
        paper,
        law=law,
        travel=paper.travel * (1 + data.draw(near)),
        X0=paper.X0 * (1 + data.draw(near)),
        rpm=paper.rpm * (1 + data.draw(near)),
        M=paper.M * (1 + data.draw(near)),
        C=data.draw(st.integers(0, 50)),
        F=data.draw(st.integers(0, 50)),
        shape=data.draw(st.sampled_from(["linear", "step"])),
        angles=(120 * turn[0], 60, 120 * turn[1], 240 - 120 * turn[0] - 120 * turn[1] + 60),
    )
    scene, least = framed(case), float(softest(case, case.X0))
    for share, status in ((-1e-6, "violated"), (1e-6, "proven")):
        proof = proof_of(lo.prove(scene, {"K1": least * (1 + share), "X0": case.X0}), "N_min")
        assert proof.status == status
        assert proof.angle is None or min(cam_force(case, least * (1 + share), proof.angle)) < 1e-9 * least * case.X0
    assert least > 50 * RPM
