"""Every format that offices write, for every kind of table that a scene names: the same numbers as plain CSV."""

import io
import re

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from openpyxl import Workbook

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.files import sheets
from loomopt.jobs.linkage.scene import read_path
from loomopt.jobs.rapier.scene import read_match
from loomopt.jobs.shedding.scene import read_law
from loomopt.model.numbers import curves
from loomopt.scenes import csv_tables, table_cells

ANGLES = [str(k) for k in range(0, 181, 15)]
RISE = [
    *("0", "0.03756", "0.28834", "0.90845", "1.95501", "3.37089", "5"),
    *("6.62911", "8.04499", "9.09155", "9.71166", "9.96244", "10"),
]
TURN = [str(k) for k in range(0, 360, 30)]
LOAD = ["120", "118.25", "105.5", "90", "-3.75", "0.5", "12", "40.25", "66", "90.75", "105", "119"]
OTHER = ["1.5", "2", "3.25", "4", "5", "4", "3", "2", "1", "0.5", "0.25", "1"]


def law(path):
    scene = lo.load("shedding").update({"mechanism.law": "table", "mechanism.law_table": str(path)})
    return dict(read_law(scene).read.columns)


def match(path):
    return dict(read_match(lo.load("rapier").set("targets.match.table", str(path))).columns)


def timed_path(path):
    return dict(read_path(lo.load("path-18").set("targets.path.table", str(path)), "path").columns)


def beatup_resistance(path):
    return curves(lo.load("beatup").set("effects.resistance.table", str(path)))


def warp_tension(path):
    return curves(lo.load("shedding").set("effects.warp_tension.table", str(path)))


def linkage_resistance(path):
    return curves(lo.load("sixbar-sley").set("effects.resistance.table", str(path)))


def measured(path):
    return dict(csv_tables.read_measured(path, {"phi": "angle", "psi": "angle", "Md": "torque"}).columns)


KINDS = {
    law: [("angle", "deg", ANGLES), ("s", "mm", RISE)],
    match: [("phi1", "deg", TURN), ("S", "mm", LOAD)],
    timed_path: [("phi", "deg", TURN), ("x", "m", OTHER), ("y", "m", LOAD)],
    beatup_resistance: [("angle", "deg", TURN), ("M", "N*m", LOAD)],
    linkage_resistance: [("angle", "deg", TURN), ("M", "N*m", LOAD)],
    warp_tension: [("angle", "deg", TURN), ("T", "N", LOAD)],
    measured: [("phi", "deg", TURN), ("psi", "deg", OTHER), ("Md", "N*m", LOAD)],
}
"""What reads a kind of table → its columns: name, unit, numbers."""


def rows(columns):
    return [[f"{name} [{unit}]" for name, unit, _ in columns], *zip(*(item for _, _, item in columns), strict=True)]


def joined(cells, sign=",", comma=False):
    report = ([cell.replace(".", ",") if comma and k else cell for cell in row] for k, row in enumerate(cells))
    return "".join(f"{sign.join(row)}\n" for row in report)


def plain(columns):
    return joined(rows(columns)).encode()


def semicolons(columns):
    return joined(rows(columns), ";", comma=True).encode("cp1252")


def separator_line(columns):
    return b"\xef\xbb\xbfsep=;\r\n" + joined(rows(columns), ";", comma=True).replace("\n", "\r\n").encode()


def tabs(columns):
    return joined(rows(columns), "\t").replace("\n", "\r").encode()


def utf16(columns):
    return joined(rows(columns), "\t", comma=True).encode("utf-16")


def utf16_big(columns):
    return joined(rows(columns), ";", comma=True).encode("utf-16-be")


def trailing_empty(columns):
    body = "".join(f"{','.join(row)},,\n" for row in rows(columns))
    return f"{body},,,,\n,,\n".encode()


def descending(columns):
    head, *body = rows(columns)
    return joined([head, *reversed(body)]).encode()


def units_below(columns):
    _, *body = rows(columns)
    return joined([[name for name, _, _ in columns], [f"[{unit}]" for _, unit, _ in columns], *body], ";").encode()


def round_brackets(columns):
    _, *body = rows(columns)
    return joined([[f"{name}({unit})" for name, unit, _ in columns], *body]).replace("deg", "°").encode("cp1252")


def quoted_commas(columns):
    head, *body = rows(columns)
    cells = [[f'"{cell.replace(".", ",")}"' for cell in row] for row in body]
    return joined([head, *cells]).encode()


def turned_columns(columns):
    return joined(
        [[*row[::-1], note] for row, note in zip(rows(columns), ["note", *["x"] * 40], strict=False)]
    ).encode()


def units_in_cells(columns):
    _, *body = rows(columns)
    units = [unit for _, unit, _ in columns]
    cells = [[f"{cell} {unit}" for cell, unit in zip(row, units, strict=True)] for row in body]
    return joined([[name for name, _, _ in columns], *cells], ";", comma=True).replace(" deg", "°").encode()


def units_in_headings_and_cells(columns):
    head, *body = rows(columns)
    cells = [[f"{cell}{unit}" for cell, (_, unit, _) in zip(row, columns, strict=True)] for row in body]
    return joined([head, *cells]).encode()


def workbook(columns):
    head, *body = rows(columns)
    book, out = Workbook(), io.BytesIO()
    sheet = book.worksheets[0]
    for row in [head, *([float(cell) for cell in row] for row in body), [None, None]]:
        sheet.append(row)
    book.create_sheet("about").append(["name", "value"])
    book.save(out)
    return out.getvalue()


FORMATS = [
    *(semicolons, separator_line, tabs, utf16, utf16_big, trailing_empty, descending, units_below, round_brackets),
    *(quoted_commas, turned_columns, units_in_cells, units_in_headings_and_cells, workbook),
]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.__name__)
@pytest.mark.few(24)
def test_a_format_gives_the_numbers_of_plain_csv(tmp_path, form, kind):
    ending = ".xlsx" if form is workbook else ".csv"
    known, path = tmp_path / "plain.csv", tmp_path / f"other{ending}"
    known.write_bytes(plain(KINDS[kind]))
    path.write_bytes(form(KINDS[kind]))
    assert kind(path) == kind(known)


def with_cell(text, place, cell):
    """Return a CSV table with semicolons, and one cell of its fourth line exchanged."""
    lines = [line.split(";") for line in text.split("\n")]
    lines[3][place] = cell
    return "\n".join(";".join(line) for line in lines).encode()


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize(
    "cell", ["#N/A", "#NV", "#DIV/0!", "#REF!", "#VALUE!", "#BEZUG!", "#ÜBERLAUF!", "#NAME?", "####"]
)
@pytest.mark.few(24)
def test_an_error_of_a_spreadsheet_is_no_remark(tmp_path, kind, place, cell):
    path = tmp_path / "error.csv"
    path.write_bytes(with_cell(joined(rows(KINDS[kind]), ";"), place, cell))
    with pytest.raises(BadInput, match=rf'line 4, column {KINDS[kind][place][0]}: "{re.escape(cell)}" is an error'):
        kind(path)


def test_lines_of_remarks_are_no_cells(tmp_path):
    path, known = tmp_path / "remarks.csv", tmp_path / "known.csv"
    text = joined(rows(KINDS[law]))
    known.write_text(text, encoding="utf-8")
    remarks = "#########\n# made on Monday, by hand\n#N/A: not measured\n#!\n"
    path.write_text(remarks + text + remarks, encoding="utf-8")
    assert law(path) == law(known)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_cell_in_another_unit_than_its_column_is_refused(tmp_path, kind):
    path = tmp_path / "units.csv"
    path.write_bytes(with_cell(joined(rows(KINDS[kind]), ";"), 0, "0.5 rad"))
    with pytest.raises(BadInput, match=r"line 4, column .*another unit than its column"):
        kind(path)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("place", [0, 1])
def test_a_formula_without_a_stored_value_is_named(tmp_path, kind, place):
    from openpyxl import load_workbook

    path = tmp_path / "formula.xlsx"
    path.write_bytes(workbook(KINDS[kind]))
    book = load_workbook(path)
    book.worksheets[0].cell(4, place + 1).value = "=A2+1"
    book.save(path)
    with pytest.raises(BadInput, match=r'line 4, column .*: the formula "=A2\+1" has no stored value'):
        kind(path)


@pytest.mark.parametrize("sign", [";", "\t", "|"])
def test_points_that_may_part_thousands_are_read_by_a_rule_that_is_told(sign):
    loads = ["1.955", "1.922", *["955"] * 10]
    for texts, remarks in ((loads, 1), ([*loads[:-1], "0.5"], 0)):
        cells = list(zip(TURN, texts, strict=True))
        table = table_of(joined([["angle [deg]", "M [N*m]"], *cells], sign).encode())
        assert len(table.remarks) == remarks
        assert table.columns["M"][0] == 1.955


def test_points_in_texts_of_a_workbook_are_told_and_those_of_its_numbers_are_not():
    for loads, remarks in (
        ([1.955] * 12, 0),
        (["1.955"] * 12, 1),
        (["1.955", *[0.5] * 11], 1),
        (["1.5", *[1.955] * 11], 0),
    ):
        book, out = Workbook(), io.BytesIO()
        for row in [("angle [deg]", "M [N*m]"), *zip(map(int, TURN), loads, strict=True)]:
            book.worksheets[0].append(row)
        book.save(out)
        assert len(table_of(out.getvalue()).remarks) == remarks


def table_of(raw):
    """Return the table that the bytes of a file make."""
    return csv_tables._table(list(table_cells.read(raw, "t.csv")), "t.csv", {"angle": "angle", "M": "torque"})


def test_a_parquet_file_has_the_gaps_of_csv(tmp_path):
    frame = pd.DataFrame({"phi [deg]": [0.0, 90.0, 180.0], "Md [N*m]": [1.0, None, 3.0]})
    tables = []
    for ending, write in (("csv", frame.to_csv), ("parquet", frame.to_parquet)):
        write(tmp_path / f"p.{ending}", index=False)
        columns = csv_tables.read_measured(tmp_path / f"p.{ending}", {"phi": "angle", "Md": "torque"}).columns
        tables.append(str(dict(columns)))
    assert tables[0] == tables[1]
    assert "nan" in tables[0]


NUMBERS = (
    st.floats(-1e6, 1e6, allow_nan=False)
    .map(lambda value: float(f"{value:.9g}"))
    .filter(lambda value: value == 0 or abs(value) > 1e-50)
)


@given(st.lists(NUMBERS, min_size=3, max_size=12), st.booleans(), st.sampled_from([".csv", ".xlsx"]))
def test_what_is_written_is_read_to_the_last_digit(tmp_path_factory, values, comma, ending):
    path = tmp_path_factory.mktemp("table") / f"p{ending}"
    frame = pd.DataFrame({"phi [rad]": [0.5 * k for k in range(len(values))], "Md [N*m]": values})
    frame.attrs["scene"] = "made up, 1.5"
    sheets.write(path, {"curves": frame}, comma)
    try:
        result = csv_tables.read_measured(path, {"phi": "angle", "Md": "torque"})
    except BadInput as error:
        assert "part thousands" in str(error) or "decimal sign" in str(error)  # noqa: PT017 (only some tables have two readings)
        assert ending == ".csv"
        assert not comma
        return
    assert result.columns["Md"] == tuple(values)


@given(st.binary(max_size=400))
def test_any_bytes_are_cells_or_refused(raw):
    try:
        assert list(table_cells.read(raw, "any.csv"))
    except BadInput as refused:
        assert refused.remedy  # noqa: PT017 (both ends are right)


@pytest.mark.parametrize(
    ("texts", "halves"),
    [
        (["0", "0.5", "12.125", "3.25"], [0.0005] * 4),
        (["0.000", "0.001"], [0.0005] * 2),
        (["7.24016e-05", "0.00115402", "0.0181848", "1.66684", "17.3252"], [5e-11, 5e-9, 5e-8, 5e-6, 5e-5]),
        (["120", "105", "90"], [0.5] * 3),
    ],
)
def test_precision_is_that_of_most_decimals_or_of_digits_from_the_first_one(texts, halves):
    assert csv_tables._halves(texts, None) == pytest.approx(halves)


def test_a_workbook_travels_with_an_answer(tmp_path):
    from loomopt.scenes.numbers import tables

    path = tmp_path / "law.xlsx"
    path.write_bytes(workbook(KINDS[law]))
    scene = lo.load("shedding").update({"mechanism.law": "table", "mechanism.law_table": str(path)})
    table = tables(scene)["mechanism.law_table"]
    again = tmp_path / "law.csv"
    again.write_text(table, encoding="utf-8")
    assert law(again) == law(path)
