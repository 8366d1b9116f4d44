"""Proofs where a false one might hide: effects, laws, coils, other numbers, change points, jumps, turned links."""

import math
from dataclasses import replace

import numpy as np
import pytest
from proofs import DWELL, FULL, SLACK, cam_force, proof_of, proofs_of, solved, violated
from support import toy
from support.shedding_cases import flat, freed, product

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.model.sampling import Sampler
from loomopt.solving.certificate import taylor_bounds
from loomopt.solving.certificate.taylor_bounds import Boxes
from reference import shedding as plain
from reference.beatup import Machine

# Effects, laws, coils ------------------------------------------------------------------------------------------------


@pytest.mark.few(1)
@pytest.mark.parametrize("model", ["lumped", "exact"])
def test_every_effect_of_the_beat_up_runs_on_balls(model):
    """Limits stand off the plain machine's own peaks by a millionth."""
    scene = FULL.set("effects.rod_inertia.model", model)
    design = solved("beatup").design
    machine, angles = Machine(scene), np.linspace(0, 2 * math.pi, 200_001)
    rms, peak = machine.pulse_rms(design), float(np.abs(machine.torques(design, angles)[1]).max())
    for share, status in ((1e-6, "proven"), (-1e-6, "violated")):
        limits = {"peak_torque": f"{peak * (1 + share)!r} N*m", "pulse_rms": f"{rms * (1 + share)!r} N*m"}
        proofs = lo.prove(scene.update({f"limits.{name}.max": value for name, value in limits.items()}), design)
        assert [proof_of(proofs, name).status for name in limits] == [status] * 2
        claims = ("peak_torque", "reed_centrifugal", "shaking_force", "mu_min")
        assert [proof_of(proofs, f"peak {name}").status for name in claims] == ["proven"] * 4
    angle = proof_of(proofs, "peak_torque").angle
    assert abs(machine.torques(design, np.array([angle]))[1][0]) > peak * (1 - 1e-6)


def test_levels_are_judged_in_the_dwells_alone():
    """At the bottom K1 (X0 + h) must carry G − T2, at the top K1 X0 must carry G + T1."""
    scene = lo.load("shedding-static")
    least = (369.55 + 124.545) / 0.08
    for share, status in ((1e-6, "proven"), (-1e-6, "violated")):
        proofs = lo.prove(scene, {"K1": least * (1 + share), "X0": 0.08})
        statuses = [proof.status for proof in proofs.proofs if proof.limit == "N_min"]
        assert statuses == [status]
        claimed = {proof.limit: proof.status for proof in proofs.proofs}
        assert claimed["peak contact_min"] == claimed["peak contact_max"] == "proven"
    assert 300 <= math.degrees(proof_of(proofs, "N_min").angle) <= 360, "the upper dwell"


@pytest.mark.parametrize(("intervals", "symmetric"), [(6, False), (8, True)])
def test_a_free_law_is_proven_with_its_own_knots_whatever_the_target_has(intervals, symmetric):
    answer = freed(plain.PAPER, intervals, symmetric)
    scene, design = product(plain.PAPER), flat(answer.design)
    for target in ("law", "stiffness"):
        assert lo.prove(scene, answer.design, target).passed, target
        soft = proof_of(lo.prove(scene, {**design, "K1": design["K1"] * (1 - 1e-6)}, target), "N_min")
        assert soft.status == "violated"
        case = replace(plain.PAPER, law=tuple(answer.design["law"]))
        assert min(cam_force(case, design["K1"] * (1 - 1e-6), soft.angle)) < 0
    assert violated(lo.prove(scene, {}, "law")) == {"N_min"}, "today's law and spring"


def test_the_coils_of_an_answer_are_proven_and_a_wire_too_thin_is_not():
    scene = lo.load("shedding-printed-travel").with_effect("coil")
    answer = lo.solve(scene, prove=True, starts=1)
    assert (answer.status, answer.certificate.whole_cycle) == ("optimal", "proven")
    proofs = lo.prove(scene, answer.design)
    rows = {"coil_index", "shear_share", "bending_share", "surge_ratio", "spring_length", "coils give K1"}
    assert rows <= {proof.limit for proof in proofs.proofs}
    thin = lo.prove(scene, {**answer.design, "wire": answer.design["wire"] * (1 - 1e-6)})
    assert "coils give K1" in violated(thin)


# Where a false proof might hide ---------------------------------------------------------------------------------------


@pytest.mark.few(6)
@pytest.mark.parametrize(
    ("job", "number", "value", "limit"),
    [
        *(("shedding", name, value, "N_min") for name, value in (("rise", 1.9), ("return", 1.9), ("M", 45.0))),
        *(("shedding", name, value, "N_min") for name, value in (("G", 500.0), ("travel", 0.07), ("speed", 70.0))),
        *(("beatup", name, value, "peak_torque") for name, value in (("J4", 0.9), ("speed", 80.0))),
        *(("rapier", name, value, DWELL.format("after")) for name, value in (("wheel", 0.3), ("s_dwell", 0.003))),
        *(("rapier", name, value, "stroke is reached") for name, value in (("l1", 0.078), ("stroke", 0.9))),
    ],
)
def test_a_design_is_judged_by_its_own_numbers_whether_the_target_chooses_them_or_not(job, number, value, limit):
    scene = lo.load(job)
    scene = scene.set("limits.peak_torque.max", "95 N*m") if job == "beatup" else scene
    design = {**solved(job).design, number: value}
    assert limit not in violated(proofs_of(job))
    assert limit in violated(lo.prove(scene, design))
    assert not all(item.ok for item in lo.evaluate(scene, design).limits)


@pytest.mark.slow
def test_a_free_sleys_answer_is_proven_without_freeing_it_again():
    answer = lo.solve(lo.load("rapier").free(["sley"]), starts=1)
    assert all(limit.ok for limit in lo.evaluate(lo.load("rapier"), answer.design).limits)
    assert lo.prove(lo.load("rapier"), answer.design).passed


def test_a_free_cams_answer_is_proven_without_freeing_it_again():
    freed_angles = lo.load("shedding").free(["rise", "far_dwell", "return", "near_dwell"])
    assert lo.prove(lo.load("shedding"), lo.solve(freed_angles, starts=1).design).passed


def test_a_looser_limit_of_the_same_name_hides_none():
    """The target's own tolerance of 7.45 N*m beside 20 N*m in [limits], a design with 8 N*m."""
    scene = lo.load("beatup").set("limits.M3_fdc.max", "20 N*m")
    design = lo.solve(lo.load("beatup").set("targets.torque.M3_tolerance", "8 N*m"), "torque", starts=1).design
    statuses = {proof.text: proof.status for proof in lo.prove(scene, design, "torque").proofs}
    assert statuses["M3_fdc <= 20 N*m"] == "proven"
    assert statuses["M3_fdc <= 7.45 N*m"] == "violated"


def test_the_fastest_speed_is_proven_and_a_design_without_a_speed_runs_at_the_scenes():
    scene, answer = lo.load("shedding"), solved("shedding", "speed")
    faster = {**answer.design, "speed": answer.design["speed"] * (1 + 1e-6)}
    assert lo.prove(scene, answer.design, "speed").passed
    assert violated(lo.prove(scene, faster, "speed")) == {"N_min"}
    assert violated(lo.prove(scene, {}, "speed")) == {"N_min"}


@pytest.mark.parametrize(("l1", "gap"), [(31, 1e-4), (31, 1e-6), (45, 1e-5)])
def test_a_peak_beside_a_change_point_is_no_lower_than_what_is_proven_of_it(l1, gap):
    """The dyad folds flat but for a share `gap` of the room: the spike is some sqrt(gap) rad wide, at 180 deg."""
    scene = lo.load("beatup").update({"mechanism.l1": f"{l1} mm", "mechanism.l4": f"{220 * (1 - gap) - l1!r} mm"})
    design = {**scene.mechanism}
    near = np.sqrt(gap) * np.concatenate([-np.geomspace(1e-6, 1e3, 20_000), [0.0], np.geomspace(1e-6, 1e3, 20_000)])
    highest = float(np.abs(Machine(scene).torques(design, math.pi + near)[1]).max())
    proofs = lo.prove(scene)
    claim = proof_of(proofs, "peak peak_torque")
    assert claim.status in ("proven", "undecided")
    below = lo.prove(scene.set("limits.peak_torque.max", f"{highest * (1 - 1e-6)!r} N*m"))
    assert proof_of(below, "peak_torque").status != "proven"
    if claim.status == "proven":
        assert claim.slack / SLACK > 0.1 * highest


def wrapped(m, values, phi):
    """An angle that grows all round and jumps from π to −π at 0.3 + π."""
    return m.atan2(m.sin(phi - 0.3), m.cos(phi - 0.3)) + 0 * values["x"]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_jump_of_the_angle_inside_a_box_is_not_stepped_over(sign):
    square, limits = {"f": lambda v: v["x"] ** 2}, (("wave", 1, 3.0),)
    made = toy.program("x", square, {"wave": wrapped}, limits=limits, signed=True, bounded=True)
    boxes = Boxes(Sampler(made.model, {"x": 0.0}))
    assert "proven" not in {boxes.bound("wave", sign, limit).status for limit in (2.5, 3.0, 3.1)}


def test_a_link_that_turns_right_over_has_no_stroke_to_prove(monkeypatch):
    """Its travel runs on, 4π a turn; what is read of it jumps at ±2π m."""
    lengths = {"C0x": -0.06, "C0y": 0.17, "l4": 0.3, "l5": 0.2, "l6": 0.2, "phi40": 0.0}
    monkeypatch.setattr(taylor_bounds, "MOST_BOXES", 2000)
    try:
        claim = proof_of(lo.prove(lo.load("rapier"), lengths), "peak stroke")
    except BadInput:
        return
    assert claim.status != "proven"
