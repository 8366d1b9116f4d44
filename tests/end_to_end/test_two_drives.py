"""Two drives in one front: the recipe of the page, and studies of several scenes in one figure and table."""

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.interface.study_table import ColumnUnits

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "which-drive.md").read_text(encoding="utf-8")
RECIPE = PAGE[PAGE.index("## Both drives in one front") :]
AXES = ("peak_torque", "m4e")


def commands():
    """Commands of the recipe."""
    (block,) = re.findall(r"^```text\n(.*?)^```", RECIPE, re.MULTILINE | re.DOTALL)
    lines = block.replace("\\\n", " ").splitlines()
    return [shlex.split(line.removeprefix("loomopt ")) for line in lines]


def numbers(title):
    """Rests, deg, and torques, N·m, of a table of the recipe."""
    table = RECIPE[RECIPE.index(f"| {title}") :].splitlines()
    return [[float(text.strip(" °")) for text in line.split("|")[2:-1]] for line in (table[0], table[2])]


def shortened(command, ends):
    """The same command for three points of a part of its front."""
    words = ["3" if command[k - 1] == "--points" else word for k, word in enumerate(command)]
    return [*words, "--range", f"length.still={ends[0]}:{ends[1]} deg"]


@pytest.mark.slow
def test_the_recipe_of_the_page_gives_both_fronts(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (scene,) = re.findall(r"^`four-bar.toml`:\n\n```toml\n(.*?)^```", RECIPE, re.MULTILINE | re.DOTALL)
    Path("four-bar.toml").write_text(scene, encoding="utf-8")
    first, second = commands()
    assert run(first) == 0
    rest = numbers("six-bar at 400 rpm")[0][1]
    assert run([*shortened(second, (rest - 0.05, rest + 0.05)), "--json"]) == 0
    printed = capsys.readouterr().out
    document = json.loads(printed[printed.index("\n{") + 1 :])
    for title, rows in (("six-bar at", document["rows"]), ("four-bar at", document["others"][0]["rows"])):
        rests, torques = numbers(title)
        front = sorted((np.degrees(row["figures"]["length.still"]), row["figures"]["peak_torque"]) for row in rows)
        places, values = zip(*front, strict=True)
        inside = [k for k, rest in enumerate(rests) if front[0][0] - 0.01 <= rest <= front[-1][0] + 0.01]
        assert len(inside) == (1 if title == "six-bar at" else len(rests))
        for k in inside:
            torque = np.interp(rests[k], places, values)
            assert torque == pytest.approx(torques[k], rel=1e-3)
        assert all(row["certified"] for row in rows)
    assert Path("drives.png").stat().st_size > 10_000


@pytest.fixture(scope="module")
def fronts():
    return [lo.pareto(f"beatup-{name}", AXES, points=3) for name in ("light", "heavy")]


@pytest.mark.slow
def test_a_figure_has_the_lines_of_both_studies_in_its_own_units(fronts):
    light, heavy = fronts
    both = light.with_studies(heavy)
    chart, alone = both.charts().charts[0], light.charts().charts[0]
    lines = [curve for curve in chart.series if curve.label == "beatup-heavy"]
    assert [(kind, text) for kind, text in chart.key[:2]] == [("c0", "beatup-light"), ("c1", "beatup-heavy")]
    assert len(chart.series) == len(alone.series) + 2
    assert ColumnUnits(light.study, False).of("peak_torque") == "N*m"
    torques = sorted(row.figures["peak_torque"] for row in heavy.rows)
    assert sorted(lines[0].y) == pytest.approx(torques, rel=1e-12)
    assert chart.x.low <= min(lines[0].x) <= max(lines[0].x) <= chart.x.high
    assert both.tables() == [*light.tables(), *heavy.tables()]
    assert both.as_dict()["others"] == [heavy.as_dict()]
    assert len(both.figure()[1]) == len(light.figure()[1])


@pytest.mark.slow
def test_studies_over_other_numbers_are_refused(fronts):
    other = lo.pareto("beatup-light", ("peak_torque", "mu_min"), points=3)
    with pytest.raises(lo.BadInput, match=r"the study of beatup-light is over .*mu_min"):
        fronts[0].with_studies(other)
