"""The accuracy study from the command line: output and files, refused input, an interrupted study."""

import json

import pytest
from few_settings import SMALL

from loomopt.interface.cli.app import run
from loomopt.studies.accuracy import accuracy, optima, readings

pytestmark = pytest.mark.slow


@pytest.fixture
def quick(monkeypatch):
    """Command with few settings."""
    monkeypatch.setattr(accuracy, "QUICK_REPEATS", 1)
    monkeypatch.setattr(optima, "QUICK", SMALL)
    monkeypatch.setattr(readings, "SAMPLES", (36, 72, 144))


def test_the_command_prints_one_json_object(quick, capsys):
    assert run(["accuracy", "beatup", "--set", "operation.M0=600 N*m", "--json"]) == 0
    out, err = capsys.readouterr()
    data = json.loads(out)
    assert err == ""
    assert list(data) == ["problem", "rows", "orders", "advice"]
    assert data["problem"] == "beatup"
    wanted = {"quantity", "method", "setting", "error", "seconds", "evaluations", "status"}
    assert all(set(row) == wanted for row in data["rows"])
    assert {"exchange", "uniform points", "sampled points", "finite differences"} <= {r["method"] for r in data["rows"]}


def test_the_command_prints_rows_orders_and_advice_and_writes_figure_and_table(quick, capsys, tmp_path):
    files = [tmp_path / name for name in ("f.png", "f.svg", "f.pdf", "f.csv")]
    assert run(["accuracy", "beatup-light", *(word for file in files for word in ("--out", str(file)))]) == 0
    out, err = capsys.readouterr()
    assert "finite differences" in out
    assert "rounding takes over." in " ".join(out.split())
    assert "In time on this machine: 1e-6 costs" in out
    assert err.count("Wrote ") == 4
    starts = [file.read_bytes()[:8] for file in files]
    assert starts[0] == b"\x89PNG\r\n\x1a\n"
    assert starts[1].startswith(b"<?xml")
    assert starts[2].startswith(b"%PDF")
    assert "balance claimed peak" in files[1].read_text()  # matplotlib names what it draws as outlines in comments
    header = next(line for line in files[3].read_text().splitlines() if not line.startswith("#"))
    assert header == "quantity,method,setting,error [1],time [s],evaluations,status"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["accuracy", "betup"], "betup"),
        (["accuracy", "beatup", "--out", "f.dxf"], ".csv"),
        (["accuracy", "beatup", "--with", "nonsense"], "nonsense"),
        (["accuracy", "beatup", "--set", "mechanism.l1=90 mm"], "l1"),
    ],
)
def test_bad_input_is_refused_before_anything_is_solved(capsys, monkeypatch, arguments, message):
    monkeypatch.setattr(optima, "ladders", pytest.fail)
    assert run(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err


def test_an_interrupted_study_shows_the_finished_rows(capsys, monkeypatch):
    genuine = accuracy.climbs

    def stopped(scene, full, on_run):
        yield next(genuine(scene, full, on_run, accuracy.LADDERS[1:]))
        raise KeyboardInterrupt

    monkeypatch.setattr(accuracy, "climbs", stopped)
    assert run(["accuracy", "beatup"]) == 130
    out, err = capsys.readouterr()
    assert "sampled points" in out
    assert "finite differences" not in out
    assert "stopped" in err
