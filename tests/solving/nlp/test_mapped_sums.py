"""An NLP whose steady motions are mapped functions: the rows, slopes and curvatures of the one that is written out."""

import casadi as ca
import numpy as np
import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.solving.nlp import expressions, mapped_sums, transcribe
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.point import Settings, sampler_at
from loomopt.solving.nlp.rows import structure

SHAFT = {"effects.shaft_torsion.stiffness": "2 MN*m/rad", "effects.shaft_torsion.damping": "45 N*m*s/rad"}
DESIGN = {"l1": 0.0311, "l2": 0.07, "l3": 0.152, "l4": 0.166, "s": 0.011}


def sampled_pulse(folder):
    """Curve of the resistance with more intervals than a switch selects one of by a formula."""
    angles = np.linspace(-14.9, 14.9, 13)
    rows = [
        f"{angle!r},{745 * np.cos(np.pi * angle / 29.8):.6f},{int(abs(angle) == 14.9)}" for angle in angles.tolist()
    ]
    path = folder / "pulse.csv"
    path.write_text("\n".join(["angle [deg],M [N*m],corner", *rows]) + "\n", encoding="utf-8")
    return str(path)


def beatup(folder):
    return lo.load("beatup").update(SHAFT), "pulse", DESIGN


def with_choices(folder):
    return lo.load("beatup").update({**SHAFT, "effects.resistance.table": sampled_pulse(folder)}), "balance", DESIGN


def six_bar(folder):
    scene = lo.load("sixbar-sley").change({}, off=("gravity",)).update(SHAFT)
    return scene.set("limits.twist_peak.max", "0.3 mrad"), "balance", {"mass": 2.0}


def put(scene, target, moved):
    """NLP at a design, with the arguments of its functions."""
    job = registry.of(scene)
    program = job.program(scene, target)
    x = job.values(program, {**job.today(scene), **moved})
    x = {variable.name: moved.get(variable.name, x[variable.name]) for variable in program.variables}
    sampler = sampler_at(program, x)
    calls = Calls(program, Settings())
    nodes = [peak[:2] for peak in calls.peaks(sampler)]
    nlp = transcribe.Transcription(structure(program, sampler, 2))
    nlp.solver(False, Settings())
    return nlp, calls.arguments(nlp, sampler, x, calls.first_extra(nlp, sampler), nodes)


def derivatives(nlp, arguments):
    """Objective, its slopes, rows, their slopes and the curvature of a Lagrangian."""
    x, p = arguments["x0"], arguments["p"]
    rows, slopes = (np.asarray(part) for part in nlp.jacobian(x, p))
    value, slope = nlp.gradient(x, p)
    prices = np.linspace(-1.0, 2.0, rows.size)
    return [float(value), np.ravel(slope), rows.ravel(), slopes, np.asarray(nlp.curvature(x, p, 0.7, prices))]


@pytest.mark.slow
@pytest.mark.parametrize("case", [beatup, with_choices, six_bar])
def test_derivatives_are_those_of_the_expressions_written_out(case, tmp_path, monkeypatch):
    scene, target, moved = case(tmp_path)
    nlp, arguments = put(scene, target, moved)
    ours = derivatives(nlp, arguments)
    monkeypatch.setattr(expressions, "with_recorder", lambda system, recorder: system)
    monkeypatch.setattr(mapped_sums.SumRecorder, "harmonics", written_out)
    plain, arguments = put(scene, target, moved)
    assert [type(item.nlp["f"]) for item in (nlp, plain)] == [ca.MX, ca.SX]
    theirs = derivatives(plain, arguments)
    for mine, wanted in zip(ours, theirs, strict=True):
        size = np.max(np.abs(wanted))
        assert size > 0
        assert np.max(np.abs(mine - wanted)) <= 1e-11 * size


def written_out(recorder, cosines, sines, phi):
    return systems.casadi().harmonics(cosines, sines, phi)


@pytest.mark.parametrize("name", ["beatup", "sixbar-sley"])
def test_the_expressions_do_not_grow_with_the_angles_of_a_turn(name):
    """Rows with a steady motion have a few times the nodes of rows without, not those of a pose at every angle."""
    rigid = lo.load(name).change({}, off=("gravity",) if name == "sixbar-sley" else ())
    sizes = []
    for scene in (rigid.update(SHAFT), rigid):
        job = registry.of(scene)
        program = job.program(scene, "balance")
        sizes.append(transcribe.graph_size(program, job.values(program, job.today(scene))))
    assert sizes[0] < 6 * sizes[1]
