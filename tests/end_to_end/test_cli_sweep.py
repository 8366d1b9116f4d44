"""`loomopt sweep` from end to end: what is printed, written and refused, and with which exit status."""

import json

import pandas as pd
import pytest

from loomopt.interface.cli.app import run
from loomopt.studies.sweep import Sweep

M0 = ("--over", "operation.M0=700:800:50 N*m")
ROW = ["point", "place", "parent", "status", "reason", "design", "figures", "multipliers", "reached", "certified"]


@pytest.fixture
def cli(capsys, monkeypatch, tmp_path):
    """Return a call of the command line in an empty folder: exit status, stdout, stderr."""
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        status = run(["sweep", *arguments])
        return status, *capsys.readouterr()

    return call


def test_json_has_a_row_per_combination(cli):
    status, out, err = cli("beatup", *M0, "--json")
    data = json.loads(out, parse_constant=pytest.fail)
    assert (status, err) == (0, "")
    assert list(data) == ["problem", "target", "rows", "units", "changes", "gaps", "provenance"]
    assert (data["problem"], data["target"]) == ("beatup", "balance")
    assert [list(row) for row in data["rows"]] == [[*ROW, "seconds"]] * 3
    assert [row["place"] for row in data["rows"]] == [{"operation.M0": value} for value in (700.0, 750.0, 800.0)]
    assert data["rows"][1]["figures"]["peak_torque"] == pytest.approx(89.284623, rel=1e-6)
    assert data["units"]["peak_torque"] == "N*m"
    assert data["provenance"]["over"] == "operation.M0 = 700 N*m ... 800 N*m, 3 values"


def test_tables_and_figures_are_written_with_their_provenance(cli, tmp_path):
    names = ("t.csv", "t.parquet", "f.png", "f.svg")
    files = [word for name in names for word in ("--figure" if name[0] == "f" else "--out", name)]
    status, out, err = cli("beatup", *M0, *files, "--store", "s.db")
    assert status == 0
    assert out.startswith("beatup, balance: 3 points, 3 optimal")
    assert err.splitlines() == [f"Wrote {name}" for name in names]
    text = (tmp_path / "t.csv").read_text()
    assert "# study: sweep\n# target: balance\n# over: operation.M0 = 700 N*m ... 800 N*m, 3 values\n" in text
    table, other = (
        pd.read_csv(tmp_path / "t.csv", comment="#", index_col="point"),
        pd.read_parquet(tmp_path / "t.parquet"),
    )
    assert table["peak_torque [N*m]"].tolist() == pytest.approx(other["peak_torque [N*m]"].tolist(), rel=1e-9)
    assert table["l2 [mm]"].iloc[0] == pytest.approx(76.8923, rel=1e-6), "no counterweight"
    assert other.attrs["study"] == "sweep"
    assert (tmp_path / "f.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "f.svg").read_text().count("operation.M0") == 5, "two columns of panels and three designs"
    _, _, _ = cli("beatup", *M0, "--si", "--out", "si.csv", "--store", "s.db", "--resume")
    assert "l2 [m]" in (tmp_path / "si.csv").read_text()


@pytest.mark.slow
def test_a_store_is_resumed_only_when_asked(cli, tmp_path):
    first = cli("beatup", *M0, "--store", "s.db", "--json")
    status, out, err = cli("beatup", *M0, "--store", "s.db")
    assert (status, out) == (2, "")
    assert err.startswith("loomopt: s.db: --store: it holds 3 of the 3 points of this study already. Resume (--resume")
    again = cli("beatup", *M0, "--store", "s.db", "--resume", "--json")
    assert json.loads(again[1])["rows"] == json.loads(first[1])["rows"], "their seconds too: nothing was solved"


@pytest.mark.slow
def test_two_workers_print_the_same_rows(cli):
    here, there = (json.loads(cli("beatup", *M0, *more, "--json")[1])["rows"] for more in ((), ("--workers", "2")))
    assert [row | {"seconds": 0} for row in here] == [row | {"seconds": 0} for row in there]


def test_ctrl_c_prints_what_is_finished(cli, monkeypatch):
    solved = Sweep.solved

    def stopping(self, task, parent):
        if task.point == 1:
            raise KeyboardInterrupt
        return solved(self, task, parent)

    monkeypatch.setattr(Sweep, "solved", stopping)
    status, out, err = cli("beatup", *M0, "--json")
    assert status == 130
    assert [row["point"] for row in json.loads(out)["rows"]] == [0, 2]
    assert err == "loomopt: stopped; nothing was left half-written.\n"


@pytest.mark.slow
def test_what_is_finished_by_ctrl_c_is_written_too(cli, tmp_path, monkeypatch):
    solved = Sweep.solved

    def stopping(self, task, parent):
        if task.point == 1:
            raise KeyboardInterrupt
        return solved(self, task, parent)

    monkeypatch.setattr(Sweep, "solved", stopping)
    status, out, err = cli("beatup", *M0, "--out", "t.csv", "--figure", "f.png")
    assert status == 130
    assert out.startswith("beatup, balance: 2 of 3 points")
    assert err.splitlines() == [
        "Wrote t.csv, 2 of the 3 points, as far as they were finished",
        "Wrote f.png, 2 of the 3 points, as far as they were finished",
        "loomopt: stopped; nothing was left half-written.",
    ]
    assert pd.read_csv(tmp_path / "t.csv", comment="#")["point"].tolist() == [0, 2]
    assert (tmp_path / "f.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("over", "files", "status", "statuses"),
    [
        ("operation.M0=500:600:100 N*m", ("--out", "t.csv", "--figure", "f.png"), 3, {"infeasible"}),
        ("operation.M0=600:750:150 N*m", (), 0, {"infeasible", "optimal"}),
    ],
)
def test_infeasible_rows_are_rows_and_without_an_answer_there_is_no_figure(
    cli, tmp_path, over, files, status, statuses
):
    result, out, err = cli("beatup", "--over", over, "--target", "torque", "--json", *files)
    data = json.loads(out)
    assert {row["status"] for row in data["rows"]} == statuses
    assert result == status
    assert all(row["reason"].startswith("limits that clash: ") for row in data["rows"] if row["status"] == "infeasible")
    assert len(data["gaps"]) == 1
    assert err.splitlines() == (["Wrote t.csv", "f.png is not written: no row is certified"] if files else [])
    assert [item.name for item in tmp_path.iterdir()] == ["t.csv"][: len(files)]


def test_a_combination_that_is_no_scene_is_a_failed_row_and_exit_4(cli):
    over = ("--over", "limits.swing.min=23:23.2:0.2 deg", "--over", "limits.swing.max=23.1:23.4:0.3 deg")
    status, out, _ = cli("beatup", "--target", "torque", *over)
    assert status == 4
    assert "4 points, 3 optimal, 1 failed" in out
    assert "point 2, failed: " in out


@pytest.mark.parametrize(
    "arguments",
    [
        ("--over", "operation.M0"),
        ("--over", "operation.M0=600:900:25"),
        ("--over", "operation.M0=600:900 N*m"),
        ("--over", "operation.M0=600:900:25 mm"),
        ("--over", "operation.X=600:900:25 mm"),
        (*M0, *M0),
        (*M0, "--workers", "two"),
        (*M0, "--workers", "0"),
        (*M0, "--resume"),
        (*M0, "--out", "t.txt"),
        (*M0, "--out", "none/t.csv"),
        (*M0, "--figure", "f.csv"),
        (*M0, "--store", "none/s.db"),
        (*M0, "--store", "t.csv", "--out", "./t.csv"),
        (*M0, "--target", "none"),
        (*M0, "--dask", "nowhere"),
        (),
    ],
    ids=" ".join,
)
def test_bad_input_is_one_message_and_nothing_is_written(cli, tmp_path, arguments):
    status, out, err = cli("beatup", *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("loomopt: ")
    assert list(tmp_path.iterdir()) == []


def test_a_cluster_and_workers_are_refused_before_the_cluster_is_sought(cli):
    status, out, err = cli("beatup", *M0, "--workers", "2", "--dask", "tcp://127.0.0.1:1")
    assert (status, out) == (2, "")
    assert err == "loomopt: --workers: there are a cluster and a number of workers (given: 2). Give one of them.\n"
