"""Rapier scenes at and beyond the edge: a true statement each time, and relaxations that help when granted."""

import math
import warnings

import pytest
from support import slow

import loomopt as lo
from loomopt.base.errors import BadInput
from reference.rapier import LENGTHS, OPERATION

HARD: dict[str, dict[str, object]] = {
    "second crank of no length": {"mechanism.l4": "1e-6 mm", "bounds.l4": "1e-6 mm"},
    "second shaft on the sley's path": {
        "bounds.C0x": {"min": "100 mm", "max": "140 mm"},
        "bounds.C0y": {"min": "660 mm", "max": "690 mm"},
    },
    "five-bar that locks for part of the turn": {"bounds.l4": {"min": "150 mm", "max": "250 mm"}},
    "dwell longer than the geometry allows": {
        "operation.dwell_after": "80 deg",
        "operation.dwell_before": "80 deg",
    },
    "no room in the dwell": {"operation.s_dwell": "0.001 mm"},
    "stroke out of reach": {"operation.stroke": "2000 mm"},
    "transmission angle all but right": {"limits.mu_min.min": "89 deg"},
}


def granted(scene, relaxations, more):
    """Return the scene with relaxations granted, each `more` beyond, relative to the limit."""
    changes: dict[str, object] = {}
    for relaxation in relaxations:
        name, side = relaxation.limit, relaxation.side
        outward = 1 if side == "max" else -1
        value = relaxation.needed + outward * more * max(abs(relaxation.needed), abs(relaxation.value))
        unit = "m" if name in (*LENGTHS, *OPERATION[:2]) else "rad"
        text = f"{value!r} {unit}"
        if name in scene.operation:
            changes[f"operation.{name}"] = text
        elif name in scene.bounds:
            old = scene.bounds[name]
            ends = {"min": f"{old.min!r} {unit}", "max": f"{old.max!r} {unit}"}
            changes[f"bounds.{name}"] = ends | {side: text}
        else:
            changes[f"limits.{name}.{side}"] = text
    return scene.update(changes)


def numbers(answer):
    return [*answer.design.values(), *(v for v in answer.figures.values() if v is not None)]


@pytest.mark.slow
@pytest.mark.parametrize("name", slow.after(5, HARD))
def test_what_cannot_be_had_is_said_with_relaxations_that_help(name):
    scene = lo.load("rapier").update(HARD[name])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        answer = lo.solve(scene, starts=1)
    assert answer.status == "infeasible", answer.message
    assert not answer.admissible
    assert all(math.isfinite(value) for value in numbers(answer))
    assert answer.relaxation
    together = [relaxation for relaxation in answer.relaxation if not relaxation.alone] or [answer.relaxation[0]]
    helped = lo.solve(granted(scene, together, 1e-3), starts=1)
    assert helped.status in ("optimal", "uncertified"), helped.message
    assert helped.admissible


def test_a_design_that_no_start_leads_to_is_found_from_todays_machine():
    """No drive with so short a link closes near any start; the least relaxation is none: solve from there."""
    answer = lo.solve(lo.load("rapier").update({"bounds.l5": {"min": "50 mm", "max": "120 mm"}}), starts=1)
    assert answer.status == "optimal", answer.message
    assert answer.design["l5"] == pytest.approx(0.120, rel=1e-9)


@pytest.mark.slow
def test_a_transmission_angle_of_80_degrees_is_bought_with_acceleration():
    scene = lo.load("rapier")
    steep, plain = lo.solve(scene.set("limits.mu_min.min", "80 deg"), starts=1), lo.solve(scene, starts=1)
    assert steep.status == "optimal"
    assert steep.figures["mu_min"] >= math.radians(80) - 1e-9
    assert steep.figures["peak_acceleration"] > plain.figures["peak_acceleration"]


@pytest.mark.slow
def test_a_drive_that_is_fixed_altogether_is_told_its_own_stroke():
    scene = lo.load("rapier")
    fixed = {f"bounds.{name}": scene.given(f"mechanism.{name}") for name in scene.bounds if scene.bounds[name].free}
    answer = lo.solve(scene.update(fixed), starts=1)
    assert answer.status == "infeasible"
    relaxation = answer.relaxation[0]
    assert relaxation.limit == "stroke"
    assert relaxation.needed == pytest.approx(lo.evaluate(scene).figures["stroke"], rel=1e-9)


def wished(tmp_path, text):
    """Return the packaged scene with a table of its own."""
    if text is not None:
        (tmp_path / "wish.csv").write_text(text, encoding="utf-8")
    return lo.load("rapier").set("targets.match.table", str(tmp_path / "wish.csv"))


ROWS = "".join(f"{10 * k},{k}\n" for k in range(12))
TABLES = {
    "wrong header": ("angle,S [mm]\n" + ROWS, "column phi1"),
    "header without unit": ("phi1,S\n" + ROWS, "column phi1"),
    "wrong unit": ("phi1 [deg],S [kg]\n" + ROWS, "column S"),
    "not a number": ("phi1 [deg],S [mm]\n" + ROWS + "120,nan\n", 'line 14, column S: "nan" is no number'),
    "infinite": ("phi1 [deg],S [mm]\n" + ROWS + "120,inf\n", 'line 14, column S: "inf" is no number'),
    "row cut short": ("phi1 [deg],S [mm]\n" + ROWS + "120\n", "line 14, column S: the cell is empty"),
    "three rows": ("phi1 [deg],S [mm]\n0,0\n90,400\n180,850\n", "3 rows"),
    "empty": ("", "empty"),
    "missing": (None, "does not exist"),
}


@pytest.mark.parametrize("name", TABLES)
def test_a_table_that_cannot_be_matched_is_refused(tmp_path, name):
    text, part = TABLES[name]
    with pytest.raises(BadInput, match=part) as refused:
        lo.solve(wished(tmp_path, text), "match", starts=1)
    assert "\n" not in str(refused.value)


def travels(scene, every):
    """Return a scene's travel as a table for target match: each so many of the curves' rows."""
    curves = lo.simulate(scene).iloc[::every]
    pairs = zip(curves["phi [rad]"], curves["S [m]"], strict=True)
    return "phi1 [deg],S [mm]\n" + "".join(f"{math.degrees(phi)!r},{1e3 * travel!r}\n" for phi, travel in pairs)


def second_drive():
    """Return another drive than the packaged one, from whose start it has to be found."""
    return lo.load("rapier").update({"mechanism.l4": "11 mm", "mechanism.l6": "190 mm"})


@pytest.mark.parametrize(
    "every", [pytest.param(18, id="today's"), pytest.param(19, id="another drive's", marks=pytest.mark.slow)]
)
def test_a_drives_own_travel_is_recovered(tmp_path, every):
    """To 1e-7 m of 0.85 m: the mean square is then at rounding, its root is not."""
    scene = lo.load("rapier") if every == 18 else second_drive()
    answer = lo.solve(wished(tmp_path, travels(scene, every)), "match", starts=1)
    assert answer.status == "optimal", answer.message
    assert answer.figures["match_rms"] < 1e-7


@pytest.mark.slow
def test_a_second_table_is_matched_and_not_the_first(tmp_path):
    for every in (20, 24):
        answer = lo.solve(wished(tmp_path, travels(lo.load("rapier"), every)), "match", starts=1)
        assert answer.status == "optimal", answer.message
        assert answer.figures["match_rms"] < 1e-7
