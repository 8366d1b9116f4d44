"""Tables of numbers in CSV files beside a scene: strict, the units in the header."""

import csv
import math
from collections.abc import Mapping
from pathlib import Path

from loomopt import packaged
from loomopt.errors import BadInput
from loomopt.scene_errors import refusal
from loomopt.scenes import Scene
from loomopt.units import DISPLAY_UNIT, QuantityError, factor

LARGEST_FILE, FEWEST_ROWS, MOST_ROWS = 1_000_000, 8, 2000
UNITS = {"angle": ("deg", "rad"), "length": ("mm", "cm", "m", "in")}
"""Units a column may have, by kind of quantity."""


def read(scene: Scene, given: str, key: str, kinds: Mapping[str, str]) -> tuple[list[tuple[float, ...]], str]:
    """Return the columns of a table, SI, and the file's path. Raises BadInput.

    given: the file as the scene names it, under `key`; kinds: column name → kind of quantity.
    """
    path = located(scene, given)
    try:
        if not path.is_file():
            problem = "the table cannot be read: there is no such file"
            raise refusal(problem, scene.origin, key, given, remedy="Correct it")
        if path.stat().st_size > LARGEST_FILE:
            raise refusal("the table is too large", str(path), allowed="up to 1 MB", remedy="Thin it out")
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except BadInput:
        raise
    except (OSError, ValueError) as error:
        raise refusal(f"the table cannot be read: {error}", str(path), remedy="Give a CSV file, UTF-8") from None
    rows = list(csv.reader(line for line in lines if line.strip() and not line.startswith("#")))
    return _columns(rows, kinds, str(path)), str(path)


def header(kinds: Mapping[str, str]) -> str:
    """Return the header a table should have."""
    return ", ".join(f"{name} [{DISPLAY_UNIT[kind]}]" for name, kind in kinds.items())


def located(scene: Scene, given: str) -> Path:
    """Return where a table lies: beside the scene's file, or among the packaged scenes."""
    origin = Path(scene.origin)
    among = packaged.problems_path()
    packed = origin.parent == Path() and not origin.is_file() and (among / origin).is_file()
    return (among if packed else origin.parent) / given


def _columns(rows: list[list[str]], kinds: Mapping[str, str], origin: str) -> list[tuple[float, ...]]:
    if not rows:
        raise refusal("the table is empty", origin, allowed=header(kinds), remedy="Give a header and rows")
    head = [cell.strip() for cell in rows[0]]
    places = [_place(head, name, kinds, origin) for name in kinds]
    if not FEWEST_ROWS <= len(rows) - 1 <= MOST_ROWS:
        found = f"the table has {len(rows) - 1} rows"
        raise refusal(found, origin, allowed=f"{FEWEST_ROWS} to {MOST_ROWS}", remedy="Give more, or fewer")
    return [
        tuple(_number(row, place, unit, line, origin) for line, row in enumerate(rows[1:], 2)) for place, unit in places
    ]


def _place(head: list[str], name: str, kinds: Mapping[str, str], origin: str) -> tuple[int, float]:
    """Return a column's place and its unit in SI."""
    for place, cell in enumerate(head):
        symbol, _, unit = cell.removesuffix("]").partition(" [")
        if symbol == name and unit in UNITS[kinds[name]]:
            try:
                return place, factor(unit)
            except QuantityError:
                continue
    problem = f"the table has no column {name} with its unit"
    raise refusal(problem, origin, value=", ".join(head), allowed=header(kinds), remedy="Name the columns so")


def _number(row: list[str], place: int, unit: float, line: int, origin: str) -> float:
    try:
        value = float(row[place])
    except (ValueError, IndexError):
        value = math.nan
    if not math.isfinite(value):
        shown = row[place] if place < len(row) else "nothing"
        raise refusal(f"row {line} of the table holds no number", origin, value=shown, remedy="Write decimal numbers")
    return value * unit
