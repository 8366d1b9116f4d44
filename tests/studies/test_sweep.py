"""Sweeps: one row per combination, with the same bits from one process, several, a cluster, and after a kill."""

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from support import inch

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface import study_table
from loomopt.interface.files import outputs
from loomopt.picture.table import TextTable
from loomopt.studies import sweep
from loomopt.studies.run import run
from loomopt.studies.run.rows import digest
from loomopt.studies.run.store import Store

OVER = {"operation.M0": "600:900:15 N*m"}
KILLED = """
import os, signal, sys
import loomopt as lo

seen = []

def stop(row):
    seen.append(row)
    if len(seen) == 12:
        os.kill(os.getpid(), signal.SIGKILL)

if __name__ == "__main__":
    lo.sweep("beatup", {"operation.M0": "600:900:15 N*m"}, store=sys.argv[1], workers=2, on_row=stop)
"""


@pytest.fixture(scope="module")
def serial():
    return lo.sweep("beatup", OVER)


@pytest.mark.parametrize("every", [pytest.param(1, marks=pytest.mark.slow), 7])
def test_every_point_is_certified_and_as_good_as_a_search_from_scratch(serial, every):
    """Compared with a sweep from scratch, of every seventh point and of all points."""
    assert all(row.certified for row in serial.rows)
    assert sum(row.parent is None for row in serial.rows) == 4
    rows = serial.rows[::every]
    over = {"operation.M0": [f"{row.place['operation.M0']!r} N*m" for row in rows]}
    cold = run.run(replace(sweep.plan_sweep(lo.load("beatup"), over), cold=True))
    assert all(row.parent is None for row in cold)
    for row, scratch in zip(rows, cold, strict=True):
        assert row.place == scratch.place
        for figure in ("M3_fdc", "peak_torque"):
            assert abs(row.figures[figure]) <= abs(scratch.figures[figure]) + 1e-7


def test_torques_of_the_closed_form(serial):
    for row in serial.rows:
        moment = row.place["operation.M0"]
        expected = max(0.0, 676.981102 - moment, moment - 871.503394)
        assert abs(row.figures["M3_fdc"]) == pytest.approx(expected, abs=1e-5)


@pytest.mark.slow
def test_killed_at_twelve_rows_and_resumed_by_two_processes_it_has_the_same_digest(serial, tmp_path):
    script, store = tmp_path / "sweep.py", tmp_path / "s.db"
    script.write_text(KILLED)
    folder = {"PYTHONPATH": str(Path(lo.__file__).parents[1])}
    done = subprocess.run([sys.executable, script, store], env=os.environ | folder, capture_output=True, timeout=120)
    assert done.returncode == -signal.SIGKILL
    with Store(store) as opened:
        stored = opened.rows(serial.study.key)
    assert len(stored) == 12
    with pytest.raises(BadInput, match="12 of the 21 points"):
        lo.sweep("beatup", OVER, store=store)
    again = lo.sweep("beatup", OVER, store=store, resume=True, workers=2)
    assert again.digest == serial.digest
    assert {row.point: row.seconds for row in stored}.items() <= {row.point: row.seconds for row in again.rows}.items()


@pytest.mark.slow
def test_a_dask_cluster_of_which_a_worker_is_killed_has_the_same_digest(serial):
    distributed = pytest.importorskip("distributed")
    killed: list[int] = []

    def kill(row):
        if len(killed) < 1 and row.parent is not None:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=2, processes=True, dashboard_address=None, silence_logs=50
    )
    with cluster, distributed.Client(cluster) as client:
        result = lo.sweep("beatup", OVER, executor=client.get_executor(retries=3), on_row=kill)
    assert killed
    assert result.digest == serial.digest


@pytest.mark.slow
def test_threads_of_one_process_solve_one_at_a_time(serial):
    with ThreadPoolExecutor(3) as threads:
        assert lo.sweep("beatup", OVER, executor=threads).digest == serial.digest


def test_a_row_reproduces_its_whole_answer(serial):
    for point in (0, 3):
        answer, row = serial.answer(point), serial.rows[point]
        assert isinstance(answer, lo.Answer)
        assert dict(answer.design) == dict(row.design)
        assert dict(answer.figures) == dict(row.figures)
        assert answer.scene.operation["M0"] == row.place["operation.M0"]
    with pytest.raises(BadInput, match="does not have this point"):
        serial.answer(21)


def test_the_table_is_in_units_of_the_scene_or_in_si_and_has_provenance(serial):
    table, si = serial.table(), serial.table(si=True)
    assert list(table.columns[:4]) == ["operation.M0 [N*m]", "status", "certified", "l1 [mm]"]
    assert list(table.columns[-4:]) == ["M3_fdc reached", "parent", "time [s]", "reason"]
    assert table["l2 [mm]"].tolist() == pytest.approx((1000 * si["l2 [m]"]).tolist(), rel=1e-12)
    assert table.index.name == "point"
    assert table.loc[0, "M3_fdc per l1 min [N*m/mm]"] == pytest.approx(27.5, rel=1e-3)
    assert pd.isna(table.loc[10, "M3_fdc per l1 min [N*m/mm]"])
    assert table.loc[10, "M3_fdc [N*m]"] == 0.0, "rounding is shown as 0"
    assert table.attrs["study"] == "sweep"
    assert table.attrs["target"] == "balance"
    assert table.attrs["over"] == "operation.M0 = 600 N*m ... 900 N*m, 21 values"
    assert "peak_torque [N*m]" in table._repr_html_()
    assert "peak_torque [N*m]" in serial._repr_html_()
    assert repr(serial) == "<StudyTable sweep of beatup, balance: 21 of 21 points, 21 certified>"


def test_a_row_that_misses_its_goal_is_never_called_just_optimal(serial):
    missed = [row for row in serial.rows if abs(row.figures["M3_fdc"]) > 1.0]
    assert [row.place["operation.M0"] for row in missed] == [600, 615, 630, 645, 660, 675, 885, 900]
    table = serial.table()
    for row in serial.rows:
        outcome = "optimal but M3_fdc not reached" if row in missed else "optimal"
        assert table.loc[row.point, "status"] == row.outcome == outcome
        assert row.status == "optimal"
    heading, grid, *_ = study_table.tables(serial.study, serial.solved)
    assert isinstance(grid, TextTable)
    assert heading == "beatup, balance: 21 points, 8 optimal but M3_fdc not reached, 13 optimal"
    assert [line[-1] for line in grid.lines] == ["M3_fdc not reached" if row in missed else "" for row in serial.rows]
    assert serial.as_dict()["rows"][0]["reached"] == {"M3_fdc": False}
    answer = serial.answer(0)
    assert "optimal but M3_fdc not reached" in repr(answer)
    assert answer.to_frame()["outcome"].tolist() == ["optimal but M3_fdc not reached"]
    assert outputs.describe_design(answer.result).shortfall == "M3_fdc not reached"


def test_changes_along_a_sweep_name_the_limits_that_become_active_or_inactive(serial):
    data = serial.as_dict()
    assert list(data) == ["problem", "target", "rows", "units", "changes", "gaps", "provenance"]
    first = data["changes"][0]
    assert first["at"] == (675.0, 690.0)
    assert (first["kind"], first["limits"]) == ("active set", ("swing", "theta"))
    assert data["gaps"] == []
    assert {"operation.M0": "N*m", "l1": "m", "M3_fdc per l1 min": "N*m/m"}.items() <= data["units"].items()


def test_two_numbers_make_every_combination_and_clashes_stay_rows_with_their_reason():
    over = {"limits.swing.min": ["23 deg", "23.2 deg"], "limits.swing.max": ["23.1 deg", "23.4 deg"]}
    result = lo.sweep("beatup", over, target="torque")
    assert [tuple(row.place.values()) for row in result.rows] == [
        (low, high) for low in map(swing_min, (23, 23.2)) for high in map(swing_min, (23.1, 23.4))
    ]
    assert [row.status for row in result.rows] == ["optimal", "optimal", "failed", "optimal"]
    assert "min is more than max" in result.rows[2].reason
    assert result.as_dict()["changes"] == []
    assert result.table()["reason"].isna().tolist() == [True, True, False, True]


def swing_min(degrees):
    return lo.load("beatup").set("limits.swing", {"min": f"{degrees} deg"}).limits["swing"].min


def test_an_inch_machine_is_shown_in_inches():
    scene = inch.scene("beatup", operation__speed="350 rpm")
    table = lo.sweep(scene, {"operation.M0": ["2000 lbf*in", "2200 lbf*in"]}, target="torque").table()
    assert table["operation.M0 [lbf*in]"].tolist() == pytest.approx([2000, 2200], rel=1e-14)
    assert {"l1 [in]", "m4e [lb]", "peak_torque [lbf*in]"} <= set(table.columns)


def test_with_only_global_optima_no_point_starts_warm():
    result = lo.sweep("shedding", {"operation.speed": "200:400:50 rpm"})
    assert result.study.settings["cold"] is True
    assert [row.parent for row in result.rows] == [None] * 5
    assert result.rows[4].figures["K1"] == pytest.approx(46819.099799, rel=1e-9)


def test_the_key_depends_on_what_rows_depend_on(tmp_path):
    scene = lo.load("beatup")
    first = sweep.plan_sweep(scene, OVER)
    same = sweep.plan_sweep(scene.set("problem.title", "another"), {"operation.M0": "600:900:15 N*m"})
    assert same.key == first.key
    changed = [
        sweep.plan_sweep(scene.set("operation.speed", "601 rpm"), OVER),
        sweep.plan_sweep(scene, {"operation.M0": "600:900:20 N*m"}),
        sweep.plan_sweep(scene, OVER, "torque"),
        sweep.plan_sweep(scene, OVER, accuracy=1e-9),
        sweep.plan_sweep(scene, OVER, seed=1),
    ]
    assert len({first.key, *(plan.key for plan in changed)}) == 6


def test_the_key_follows_the_contents_of_a_table_that_the_scene_names(tmp_path):
    path = tmp_path / "my law.csv"
    path.write_text("phi1 [deg],S [mm]\n" + "".join(f"{36 * k},{k * (10 - k)}\n" for k in range(10)))
    scene = lo.load("rapier").set("targets.match.table", str(path))
    before = sweep.plan_sweep(scene, {"operation.stroke": ["800 mm"]}).key
    path.write_text(path.read_text().replace("36,9", "36,8"))
    assert sweep.plan_sweep(scene, {"operation.stroke": ["800 mm"]}).key != before


@pytest.mark.parametrize(
    ("over", "words"),
    [
        ({}, "nothing to sweep"),
        ({"operation.M0": []}, "no value"),
        ({"operation.M0": [800]}, "unit is missing"),
        ({"operation.M0": "600:900:25"}, "unit is missing"),
        ({"operation.M0": "600:900:25 mm"}, "a unit of length, not of torque"),
        ({"operation.M00": "600:900:25 N*m"}, 'Perhaps "M0" is meant'),
        ({"problem.title": ["a", "b"]}, "it is not a number"),
        ({"mechanism.l1": "31:400:1 mm"}, "l1"),
        ({"operation.M0": "1:20000:1 N*m", "operation.speed": ["600 rpm", "700 rpm"]}, "more than 20000 combinations"),
    ],
)
def test_bad_input_is_refused_before_anything_is_solved(over, words):
    with pytest.raises(BadInput, match=words):
        sweep.plan_sweep(lo.load("beatup"), over)


def test_resume_needs_a_store_and_workers_exclude_an_executor(tmp_path):
    with pytest.raises(BadInput, match="nothing to resume from"):
        lo.sweep("beatup", OVER, resume=True)
    with ThreadPoolExecutor(1) as threads, pytest.raises(BadInput, match="an executor and a number of workers"):
        lo.sweep("beatup", OVER, executor=threads, workers=2)


def test_rows_do_not_grow_with_the_number_of_points(serial):
    """Only the row of a solve stays in memory: a few kilobytes."""
    import json

    assert max(len(json.dumps(row.as_dict())) for row in serial.rows) < 6000
    assert digest(serial.rows) == serial.digest
