"""Tables as offices write them: what is plain is read, what can be mistaken is refused in words of the file."""

import csv
import math

import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.base.quantities import plain_number
from loomopt.jobs.rapier.scene import match_table
from loomopt.scenes import packaged

HEAD = "phi1 [deg],S [mm]\n"
ROWS = [f"{30 * k},{k}" for k in range(12)]
LAW = [f"{10 * k},{k * k}" for k in range(13)]


def read(tmp_path, text):
    """Return the columns of a table of head travel."""
    path = tmp_path / "wish.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return match_table(lo.load("rapier").set("targets.match.table", str(path)))


def with_row(row):
    return HEAD + "\n".join([*ROWS[:5], row, *ROWS[6:]]) + "\n"


# text of the file -> part of the message
REFUSED = {
    "decimal commas": (HEAD + "\n".join(f"{k},5,{k},25" for k in range(12)), "line 2: 4 cells stand under 2 headings"),
    "one decimal comma": (with_row("150,1,5"), "line 7: 3 cells stand under 2 headings"),
    "next to nothing": (with_row("150,1.3e-171"), 'column S: the number "1.3e-171" is too large or too small'),
    "a comma beside a point": (with_row('150,"1,5"').replace("0,0", "0,0.5"),
        "the decimal sign is a point and a comma"),
    "thousands or a decimal comma": (
        "phi1 [deg]\tS [mm]\n" + "\n".join(f"{30 * k}\t1,{100 + k}" for k in range(12)),
        'may be the decimal sign or part thousands: "1,100" (line 2, column S)'),
    "thousands or a decimal point": (
        "phi1 [deg];S [mm]\n" + "\n".join(f"{30 * k};{v}" for k, v in enumerate(["0,5", "1.234"] * 6)),
        'may be a decimal sign or part thousands: "1.234" (line 3, column S), beside "0,5" (line 2, column S)'),
    "decimal commas under nameless columns": (
        "phi1 [deg],S [mm],,\n" + "\n".join(f"{k},5,{k},25" for k in range(12)), "line 2: 4 cells stand under 2"),
    "row cut short": (with_row("150"), "line 7, column S: the cell is empty"),
    "grouped digits": (with_row("150,1_0"), 'line 7, column S: "1_0" is no number'),
    "digits of another script": (with_row("150,\u0661\u0662"), "line 7"),
    "wide digits": (with_row("150,\uff11\uff12"), "line 7"),
    "space inside": (with_row("150,1 0"), "line 7"),
    "hexadecimal": (with_row("150,0x10"), "line 7"),
    "empty cell": (with_row("150,"), "line 7"),
    "not finite": (with_row("150,nan"), "line 7"),
    "infinite": (with_row("150,1e999"), "line 7"),
    "too large to compute with": (with_row("150,1e200"), "line 7"),
    "too small to compute with": (with_row("150,1e-400"), "line 7"),
    "another unit in the cell": (with_row("150,1 cm"), 'line 7, column S: "1 cm" has another unit than its column'),
    "a unit of another kind in the cell": (with_row("150,10 kg"), 'line 7, column S: "10 kg" is no number'),
    "one angle twice": (with_row("120,5"), 'line 7, column phi1: the angle "120" is also in line 6'),
    "one angle twenty times": (HEAD + "90,5\n" * 20, "the table has 1 rows below its header"),
    "angles of two turns": (HEAD + "\n".join(f"{60 * k},{k}" for k in range(12)), "phi1 go beyond one turn"),
    "angles of the second turn": (HEAD + "\n".join(f"{361 + k},{k}" for k in range(12)), "beyond one turn"),
    "a turn and a half in all": (HEAD + "\n".join(f"{-270 + 50 * k},{k}" for k in range(12)), "beyond one turn"),
    "degrees under radians": ("phi1 [rad],S [mm]\n" + "\n".join(ROWS), "beyond one turn"),
    "a column twice": ("phi1 [deg],S [mm],S [mm]\n" + "\n".join(f"{r},1" for r in ROWS), "column S 2 times"),
    "a column in two units": (
        "phi1 [deg],phi1 [rad],S [mm]\n" + "\n".join(f"{k},{k},1" for k in range(12)), "column phi1 2 times"),
    "no unit": ("phi1,S\n" + "\n".join(ROWS), "line 1, column phi1: the unit is missing"),
    "another unit": (HEAD.replace("mm", "mN") + "\n".join(ROWS), 'column S: "mN" is not a unit of this column'),
    "a date": (with_row("150,2024-05-01"), '"2024-05-01" is no number'),
    "an old workbook": (b"\xd0\xcf\x11\xe0" + bytes(600), "a workbook of Excel 97"),
    "a workbook cut short": (b"PK\x03\x04" + bytes(600), "the workbook cannot be read"),
    "unit without its bracket": ("phi1 [deg,S [mm]\n" + "\n".join(ROWS), "no column phi1"),
    "long cell": (HEAD + "0," + "1" * (csv.field_size_limit() + 1) + "\n", "not CSV"),
    "open quotation mark": (with_row('150,"10'), "not CSV"),
    "text after a quotation mark": (with_row('150,"10"5'), "not CSV"),
    "not UTF-8": (HEAD.encode() + b"0,\x81\n", "UTF-8"),
    "too large": (HEAD + "0,1\n" * 300_000, "too large"),
    "a line of its own by U+2028": (with_row("150,5\u2028160,6"), "line 7"),
    "null character": (with_row("150,5\0"), "line 7"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_can_be_mistaken_is_refused_by_name(tmp_path, name):
    text, part = REFUSED[name]
    with pytest.raises(BadInput) as refused:
        read(tmp_path, text)
    message = str(refused.value)
    assert part in message
    assert "wish.csv" in message
    assert refused.value.remedy
    assert message.isprintable()
    assert len(message) < 2000


# text of the file -> the last angle, deg, and the last travel, mm
READ = {
    "as it should be": (HEAD + "\n".join(ROWS), 330, 11),
    "byte order mark, blank lines, remarks, CR LF": (
        "\ufeff# measured\r\n" + HEAD.strip() + "\r\n\r\n" + "\r\n".join(ROWS) + "\r\n\r\n", 330, 11),
    "quoted, spaced, signed, with exponents": (
        '"phi1 [deg]", S [mm] \n' + "\n".join(f'"{30 * k}", +{k}.0e0 ' for k in range(12)), 330, 11),
    "columns beside, in another order, with words": (
        "S [mm],who,phi1 [deg]\n" + "\n".join(f"{k},me,{30 * k}" for k in range(12)), 330, 11),
    "nameless columns without anything": (
        "phi1 [deg],S [mm],,\n" + "\n".join(f"{r},," for r in ROWS), 330, 11),
    "a whole turn with its end": (HEAD + "\n".join(f"{30 * k},{k % 12}" for k in range(13)), 360, 0),
    "both sides of zero": (HEAD + "\n".join(f"{30 * k - 180},{k}" for k in range(13)), 180, 12),
    "backward": (HEAD + "\n".join(reversed(ROWS)), 330, 11),
    "a row twice": (with_row("120,4").replace("120,4\n120,4", "120,4\n120,4\n150,5"), 330, 11),
    "quoted decimal comma": (with_row('150,"1,5"'), 330, 11),
    "semicolons and decimal commas": (
        "phi1 [deg];S [mm]\n" + "\n".join(f"{30 * k},0;{k},25" for k in range(12)), 330, 11.25),
    "thousands beside a decimal sign": (
        "phi1 [deg];S [mm]\n" + "\n".join(f"{30 * k};1.00{k % 10},5" for k in range(12)), 330, 1001.5),
    "thousands parted by blanks, a true minus": (
        "phi1 [deg]\tS [mm]\n" + "\n".join(f"{30 * k}\t\u22121\u202f00{k % 10}.5" for k in range(12)), 330, -1001.5),
    "ambiguous commas between semicolons": (
        "phi1 [deg];S [mm]\n" + "\n".join(f"{30 * k};1,{100 + k}" for k in range(12)), 330, 1.111),
    "units in a row of their own": ("phi1,S\n[deg],[mm]\n" + "\n".join(ROWS), 330, 11),
    "bare units in a row of their own": ("phi1;S\ndeg;mm\n" + "\n".join(r.replace(",", ";") for r in ROWS), 330, 11),
    "round brackets, degree sign, another case": ("PHI1 (\u00b0),s (mm)\n" + "\n".join(ROWS), 330, 11),
    "Windows-1252": ("phi1 [\u00b0],S [mm],Gr\u00f6\u00dfe\n".encode("cp1252") + "\n".join(ROWS).encode(), 330, 11),
    "a title above": ("Messung 7\n\n" + HEAD + "\n".join(ROWS), 330, 11),
    "the header in a remark": ("# phi1 [deg],S [mm]\n" + "\n".join(ROWS), 330, 11),
    "angles under the name of curves": ("phi [deg],S [mm]\n" + "\n".join(ROWS), 330, 11),
    "radians, rounded": (
        "phi1 [rad],S [mm]\n" + "\n".join(f"{math.tau * k / 12:.4f},{k}" for k in range(13)), 360, 12),
}  # fmt: skip


@pytest.mark.parametrize("name", READ)
def test_what_is_plain_is_read(tmp_path, name):
    text, angle, travel = READ[name]
    angles, travels = read(tmp_path, text)
    assert math.degrees(angles[-1]) == pytest.approx(angle, abs=2e-3)
    assert travels[-1] == pytest.approx(1e-3 * travel, abs=1e-15)


def test_the_packaged_table_is_read_to_the_last_digit():
    lines = (packaged.problems()["rapier"].with_name("rapier-wish.csv")).read_text(encoding="utf-8").splitlines()[2:]
    angles, travels = match_table(lo.load("rapier"))
    pairs = [line.split(",") for line in lines]
    assert travels == tuple(float(travel) * 1e-3 for _, travel in pairs)
    assert angles == tuple(float(angle) * (math.pi / 180) for angle, _ in pairs)


@pytest.mark.parametrize(
    ("row", "part"),
    [("50,5,25", "line 7: 3 cells stand"), ("40,5", 'line 7, column angle: the angle "40" is also in line 6')],
)
def test_cam_laws_are_read_as_strictly(tmp_path, row, part):
    path = tmp_path / "law.csv"
    path.write_text("angle [deg],s [mm]\n" + "\n".join([*LAW[:5], row, *LAW[6:]]), encoding="utf-8")
    with pytest.raises(BadInput, match=part):
        lo.load("shedding").update({"mechanism.law": "table", "mechanism.law_table": str(path)})


@pytest.mark.parametrize("text", ["1", "+1.", "-.5", "1e3", "12.25E-2", "0", "0e-999", "-0.0"])
def test_plain_numbers_are_those_of_python(text):
    assert plain_number(text) == float(text)


@pytest.mark.parametrize("text", ["", " 1", "1 ", "1_0", "1,0", "\u0661", "\u00b2", "nan", "inf", "0x1", "1e", "1/2",
                                  "1e61", "1e-61", "1e-400", "1" * 200, "1\n"])  # fmt: skip
def test_anything_else_is_no_plain_number(text):
    assert plain_number(text) is None
