"""Tables of numbers in CSV files that a scene names: strict, the units in the header; no message repeats a cell."""

import csv
import io
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from loomopt.base.errors import BadInput, near_file, refusal
from loomopt.base.quantities import is_beyond, plain_number
from loomopt.base.units import DISPLAY_UNIT, QuantityError, factor, fits
from loomopt.scenes.scene import Scene, reads

LARGEST_FILE, FEWEST_ROWS, MOST_ROWS = 1_000_000, 8, 2000
UNITS = {
    "angle": ("deg", "rad"),
    "length": ("mm", "cm", "m", "in"),
    "torque": ("N*m", "kN*m", "N*mm", "lbf*in", "lbf*ft"),
    "force": ("N", "kN", "lbf"),
}
"""Units a column may have, by kind of quantity."""
MARKS = {"": 0.0, "0": 0.0, "1": 1.0, "x": 1.0}
"""What a column of marks may hold."""
TURN = 2 * math.pi + 1e-4
"""Largest angle, rad: one turn, with room for 6.2832."""
_HEADING = re.compile(r"(.*\S) +\[(.+)\]")


class _Column(NamedTuple):
    """A column that is read: its name, kind of quantity and place, and its unit in SI."""

    name: str
    kind: str
    place: int
    unit: float


def read(
    scene: Scene, given: str, key: str, kinds: Mapping[str, str], marks: Sequence[str] = (), fewest: int = FEWEST_ROWS
) -> tuple[list[tuple[float, ...]], str]:
    """Return the columns of a table, SI, and the file as named. Raises BadInput.

    given: the file as the scene names it, under `key`; kinds: column name → kind of quantity; marks: columns without a
    unit that may be there, 1 (or x) in the rows that are meant, 0 in all without one; fewest: rows there must be.
    """
    rows = _named(scene, given, key, header(kinds))
    return [*_columns(rows, kinds, given, fewest), *(_marked(rows, name, given) for name in marks)], given


def columns(scene: Scene, given: str, key: str, allowed: str) -> tuple[str, ...]:
    """Return the names of a table's columns that have a unit; allowed: the header it should have. Raises BadInput.

    given: the file as the scene names it, under `key`.
    """
    rows = _named(scene, given, key, allowed)
    found = [_HEADING.fullmatch(cell.strip()) for cell in rows[0]] if rows else []
    return tuple(heading[1] for heading in found if heading)


def _named(scene: Scene, given: str, key: str, allowed: str) -> list[list[str]]:
    """Return the cells of a file that a scene names, or that came with it, row by row. Raises BadInput."""
    held = scene.paths.text(key)
    reads(scene, given)

    def raw() -> bytes:
        if held is not None:
            return held.encode()
        return _bytes(scene.paths.located(given, key, scene.origin), given, scene.origin, key)

    return _rows(raw, given, allowed)


def measured(path: Path, kinds: Mapping[str, str]) -> dict[str, tuple[float, ...]]:
    """Return those columns of a caller's table that have a name of `kinds`, SI, its first one always. Raises BadInput.

    kinds: column name → kind of quantity, angles first.
    """
    given, (angle, *names) = str(path), kinds
    allowed = f"{angle} [{DISPLAY_UNIT[kinds[angle]]}] and a column of the curves"
    rows = _rows(lambda: _bytes(path, given, "", "beside"), given, allowed)
    headings = [_HEADING.fullmatch(cell.strip()) for cell in rows[0]] if rows else []
    there = [name for name in names if any(each and each[1] == name for each in headings)]
    if rows and not there:
        allowed = ", ".join(f"{name} [{DISPLAY_UNIT[kinds[name]]}]" for name in names)
        remedy = "Name its columns as the curves are named"
        raise refusal("the table has no column of the curves", given, allowed=allowed, remedy=remedy)
    asked = {name: kinds[name] for name in (angle, *there)}
    return dict(zip(asked, _columns(rows, asked, given, 1), strict=True))


def _rows(read: Callable[[], bytes], given: str, allowed: str) -> list[list[str]]:
    """Return the cells of a CSV file, row by row. Raises BadInput."""
    try:
        raw = read()
        if len(raw) > LARGEST_FILE:
            raise refusal("the table is too large", given, allowed="up to 1 MB", remedy="Thin it out")
        lines = io.StringIO(raw.decode("utf-8-sig"), newline=None)
        return list(csv.reader((line for line in lines if line.strip() and not line.startswith("#")), strict=True))
    except BadInput:
        raise
    except OSError as error:
        problem = f"the table cannot be read: {error.strerror or 'it is no file'}"
        raise refusal(problem, given, remedy="Check the path and its permissions") from None
    except UnicodeDecodeError as error:
        raise refusal(f"it is not UTF-8 text (byte {error.start})", given, remedy="Save the file as UTF-8") from None
    except (csv.Error, ValueError):
        remedy = "Write short cells, and close every quotation mark on its own line"
        raise refusal("the table is not CSV", given, allowed=allowed, remedy=remedy) from None


def _bytes(path: Path, given: str, origin: str, key: str) -> bytes:
    """Return what stands in a file, a byte more than may at most. Raises BadInput where there is none, and OSError."""
    if not path.is_file():
        problem = "the table cannot be read: there is no such file"
        near = near_file(path)
        remedy = f'Perhaps "{Path(given).with_name(Path(near).name)}" is meant' if near else "Correct it"
        raise refusal(problem, origin, key, given, remedy=remedy)
    with path.open("rb") as file:
        return file.read(LARGEST_FILE + 1)


def header(kinds: Mapping[str, str]) -> str:
    """Return the header a table should have."""
    return ", ".join(f"{name} [{DISPLAY_UNIT[kind]}]" for name, kind in kinds.items())


def _columns(
    rows: Sequence[Sequence[str]], kinds: Mapping[str, str], origin: str, fewest: int
) -> list[tuple[float, ...]]:
    if not rows:
        raise refusal("the table is empty", origin, allowed=header(kinds), remedy="Give a header and rows")
    columns = list(_found(rows[0], kinds, origin))
    if not fewest <= len(rows) - 1 <= MOST_ROWS:
        found = f"the table has {len(rows) - 1} rows"
        raise refusal(found, origin, allowed=f"{fewest} to {MOST_ROWS}", remedy="Give more, or fewer")
    for line, row in enumerate(rows[1:], 2):
        _check_length(row, rows[0], line, origin)
    values = [tuple(_number(row, column, line, origin) for line, row in enumerate(rows[1:], 2)) for column in columns]
    for column, numbers in zip(columns, values, strict=True):
        if column.kind == "angle" and column.name == next(iter(kinds)):
            _check_angles(column.name, numbers, origin)
    return values


def _found(head: Sequence[str], kinds: Mapping[str, str], origin: str) -> Iterator[_Column]:
    """Yield the columns that a header names. Raises BadInput for one that is not there once, with its unit."""
    headings = [_HEADING.fullmatch(cell.strip()) for cell in head]
    for name, kind in kinds.items():
        named = [(place, each[2]) for place, each in enumerate(headings) if each and each[1] == name]
        if len(named) > 1:
            raise refusal(f"the table has column {name} {len(named)} times", origin, remedy="Take out all but one")
        if not named or not _is_unit(named[0][1], kind):
            units = " or ".join(UNITS.get(kind, (DISPLAY_UNIT[kind],)))
            problem = f"the table has no column {name} with its unit ({units})"
            raise refusal(problem, origin, allowed=header(kinds), remedy="Name the columns so, parted by commas")
        yield _Column(name, kind, named[0][0], factor(named[0][1]))


def _is_unit(text: str, kind: str) -> bool:
    """Say whether a column of a kind may have a unit."""
    if kind in UNITS:
        return text in UNITS[kind]
    try:
        return text == DISPLAY_UNIT[kind] or fits(text, kind)
    except QuantityError:
        return False


def _marked(rows: Sequence[Sequence[str]], name: str, origin: str) -> tuple[float, ...]:
    """Return which rows a column marks; none where there is no such column. Raises BadInput."""
    places = [place for place, cell in enumerate(rows[0]) if cell.strip() == name]
    if not places:
        return (0.0,) * (len(rows) - 1)
    cells = [row[places[0]].strip().lower() for row in rows[1:]]
    for line, cell in enumerate(cells, 2):
        if cell not in MARKS:
            problem = f"row {line} of the table holds no mark under {name}"
            raise refusal(problem, origin, allowed="1 or x for a mark, 0 or nothing for none", remedy="Correct it")
    return tuple(MARKS[cell] for cell in cells)


def _check_length(row: Sequence[str], head: Sequence[str], line: int, origin: str) -> None:
    """Raise BadInput for a row that does not stand under its header: a decimal comma parts one number into two."""
    nameless = (cell for cell, name in zip(row, head, strict=False) if not name.strip())
    if len(row) != len(head) or any(cell.strip() for cell in nameless):
        cells = sum(1 for cell in row if cell.strip())
        problem = f"row {line} of the table has {cells} numbers or words under {sum(map(bool, head))} columns"
        remedy = "Write one number in each column, with a decimal point, not a comma"
        raise refusal(problem, origin, remedy=remedy)


def _number(row: Sequence[str], column: _Column, line: int, origin: str) -> float:
    text = row[column.place].strip(" \t")
    value = plain_number(text)
    if is_beyond(text):
        problem = f"row {line} of the table holds a number under {column.name} that is too large or too small"
        raise refusal(
            problem, origin, value=text, allowed="0, and sizes of 1e-60 to 1e60", remedy="Write 0 for next to nothing"
        )
    if value is None:
        problem = f"row {line} of the table holds no number under {column.name}"
        remedy = "Write digits and a decimal point, such as 12.5 or 1.25e1"
        raise refusal(problem, origin, remedy=remedy)
    return value * column.unit


def _check_angles(name: str, angles: Sequence[float], origin: str) -> None:
    """Raise BadInput for an angle that comes twice, and for angles that are not of one turn."""
    if max(map(abs, angles)) > TURN or max(angles) - min(angles) > TURN:
        allowed = "-360 to 360 deg, one turn in all"
        problem = f"the table's angles {name} go beyond one turn"
        raise refusal(problem, origin, allowed=allowed, remedy="Check their unit, or take off whole turns")
    seen: set[float] = set()
    for line, angle in enumerate(angles, 2):
        if angle in seen:
            problem = f"row {line} of the table repeats an angle {name}"
            raise refusal(problem, origin, remedy="Keep one row for each angle")
        seen.add(angle)
