"""Cam laws from tables with few digits: the spring of the true law, what is told of the table, and what is refused."""

import math

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.maths.systems import FLOAT
from loomopt.physics.mechanisms.cam_laws import LAWS


def double_harmonic(u):
    x = math.pi * u
    return ((1 - math.cos(x)) - (1 - math.cos(2 * x)) / 4) / 2


def cycloid(u):
    return u - math.sin(2 * math.pi * u) / (2 * math.pi)


def modified_sine(u):
    return float(LAWS["modified_sine"].formula(FLOAT, u, float((u >= 1 / 8) + (u >= 7 / 8))).s)


def written(path, law, travel, rise, step, digits):
    """Write a law as a table, rows every so many degrees, so many decimals of a millimetre."""
    count = round(rise / step)
    lines = [f"{k * step:g},{travel * law(k / count):.{digits}f}" for k in range(count + 1)]
    path.write_text("angle [deg],s [mm]\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def norton(path):
    """Return a follower of 1 kg on a rise and fall without dwells (Norton, problem 15-13), its law from a table."""
    document = {
        "problem": {"name": "norton", "job": "shedding", "title": "double harmonic", "source": "Norton 15-13"},
        "operation": {"speed": "200 rpm", "N_min": "0 N"},
        "mechanism": {
            "law": "table",
            "law_table": str(path),
            "segments": [{"angle": "180 deg", "to": "20 mm"}, {"angle": "180 deg", "to": "0 mm"}],
            "K1": "10 N/m",
            "X0": "20 mm",
        },
        "effects": {"inertia": {"M": "1 kg"}, "damping": {"C": "0.632455532 N*s/m"}},
        "bounds": {"K1": {"min": "0 N/m", "max": "100 kN/m"}, "X0": {"min": "0 mm", "max": "20 mm"}},
    }
    return lo.scene(document)


def heald(path):
    """Return a heald frame of 30 kg and 60 mm whose law is a table."""
    document = {
        "problem": {"name": "heald", "job": "shedding", "title": "a heald frame", "source": "made up"},
        "operation": {"speed": "300 rpm", "N_min": "0 N"},
        "mechanism": {
            "law": "table",
            "law_table": str(path),
            "travel": "60 mm",
            "rise": "120 deg",
            "far_dwell": "60 deg",
            "return": "120 deg",
            "near_dwell": "60 deg",
            "K1": "5 N/mm",
            "X0": "50 mm",
        },
        "effects": {"inertia": {"M": "30 kg"}},
        "bounds": {"K1": {"min": "0 N/m", "max": "1000 kN/m"}, "X0": {"min": "0 mm", "max": "80 mm"}},
    }
    return lo.scene(document)


@pytest.mark.parametrize(
    ("step", "digits", "most"), [(5, 12, 2e-3), pytest.param(1, 3, 1e-2, marks=pytest.mark.slow), (2, 4, 5e-3)]
)
def test_the_spring_is_that_of_the_true_law(tmp_path, step, digits, most):
    scene = norton(written(tmp_path / "law.csv", double_harmonic, 20, 180, step, digits))
    assert lo.solve(scene).design["K1"] == pytest.approx(219.374539, rel=most)


@pytest.mark.parametrize(("step", "digits"), [pytest.param(1, 3, marks=pytest.mark.slow), (2, 3), (2, 4)])
def test_a_frame_with_dwells_has_the_spring_of_the_true_law(tmp_path, step, digits):
    scene = heald(written(tmp_path / "law.csv", cycloid, 60, 120, step, digits))
    assert lo.solve(scene).design["K1"] == pytest.approx(18964.2842, rel=1e-2)


def test_precision_misfit_change_and_uncertainty_are_told(tmp_path):
    scene = heald(written(tmp_path / "law.csv", cycloid, 60, 120, 2, 3))
    (report,) = lo.evaluate(scene).as_dict()["tables"]
    assert report["key"] == "mechanism.law_table"
    assert report["rows"] == 61
    assert report["precision"] == {"angle": 0.0, "s": pytest.approx(5e-7)}
    assert 0 < report["misfit"]["s"] < 2e-6
    assert 0 < report["change"] < 1.3 * 5e-7
    assert 0 < report["uncertainty"] < 0.02
    remark = registry.of(scene).views.remarks(scene, {})[0]
    assert "s to ±0.0005 mm" in remark
    assert "uncertain by" in remark


@pytest.mark.slow
def test_digits_say_that_zeros_were_cut_off(tmp_path):
    path = written(tmp_path / "law.csv", cycloid, 60, 120, 2, 3)
    (plain,), (exact,) = (
        lo.evaluate(scene).as_dict()["tables"] for scene in (heald(path), heald(path).set("mechanism.digits", 9))
    )
    assert exact["precision"]["s"] == pytest.approx(5e-13)
    assert exact["change"] < 1e-2 * plain["change"]


def test_a_table_that_cannot_tell_accelerations_is_refused_where_they_are_read(tmp_path):
    path = written(tmp_path / "law.csv", modified_sine, 10, 100, 1, 2)
    scene = heald(path).set("mechanism.travel", "10 mm")
    needed = r"s'' is uncertain by 2\d % of its peak.*s to 3 decimals of mm instead of 2"
    with pytest.raises(BadInput, match=needed) as caught:
        lo.solve(scene)
    assert caught.value.key == "mechanism.law_table"
    assert lo.evaluate(scene).as_dict()["tables"][0]["uncertainty"] > 0.1
    registry.of(scene).demand(scene.without_effect("inertia"), "stiffness")


def test_a_table_too_coarse_is_refused_with_the_spacing_it_needs(tmp_path):
    scene = heald(written(tmp_path / "law.csv", modified_sine, 60, 80, 10, 6))
    with pytest.raises(BadInput, match="a row every 5 deg"):
        registry.of(scene).demand(scene, "stiffness")


@pytest.mark.parametrize(("unit", "size"), [("rad", math.pi / 180), ("deg", 1.0)])
def test_rounded_angles_of_even_steps_are_even(tmp_path, unit, size):
    path = tmp_path / "law.csv"
    rows = [f"{120 * k / 36 * size:.4f},{60 * cycloid(k / 36):.6f}" for k in range(37)]
    path.write_text(f"angle [{unit}],s [mm]\n" + "\n".join(rows), encoding="utf-8")
    from loomopt.jobs.shedding.scene import read_law

    law = read_law(heald(path)).law
    assert law.u == pytest.approx(np.arange(37) / 36, abs=1e-15)
    assert law.fit.uncertainty < 0.02


def test_tables_of_other_jobs_are_told_too():
    for name, target, key in [("rapier", "match", "targets.match.table"), ("path-18", "path", "targets.path.table")]:
        scene = lo.load(name)
        (record,) = registry.of(scene).tables(scene, target)
        assert record.key == key
        assert any(misfit for misfit in record.misfit.values())
        assert all(half >= 0 for half in record.precision.values())
