"""Every format that offices write, for every kind of table that a scene names: the same numbers as plain CSV."""

import io

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
    *(quoted_commas, turned_columns, workbook),
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
