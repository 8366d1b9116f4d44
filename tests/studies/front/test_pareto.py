"""Fronts as a designer works with them: tables, whole answers of points, the same rows whoever computes them."""

import json
import math
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from support import inch

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface import results
from loomopt.interface.study.points import StudyTable
from loomopt.jobs import registry
from loomopt.studies.front import front, plan
from loomopt.studies.run.store import Store

AXES = ("peak_torque", "m4e")
KILLED = """
import os, signal, sys
import loomopt as lo

seen = []

def stop(row):
    seen.append(row)
    if len(seen) == 6:
        os.kill(os.getpid(), signal.SIGKILL)

if __name__ == "__main__":
    lo.pareto("beatup", ("peak_torque", "m4e"), target="balance", points=8, store=sys.argv[1], workers=2, on_row=stop)
"""


@pytest.fixture(scope="module")
def serial():
    return lo.pareto("beatup", AXES, target="balance", points=8)


@pytest.fixture(scope="module")
def reed():
    return lo.pareto("beatup", ("peak_torque", "M3_fdc"), points=3, ranges={"M3_fdc": "20:40 N*m"})


def test_rows_are_in_the_order_of_the_second_axis(serial):
    masses = [row.design["m4e"] for row in serial.rows]
    assert masses == sorted(masses)
    assert (masses[0], masses[-1]) == (0.0, pytest.approx(6.286039692, rel=1e-8))
    assert {row.point for row in serial.rows} <= {row.point for row in serial.solved}
    assert len(serial.solved) > len(serial.rows), "some are dominated"


@pytest.mark.slow
def test_killed_after_some_rows_and_resumed_by_two_processes_it_has_the_same_digest(serial, tmp_path):
    script, store = tmp_path / "front.py", tmp_path / "s.db"
    script.write_text(KILLED)
    lo.sweep("beatup", {"operation.M0": ["800 N*m"]}, store=store)
    folder = {"PYTHONPATH": str(Path(lo.__file__).parents[1])}
    done = subprocess.run([sys.executable, script, store], env=os.environ | folder, capture_output=True, timeout=120)
    assert done.returncode == -signal.SIGKILL
    with Store(store) as opened:
        rows = opened.rows(serial.study.key)
    assert len(rows) == 6
    with pytest.raises(BadInput, match="holds 6 points of this study"):
        lo.pareto("beatup", AXES, target="balance", points=8, store=store)
    again = lo.pareto("beatup", AXES, target="balance", points=8, store=store, resume=True, workers=2)
    assert again.digest == serial.digest
    assert {row.point: row.seconds for row in rows}.items() <= {row.point: row.seconds for row in again.solved}.items()
    texts = [json.loads(text) for text in stored(store)]
    assert {data["study"] for data in texts} == {"sweep 5", "pareto 8"}, "a sweep and a front share the file"
    (values,) = (data for data in texts if data["study"] == "pareto 8")
    assert made_again(values).key == serial.study.key


def stored(path):
    """Return what a store says of its studies."""
    import sqlite3

    with sqlite3.connect(path) as file:
        return [text for (text,) in file.execute("SELECT told FROM study ORDER BY rowid")]


def made_again(report):
    """Return the study that a store tells of."""
    scene = registry.scene(report["document"])
    most = [axis for axis, sense in report["axes"].items() if sense == "most"]
    ranges = {axis: (low, high) for axis, (low, high) in report["ranges"].items()}
    axes, settings = list(report["axes"]), {"points": report["points"], "accuracy": report["accuracy"]}
    return front.trade(scene, axes, report["target"], maximise=most, ranges=ranges, **settings)


@pytest.mark.slow
def test_two_processes_from_the_start_have_the_same_digest(serial):
    assert lo.pareto("beatup", AXES, target="balance", points=8, workers=2).digest == serial.digest


@pytest.mark.slow
def test_a_dask_cluster_of_which_a_worker_is_killed_has_the_same_digest(serial):
    distributed = pytest.importorskip("distributed")
    killed: list[int] = []

    def kill(row):
        if not killed and row.parent is not None:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    )
    with cluster, distributed.Client(cluster) as client:
        executor = client.get_executor(retries=3)
        second_front = lo.pareto("beatup", AXES, target="balance", points=8, executor=executor, on_row=kill)
    assert killed
    assert second_front.digest == serial.digest


def test_a_row_gives_its_whole_answer_again_with_the_limit_on_the_other_axis_among_its_limits(serial):
    row = serial.rows[3]
    answer = serial.answer(row.point)
    assert (dict(answer.design), dict(answer.figures)) == (dict(row.design), dict(row.figures))
    assert answer.status == "optimal"
    assert answer.certificate is not None
    assert answer.certificate.passed
    item = next(limit for limit in answer.limits if limit.name == "m4e")
    assert (item.min, item.max, item.ok) == (0.0, row.place["m4e"], True)
    price = next(price for price in answer.binding if price.limit == "m4e")
    assert price.worth["peak_torque"] == pytest.approx(-row.multipliers[plan.sloped(("peak_torque", "m4e"))], rel=1e-9)
    assert price.text == f"m4e <= {row.place['m4e']:.6g} kg"
    assert answer.message.startswith(f"The least peak_torque with m4e at most {row.place['m4e']:.6g} kg.")
    assert answer.table().loc["m4e", "binds"] == "max"
    assert repr(answer).startswith("<Answer beatup, peak_torque against m4e: optimal; peak_torque 9")
    assert answer.draw().svg.startswith("<?xml") or "<svg" in answer.draw().svg
    assert "best design for peak_torque against m4e" in answer._repr_html_()
    assert answer.as_dict()["target"] == "balance"


def test_an_answer_of_a_front_is_judged_and_proven_by_its_own_limits(serial, reed):
    row = serial.rows[3]
    answer = serial.answer(row.point)
    again = answer.evaluate()
    assert again.limits == answer.limits
    assert again.evaluate().admissible
    heavier = lo.Answer(
        replace(answer.result, design=dict(answer.design) | {"m4e": row.place["m4e"] + 1e-3}), answer.target
    ).evaluate()
    assert [limit.name for limit in heavier.limits if not limit.ok] == ["m4e"]
    middle = reed.rows[1]
    of_reed = reed.answer(middle.point)
    torque = next(limit for limit in of_reed.limits if limit.name == "M3_fdc")
    assert (torque.min, torque.max) == pytest.approx((-30.0, 30.0))
    assert of_reed.as_dict()["target"] == "balance", "what it demands of all else is held"
    proofs = of_reed.prove()
    assert proofs.passed
    assert "M3_fdc" in {proof.limit for proof in proofs.proofs}
    with pytest.raises(BadInput, match="does not have this point"):
        reed.answer(999)


@pytest.mark.parametrize(
    ("problem", "axes", "more", "side"),
    [
        pytest.param(
            *("beatup", ("pulse_rms", "mu_min"), {"target": "balance", "maximise": ["mu_min"]}, "min"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *("beatup", ("mu_min", "pulse_rms"), {"target": "balance", "maximise": ["mu_min"]}, "max"),
            marks=pytest.mark.slow,
        ),
        ("shedding", ("K1", "X0"), {"ranges": {"X0": "40:80 mm"}}, "max"),
    ],
    ids=["most of an angle", "root of a mean square", "variable"],
)
def test_limits_on_axes_are_told_as_limits_of_their_figures(problem, axes, more, side):
    trade = front.trade(
        lo.load(problem), axes, **{**more, "points": 3, "ranges": front.si(lo.load(problem), more.get("ranges", {}))}
    )
    rows = tuple(trade.solved(task, None) for task in trade.batch(()))
    task = trade.batch(rows)[0]
    parent = rows[task.parent]
    row, answer = trade.solved(task, parent), results.to_answer(trade.solve(task, parent), trade.scene)
    item = next(limit for limit in answer.limits if limit.name == axes[1])
    assert getattr(item, side) == pytest.approx(row.place[axes[1]], rel=1e-14)
    assert item.value == pytest.approx(row.place[axes[1]], rel=1e-8)
    assert answer.admissible
    assert dict(answer.figures) == dict(row.figures)
    price = next(price for price in answer.binding if price.limit == axes[1])
    assert price.side == side
    assert price.worth[axes[0]] == pytest.approx(abs(row.multipliers[plan.sloped(axes)]), rel=1e-7)


def test_the_table_names_the_axes_first_and_the_slope_with_its_unit(reed):
    table, si = reed.table(), reed.table(si=True)
    assert list(table.columns[:4]) == ["|M3_fdc| [N*m]", "peak_torque [N*m]", "status", "certified"]
    assert table["|M3_fdc| [N*m]"].tolist() == pytest.approx([20.0, 30.0, 40.0])
    assert table["peak_torque per M3_fdc [N*m/N*m]"].tolist() == pytest.approx([-0.119046192606] * 3)
    assert table["l2 [mm]"].tolist() == pytest.approx((1000 * si["l2 [m]"]).tolist(), rel=1e-12)
    assert len(set(table.columns)) == len(table.columns)
    assert table.attrs["axes"] == "least peak_torque, least |M3_fdc|"
    assert table.attrs["range of M3_fdc"] == "20 N*m ... 40 N*m"
    assert (table.attrs["study"], table.attrs["target"]) == ("pareto", "balance")
    assert (table.attrs["held"], table.attrs["not held"]) == ("the scene's limits", "M3_fdc 0 N*m")
    assert "|M3_fdc| [N*m]" in reed._repr_html_()
    assert repr(reed) == "<StudyTable pareto of beatup, balance, peak_torque against |M3_fdc|: 3 points, 3 certified>"


@pytest.mark.slow
def test_an_inch_machine_is_shown_in_inches():
    scene = inch.scene("beatup", operation__speed="350 rpm")
    table = lo.pareto(scene, ("peak_torque", "M3_fdc"), points=3, ranges={"M3_fdc": "4250:4500 lbf*in"}).table()
    assert {"|M3_fdc| [lbf*in]", "peak_torque [lbf*in]", "l1 [in]", "m4e [lb]"} <= set(table.columns)
    assert table["|M3_fdc| [lbf*in]"].iloc[0] == pytest.approx(4250.0)


def test_failures_stay_rows_with_their_reason_and_dominated_ones_are_left_out(serial):
    failed = replace(
        serial.solved[2], point=99, status="failed", reason="it died", certified=False, design={}, figures={}, warm={}
    )
    result = StudyTable(serial.study, (*serial.solved, failed))
    assert result.rows[-1] == failed
    table = result.table()
    assert table.loc[99, "reason"] == "it died"
    assert table.loc[99, "m4e [kg]"] == pytest.approx(failed.place["m4e"]), "the requested value"
    assert table["peak_torque [N*m]"].isna().tolist() == [False] * len(serial.rows) + [True]


def test_a_front_that_has_only_begun_shows_what_there_is(serial):
    result = StudyTable(serial.study, serial.solved[:1])
    assert result.findings.message == "No front yet: an end is not solved."
    assert result.rows == serial.solved[:1]


@pytest.mark.slow
def test_one_design_that_is_best_in_both():
    second_front = lo.pareto("beatup", AXES, "none")
    assert second_front.findings.message == "peak_torque and m4e do not conflict: one design is best in both."
    assert plan.values(second_front.rows, "m4e") == [0.0]
    assert second_front.answer(second_front.rows[0].point).message.startswith(
        "The least peak_torque, then the least m4e."
    )


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"m4e": "0:3"}, "the unit is missing"),
        ({"m4e": "0:3 mm"}, "a unit of length, not of mass"),
        ({"m4e": "0:3:1 kg"}, "no range of numbers"),
        ({"m4e": "3:0 kg"}, "must be smaller"),
        ({"m4e": (0.0, 1.0, 2.0)}, "two ends"),
        ({"l1": "30:31 mm"}, "not one of the two axes"),
    ],
)
def test_ranges_are_read_with_their_units(given, words):
    with pytest.raises(BadInput, match=words):
        lo.pareto("beatup", AXES, ranges=given)


def test_ranges_in_text_and_in_si_are_the_same_study():
    scene = lo.load("beatup")
    studies = [front.trade(scene, AXES, ranges=front.si(scene, {"m4e": given})) for given in ("0:3 kg", (0, 3))]
    assert studies[0].key == studies[1].key
    assert front.si(lo.load("rapier"), {"dwell": "30:45 deg"})["dwell"] == pytest.approx((math.pi / 6, math.pi / 4))
