"""Curves beside what was measured: columns of their own, the rms difference, dots in the figure."""

import math

import numpy as np
import pytest
from typer.testing import CliRunner

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.cli import app


@pytest.fixture
def measured(tmp_path):
    """Write the packaged machine's rocker angle at 24 crank angles, off by 0.1 deg up and down, with other columns."""
    frame = lo.simulate("beatup")
    rows = ["phi [deg],psi [deg],time"]
    for k in range(24):
        at = int(np.argmin(np.abs(frame["phi [rad]"] - math.radians(15 * k))))
        rows.append(f"{15 * k - (360 if k > 20 else 0)},{math.degrees(frame['psi [rad]'][at]) + 0.1 * (-1) ** k!r},x")
    path = tmp_path / "measured.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def test_what_was_measured_stands_in_a_column_of_its_own_with_its_rms(measured):
    frame = lo.simulate("beatup", measured=measured)
    there = frame["psi_measured [rad]"].dropna()
    assert len(there) == 24
    off = (frame["psi [rad]"] - frame["psi_measured [rad]"]).dropna()
    assert off.abs().to_numpy() == pytest.approx(math.radians(0.1), rel=1e-9)
    assert float(frame.attrs["rms_psi [rad]"]) == pytest.approx(math.radians(0.1), rel=1e-9)
    assert frame.attrs["measured"] == str(measured)


def test_angles_between_the_rows_of_curves_have_rows_of_their_own(tmp_path):
    path = tmp_path / "one.csv"
    path.write_text("phi [deg],psi [deg]\n12.345,150\n")
    frame = lo.simulate("beatup", measured=path)
    at = frame["psi_measured [rad]"].first_valid_index()
    assert frame["phi [rad]"][at] == pytest.approx(math.radians(12.345), abs=1e-15)


@pytest.mark.slow
def test_an_answer_is_drawn_beside_what_was_measured(measured):
    answer = lo.evaluate("beatup")
    figure = answer.plot(measured=measured)
    lines = [line for axes in figure.axes for line in axes.lines if line.get_fillstyle() == "none"]
    assert len(lines) == 1
    assert np.isfinite(np.asarray(lines[0].get_ydata(), dtype=float)).sum() in (24, 25)
    assert answer.simulate(measured=measured)["psi_measured [rad]"].notna().sum() == 24


@pytest.mark.slow
def test_the_command_tells_the_rms_and_writes_both(measured, tmp_path):
    out = [tmp_path / name for name in ("curves.csv", "curves.png")]
    words = ["simulate", "beatup", "--beside", str(measured), *(w for path in out for w in ("--out", str(path)))]
    report = CliRunner().invoke(app.application(words), words)
    assert report.exit_code == 0, report.output
    assert "psi" in report.stdout
    assert " 24 " in report.stdout
    assert " 0.1 " in report.stdout
    assert "psi_measured [deg]" in out[0].read_text()
    assert out[1].stat().st_size > 1000


@pytest.mark.parametrize(
    ("rows", "report"),
    [
        ("phi [deg],chi [deg]\n0,1\n", "no column of the curves"),
        ("psi [deg]\n1\n", "no column phi"),
        ("phi [deg],psi [mm]\n0,1\n", "is not a unit of this column"),
        ("phi [deg],psi [deg]\n0,1\n0,2\n0,3\n", "is also in line 2"),
        ("phi [deg],psi [deg]\n0,\n", "column psi is empty"),
        ("", "empty"),
    ],
)
def test_a_file_that_measures_nothing_is_refused_in_one_line(tmp_path, rows, report):
    path = tmp_path / "bad.csv"
    path.write_text(rows)
    with pytest.raises(BadInput, match=report):
        lo.simulate("beatup", measured=path)


@pytest.mark.parametrize("wrong", [5, "none.csv", b"x", True])
def test_what_is_no_file_is_refused(wrong):
    with pytest.raises(BadInput):
        lo.simulate("beatup", measured=wrong)


@pytest.mark.parametrize("comma", [False, True])
@pytest.mark.parametrize("name", ["p.csv", "p.xlsx"])
@pytest.mark.parametrize("problem", ["beatup", "rapier", "shedding"])
@pytest.mark.few(1)
def test_own_curves_are_read_as_measured_ones(tmp_path, problem, name, comma):
    path = tmp_path / name
    words = ["simulate", problem, "--out", str(path), *(["--decimal", "comma"] if comma else [])]
    made = CliRunner().invoke(app.application(words), words)
    assert made.exit_code == 0, made.output
    frame = lo.simulate(problem, measured=path)
    record = {str(key): value for key, value in frame.attrs.items() if str(key).startswith("rms_")}
    assert len(record) > 3
    for key, value in record.items():
        assert float(value) <= 1e-11 * frame[key.removeprefix("rms_")].abs().max(), key


def test_precision_and_the_rule_for_ambiguous_commas_are_told(tmp_path):
    path = tmp_path / "m.csv"
    path.write_text("phi [deg];psi [deg]\n0;82,250\n66;67,125\n120;74,500\n")
    words = ["simulate", "beatup", "--beside", str(path)]
    report = CliRunner().invoke(app.application(words), words)
    assert report.exit_code == 0, report.output
    assert "0.0005" in report.stdout
    assert "commas are read as decimal commas" in " ".join(report.stdout.split())
    frame = lo.simulate("beatup", measured=path)
    assert float(frame.attrs["precision_psi"]) == pytest.approx(math.radians(0.0005))
