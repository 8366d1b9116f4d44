"""The torque budget to work with: its table, JSON, figure and words, in Python and on the command line."""

import json
import math

import numpy as np
import pytest
from support import overlaps

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.cli import app

MORE = ["--with", "gravity", "--with", "bearing_friction", "--fluctuation", "0.02"]


def run_budget(capsys, *words):
    """Return the exit status, stdout and stderr of the command."""
    status = app.run(["budget", *words])
    output = capsys.readouterr()
    return status, output.out, output.err


def test_json_has_the_shares_their_sum_and_the_motor(capsys):
    status, out, err = run_budget(capsys, "beatup", *MORE, "--json")
    data = json.loads(out)
    assert (status, err) == (0, "")
    assert data["problem"] == "beatup"
    assert [row["effect"] for row in data["rows"]] == ["inertia", "resistance", "gravity", "bearing_friction"]
    for row in (*data["rows"], data["total"]):
        assert {"at_peak", "rms", "energy"} <= row.keys()
    assert data["motor"].keys() >= {"rms_torque", "mean_power", "peak_power", "regenerated", "flywheel"}
    assert data["motor"]["flywheel"] == pytest.approx(0.814006, rel=1e-5)
    assert data["units"]["flywheel"] == "kg*m^2"
    assert data["total"]["at_peak"] == pytest.approx(math.fsum(row["at_peak"] for row in data["rows"]), rel=1e-14)


def test_what_is_not_known_is_null_with_its_reason(capsys):
    data = json.loads(run_budget(capsys, "beatup", "--json")[1])
    assert data["motor"]["flywheel"] is None
    assert data["undefined"]["flywheel"] == "no fluctuation is given, such as 0.02"
    document = {**lo.load("shedding-static").without_effect("warp_tension").document}
    document["operation"] = {key: value for key, value in document["operation"].items() if key != "speed"}
    still = lo.budget(lo.scene({**document, "targets": {}}))
    assert still.motor.rms_torque > 0.0
    assert still.motor.mean_power is still.motor.peak_power is still.motor.regenerated is None
    assert still.undefined["mean_power"] == "operation.speed is not given"


def test_the_terminal_tells_them_in_the_scene_s_units(capsys):
    status, out, _ = run_budget(capsys, "beatup", *MORE, "--set", "display.torque=lbf*in")
    assert status == 0
    assert "peak crank torque -832.466 lbf*in at 33.3003 deg" in out
    (line,) = [line.split() for line in out.splitlines() if line.startswith("bearing_friction")]
    assert float(line[1]) == pytest.approx(0.411424 / 0.1129848, rel=1e-5)
    assert line[2] == "-0.4374"
    assert "mean power" in out
    assert "for a fluctuation of 0.02" in " ".join(out.split())


def test_a_table_has_a_line_per_effect_and_one_for_their_sum():
    budget = lo.budget(lo.load("beatup").set("display.torque", "lbf*in"))
    table, si = budget.table(), budget.table(si=True)
    assert list(table.index) == ["inertia", "resistance", "total"]
    assert si.loc["total", "at_peak [N*m]"] == budget.total.at_peak
    assert table.loc["total", "at_peak [lbf*in]"] == pytest.approx(budget.total.at_peak / 0.1129848290276167, rel=1e-14)
    assert table.attrs["scene"] == "beatup"
    assert "inertia" in budget._repr_html_()
    assert repr(budget) == "<Budget beatup: crank torque -830.638 lbf*in at its peak, of 2 effects>"


def test_the_figure_has_a_curve_for_each_share_and_no_text_runs_into_anything(tmp_path):
    scene = lo.load("beatup")
    for effect in scene.schema.effects.values():
        if effect.name not in scene.effects and effect.name not in ("shaft_torsion", "speed_fluctuation"):
            scene = scene.set(f"effects.{effect.name}", dict(effect.examples[0]))
    budget = lo.budget(scene)
    assert len(budget.rows) >= 7
    drawn = budget.plot(tmp_path / "budget.svg")
    assert overlaps.overlapping(drawn) == []
    (axes,) = drawn.axes
    curves = [y for y in (np.asarray(line.get_ydata()) for line in axes.lines) if len(y) > 2]
    assert len(curves) == len(budget.rows) + 1, "the shares and their sum"
    sums = np.sum(curves[:-1], axis=0)
    assert curves[-1] == pytest.approx(sums, abs=1e-9)
    assert (tmp_path / "budget.svg").stat().st_size > 1000
    with pytest.raises(BadInput, match="svg"):
        budget.plot(tmp_path / "budget.gif")


def test_figures_are_written_from_the_command_line(tmp_path, capsys):
    path = tmp_path / "shares.png"
    status, _, err = run_budget(capsys, "shedding", "--figure", str(path))
    assert (status, err) == (0, f"Wrote {path}\n")
    assert path.read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("rapier",), "no effect acts on the crank"),
        (("beatup", "--fluctuation", "0"), "--fluctuation: it is out of range"),
        (("beatup", "--fluctuation", "2 %"), "--fluctuation: it is not a number"),
        (("beatup", "--figure", "a.gif"), ".png"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_printed(words, message, capsys):
    status, out, err = run_budget(capsys, *words)
    assert (status, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1
