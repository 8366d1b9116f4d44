"""Running studies: the same rows whoever computes them, whatever dies; nothing finished is lost or done twice."""

import json
import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import pytest
from made_up_study import Chain
from support import slow

from loomopt.base.errors import BadInput
from loomopt.studies.run import run
from loomopt.studies.run.rows import Multiplier, Row, Side, digest
from loomopt.studies.run.store import Store


@pytest.fixture
def chain(tmp_path):
    return Chain(tmp_path / "log")


def values(rows):
    return [row.figures.get("value") for row in rows]


def test_rows_come_in_the_order_of_points_each_after_its_parent(chain):
    seen: list[Row] = []
    rows = run.run(chain, on_row=seen.append)
    assert [row.point for row in rows] == list(range(24))
    assert [row.parent for row in rows] == [None] * 8 + list(range(16))
    assert values(rows)[16] == 0.1 * 16 + (0.1 * 8 + 0.0)
    assert tuple(seen) == rows
    assert chain.solves() == list(range(24))


@pytest.mark.slow
def test_threads_and_processes_give_the_same_digest(chain):
    expected = digest(run.run(chain))
    with ThreadPoolExecutor(3) as threads:
        assert digest(run.run(chain, threads)) == expected
    with ProcessPoolExecutor(2, get_context("spawn")) as processes:
        assert digest(run.run(chain, processes)) == expected
        assert processes.submit(int, 7).result() == 7, "a caller's executor goes on living"
    assert digest(run.run(chain, run.workers(2))) == expected


def test_workers_begin_each_round_with_the_points_that_take_long(chain):
    expected = digest(run.run(chain))
    long = replace(chain, log=chain.log.with_name("long"), long=(3, 14))
    with ThreadPoolExecutor(1) as alone:
        assert digest(run.run(long, alone)) == expected
    assert long.solves()[:3] == [3, 0, 1]
    assert long.solves()[8:11] == [14, 8, 9]


def test_a_worker_has_imported_what_solves_need_before_its_first_task():
    pool = run.workers(1)()
    try:
        assert pool.submit(eval, f"set({run.NEEDED}) <= set(__import__('sys').modules)").result()
    finally:
        pool.shutdown()


def test_a_point_that_fails_is_a_row_with_its_reason_and_the_others_go_on(chain):
    rows = run.run(replace(chain, raises=(3,)))
    assert (rows[3].status, rows[3].certified) == ("failed", False)
    assert (rows[3].reason or "").startswith("no such point")
    assert {row.status for row in rows if row.point != 3} == {"optimal"}
    assert rows[11].parent == 3


@pytest.mark.slow
def test_a_worker_that_dies_costs_a_new_pool_and_no_row(chain):
    expected = digest(run.run(replace(chain, log=chain.log.with_name("other"))))
    dying = replace(chain, kills_once=(2, 13))
    assert digest(run.run(dying, run.workers(2))) == expected
    assert dying.solves().count(2) == dying.solves().count(13) == 2


@pytest.mark.slow
def test_a_point_that_kills_three_workers_is_a_failed_row(chain):
    lethal = replace(chain, kills=(5,))
    rows = run.run(lethal, run.workers(2))
    assert lethal.solves().count(5) == 3
    assert (rows[5].status, rows[5].reason) == ("failed", run.DIED)
    assert {row.status for row in rows if row.point != 5} == {"optimal"}


DYING = """
import os, signal, sys
from pathlib import Path
from loomopt.base.errors import BadInput
from loomopt.studies.run import run

log, most = Path(sys.argv[1]), int(sys.argv[2])

def dies(lifeline, begin=run._begin):
    with log.open("a") as file:
        file.write("x")
    if len(log.read_text()) <= most:
        os.kill(os.getpid(), signal.SIGKILL)
    begin(lifeline)

run._begin = dies
if __name__ == "__main__":
    try:
        pool = run.workers(2)()
        print(pool.submit(int, 7).result())
        pool.shutdown()
    except Exception as error:
        print(type(error).__name__, error)
"""


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("deaths", "message"), slow.after(1, [(2, "7"), (9, "BrokenExecutor worker processes were killed 3"), (1, "7")])
)
def test_a_worker_that_is_killed_while_it_starts_costs_a_new_pool(tmp_path, deaths, message):
    script = tmp_path / "dying.py"
    script.write_text(DYING)
    folder = {"PYTHONPATH": str(Path(run.__file__).parents[3])}
    command = [sys.executable, script, tmp_path / "log", str(deaths)]
    done = subprocess.run(command, env=os.environ | folder, capture_output=True, text=True, timeout=120)
    assert done.stdout.startswith(message), done.stderr
    assert len((tmp_path / "log").read_text()) >= min(deaths, 2) + 1


@pytest.mark.slow
def test_a_call_that_the_script_itself_repeats_is_bad_input(tmp_path):
    script = tmp_path / "bare.py"
    script.write_text("from loomopt.studies.run import run\nrun.workers(2)()\n")
    folder = {"PYTHONPATH": str(Path(run.__file__).parents[3])}
    done = subprocess.run(
        [sys.executable, script], env=os.environ | folder, capture_output=True, text=True, timeout=120
    )
    assert "BadInput: workers: worker processes cannot start here. In a script" in done.stderr


def test_a_broken_executor_of_the_callers_is_told(chain):
    with ProcessPoolExecutor(1, get_context("spawn")) as processes, pytest.raises(BrokenProcessPool):
        run.run(replace(chain, kills=(0,)), processes)


@pytest.mark.parametrize("make", [None, ThreadPoolExecutor], ids=["serial", "threads"])
def test_ctrl_c_keeps_what_is_finished_and_a_resumed_run_repeats_a_sample(chain, tmp_path, make):
    expected = digest(run.run(replace(chain, log=tmp_path / "other")))

    def stop(row):
        if row.point == 11:
            raise KeyboardInterrupt

    with Store(tmp_path / "s.db") as store:
        store.begin(chain.key, {})
        with pytest.raises(KeyboardInterrupt):
            run.run(chain, make and make(1), store, stop)
        subset = [row.point for row in store.rows(chain.key)]
        assert set(range(12)) <= set(subset)
    with Store(tmp_path / "s.db") as store:
        assert digest(run.run(chain, None, store)) == expected
    assert sorted({*chain.solves()}) == list(range(24))
    assert sum(chain.solves().count(point) - 1 for point in range(24)) == run.DOUBTED


@pytest.mark.parametrize(
    "change", [{"figures": {"value": 1.1, "nothing": None}}, {"figures": {}}, {"design": {"a": 1.0}}]
)
def test_a_row_that_does_not_come_out_again_stops_a_resumed_run(chain, tmp_path, change):
    with Store(tmp_path / "s.db") as store:
        store.begin(chain.key, {})
        for row in run.run(replace(chain, count=1, log=tmp_path / "other")):
            store.add(chain.key, replace(row, **change))
    message = r"s\.db: store: solving point 0 again does not give the row"
    with Store(tmp_path / "s.db") as store, pytest.raises(BadInput, match=message):
        run.run(chain, None, store)
    assert chain.solves() == [0]


def test_rows_that_are_not_certified_are_not_doubted_and_rounding_is_none(chain, tmp_path):
    with Store(tmp_path / "s.db") as store:
        store.begin(chain.key, {})
        first, second, *_ = run.run(replace(chain, count=2, log=tmp_path / "other"))
        store.add(chain.key, replace(first, status="failed", certified=False))
        store.add(chain.key, replace(second, figures={"value": 0.1 * (1 + 1e-9), "nothing": None}))
    with Store(tmp_path / "s.db") as store:
        assert run.run(chain, None, store)[0].status == "failed"
    assert 0 not in chain.solves()


def test_tasks_are_told_again_from_rows(chain):
    rows = run.run(chain)
    again = list(run.tasks(chain, rows))
    assert [task.point for task, _ in again] == list(range(24))
    assert all(parent == (rows[task.parent] if task.parent is not None else None) for task, parent in again)
    assert len(list(run.tasks(chain, rows[:10]))) == 10


def test_a_digest_leaves_out_seconds_and_order_and_nothing_else():
    row = Row(0, {"a": 0.1}, None, "optimal", None, figures={"f": 1 / 3}, warm={"x": [0.1]})
    other = Row(1, {"a": 0.2}, 0, "optimal", None)
    assert digest([row, other]) == digest([other, replace(row, seconds=7.0)])
    for change in ({"warm": {"x": [0.2]}}, {"figures": {"f": 0.3333333333333333 + 1e-16}}, {"parent": 1}):
        assert digest([row, other]) != digest([replace(row, **change), other])


def test_a_reason_is_one_line_and_nothing_that_a_terminal_obeys():
    row = Row(0, {}, None, "failed", "no\nsuch \x1b[2J\x07 point")
    assert row.reason == "no such [2J point"
    assert Row(0, {}, None, "failed", "1 \u2264 2").reason == "1 \u2264 2"


def test_a_row_is_the_same_through_json():
    prices = {Multiplier("f", Side("l", "min")): -0.0}
    row = Row(3, {"a": 0.1}, 1, "failed", "why", {"l": 1e-300}, {"f": None, "g": 5e-324}, prices, {"f": True})
    assert Row.from_dict(json.loads(json.dumps(row.as_dict()))) == row
    assert "warm" not in row.row_json()
    with pytest.raises(TypeError):
        row.as_dict()["figures"]["f"] = 1.0


@pytest.mark.parametrize(
    ("multiplier", "text"),
    [
        (Multiplier("M3_fdc", Side("l1", "min")), "M3_fdc per l1 min"),
        (Multiplier("K1", Side("N_min", "fixed")), "K1 per N_min fixed"),
        (Multiplier("K1", Side("the spring's index", "max")), "K1 per the spring's index max"),
        (Multiplier("peak_torque", Side("m4e")), "peak_torque per m4e"),
        (Multiplier("K1", Side("no clash")), "K1 per no clash"),
    ],
)
def test_a_multiplier_s_text_is_read_as_it_was_written(multiplier, text):
    assert multiplier.text == text
    assert Multiplier.read(text) == multiplier
    assert Side.read(multiplier.side.text) == multiplier.side


@pytest.mark.parametrize("count", [0, -1, 5000])
def test_a_number_of_workers_that_cannot_be_is_refused(count):
    with pytest.raises(BadInput, match="1 to 1024"):
        run.workers(count)
