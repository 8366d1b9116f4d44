"""The table a head's travel should match: read from a CSV file beside the scene."""

import csv
import math
from pathlib import Path
from typing import Any

from loomopt import packaged
from loomopt.errors import BadInput
from loomopt.scene_errors import refusal
from loomopt.units import QuantityError, factor

LARGEST_FILE, MOST_ROWS = 1_000_000, 2000
COLUMNS = "phi1 [deg], S [mm]"


def read(scene: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return crank angles, rad, and head travels, m, of `targets.match.table`. Raises BadInput."""
    given = scene.targets["match"].table
    key = "targets.match.table"
    if given is None:
        remedy = f'Write table = "s.csv" in [targets.match]; the file has the columns {COLUMNS}'
        raise refusal("target match needs a table of head travel", scene.origin, key, remedy=remedy)
    path = located(scene, given)
    try:
        if not path.is_file():
            raise refusal(
                "the table cannot be read: there is no such file", scene.origin, key, given, remedy="Correct it"
            )
        if path.stat().st_size > LARGEST_FILE:
            raise refusal("the table is too large", str(path), allowed="up to 1 MB", remedy="Thin it out")
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except BadInput:
        raise
    except (OSError, ValueError) as error:
        raise refusal(f"the table cannot be read: {error}", str(path), remedy="Give a CSV file, UTF-8") from None
    rows = list(csv.reader(line for line in lines if line.strip() and not line.startswith("#")))
    return _columns(rows, str(path))


def located(scene: Any, given: str) -> Path:
    """Return where a table lies: beside the scene's file, or among the packaged scenes."""
    origin = Path(scene.origin)
    among = packaged.problems_path()
    return (
        among if origin.parent == Path() and not origin.is_file() and (among / origin).is_file() else origin.parent
    ) / given


def _columns(rows: list[list[str]], origin: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    if not rows:
        raise refusal("the table is empty", origin, allowed=COLUMNS, remedy="Give a header and rows")
    head = [cell.strip() for cell in rows[0]]
    angle, travel = (_place(head, name, kind, origin) for name, kind in (("phi1", "angle"), ("S", "length")))
    if not 8 <= len(rows) - 1 <= MOST_ROWS:
        found = f"the table has {len(rows) - 1} rows"
        raise refusal(found, origin, allowed=f"8 to {MOST_ROWS}", remedy="Give more, or fewer")
    numbers = [
        [_number(row, place, unit, line, origin) for place, unit in (angle, travel)]
        for line, row in enumerate(rows[1:], 2)
    ]
    return tuple(row[0] for row in numbers), tuple(row[1] for row in numbers)


def _place(head: list[str], name: str, kind: str, origin: str) -> tuple[int, float]:
    """Return a column's place and its unit in SI."""
    for place, cell in enumerate(head):
        symbol, _, unit = cell.removesuffix("]").partition(" [")
        if symbol == name and unit in {"angle": ("deg", "rad"), "length": ("mm", "cm", "m", "in")}[kind]:
            try:
                return place, factor(unit)
            except QuantityError:
                continue
    raise refusal(
        f"the table has no column {name} with its unit",
        origin,
        value=", ".join(head),
        allowed=COLUMNS,
        remedy="Name the columns so",
    )


def _number(row: list[str], place: int, unit: float, line: int, origin: str) -> float:
    try:
        value = float(row[place])
    except (ValueError, IndexError):
        value = math.nan
    if not math.isfinite(value):
        shown = row[place] if place < len(row) else "nothing"
        raise refusal(f"row {line} of the table holds no number", origin, value=shown, remedy="Write decimal numbers")
    return value * unit
