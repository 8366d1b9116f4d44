"""What a designer works with in Python: figure, drawing, files, one-row tables, words; all of it in Jupyter too."""

import inspect
import json
import math
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pandas as pd
import pytest
from matplotlib.figure import Figure
from support import inch

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.interface.figures.shown_figure import ShownFigure

PNG = b"\x89PNG"


@pytest.fixture(scope="module")
def answer():
    return lo.solve("beatup-light", starts=1)


@pytest.fixture(scope="module")
def evaluation(answer):
    return lo.evaluate("beatup", answer, target="torque")


@pytest.fixture(params=["answer", "evaluation"])
def evaluated(request):
    return request.getfixturevalue(request.param)


def tree(html):
    return ElementTree.fromstring(html.replace("&nbsp;", " "))


@pytest.mark.few(1)
def test_a_plot_is_a_figure_that_shows_itself_and_is_written_where_asked(evaluated, tmp_path):
    figure = evaluated.plot(tmp_path / "curves.svg")
    assert isinstance(figure, Figure)
    assert isinstance(figure, ShownFigure)
    assert figure._repr_png_().startswith(PNG)
    of = (
        "best design for balance, M3_fdc not reached"
        if isinstance(evaluated, lo.Answer)
        else "a given design, limits not held"
    )
    assert figure.get_suptitle() == f"{evaluated.scene.name}: {of}, curves over the cycle"
    assert len(figure.axes) >= len(evaluated.curves().columns) / 3
    assert ElementTree.parse(tmp_path / "curves.svg").getroot().tag.endswith("svg")
    with pytest.raises(lo.BadInput):
        evaluated.plot(tmp_path / "curves.txt")
    assert [path.name for path in tmp_path.iterdir()] == ["curves.svg"]


@pytest.mark.slow
def test_a_plot_is_the_picture_of_the_command(answer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer.plot("python.png")
    Path("answer.json").write_text(json.dumps(answer.as_dict()))
    assert run(["simulate", "beatup-light", "--design", "answer.json", "--out", "command.png"]) == 0
    assert Path("python.png").read_bytes() == Path("command.png").read_bytes()


def test_a_drawing_shows_itself(evaluated):
    drawn = evaluated.draw()
    texts = {element.text for element in tree(drawn._repr_svg_()).iter() if element.text}
    assert {"A", "B", "C", "D"} <= texts
    assert 'mm" height="' in drawn.svg, "at true scale; as it shows itself: tests/interface/text/test_notebook.py"
    assert drawn.drawing.primitives


@pytest.mark.parametrize("name", ["a.svg", "a.dxf", "a.csv"])
def test_an_export_is_the_file_of_the_command(answer, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert answer.export(name) == Path(name)
    Path("design.json").write_text(json.dumps(dict(answer.design)))
    assert run(["export", "beatup-light", "--design", "design.json", "--out", f"b{Path(name).suffix}"]) == 0
    values, theirs = (Path(item).read_text().splitlines() for item in (name, f"b{Path(name).suffix}"))
    assert len(values) == len(theirs) > 5
    assert sum(mine != other for mine, other in zip(values, theirs, strict=True)) < 0.05 * len(values)


def test_an_evaluation_is_exported_too_and_other_files_are_refused(evaluation, tmp_path):
    assert evaluation.export(tmp_path / "a.csv").read_text()
    with pytest.raises(lo.BadInput):
        evaluation.export(tmp_path / "a.step")
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


def test_one_row_holds_all_of_the_design_and_its_figures_in_the_tables_units(evaluated):
    frame, table = evaluated.to_frame(), evaluated.table()
    assert len(frame) == 1
    row = frame.iloc[0]
    for name, unit, value in zip(table.index, table["unit"], table["design"], strict=True):
        assert row[f"{name} [{unit}]"] == value
    assert frame.attrs["scene_hash"] == evaluated.scene.hash
    assert frame.attrs["target"] == evaluated.target


def test_one_row_in_si_is_design_and_figures_themselves(evaluated):
    row = evaluated.to_frame(si=True).iloc[0]
    for name, value in {**evaluated.design, **evaluated.figures}.items():
        if value is not None:
            assert row[f"{name} [{evaluated.units[name]}]"] == value


def test_rows_of_answers_compare_and_those_of_other_units_do_in_si(answer):
    today = lo.evaluate("beatup-light")
    both = pd.concat([today.to_frame(), answer.to_frame()], ignore_index=True)
    assert list(both["outcome"]) == ["admissible", "optimal but M3_fdc not reached"]
    assert not both.isna().any(axis=None)
    inches = lo.evaluate(inch.scene("beatup-light"))
    assert {"l1 [mm]"} <= set(today.to_frame().columns) - set(inches.to_frame().columns)
    assert "l1 [in]" in inches.to_frame()
    alike = pd.concat([item.to_frame(si=True) for item in (today, inches)], ignore_index=True)
    numbers = alike.select_dtypes("number")
    assert not alike.isna().any(axis=None)
    assert len(numbers.columns) > 15
    for name in numbers:
        assert math.isclose(*numbers[name], rel_tol=1e-9, abs_tol=1e-12)


def test_a_list_of_a_design_is_one_cell():
    knots = (0.0, 8.0, 0.0, -8.0, 0.0)
    law = {"mechanism.law": "spline", "mechanism.law_coefficients": str(list(knots))}
    second_evaluation = lo.evaluate(lo.load("shedding").update(law), {"K1": 1e5, "law": knots})
    row = second_evaluation.to_frame().iloc[0]
    assert row["K1 [N/m]"] == pytest.approx(1e5)
    assert row["law [1]"] == pytest.approx(knots)


def test_words_of_things_are_short_and_say_what_counts(answer, evaluation):
    infeasible = lo.solve("beatup-light", "retrofit", starts=1)
    record = {
        repr(answer): [
            "Answer",
            "beatup-light, balance: optimal but M3_fdc not reached",
            "M3_fdc -76.9811 N*m",
            "peak_torque 82.3371 N*m",
        ],
        repr(evaluation): ["Evaluation", "beatup, torque", "peak_torque"],
        repr(answer.scene): ["Scene", "beatup-light", "job beatup", "inertia, resistance"],
        repr(answer.prove()): ["Proofs", "beatup-light, balance: every limit holds at every crank angle"],
        repr(answer.draw()): ["beatup-light"],
        repr(infeasible): ["infeasible", "limits that clash", "l1 >= 30 mm"],
    }
    for text, words in record.items():
        assert len(text) <= 200
        assert "\n" not in text
        assert [word for word in words if word not in text] == []


def test_everything_shows_itself_in_jupyter(answer, evaluation):
    shown = {"scene": answer.scene, "answer": answer, "evaluation": evaluation, "proofs": answer.prove()}
    pages = {name: tree(thing._repr_html_()) for name, thing in shown.items()}
    assert all(page.findall("table") for page in pages.values())
    drawn = {name for name, page in pages.items() if page.findall("{http://www.w3.org/2000/svg}svg")}
    assert drawn == {"scene", "answer", "evaluation"}
    words = {name: "".join(page.itertext()) for name, page in pages.items()}
    assert "Beat-up, light cloth" in words["scene"]
    assert "M3_fdc" in words["evaluation"]
    assert "every limit holds" in words["proofs"]


def test_today_beside_an_answer_is_an_evaluation_of_its_scene(answer):
    assert isinstance(answer.today, lo.Evaluation)
    assert (answer.today.scene, answer.today.target) == (answer.scene, "balance")
    assert answer.today.figures == lo.evaluate("beatup-light").figures
    with pytest.warns(DeprecationWarning, match="before is now today"):
        assert answer.before is answer.today
    with pytest.warns(DeprecationWarning, match="sought is now task_name"):
        assert answer.sought == answer.task_name == "balance"


def test_an_evaluation_goes_on_in_its_own_scene_and_target(evaluation):
    assert evaluation.target == "torque"
    again = evaluation.evaluate()
    assert (again.figures, again.limits, again.target) == (evaluation.figures, evaluation.limits, "torque")
    assert evaluation.prove().target == "torque"
    assert evaluation.curves().attrs["target"] == "torque"


PUBLIC = [getattr(lo, name) for name in lo.__all__]
CLASSES = [entry for entry in PUBLIC if inspect.isclass(entry)]
METHODS = [
    (kind, name, getattr(member, "fget", None) or getattr(member, "func", None) or getattr(member, "__func__", member))
    for kind in CLASSES
    for name, member in inspect.getmembers_static(kind)
    if not name.startswith("_") and "loomopt" in str(getattr(member, "__module__", None) or member)
]
CALLS = [(lo, entry.__name__, entry) for entry in PUBLIC if not inspect.isclass(entry)] + [
    entry for entry in METHODS if inspect.isfunction(entry[2])
]


@pytest.mark.parametrize(("kind", "name", "call"), CALLS, ids=lambda value: getattr(value, "__name__", str(value)))
def test_an_editor_knows_every_argument_and_result(kind, name, call):
    signature = inspect.signature(call)
    arguments = [item for item in signature.parameters.values() if item.name != "self"]
    assert all(item.annotation is not inspect.Parameter.empty for item in arguments)
    assert signature.return_annotation is not inspect.Signature.empty
    assert inspect.getdoc(call)
    assert "Any" not in str(signature) or name == "as_dict"  # JSON's own data


def test_the_methods_that_an_editor_completes_are_there():
    names = {name for kind, name, _ in METHODS if kind is lo.Answer}
    assert {"plot", "draw", "export", "to_frame", "table", "curves", "evaluate", "simulate", "prove"} <= names
    assert (Path(lo.__file__).parent / "py.typed").is_file()
    assert all(inspect.getdoc(kind) for kind in CLASSES)


@pytest.mark.parametrize("shown", [lo.Answer, lo.Evaluation])
def test_a_signature_is_names_that_can_be_read(shown):
    text = str(inspect.signature(shown))
    assert text.startswith("(problem, effects, design, figures, units, limits")
    assert "loomopt" not in text
    assert "<factory>" not in text
    assert ("certificate" in text) == (shown is lo.Answer)


def test_a_goal_that_is_reached_reads_zero():
    """Rounding has no digits that mean something: the least M3_fdc of a balanced machine is 0 in what Python shows."""
    answer = lo.solve("beatup")
    rounded = lo.Answer(replace(answer.result, figures={**answer.figures, "M3_fdc": -1.13687e-13}), answer.target)
    assert "M3_fdc 0 N*m, " in repr(rounded)
    assert "M3_fdc 0.0001 N*m, " in repr(
        lo.Answer(replace(answer.result, figures={**answer.figures, "M3_fdc": 1e-4}), answer.target)
    )
