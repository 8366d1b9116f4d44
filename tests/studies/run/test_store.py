"""The store: a row is there for good once it is written; what is not a store of ours is left as it is."""

import sqlite3

import pytest

from loomopt.base.errors import BadInput
from loomopt.studies.run.rows import Multiplier, Row, Side
from loomopt.studies.run.store import Store

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
        asked = {name: store._file.execute(f"PRAGMA {name}").fetchone()[0] for name in ("journal_mode", "synchronous")}
    assert asked == {"journal_mode": "delete", "synchronous": 2}


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


@pytest.mark.parametrize("what", ["text", "tables", "version", "folder"])
def test_what_is_no_store_is_left_as_it_is(tmp_path, what):
    path = tmp_path / "s.db"
    if what == "folder":
        path.mkdir()
    elif what == "text":
        path.write_bytes(b"a letter to a friend, long enough to be read as the head of a file" * 20)
    else:
        file = sqlite3.connect(path)
        file.execute("CREATE TABLE mine (a)" if what == "tables" else "PRAGMA user_version = 7")
        file.commit()
        file.close()
    before = None if what == "folder" else path.read_bytes()
    with pytest.raises(BadInput, match=r"s\.db: ") as told:
        Store(path)
    assert len(str(told.value).splitlines()) == 1
    assert before is None or path.read_bytes() == before


@pytest.mark.parametrize("cell", ["design = '{'", "status = '7'", "figures = '[]'", "warm = NULL", "place = x'ff'"])
def test_a_damaged_row_is_told_by_its_point(tmp_path, cell):
    with Store(tmp_path / "s.db") as store:
        store.begin("one", {})
        store.add("one", ROW)
    file = sqlite3.connect(tmp_path / "s.db")
    file.execute(f"UPDATE row SET {cell}")
    file.commit()
    file.close()
    with Store(tmp_path / "s.db") as store, pytest.raises(BadInput, match="the row of point 2 is damaged") as told:
        store.rows("one")
    assert len(str(told.value).splitlines()) == 1
