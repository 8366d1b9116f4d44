"""Proofs over the whole cycle: what does not hold is refuted at an angle that really breaks it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from proofs import CLAIMED, JOBS, SLACK, cam_force, dense, proof_of, solved, violated
from support.shedding_cases import framed, product

import loomopt as lo
from loomopt.model.sampling import Sampler
from loomopt.scenes.packaged import problems
from reference import shedding as plain
from reference.beatup import Machine
from reference.cam_force import lopsided
from reference.rapier import Drive


@pytest.mark.few(4)
@pytest.mark.parametrize("name", [name for name in problems() if name != "beatup-light"])
def test_todays_machines_are_refuted_for_what_evaluate_says_fails(name):
    scene = lo.load(name)
    proofs = lo.prove(scene)
    failing = {limit.name for limit in lo.evaluate(scene).limits if not limit.ok} & {*scene.limits, "N_min", "M3_fdc"}
    assert violated(proofs) & {*scene.limits, "N_min", "M3_fdc"} == failing
    for proof in proofs.proofs:
        assert proof.status in ("proven", "violated")
        assert (proof.margin < 0) <= (proof.status == "violated") or abs(proof.margin) <= proof.slack


@pytest.mark.parametrize("case", [plain.PAPER, plain.PRINTED], ids=["paper", "printed travel"])
def test_todays_spring_lifts_off_at_the_angle_that_is_told(case):
    proof = proof_of(lo.prove(product(case)), "N_min")
    assert proof.status == "violated"
    assert max(cam_force(case, 8029.14, proof.angle)) < 0
    assert 0 <= proof.angle < 2 * math.pi


FRAMES = {
    "paper": plain.PAPER,
    "printed": plain.PRINTED,
    "trapezoid": replace(plain.PAPER, law="modified_trapezoid"),
    "harmonic, friction": replace(plain.PAPER, law="harmonic", C=35, F=20, angles=(100, 70, 130, 60)),
    "step, N_min": replace(plain.PAPER, shape="step", N_min=60, law="polynomial_4567"),
    "lopsided": replace(plain.PAPER, law=lopsided()),
}


@pytest.mark.parametrize("name", FRAMES)
@pytest.mark.few(1)
def test_a_spring_a_millionth_too_soft_is_refuted_and_the_softest_is_proven(name):
    """The least stiffness is the plain reference's, to 30 digits."""
    case = FRAMES[name]
    scene, least = framed(case), float(plain.least_stiffness(case)[0])

    def proof_at(share, slack=SLACK):
        return proof_of(lo.prove(scene, {"K1": least * (1 + share), "X0": case.X0}, slack=slack), "N_min")

    soft = proof_at(-1e-6)
    assert soft.status == "violated"
    assert min(cam_force(case, least * (1 - 1e-6), soft.angle)) < case.N_min
    assert [proof_at(share).status for share in (-1e-9, 1e-9)] == ["proven"] * 2
    assert proof_at(-1e-9, 1e-12).status == "violated"
    assert proof_at(1e-9, 1e-12).status == "proven"


LOADED = {
    "beatup": lo.load("beatup").with_effect("centrifugal"),
    "rapier": lo.load("rapier").with_effect("head_inertia").with_effect("tape_friction"),
    "shedding": lo.load("shedding").with_effect("damping").with_effect("dry_friction"),
}
PEAKS = {
    "beatup": {"peak_torque": "N*m", "reed_centrifugal": "N", "shaking_force": "N"},
    "rapier": {
        "peak_acceleration": "m/rad^2",
        "peak_jerk": "m/rad^3",
        "tape_force": "N",
        "peak_torque": "N*m",
        "mu_min": "rad",
    },
    "shedding": {
        "contact_max": "N",
        "law_acceleration": "",
        "pressure_angle_max": "rad",
        "curvature_min": "1/m",
        "curvature_max": "1/m",
    },
}


def beyond(job, figure, angle):
    """Return a figure's quantity of today's machine at an angle, by other formulas; None where there are none."""
    scene = LOADED[job]
    if job == "beatup" and figure == "peak_torque":
        return abs(Machine(scene).torques({**scene.mechanism}, np.array([angle]))[1][0])
    if job == "rapier" and figure in ("peak_acceleration", "peak_jerk"):
        return abs(dense(Drive(scene), 2 + (figure == "peak_jerk"), np.array([angle]))[0])
    if figure == "contact_max":
        case = replace(plain.PAPER, C=35, F=20)
        return max(cam_force(case, 8029.14, angle)) + 2 * 20 * (math.degrees(angle) % 180 >= 120 - 1e-9)
    return None


@pytest.mark.few(1)
@pytest.mark.parametrize("job", JOBS)
def test_peaks_are_proven_and_limits_a_millionth_tighter_refuted(job):
    scene = LOADED[job]
    values = {name: lo.evaluate(scene).figures[name] for name in PEAKS[job]}
    for share, status in ((1e-6, "violated"), (1e-10, "proven"), (-1e-6, "proven")):
        limits = {}
        for name, unit in PEAKS[job].items():
            side, sign = ("min", 1) if name.endswith("_min") else ("max", -1)
            limits[f"limits.{name}.{side}"] = f"{values[name] * (1 + sign * share)!r} {unit}".strip()
        proofs = lo.prove(scene.update(limits))
        for name, value in values.items():
            assert proof_of(proofs, f"peak {name}").status == "proven"
            proof = proof_of(proofs, name)
            assert proof.status == status, (name, share)
            if status == "violated":
                true = beyond(job, name, proof.angle)
                assert true is None or true > value * (1 - share), name
                assert proof.margin == pytest.approx(-1e-6 * abs(value), rel=1e-3)


def test_a_claim_that_is_too_low_is_refuted(monkeypatch):
    """As if sampling had missed the top of every peak by a millionth."""
    true = Sampler.peak
    monkeypatch.setattr(Sampler, "peak", lambda *given: true(*given) - 1e-6 * abs(true(*given)))
    for job, scene in LOADED.items():
        refuted = {name for name in violated(lo.prove(scene)) if name.startswith("peak ")}
        assert refuted >= {f"peak {figure}" for figure in CLAIMED[job]}


STATIC = {
    "beatup": {
        "swing": "rad",
        "theta": "rad",
        "beta": "rad",
        "mu_min": "rad",
        "J4": "kg*m^2",
        "r4": "m",
        "M3_fdc": "N*m",
        "alpha_fdc": "rad/s^2",
    },
    "rapier": {"swing": "rad", "theta": "rad", "sley_mu_min": "rad"},
    "pulse": {"pulse_rms": "N*m"},
}
SIDES = {"mu_min": "min", "sley_mu_min": "min", "pulse_rms": "max", "J4": "max"}


@pytest.mark.few(1)
@pytest.mark.parametrize(
    "case",
    ["beatup", "rapier", "pulse"],
)
def test_limits_of_one_position_are_judged_at_their_edge(case):
    """The values are those of the plain machines."""
    scene, design = (
        lo.load("rapier" if case == "rapier" else "beatup"),
        dict(solved(case.replace("pulse", "beatup")).design),
    )
    if case == "rapier":
        true = dict(zip(("swing", "theta", "sley_mu_min"), Drive(scene, design).sley(), strict=True))
    else:
        true = {**Machine(scene).static(design), "pulse_rms": Machine(scene).pulse_rms(design)}
    for share, status in ((1e-6, "violated"), (1e-9, "proven"), (-1e-9, "proven")):
        for side, sign in (("min", 1), ("max", -1)):
            names = [name for name in STATIC[case] if SIDES.get(name, side) == side]
            limits = {}
            for name in names:
                size = max(abs(true[name]), {"rad": 1.0, "N*m": 88.0}.get(STATIC[case][name], 0.0))
                limits[f"limits.{name}"] = {side: f"{float(true[name] + sign * share * size)!r} {STATIC[case][name]}"}
            proofs = lo.prove(scene.update(limits), design) if names else None
            for name in names:
                proof = proof_of(proofs, name)
                assert (proof.status, proof.angle) == (status, None), (name, side, share)
