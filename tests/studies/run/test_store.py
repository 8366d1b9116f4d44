"""The store: a row is there for good once it is written; what is not a store of ours is left as it is."""

import gc
import json
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from loomopt.base.errors import BadInput
from loomopt.studies.run.rows import Multiplier, Row, Side
from loomopt.studies.run.store import COLUMNS, Store, _checksum

ROW = Row(
    2, {"operation.M0": 0.1 + 0.2}, 1, "optimal", None, {"l1": 1 / 3}, {"a": None, "b": 5e-324},
    {Multiplier("a", Side("l1", "min")): -0.0}, {"a": False},
    True, 0.5, {"x": {"l1": 1 / 7}, "nodes": [[[0, 0.5, -1.0, False]]]},
)  # fmt: skip


def test_rows_are_read_back_bit_by_bit_each_with_its_study(tmp_path):
    with Store(tmp_path / "s.db") as store:
        store.begin("one", {"scene": "a"})
        store.begin("other", {})
        store.add("one", ROW)
        assert store.rows("one") == [ROW]
        assert store.rows("other") == []
    with Store(tmp_path / "s.db") as store:
        store.begin("one", {"scene": "changed by nobody"})
        assert store.rows("one") == [ROW]
        with pytest.raises(BadInput, match="UNIQUE"):
            store.add("one", ROW)
        assert store.rows("one") == [ROW]


def test_the_journal_is_one_that_survives_a_crash_on_any_file_system(tmp_path):
    with Store(tmp_path / "s.db") as store:
        request = {
            name: store._file.execute(f"PRAGMA {name}").fetchone()[0] for name in ("journal_mode", "synchronous")
        }
    assert request == {"journal_mode": "delete", "synchronous": 2}


def test_others_can_read_the_tables(tmp_path):
    with Store(tmp_path / "s.db") as store:
        store.begin("one", {"scene": "a"})
        store.add("one", ROW)
    file = sqlite3.connect(tmp_path / "s.db")
    query = "SELECT point, json_extract(design, '$.l1'), told FROM row JOIN study ON study.key = row.study"
    assert file.execute(query).fetchall() == [(2, 1 / 3, '{"scene": "a"}')]
    file.close()


def test_a_file_in_use_is_refused(tmp_path):
    with Store(tmp_path / "s.db"), pytest.raises(BadInput, match="another run has it open"):
        Store(tmp_path / "s.db")
    with Store(tmp_path / "s.db"):
        pass


@pytest.mark.parametrize("subject", ["text", "tables", "version", "folder"])
def test_what_is_no_store_is_left_as_it_is(tmp_path, subject):
    path = tmp_path / "s.db"
    if subject == "folder":
        path.mkdir()
    elif subject == "text":
        path.write_bytes(b"a letter to a friend, long enough to be read as the head of a file" * 20)
    else:
        file = sqlite3.connect(path)
        file.execute("CREATE TABLE mine (a)" if subject == "tables" else "PRAGMA user_version = 7")
        file.commit()
        file.close()
    before = None if subject == "folder" else path.read_bytes()
    with pytest.raises(BadInput, match=r"s\.db: ") as caught:
        Store(path)
    assert len(str(caught.value).splitlines()) == 1
    assert before is None or path.read_bytes() == before


def damaged(path, *statements):
    """Change what stands in a file, as anybody could."""
    file = sqlite3.connect(path)
    for statement in statements:
        file.execute(statement)
    file.commit()
    file.close()


def write_store(path):
    """Make a store of one row."""
    with Store(path) as store:
        store.begin("one", {})
        store.add("one", ROW)
    return path


DEEP = "[" * 20000 + "]" * 20000
CELLS = [
    *("design = '{'", "status = '7'", "figures = '[]'", "warm = NULL", "place = x'ff'", "reason = 7"),
    *("design = replace(design, '3', '4')", "warm = replace(warm, '1', '2')", "study = 'one', seconds = '0.25'"),
    *("checksum = ''", "checksum = x'00'", "checksum = 7", f"warm = '{DEEP}'", "status = char(27) || '[2J'"),
]


@pytest.mark.parametrize("cell", CELLS)
def test_a_damaged_row_is_told_by_its_point(tmp_path, cell):
    damaged(write_store(tmp_path / "s.db"), f"UPDATE row SET {cell}")
    with Store(tmp_path / "s.db") as store, pytest.raises(BadInput, match="the row of point 2 is damaged") as caught:
        store.rows("one")
    assert len(str(caught.value).splitlines()) == 1
    assert "\x1b" not in str(caught.value)


def test_a_row_of_another_study_or_point_is_damaged(tmp_path):
    damaged(
        write_store(tmp_path / "s.db"), "INSERT INTO study VALUES ('other', '{}')", "UPDATE row SET study = 'other'"
    )
    with Store(tmp_path / "s.db") as store, pytest.raises(BadInput, match="damaged"):
        store.rows("other")
    damaged(write_store(tmp_path / "t.db"), "UPDATE row SET point = char(27) || 'x'")
    with Store(tmp_path / "t.db") as store, pytest.raises(BadInput, match="damaged") as caught:
        store.rows("one")
    assert "\x1b" not in str(caught.value)


WRONG = [
    *({"point": "x"}, {"point": -1}, {"point": True}, {"parent": 0.5}, {"parent": "1"}, {"status": "\x1b[2Joptimal"}),
    *({"status": ["optimal"]}, {"reason": 7}, {"reason": "\x1b]0;x\x07"}, {"design": {"l1": "1"}}, {"place": [1]}),
    *(
        {"design": {"l1": 10**400}},
        {"figures": {"a": True}},
        {"figures": {"\x1b[2J": 1.0}},
        {"multipliers": {"a": None}},
    ),
    *(
        {"reached": {"a": 1}},
        {"certified": 1},
        {"seconds": None},
        {"warm": []},
        {"warm": json.loads(DEEP[19900:20100])},
    ),
]


@pytest.mark.parametrize("wrong", WRONG)
def test_what_no_row_holds_is_damage_whatever_its_checksum_says(tmp_path, wrong):
    path = write_store(tmp_path / "s.db")
    cells = [v if k == "point" else json.dumps(v) for k, v in {**ROW.as_dict(), **wrong}.items()]
    file = sqlite3.connect(path)
    file.execute("DELETE FROM row")
    marks = ", ".join("?" * (2 + len(cells)))
    file.execute(f"INSERT INTO row VALUES ({marks})", ("one", *cells, _checksum("one", cells)))
    file.commit()
    file.close()
    with Store(path) as store, pytest.raises(BadInput, match="damaged") as caught:
        store.rows("one")
    assert str(caught.value).isprintable()


ENDLESS = "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT"
SUBJECTS = {
    "view": ("DROP TABLE row", f"CREATE VIEW row AS {ENDLESS} {', '.join(f'i AS {name}' for name in COLUMNS)} FROM n"),
    "trigger": (f"CREATE TRIGGER slow AFTER INSERT ON study BEGIN INSERT INTO study {ENDLESS} i, 'x' FROM n; END",),
    "table": ("CREATE TABLE mine (a)",),
    "column": ("ALTER TABLE row ADD COLUMN more",),
    "missing": ("DROP TABLE row",),
    "index": ("CREATE INDEX mine ON row (status)",),
}


@pytest.mark.parametrize("subject", SUBJECTS)
def test_what_no_store_holds_is_refused_at_once(tmp_path, subject):
    path = write_store(tmp_path / "s.db")
    damaged(path, *(SUBJECTS[subject]))
    before = path.read_bytes()
    name = {"view": "row", "trigger": "slow", "column": "row", "missing": "row"}.get(subject, "mine")
    with pytest.raises(BadInput, match=f"it has tables that no store has: {name}"):
        Store(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize("subject", ["tables", "mine"])
def test_a_refused_store_is_let_go(tmp_path, subject):
    path = write_store(tmp_path / "s.db")
    damaged(path, "CREATE TABLE mine (a)" if subject == "mine" else "PRAGMA user_version = 9")
    gc.disable()
    try:
        with pytest.raises(BadInput) as caught:
            Store(path)
        damaged(path, "CREATE TABLE more (a)")  # while the error is at hand
    finally:
        gc.enable()
    assert caught


@pytest.mark.parametrize("name", [":memory:", "file:s.db?mode=memory", "file:s.db", "s?mode=ro.db", "%41.db"])
def test_a_name_that_sqlite_would_read_otherwise_is_that_of_a_file(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    write_store(Path(name))
    assert [path.name for path in tmp_path.iterdir()] == [name]
    with Store(Path(name)) as store:
        assert store.rows("one") == [ROW]


SLOW = """
import os, signal, sys, threading
from pathlib import Path
from loomopt.base.interrupts import stoppable
from loomopt.studies.run.store import COLUMNS, Store, _checksum

def run():
    with Store(Path(sys.argv[1])) as store:
        threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
        with store._plain_errors():
            store._file.execute("WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT max(i) FROM n")
    return 0

sys.exit(stoppable(run))
"""


@pytest.mark.slow
def test_ctrl_c_stops_what_sqlite_is_at(tmp_path):
    done = subprocess.run([sys.executable, "-c", SLOW, tmp_path / "s.db"], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (130, "loomopt: stopped; nothing was left half-written.\n")
