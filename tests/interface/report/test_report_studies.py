"""What a page shows beside an answer: the terminal's tables and a chart of each study, forces, a family's members."""

import json
import re
from html import unescape
from xml.etree import ElementTree

import numpy as np
import pytest

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.interface.forces import from_curves
from loomopt.interface.report import charts, document, markup
from loomopt.interface.study import sensitivity
from loomopt.picture.chart import Bars
from loomopt.picture.table import TextTable

pytestmark = pytest.mark.slow

MADE = {f"tolerances.{name}": {"plus_minus": "0.06 mm", "sigmas": 3} for name in ("l1", "l3")}


@pytest.fixture(scope="module")
def answer():
    return lo.solve(lo.load("beatup").update(MADE), starts=1)


@pytest.fixture(scope="module")
def studies(answer):
    return {
        "budget": answer.budget(fluctuation=0.02),
        "tolerance": lo.tolerance(answer.scene, answer, samples=2048, worst=False),
        "sensitivity": lo.sensitivity("shedding-static"),
        "effects": lo.effects("shedding-static"),
    }


def plain(html):
    """Return the text of a page."""
    return unescape(re.sub(r"<(?!br).*?>", "", html.replace("<br>", "\n")))


def drawn(html):
    """Return the drawings of a page's charts, read."""
    result = re.findall(r'<figure class="chart">.*?(<svg .*?</svg>)', html, re.DOTALL)
    return [ElementTree.fromstring(item) for item in result]


def test_a_page_shows_the_terminals_tables_of_each_study(answer, studies, tmp_path):
    shown = plain(answer.report(tmp_path / "all.html", *studies.values()).read_text(encoding="utf-8"))
    assert len(shown.encode()) < 300_000
    for how, studie in studies.items():
        grids = [part for part in studie.tables() if isinstance(part, TextTable)]
        assert grids
        for cell in (cell for grid in grids for line in grid.lines for cell in line):
            assert cell.replace("\ue000", "\xa0") in shown, (how, cell)


def test_each_study_has_a_chart_of_its_numbers(studies):
    pages = {how: "".join(map(markup.part, result.report_parts())) for how, result in studies.items()}
    result = studies["budget"]
    (shares,) = drawn(pages["budget"])
    curves = [item for item in shares.iter() if item.get("class", "").startswith("curve")]
    assert len(curves) == len(result.rows) + 1
    points = np.array([item.split(",") for item in curves[-1].get("points").split()], dtype=float)
    left, right, first, last, bottom, top, least, most = map(float, shares.get("data-ends").split())
    peak = points[np.argmax(np.abs(least + (bottom - points[:, 1]) / (bottom - top) * (most - least)))]
    at = first + (peak[0] - left) / (right - left) * (last - first)
    assert at == pytest.approx(np.degrees(result.torque.angle), abs=2.0)
    texts = [item.get("aria-label") for item in drawn(pages["tolerance"])]
    assert texts == [
        f"machines [%] over {name}"
        for name in ("swing [deg]", "theta [deg]", "mu_min [deg]", "M3_fdc [N*m]", "peak_torque [N*m]")
    ]
    assert f"{100 * studies['tolerance'].yields['swing'].value:.4g} % accepted" in plain(pages["tolerance"])
    for how, count in (
        ("sensitivity", len(sensitivity.moved_objectives(studies["sensitivity"].result))),
        ("effects", 2),
    ):
        assert len(drawn(pages[how])) == count


def test_bars_reach_from_0_to_their_values():
    rows = [("up", (2.0, None)), ("down", (-1.0, 0.5)), ("none", (None, float("nan")))]
    (picture,) = drawn(charts.figure(Bars("b", rows, [("c0", "a"), ("c1", "b")])))
    ends = [
        re.fullmatch(r"M([\d.]+) [\d.]+H([\d.]+)", item.get("d")).groups()
        for item in picture.iter("path")
        if item.get("class").startswith("bar")
    ]
    long = [float(end) - float(begin) for begin, end in ends]
    assert len({begin for begin, _ in ends}) == 1
    assert np.array(long) / long[0] * 2.0 == pytest.approx([2.0, -1.0, 0.5], abs=2e-3)


def test_forces_in_the_joints_are_told_where_an_effect_tells_them():
    scene = lo.load("beatup").with_effect("joint_forces")
    evaluation = lo.evaluate(scene)
    (part,) = [item for item in document.of_design(evaluation).parts if item.title == "Forces in the joints"]
    forces = from_curves(scene, evaluation.simulate(), evaluation.design)
    assert part.blocks[-2:] == tuple(forces.tables())
    shown = markup.part(part)
    assert len(drawn(shown)) == 1 + len(forces.by_name)
    assert all(f"force_<wbr>{joint}</td>" in shown for joint in "ABCD")
    titles = [item.title for item in document.of_design(lo.evaluate("beatup")).parts]
    assert "Forces in the joints" not in titles


@pytest.mark.slow
def test_a_family_has_a_chapter_of_its_own_for_each_member(tmp_path):
    speeds = {"targets.family.members": [{"speed": "500 rpm"}, {"speed": "600 rpm"}]}
    second_answer = lo.solve(lo.load("shedding").update(speeds), "family", starts=1)
    html = second_answer.report(tmp_path / "family.html").read_text(encoding="utf-8")
    heads = re.findall('<p class="verdict">(.*?)</p><h2>(.*?)</h2>', html)
    assert heads == [
        ("Optimal and certified", "shedding, family"),
        ("Member 1: all limits held", "shedding, family, member 1: speed 500 rpm"),
        ("Member 2: all limits held", "shedding, family, member 2: speed 600 rpm"),
    ]
    whole, *values = html.split("<article")[1:]
    assert "Curves over the turn" not in whole
    assert all(item.count('<figure class="machine"') == 1 for item in values)
    assert f"{second_answer.members[0].figures['contact_min']:.6g}" in plain(values[0])


def test_the_command_adds_studies_to_each_answer(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["report", "shedding", "--study", "budget", "--study", "proof", "--out", "a.html"]) == 0
    titles = re.findall("<h3>(.*?)</h3>", (tmp_path / "a.html").read_text(encoding="utf-8"))
    assert titles[-2:] == ["Shares of the crank torque", "Proof at every crank angle"]
    capsys.readouterr()
    assert run(["report", "shedding", "--study", "front", "--out", "b.html"]) == 2
    assert "budget, tolerance, sensitivity, effects, accuracy, proof" in capsys.readouterr().err
    assert run(["report", "shedding", "--study", "tolerance", "--out", "b.html"]) == 2
    report = capsys.readouterr().err
    assert "no number of the scene has a tolerance" in report
    assert "solving" not in report
    assert not (tmp_path / "b.html").exists()


@pytest.fixture(scope="module")
def files(answer, tmp_path_factory):
    """An answer, the store of a sweep and that of a front."""
    folder = tmp_path_factory.mktemp("files")
    (folder / "a.json").write_text(json.dumps(answer.as_dict()), encoding="utf-8")
    lo.sweep("shedding-static", {"mechanism.travel": "60:70:5 mm"}, store=folder / "sweep.db")
    lo.pareto("shedding-static", ["K1", "X0"], points=3, store=folder / "front.db")
    return folder


@pytest.mark.slow
def test_one_page_holds_an_answer_with_stores_and_studies(files, tmp_path, monkeypatch):
    monkeypatch.chdir(files)
    page = tmp_path / "page.html"
    words = [
        "report",
        "sweep.db",
        "a.json",
        "front.db",
        "--study",
        "budget",
        "--study",
        "tolerance",
        "--study",
        "budget",
    ]
    assert run([*words, "--out", str(page)]) == 0
    html = page.read_text(encoding="utf-8")
    chapters = html.split("<article")[1:]
    heads = [re.search("<h2>(.*?)</h2>", chapter)[1] for chapter in chapters]
    assert [head.partition(",")[0] for head in heads] == [
        "sweep of shedding-static",
        "beatup",
        "pareto of shedding-static",
    ]
    shown = [re.findall("<h3>(.*?)</h3>", chapter) for chapter in chapters]
    assert sum(title == "Shares of the crank torque" for title in shown[1]) == 1
    assert not any("Shares of the crank torque" in titles for titles in (shown[0], shown[2]))


@pytest.mark.parametrize(
    ("inputs", "report"),
    [
        (["beatup", "no-such.db"], "no-such.db"),
        (["beatup", "a.json", "damaged.json"], "damaged.json"),
        (["beatup", "shedding", "--study", "tolerance"], "no number of the scene has a tolerance"),
        (["shedding", "rapier", "--study", "budget"], "no effect acts on the crank"),
        (["beatup", "sweep.db", "--target", "pulse"], "has its own scene and target"),
        (["beatup", "shedding", "--target", "pulse"], "pulse"),
        (["sweep.db", "front.db", "--study", "budget"], "cannot be used with a store"),
    ],
)
def test_all_inputs_are_checked_before_anything_is_computed(files, inputs, report, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(files)
    (files / "damaged.json").write_text('{"status": "optimal"', encoding="utf-8")
    monkeypatch.setattr("loomopt.interface.api.solve", lambda *given, **how: pytest.fail("a scene was solved"))
    assert run(["report", *inputs, "--out", str(tmp_path / "page.html")]) == 2
    assert report in capsys.readouterr().err
    assert not (tmp_path / "page.html").exists()


@pytest.mark.parametrize("name", ["front.db", "curves.csv", "page.html", "empty.sqlite"])
@pytest.mark.parametrize("there", [True, False])
def test_a_file_that_is_no_scene_answer_or_store_is_named(tmp_path, capsys, name, there):
    path = tmp_path / name
    if there:
        path.write_text("no store" if name != "empty.sqlite" else "", encoding="utf-8")
    assert run(["report", str(path), "--out", str(tmp_path / "r.html")]) == 2
    report = capsys.readouterr()
    assert report.out == ""
    assert report.err.count("\n") == 1
    assert name in report.err
    assert ("it is no scene, answer or store" if there else "the file does not exist") in report.err
