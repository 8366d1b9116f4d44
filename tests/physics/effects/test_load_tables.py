"""Loads as curves of one's own: what formulas give as samples gives the same answers, and what is refused."""

import math

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.physics.effects.kinds import Inputs

PULSE = 29.8


def pulse(path, count=21, peak=745.0, turned=0.0):
    """Write the half cosine of the packaged scene as samples, and return its file's name."""
    rows = ["angle [deg],M [N*m],corner"]
    for k in range(count):
        angle, end = PULSE * (k / (count - 1) - 0.5), k in (0, count - 1)
        rows.append(f"{angle + turned!r},{0.0 if end else peak * math.cos(math.pi * angle / PULSE)!r},{int(end)}")
    path.write_text("\n".join(rows) + "\n")
    return str(path)


@pytest.fixture
def resisted(tmp_path):
    return lo.load("beatup").set("effects.resistance.table", pulse(tmp_path / "pulse.csv"))


def curve_of(scene, column, phi):
    frame = registry.of(scene).curves(scene, registry.of(scene).today(scene), also=phi)
    at = [int(np.argmin(np.abs(frame["phi [rad]"] - item))) for item in phi]
    return frame[column][at]


def test_the_pulse_as_samples_is_the_pulse(resisted):
    phi = [0.3, 1.0, 1.15, 1.3, 4.0]
    written, sampled = (curve_of(scene, "M_R [N*m]", phi) for scene in (lo.load("beatup"), resisted))
    assert sampled == pytest.approx(written, abs=2e-3)
    assert sampled[0] == sampled[-1] == 0.0


@pytest.mark.few(1)
@pytest.mark.parametrize("target", ["balance", "pulse", "torque"])
def test_an_optimum_with_the_sampled_pulse_is_that_of_the_pulse(resisted, target):
    first, second = (lo.solve(scene, target) for scene in (lo.load("beatup"), resisted))
    assert second.certificate.passed
    for name in ("peak_torque", "pulse_rms", "l2", "m4e"):
        texts = [{**item.design, **item.figures}[name] for item in (first, second)]
        assert texts[1] == pytest.approx(texts[0], rel=2e-5), name


def test_limits_are_proven_with_a_sampled_pulse(resisted):
    assert lo.prove(lo.solve(resisted).scene).proofs


def test_a_rocking_shaft_answers_the_samples_as_it_answers_the_pulse(tmp_path):
    twisted = {"effects.shaft_torsion.stiffness": "2 MN*m/rad", "effects.shaft_torsion.damping": "45 N*m*s/rad"}
    written = lo.load("beatup").update(twisted)
    results = []
    for count in (11, 41):
        sampled = written.set("effects.resistance.table", pulse(tmp_path / f"{count}.csv", count))
        figures = [lo.evaluate(scene).figures for scene in (written, sampled)]
        results.append(max(abs(figures[1][k] / figures[0][k] - 1) for k in ("twist_peak", "shaft_peak", "M3_fdc")))
    # Fourth order: samples four times as dense lie 256 times as near, but for the corners.
    assert results[1] < 1e-6
    assert results[1] < results[0] / 50


def test_M0_is_not_read_beside_a_table_and_that_is_said(resisted):
    other = resisted.set("operation.M0", "100 N*m")
    assert lo.evaluate(other).figures == lo.evaluate(resisted).figures
    text = " ".join(registry.of(other).views.remarks(other, {}))
    assert "21 samples with 2 corners" in text
    assert "operation.M0 is not read" in text


def test_a_scene_without_M0_has_its_torque_from_the_table(tmp_path):
    document = {name: dict(values) for name, values in lo.load("beatup").document.items()}
    del document["operation"]["M0"]
    document["effects"] = {
        "inertia": document["effects"]["inertia"],
        "resistance": {"table": pulse(tmp_path / "pulse.csv")},
    }
    assert lo.solve(lo.scene(document), "torque").status == "optimal"


def test_setting_a_table_takes_the_place_of_the_pulse_and_back(resisted):
    assert resisted.given("effects.resistance.pulse") is None
    assert resisted.set("effects.resistance.pulse", "29.8 deg").hash == lo.load("beatup").hash


@pytest.mark.parametrize(
    ("rows", "report"),
    [
        ("angle [deg],M [N*m]\n0,1\n5,2\n", "2 rows"),
        ("angle [deg],M [N*m]\n0,1\n5,2\n9,1\n", "mark both as corners"),
        ("angle [deg],M [N*m],corner\n0,1,1\n5,2,\n9,1,yes\n", 'line 4, column corner: "yes" is no mark'),
        ("angle [deg],M [N]\n0,1\n5,2\n9,1\n", 'line 1, column M: "N" is not a unit of this column'),
        ("angle [deg],T [N*m]\n0,1\n5,2\n9,1\n", "no column M [(]line 1: holds"),
    ],
)
def test_a_table_that_is_no_curve_is_refused_when_the_scene_is_read(tmp_path, rows, report):
    path = tmp_path / "bad.csv"
    path.write_text(rows)
    with pytest.raises(BadInput, match=report):
        lo.load("beatup").set("effects.resistance.table", str(path))


def test_both_a_table_and_a_pulse_are_refused(tmp_path):
    both = {"effects.resistance.table": pulse(tmp_path / "p.csv"), "effects.resistance.pulse": "20 deg"}
    with pytest.raises(BadInput, match="define the same quantity twice"):
        lo.load("beatup").update(both)


def test_a_resistance_without_anything_asks_for_the_pulse():
    document = {name: dict(values) for name, values in lo.load("beatup").document.items()}
    document["effects"] = {**document["effects"], "resistance": {}}
    with pytest.raises(BadInput, match="pulse is missing"):
        lo.scene(document)


def test_the_equations_say_what_the_curve_is(resisted):
    texts = [
        equation.text for equation in registry.of(resisted).views.equations(resisted) if equation.name == "resistance"
    ]
    assert len(texts) == 1
    assert "21 samples" in texts[0]
    assert "2 corners" in texts[0]


@pytest.mark.parametrize(
    ("job", "effect", "column"), [("beatup", "resistance", "M [N*m]"), ("shedding", "warp_tension", "T [N]")]
)
def test_a_curve_of_nothing_is_no_load(tmp_path, job, effect, column):
    path = tmp_path / "nothing.csv"
    path.write_text(f"angle [deg],{column},corner\n-10,0,1\n0,0,\n10,0,1\n")
    nothing, without = lo.load(job).set(f"effects.{effect}.table", str(path)), lo.load(job).without_effect(effect)
    first, second = (lo.evaluate(scene).figures for scene in (nothing, without))
    for name, value in second.items():
        if value is not None:
            assert first[name] == pytest.approx(value, rel=1e-9, abs=1e-9), name


@pytest.mark.parametrize("turns", [-1, 1])
def test_a_curve_is_the_same_on_every_turn(resisted, turns):
    """The load alone, a turn on; also where its corners are declared in another order."""
    from types import SimpleNamespace

    from loomopt.maths import systems
    from loomopt.model.numbers import curves
    from loomopt.physics.effects.beatup import resistance

    ((_, curve),) = curves(resisted).items()
    given, values = {"beta": 1.1}, {"table": curve}
    corners = resistance.corners(Inputs(systems.FLOAT, given, values, None))
    for phi in np.linspace(0.0, 2 * math.pi, 50):
        turned = float(phi) + 2 * math.pi * turns
        results = [
            resistance.force(
                Inputs(
                    systems.FLOAT, given, values, SimpleNamespace(phi=angle), resistance.EFFECT.switch(angle, corners)
                )
            )
            for angle in (float(phi), turned)
        ]
        assert results[1] == pytest.approx(results[0], abs=1e-9)


@pytest.mark.slow
def test_the_warp_as_samples_is_the_warp(tmp_path):
    """The linear pull over the packaged cam, a corner at each half open shed."""
    rows = ["angle [deg],T [N],corner"]
    for k in range(288):
        angle = 1.25 * k
        u = angle / 120 if angle < 120 else 1 if angle < 180 else (300 - angle) / 120 if angle < 300 else 0
        s = u - math.sin(2 * math.pi * u) / (2 * math.pi)
        pull = 124.545 * (1 - 2 * s) if s <= 0.5 else -83.03 * (2 * s - 1)
        rows.append(f"{angle!r},{pull!r},{int(angle in (60, 240))}")
    path = tmp_path / "warp.csv"
    path.write_text("\n".join(rows))
    written = lo.load("shedding")
    sampled = written.set("effects.warp_tension.table", str(path))
    first, second = lo.solve(written), lo.solve(sampled, prove=True)
    assert second.design["K1"] == pytest.approx(first.design["K1"], rel=1e-9)
    assert lo.evaluate(sampled).figures["contact_max"] == pytest.approx(
        lo.evaluate(written).figures["contact_max"], rel=1e-9
    )


def test_a_table_with_a_landing_is_refused_by_name(tmp_path):
    path = tmp_path / "warp.csv"
    path.write_text("angle [deg],T [N],corner\n0,1,1\n90,-100,1\n180,1,1\n")
    scene = lo.load("shedding").set("effects.warp_tension.table", str(path)).with_effect("separation")
    with pytest.raises(BadInput, match="warp_tension"):
        lo.evaluate(scene)
