"""Tables as offices take them: workbooks, decimal commas; a name with an unknown ending is never a folder."""

import csv
import json
import math
from pathlib import Path

import openpyxl
import pandas as pd
import pytest

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.interface.files import sheets

SHEETS = ["design", "figures", "limits", "curves", "about"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def cells(path, sheet):
    return [list(row) for row in openpyxl.load_workbook(path)[sheet].iter_rows(values_only=True)]


def body(path, sign=";"):
    lines = Path(path).read_text(encoding="utf-8").splitlines()
    return list(csv.reader([line for line in lines if not line.startswith("#")], delimiter=sign))


@pytest.mark.slow
def test_an_answer_is_a_workbook_of_its_design_figures_limits_and_curves(capsys):
    assert run(["solve", "shedding", "--starts", "1", "--json", "--out", "answer.xlsx"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert openpyxl.load_workbook("answer.xlsx").sheetnames == SHEETS
    design = {row[0]: row[3] for row in cells("answer.xlsx", "design")[1:]}
    assert design["K1"] == pytest.approx(data["design"]["K1"], rel=1e-9)
    figures = {row[0]: row[3] for row in cells("answer.xlsx", "figures")[1:]}
    assert figures["peak_torque"] == pytest.approx(data["figures"]["peak_torque"], rel=1e-9)
    limits = cells("answer.xlsx", "limits")
    assert limits[0] == ["name", "unit", "value", "min", "max", "held"]
    assert len(limits) - 1 == len(data["limits"])
    assert all(row[5] is True for row in limits[1:])
    curves = cells("answer.xlsx", "curves")
    assert len(curves) > 720
    assert max(row[curves[0].index("N [N]")] for row in curves[1:]) == pytest.approx(
        data["figures"]["contact_max"], rel=1e-6
    )
    assert ["scene", "shedding"] in cells("answer.xlsx", "about")


@pytest.mark.parametrize("name", ["answer.csv", "answer.xls", "answer.txt", "results.v2", "a.b/../c.d"])
def test_a_name_with_an_unknown_ending_is_no_folder(name, folder, capsys):
    assert run(["solve", "shedding", "--out", name]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert ".xlsx" in output.err
    assert list(folder.iterdir()) == []


def test_a_folder_that_is_there_may_have_any_name(folder):
    (folder / "results.v2").mkdir()
    assert run(["solve", "shedding-static", "--starts", "1", "--out", "results.v2"]) == 0
    assert (folder / "results.v2" / "answer.json").is_file()


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("words", "sheet"),
    [
        (["simulate", "beatup"], "curves"),
        (["export", "beatup"], "joints"),
        (["export", "shedding"], "joints"),
        (["sweep", "shedding-static", "--over", "mechanism.X0=70:80:10 mm"], "points"),
    ],
)
def test_what_is_taken_as_csv_is_taken_as_a_workbook_and_with_commas(words, sheet, capsys):
    for name, more in (("point.csv", ()), ("comma.csv", ("--decimal", "comma")), ("book.xlsx", ())):
        assert run([*words, "--out", name, *more]) == 0
    point, comma, book = body("point.csv", ","), body("comma.csv"), cells("book.xlsx", sheet)
    assert len(point) == len(comma) == len(book)
    assert [len(row) for row in point] == [len(row) for row in comma]
    assert point[0] == comma[0] == book[0]
    numbers = 0
    for row, other, values in zip(point[1:], comma[1:], book[1:], strict=True):
        for heading, cell, its, value in zip(point[0], row, other, values, strict=True):
            if sheets.NUMBER.fullmatch(cell) and "time" not in heading:
                assert "." not in its
                assert float(its.replace(",", ".")) == float(cell)
                assert value == pytest.approx(float(cell), rel=1e-14, abs=1e-300)
                numbers += 1
    assert numbers > len(point)
    capsys.readouterr()
    assert run([*words, "--out", "other.csv", "--decimal", "dot"]) == 2
    assert not Path("other.csv").exists()


def test_text_is_never_a_formula_and_what_is_not_known_is_empty():
    frame = pd.DataFrame({"name": ["=1+1", "+a\x07b"], "x [m]": [math.nan, 1.5], "list": [(1.0, 2.0), None]})
    sheets.write(Path("a.xlsx"), {"all": frame})
    book = openpyxl.load_workbook("a.xlsx")["all"]
    assert [book.cell(2, 1).value, book.cell(2, 1).data_type] == ["=1+1", "s"]
    assert book.cell(3, 1).value == "+a b"
    assert book.cell(2, 2).value is None
    assert book.cell(2, 3).value == "1.0; 2.0"


def test_an_answer_exports_to_a_workbook():
    lo.evaluate("beatup").export("joints.xlsx")
    assert len(cells("joints.xlsx", "joints")) > 4
