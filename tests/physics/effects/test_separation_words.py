"""Separation: its curves, what it refuses, what it says."""

import dataclasses
import math
import subprocess
import sys

import made_up_effects as made_up
import numpy as np
import pytest
from flying_frames import JOB, ON, RUBBED, SLOW, figures

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.base.units import factor
from loomopt.interface import answer_table
from loomopt.interface.text import scenes
from loomopt.jobs import registry
from loomopt.physics.effects.shedding import separation, weight
from loomopt.studies.accuracy import accuracy


def test_curves_show_frame_and_cam_apart():
    table = lo.simulate(SLOW)
    phi, gap, N = (table[name].to_numpy() for name in ("phi [rad]", "gap [m]", "N [N]"))
    second_figures = figures(SLOW)
    assert (phi[0], phi[-1]) == (0.0, 2 * math.pi)
    assert np.all(np.diff(phi) >= 0)
    assert np.array_equal(np.maximum(table["X [m]"] - table["X_cam [m]"], 0), gap)
    flying = gap > 1e-9
    assert flying.any()
    assert np.all(N[flying] == 0)
    assert np.all(table["cam_torque [N*m]"][flying] == 0)
    assert gap[phi < second_figures["lift_off"] - 1e-9].max() == 0
    assert gap.max() == pytest.approx(second_figures["gap_max"], rel=1e-4)
    terms = sum(table[f"{name} [N]"] for name in ("return_spring", "weight", "warp_tension", "inertia"))
    assert np.abs(terms - N).max() <= 1e-11 * np.abs(table["inertia [N]"]).max(), "the equation of motion"
    at = np.flatnonzero(np.abs(phi - second_figures["landing"]) < 1e-12)
    before, after = table["X_t [m/s]"].to_numpy()[at[[0, -1]]]
    assert before == pytest.approx(second_figures["landing_speed"], rel=1e-12), "the cam dwells there"
    assert after == pytest.approx(-0.3 * before, rel=1e-12)
    even = table[(phi > 2.0) & (phi < 2.9)].drop_duplicates("phi [rad]")
    slopes = np.gradient(even["X [m]"], even["phi [rad]"])[1:-1]
    assert slopes == pytest.approx(even["X_1 [m/rad]"].to_numpy()[1:-1], rel=1e-3, abs=1e-5)


def test_curves_of_flight_are_not_thinned():
    with pytest.raises(BadInput, match="the accuracy of curves"):
        lo.simulate(SLOW, accuracy=1e-6)


def test_curves_of_two_turns_go_on_beyond_the_first():
    table = lo.simulate(ON)
    assert table["phi [rad]"].max() == pytest.approx(4 * math.pi)
    X = table["X [m]"].to_numpy()
    assert X[0] == pytest.approx(X[-1], rel=1e-8)
    marks = JOB.views.marks(ON, {})
    assert "far dwell of turn 2" in marks
    assert not any("least cam force" in name for name in marks), "in flight there is none"
    assert "least cam force" in JOB.views.marks(ON, {"K1": 2e5})


def test_curves_of_a_frame_that_stays_on_are_those_without_the_effect():
    stiff = {"K1": 2e5}
    with_, without = (lo.simulate(scene, stiff) for scene in (ON, ON.without_effect("separation")))
    assert with_["gap [m]"].max() == 0.0
    both = with_.drop_duplicates("phi [rad]").merge(without.drop_duplicates("phi [rad]"), on="phi [rad]")
    assert len(both) >= 720
    assert np.array_equal(both["N [N]_x"], both["N [N]_y"])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"effects.warp_tension.shape": "step"}, "separation and warp_tension with shape step cannot be on together"),
        ({"effects.warp_tension.shape": "levels"}, "separation and warp_tension with shape levels cannot be"),
        ({"mechanism.K1": "1000 N/m"}, "begins in contact at cam angle 0, where the force of contact would be -414"),
        ({"effects.separation.restitution": 1}, "out of range"),
        ({"effects.separation.turns": 0}, "Allowed: a whole number, at least 1, at most 10000"),
        ({"limits.gap_max.max": "1 mm"}, "this figure cannot be limited"),
    ],
)
def test_what_cannot_be_followed_is_refused(changes, message):
    with pytest.raises(BadInput, match=message):
        lo.evaluate(ON.update(changes))


def test_it_needs_the_inertia():
    with pytest.raises(BadInput, match="separation needs the effect inertia"):
        ON.without_effect("inertia")


def test_a_load_whose_force_flight_does_not_know_is_refused_by_name(monkeypatch):
    monkeypatch.setattr(registry, "entry_points", made_up.points)
    scene = registry.load("shedding").with_effect("separation")
    scene = scene.update({"effects.made_up_output": {"c": "0.02", "a": "0.3"}})
    for refused in (lo.evaluate, lo.simulate, lo.solve):
        with pytest.raises(BadInput, match=r"separation and made_up_output cannot be on together: .*the crank angle"):
            refused(scene)


@pytest.mark.parametrize(
    ("force", "why"),
    [
        (lambda at: at.pose.u, "it reads the mechanism's u"),
        (lambda at: at.pose.velocity**2, "it is not linear"),
    ],
)
def test_so_is_one_that_reads_the_cam_or_is_not_linear(force, why, monkeypatch):
    from loomopt.model.separation import UnfollowedError, _form

    sampler = JOB.sampler(ON, {})
    load = dataclasses.replace(weight.EFFECT, force=force)
    with pytest.raises(UnfollowedError, match=f"weight cannot be on together: .*{why}"):
        _form(sampler, separation.EFFECT, load, 0.0)


def test_all_other_effects_work_with_it():
    scene = ON.with_effect("damping", "dry_friction", "spring_inertia", "coil")
    sampler = JOB.sampler(scene, {})
    body = JOB.parted(scene, sampler).course.body
    assert body.mass == pytest.approx(37.68361265059934 + 0.5 / 3, rel=1e-14)
    assert (body.damping, body.friction) == pytest.approx((35.0, 20.0), rel=1e-14)
    h, K1 = 0.0656, 8029.14
    expected = [(K1 + 2 * T / h, K1 * 0.08 - 369.55 - T) for T in (124.545, 83.03)]
    assert [tuple(zone) for zone in body.zones] == [pytest.approx(zone, rel=1e-12) for zone in expected]
    assert body.corners == (h / 2,)
    assert figures(scene)["lift_off"] is not None


def test_a_sweep_carries_the_figures():
    study = lo.sweep(ON, {"effects.separation.restitution": ["0", "0.3"]})
    assert all("landing_energy" in row.figures for row in study.rows)
    assert "gap_max [mm]" not in study.table(), "at the optimum nothing is lost"


def test_proofs_and_the_study_of_accuracy_say_what_they_leave_out():
    stiff, report = ON.set("mechanism.K1", "2e5 N/m"), "separation, which is simulated (lift_off, landing,"
    proofs = lo.prove(stiff)
    assert proofs.passed
    assert report in "".join(proofs.uncovered)
    assert report in proofs.as_dict()["uncovered"][0]
    assert f"Not covered: {report}" in accuracy.summarise(ON, []).advice
    without = stiff.without_effect("separation")
    assert "uncovered" not in lo.prove(without).as_dict()


def test_the_scenes_own_equations_have_flight_and_landing():
    report = dict(text.split("\n    ", 1) for text in scenes.equations(RUBBED.with_effect("spring_inertia")))
    terms = "N_damping + N_dry_friction + N_inertia + N_return_spring + N_spring_inertia + N_warp_tension + N_weight"
    assert report["flight"].startswith(f"{terms} = 0 while X > X_cam")
    assert "X'_after = X'_cam - restitution*(X'_before - X'_cam)" in report["landing"]
    assert report["at rest in flight"].endswith("no more than F")
    assert report["landing_energy"] == "landing_energy = landing_speed^2*(M + m_s/3)/2"
    plain = dict(text.split("\n    ", 1) for text in scenes.equations(ON))
    assert "at rest in flight" not in plain
    assert not {"flight", "landing"} & {
        text.split("\n")[0] for text in scenes.equations(ON.without_effect("separation"))
    }


@pytest.mark.few(1)
@pytest.mark.parametrize(("words", "flown"), [([], False), (["--with", "separation"], True)])
def test_flight_is_imported_only_where_a_scene_needs_it(words, flown):
    code = (
        "import sys; from loomopt.interface.cli import app as cli\n"
        f"cli.run(['evaluate', 'shedding', '--json', *{words!r}])\n"
        "names = [name for name in sys.modules if 'loomopt.physics.motion' in name or 'parting' in name]\n"
        "print(names, file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ("loomopt.physics.motion.flight" in done.stderr) == flown
    assert flown or done.stderr.strip().endswith("[]")


def test_an_inch_frame_at_350_rpm_shows_its_own_units():
    inches = {"length": "in", "force": "lbf", "mass": "lb"}
    metric = ON.set("operation.speed", "350 rpm")
    scene = metric.update({f"display.{kind}": unit for kind, unit in inches.items()})
    rows = {row.name: row for row in answer_table.rows(lo.evaluate(scene).result, scene)}
    si = figures(metric)
    assert (rows["gap_max"].unit, rows["landing_energy"].unit) == ("in", "lbf*in")
    assert rows["gap_max"].value * factor("in") == pytest.approx(si["gap_max"], rel=1e-12)
    assert rows["landing_energy"].value * factor("lbf*in") == pytest.approx(si["landing_energy"], rel=1e-12)
    assert rows["landing_speed"].unit == "in/s"
    assert any(" in/s against the cam" in text for text in JOB.views.remarks(scene, {}))
