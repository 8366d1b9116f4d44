"""`loomopt pareto` from end to end: what is printed, written and refused, and with which exit status."""

import json
import re

import pandas as pd
import pytest

from loomopt.interface.cli import studies
from loomopt.interface.cli.app import run
from loomopt.studies.front.trade import Trade

MASS = ("--minimise", "peak_torque", "--against", "m4e")
FEW = (*MASS, "--target", "balance", "--range", "m4e=0:2 kg", "--points", "3")
ROW = ["point", "place", "parent", "status", "reason", "design", "figures", "multipliers", "reached", "certified"]


@pytest.fixture
def cli(capsys, monkeypatch, tmp_path):
    """Return a call of the command line in an empty folder: exit status, stdout, stderr."""
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        status = run(["pareto", *arguments])
        return status, *capsys.readouterr()

    return call


def test_json_has_the_rows_in_the_order_of_the_second_axis(cli):
    status, out, err = cli("beatup", *FEW, "--json")
    data = json.loads(out, parse_constant=pytest.fail)
    assert (status, err) == (0, "")
    assert list(data) == ["problem", "target", "message", "rows", "units", "changes", "gaps", "bettered", "provenance"]
    assert (data["problem"], data["target"]) == ("beatup", "balance")
    assert {tuple(row) for row in data["rows"]} == {(*ROW, "seconds", "axes")}
    masses = [row["axes"]["m4e"] for row in data["rows"]]
    assert masses == pytest.approx([0.0, 1.0, 2.0])
    assert data["rows"][1]["figures"]["peak_torque"] == pytest.approx(95.103966045, rel=1e-9)
    assert data["rows"][0]["multipliers"]["peak_torque per m4e"] == pytest.approx(-1.477, abs=1e-3)
    assert data["units"]["peak_torque per m4e"] == "N*m/kg"
    assert data["provenance"]["axes"] == "least peak_torque, least m4e"
    assert data["provenance"]["range of m4e"] == "0 kg ... 2 kg"


def test_changes_are_told_in_the_json_and_in_words(cli):
    arguments = ("shedding", "--minimise", "K1", "--against", "X0", "--range", "X0=1:4 mm", "--points", "4")
    status, out, _ = cli(*arguments, "--json")
    (change,) = json.loads(out)["changes"]
    assert status == 0
    assert change["at"] == pytest.approx(2.096358e-3, rel=1e-4)
    assert (change["kind"], change["limits"]) == ("active set", ["N_min min"])
    assert change["between"][0] < 2.096358e-3 < change["between"][1]
    _, message, _ = cli(*arguments)
    assert "\nX0 2.09636 mm: binding limits change, N_min min\n" in message
    assert "K1 per X0 is the slope of the front." in message


@pytest.mark.slow
def test_tables_and_figures_are_written_with_their_provenance(cli, tmp_path):
    names = ("t.csv", "t.parquet", "f.png", "f.svg")
    files = [word for name in names for word in ("--figure" if name[0] == "f" else "--out", name)]
    status, out, err = cli("beatup", *FEW, *files)
    assert status == 0
    assert out.startswith("beatup, balance, peak_torque against m4e: 3 points, 3 optimal")
    assert err.splitlines() == [f"Wrote {name}" for name in names]
    assert "# study: pareto\n# target: balance\n# axes: least peak_torque" in (tmp_path / "t.csv").read_text()
    table = pd.read_csv(tmp_path / "t.csv", comment="#", index_col="point")
    assert table["m4e [kg]"].tolist() == pytest.approx([0.0, 1.0, 2.0])
    assert table["m4e [kg]"].tolist() == pd.read_parquet(tmp_path / "t.parquet")["m4e [kg]"].tolist()
    assert (tmp_path / "f.png").read_bytes().startswith(b"\x89PNG")
    assert "peak_torque against m4e" in (tmp_path / "f.svg").read_text()


@pytest.mark.slow
def test_a_store_is_resumed_only_when_asked(cli):
    first = cli("beatup", *FEW, "--store", "s.db", "--json")
    status, out, err = cli("beatup", *FEW, "--store", "s.db")
    assert (status, out) == (2, "")
    # Three points, and what became of each neighbour's design there.
    assert re.match(r"loomopt: s.db: --store: it holds \d+ points of this study already. Resume \(--resume", err)
    again = cli("beatup", *FEW, "--store", "s.db", "--resume", "--json")
    assert json.loads(again[1])["rows"] == json.loads(first[1])["rows"], "their seconds too: nothing was solved"


@pytest.mark.slow
def test_ctrl_c_prints_what_is_finished_and_keeps_it(cli, monkeypatch):
    solved = Trade.solved

    def stopping(self, task, parent):
        if task.point == 2:
            raise KeyboardInterrupt
        return solved(self, task, parent)

    with monkeypatch.context() as interrupted:
        interrupted.setattr(Trade, "solved", stopping)
        status, out, err = cli("beatup", *FEW, "--store", "s.db", "--json")
    assert status == 130
    assert [row["point"] for row in json.loads(out)["rows"]] == [1, 0], "both ends, in the order of the second axis"
    assert err == "loomopt: stopped; nothing was left half-written.\n"
    status, out, _ = cli("beatup", *FEW, "--store", "s.db", "--resume", "--json")
    assert (status, len(json.loads(out)["rows"])) == (0, 3)


@pytest.mark.slow
def test_axes_that_do_not_conflict_are_one_point(cli):
    status, out, _ = cli("beatup", *MASS, "--target", "none")
    assert status == 0
    first = "beatup, no target, peak_torque against m4e: 1 point, 1 optimal; with the scene's limits; without M3_fdc 0"
    assert out.startswith(first)
    assert "peak_torque and m4e do not conflict: one design is best in both." in out


@pytest.mark.parametrize(
    ("arguments", "axes"),
    [
        (("--maximise", "mu_min", "--against", "pulse_rms"), {"mu_min": "most", "pulse_rms": "least"}),
        (
            ("--maximise", "mu_min", "--minimise", "pulse_rms", "--against", "pulse_rms"),
            {"mu_min": "most", "pulse_rms": "least"},
        ),
        (
            ("--minimise", "pulse_rms", "--against", "mu_min", "--maximise", "mu_min"),
            {"pulse_rms": "least", "mu_min": "most"},
        ),
        (("--maximise", "mu_min", "--maximise", "swing", "--against", "swing"), {"mu_min": "most", "swing": "most"}),
    ],
)
def test_the_most_of_an_axis(cli, monkeypatch, arguments, axes):
    request: dict[str, Trade] = {}
    monkeypatch.setattr(studies, "run", lambda study, *_: len(request.setdefault("study", study).axes))
    assert cli("beatup", *arguments)[0] == 2
    trade = request["study"]
    assert dict(zip(trade.axes, trade.senses, strict=True)) == axes
    assert list(trade.axes) == list(axes)


@pytest.mark.slow
def test_no_admissible_design_is_exit_3(cli):
    status, out, _ = cli("beatup", *MASS, "--set", "operation.M0=500 N*m", "--target", "torque", "--json")
    data = json.loads(out)
    assert status == 3
    assert {row["status"] for row in data["rows"]} == {"infeasible"}
    for row in data["rows"]:
        assert row["reason"].startswith("limits that clash: ")
        assert "M3_fdc >= -5 N*m" in row["reason"]
    assert data["message"] == "No front: an end has no certified design."


@pytest.mark.slow
def test_an_end_without_a_least_asks_for_a_range(cli, tmp_path):
    from loomopt.scenes import packaged

    text = packaged.problems()["shedding"].read_text()
    loose = "\n".join(line for line in text.splitlines() if not line.startswith("K1 = {"))
    (tmp_path / "loose.toml").write_text(loose)
    arguments = ("loose.toml", "--minimise", "K1", "--against", "X0", "--points", "3")
    status, out, err = cli(*arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "the least X0 is not reached: K1 grows without limit" in err
    assert "Give --range of X0 or of K1" in err
    assert cli(*arguments, "--range", "X0=20:80 mm")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--minimise", "nonsense", "--against", "m4e"), 'unknown axis "nonsense"'),
        (("--minimise", "m4e", "--against", "m4e"), "two axes that differ"),
        (("--minimise", "peak_torque"), "--against"),
        (("--against", "m4e"), "no axis is optimised"),
        (("--minimise", "peak_torque", "--minimise", "peak_power", "--against", "m4e"), "2 axes are optimised"),
        (("--minimise", "peak_torque", "--maximise", "peak_torque", "--against", "m4e"), "the axis is given twice"),
        (("--maximise", "peak_torque", "--against", "m4e"), "it can only be minimised"),
        ((*MASS, "--range", "m4e"), "it is not B=LO:HI UNIT"),
        ((*MASS, "--range", "m4e=0:2"), "the unit is missing"),
        ((*MASS, "--range", "m4e=2:0 kg"), "the first end of a range must be smaller"),
        ((*MASS, "--range", "m4e=0:2 kg", "--range", "m4e=0:3 kg"), "m4e is given twice"),
        ((*MASS, "--range", "l1=30:31 mm"), "l1 is not one of the two axes"),
        ((*MASS, "--points", "2"), "a front needs more points"),
        ((*MASS, "--points", "many"), "it is not a whole number"),
        ((*MASS, "--target", "nothing"), "no target nothing"),
        ((*MASS, "--workers", "0"), "number of workers is out of range"),
        ((*MASS, "--resume"), "nothing to resume from"),
        ((*MASS, "--out", "t.txt"), "t.txt"),
        ((*MASS, "--figure", "f.csv"), "f.csv"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)
def test_bad_input_is_one_message_and_nothing_is_written(cli, tmp_path, arguments, message):
    status, out, err = cli("beatup", *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("loomopt: ")
    assert message in err
    assert list(tmp_path.iterdir()) == []


DWELL = "--minimise", "peak_acceleration", "--against", "dwell", "--range", "dwell=36:37.5 deg", "--points", "3"


@pytest.mark.slow
def test_a_front_holds_what_the_default_target_demands_and_its_first_line_says_so(cli):
    status, out, _ = cli("rapier", *DWELL)
    assert status == 0
    assert " ".join(out.split()).startswith(
        "rapier, stroke-dwell, peak_acceleration against dwell: 3 points, 3 optimal; with the scene's limits, "
        "stroke 850 mm; without dwell_after at least"
    )
    data = json.loads(cli("rapier", *DWELL, "--json")[1])
    assert data["target"] == "stroke-dwell"
    assert [row["figures"]["stroke"] for row in data["rows"]] == pytest.approx([0.85] * 3, rel=1e-8)
    assert data["rows"][-1]["figures"]["peak_acceleration"] == pytest.approx(0.7232054145, rel=1e-8)
    assert data["provenance"]["held"] == "the scene's limits, stroke 850 mm"


@pytest.mark.slow
def test_with_target_none_a_front_drops_demands_and_says_which(cli):
    status, out, _ = cli("rapier", *DWELL, "--target", "none")
    assert status == 0
    assert "; with the scene's limits; without stroke 850 mm, dwell_after at least 30 deg" in " ".join(out.split())
    data = json.loads(cli("rapier", *DWELL, "--target", "none", "--json")[1])
    assert data["target"] is None
    assert data["rows"][-1]["figures"]["peak_acceleration"] == pytest.approx(0.536717, rel=1e-5)
