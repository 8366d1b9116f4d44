"""Scenes whose fronts ended without a certificate: a second level of one design, corners that coincide, a jump."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from support import slow

import loomopt as lo
from loomopt.solving.search.search import NOT_CERTIFIED, certify_best
from loomopt.studies.front import front, plan
from loomopt.studies.front import solver as solving
from loomopt.studies.front.solver import Subproblem

CASES = Path(__file__).parent / "cases"


@pytest.mark.slow
def test_an_end_whose_second_level_leaves_one_design_is_certified():
    """Two pieces of the largest force and two of the least meet: each is held by one of them, none may rise."""
    scene = lo.load(CASES / "second_level_of_one_point.toml")
    second_front = lo.pareto(scene, ("K1", "contact_max"), "stiffness", points=8)
    assert all(row.certified for row in second_front.rows)
    assert len(second_front) == 8
    forces, stiffness = (plan.values(second_front.rows, axis) for axis in ("contact_max", "K1"))
    assert forces[0] == pytest.approx(2327.2748160284, rel=1e-9)
    assert stiffness[0] == pytest.approx(26213.778447679, rel=1e-9)
    # A linear trade is one straight line but for where the preload ends.
    line = stiffness[0] + (stiffness[-2] - stiffness[0]) / (forces[-2] - forces[0]) * (forces[3] - forces[0])
    assert stiffness[3] == pytest.approx(line, rel=1e-9)


@pytest.mark.slow
def test_between_points_very_close_together_a_price_rests_on_what_is_met_exactly():
    scene = lo.load(CASES / "corners_that_coincide.toml")
    trade = front.trade(scene, ("l4", "mu_min"), maximise=("mu_min",))
    rows = [trade.solved(task, None) for task in trade.batch(())]
    for angle in (1.1144963954250675, 1.1144964044438321, 1.114496390915685, 1.1144964089532143):
        asking = Subproblem(0, (None, trade.solver.axes[1].value(angle)))
        answer = trade.solver.solve(asking, [row.warm for row in rows], False)
        assert answer.status == "optimal", answer.reason


@pytest.mark.slow
def test_a_jump_is_told_as_one_and_beside_it_the_neighbours_design_stands():
    scene = lo.load(CASES / "jump.toml")
    second_front = lo.pareto(scene, ("l1", "M3_fdc"), "none", points=5)
    assert all(row.certified for row in second_front.rows)
    assert max(row.seconds for row in second_front.rows) < 18.0
    (jump,) = second_front.findings.changes
    ((low, high),) = second_front.findings.gaps
    assert jump.kind == "jump"
    assert low < 60.84002427 < high < 60.840025
    shortest, before = (row.design["l1"] for row in second_front.rows[:-3:-1])
    assert shortest == pytest.approx(0.0331774274, rel=1e-8)
    assert before == pytest.approx(0.0332447297, rel=1e-6)


@pytest.mark.slow
def test_a_row_is_bettered_by_its_neighbours_design_and_a_jump_of_design_is_told():
    """Two basins of a six-bar sley: the search finds the one that is worse from 81 deg to 83 deg of least angle."""
    scene = lo.load(CASES / "basins-of-a-sley.toml")
    second_front = lo.pareto(scene, ("peak_torque", "mu.beat"), maximise="mu.beat", points=5)
    assert all(row.certified for row in second_front.rows)
    best = {73.12393: 6.539777417, 79.02194: 6.733152704, 81.23367: 7.008311798, 81.97092: 7.153085393}
    axes = {plan.value(row, "mu.beat") * 180 / math.pi: plan.value(row, "peak_torque") for row in second_front.rows}
    for angle, torque in best.items():
        at_least = min(value for place, value in axes.items() if place >= angle - 1e-3)
        assert at_least == pytest.approx(torque, rel=1e-6), angle
    jumps = [change.interval for change in second_front.findings.changes if change.kind == "jump"]
    assert any(min(two) < 82.7 * math.pi / 180 < max(two) for two in jumps)
    assert not any(min(two) < 81.6 * math.pi / 180 < max(two) for two in jumps)
    assert second_front.as_dict()["bettered"] == second_front.findings.bettered > 0


@pytest.mark.slow
def test_warnings_that_are_errors_change_nothing_of_a_front():
    """Designs between which the swing is sought do not all close: NumPy divides by zero there."""
    place = str(CASES / "swing-of-a-sley.toml")
    axes = ["--minimise", "peak_torque", "--maximise", "swing", "--against", "swing", "--points", "5", "--json"]
    call = [sys.executable, "-W", "error", "-m", "loomopt", "pareto", place, *axes]
    result = subprocess.run(call, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert "arning" not in result.stderr
    rows = json.loads(result.stdout)["rows"]
    assert len([row for row in rows if not row.get("narrows")]) == 5
    assert len(rows) >= 9
    assert all(row["certified"] for row in rows)


def test_a_point_whose_second_level_is_not_certified_keeps_what_the_first_came_to(monkeypatch):
    scene = lo.load(CASES / "second_level_of_one_point.toml")
    solver = front.trade(scene, ("K1", "contact_max"), "stiffness").solver

    def refused(search):
        result = certify_best(search)
        two = len(result.program.objectives) == len(solver.base.objectives)
        return replace(result, best=result.best._replace(certificate=NOT_CERTIFIED)) if result.best and two else result

    monkeypatch.setattr(solving, "certify_best", refused)
    result = solver.solve(Subproblem(1, (None, None)), [], False)
    assert result.status == "optimal"
    assert result.warm["axes"]["contact_max"] == pytest.approx(2327.2748160284, rel=1e-9)


@pytest.mark.few(1)
@pytest.mark.parametrize("intervals", slow.after(1, [6, 9]))
def test_a_cap_far_beyond_its_natural_size_is_met_though_its_multiplier_is_small(intervals):
    """The torque may be forty times its scale: what it costs there is small, what its slope balances is not."""
    scene = lo.load("shedding").update(
        {
            "mechanism.travel": "93.8 mm",
            "mechanism.X0": "68 mm",
            "mechanism.law": "harmonic",
            "mechanism.rise": "122 deg",
            "mechanism.far_dwell": "16 deg",
            "mechanism.return": "148 deg",
            "mechanism.near_dwell": "74 deg",
            "operation.speed": "296.2 rpm",
            "operation.N_min": "187.53 N",
            "effects.inertia.M": "47.46 kg",
            "effects.weight.G": "184.7 N",
            "effects.warp_tension": {"T1": "264.6 N", "T2": "0 N", "shape": "step"},
            "effects.damping.C": "41.14 N*s/m",
            "bounds.K1": {"min": "0 N/m", "max": "31054117 N/m"},
            "bounds.X0": {"min": "0 mm", "max": "68 mm"},
            "targets.law.intervals": intervals,
        }
    )
    solver = front.trade(scene, ("spring_stretch", "peak_torque"), "law").solver
    for torque in (4118.5, 15658.3, 61817.0):
        answer = solver.solve(Subproblem(0, (None, torque)), [], False)
        assert answer.status == "optimal", answer.reason
        assert answer.warm["axes"]["peak_torque"] == pytest.approx(torque, rel=1e-6)
