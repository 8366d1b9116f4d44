"""A study as a table: a row per point, units in the column names, provenance once for all."""

import itertools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from loomopt.base import arguments
from loomopt.base.errors import refusal
from loomopt.base.quantities import read
from loomopt.base.units import SI_UNIT, QuantityError, factor
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.scenes.provenance import provenance
from loomopt.solving.answer.solution import Words, grouped
from loomopt.studies.run.rows import Multiplier, Row, SceneStudy

if TYPE_CHECKING:
    import pandas as pd


class Column(NamedTuple):
    """A column of numbers: its name, its unit, and its values, SI, None where a row has none; size: of the unit, SI."""

    name: str
    unit: str
    size: float
    values: tuple[float | None, ...]

    @property
    def heading(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit}]"

    @property
    def shown(self) -> list[float | None]:
        """The values in the unit."""
        return [None if value is None else value / self.size for value in self.values]


class ColumnUnits:
    """The units of a study's columns, those of its scene or SI."""

    def __init__(self, study: SceneStudy, si: bool) -> None:
        self.study, self.si, self.words = study, si, Words(study.scene)

    def of(self, name: str) -> str:
        """Return the unit of a key that varies, a design variable or a figure."""
        kind = _kind(self.study, name)
        return SI_UNIT[kind] if self.si else self.study.scene.shown_in(kind)

    def price(self, multiplier: Multiplier) -> tuple[str, float]:
        """Return the unit of a multiplier, and its size in SI."""
        over, under = self.of(multiplier.figure), self.of(multiplier.side.limit)
        return (over if under == "1" else f"{over}/{grouped(under)}"), factor(over) / factor(under)


def columns(study: SceneStudy, rows: Sequence[Row], si: bool = False) -> dict[str, list[Column]]:
    """Return the numbers of rows as columns: "place", "sought", "design", "figures", "multipliers"; none that is empty.

    In the units of the scene, where what is only rounding beside the largest of its unit is 0; si: in SI, as they are.
    """
    numbers_of: dict[str, Sequence[Mapping[str, float | None]]] = {
        "place": [study.place(row) for row in rows],
        "sought": [study.sought(row) for row in rows],
        "design": [row.design for row in rows],
        "figures": [row.figures for row in rows],
    }
    units, found = ColumnUnits(study, si), dict[str, list[Column]]()
    for part, numbers in numbers_of.items():
        taken = {column.name for columns in found.values() for column in columns}
        taken |= {"change"} if part == "figures" else set()
        names = dict.fromkeys(name for each in numbers for name in each if name not in taken)
        found[part] = _filled(
            Column(name, units.of(name), factor(units.of(name)), tuple(each.get(name) for each in numbers))
            for name in names
        )
    multipliers = dict.fromkeys(multiplier for row in rows for multiplier in row.multipliers)
    found["multipliers"] = _filled(
        Column(each.text, *units.price(each), tuple(row.multipliers.get(each) for row in rows)) for each in multipliers
    )
    return found if si else _without_rounding(found)


PRINTED = 1e-5
"""Share of a column's largest number by which a place may differ from its row's: tables print six digits."""
NAMED = re.compile(r"(?P<key>[^\s=]+)\s*=\s*(?P<value>.+)|(?P<name>[A-Za-z_]\S*)\s+(?P<rest>.+)|(?P<bare>.+)")


def labelled_point(
    study: SceneStudy, rows: Sequence[Row], solved: Sequence[Row], label: int | str | Mapping[str, str | float]
) -> int:
    """Return the number of the point that a label names. Raises BadInput for none, and for more than one.

    rows: those that the table shows, of which a place is one; solved: all, of which a number is one.
    label: the number, also as the table prints it ("3", "3*"); the place, as "715 N*m", or of several columns
    "operation.M0 = 715 N*m, peak_torque = 86 N*m"; or a mapping, column → text with its unit or a number in SI.
    """
    numbers = [row.point for row in solved]
    allowed = f"{', '.join(map(str, numbers[:20]))}, or a place such as {_place_example(study, rows)}"
    remedy = "Choose one of them"
    if not isinstance(label, str | Mapping):
        found = [k for k in numbers if k == arguments.whole(label, "point", allowed, remedy)]
    elif isinstance(label, str) and (mark := label.strip().removeprefix("point ").rstrip("*")) in map(str, numbers):
        found = [int(mark)]
    else:
        places = _named_places(study, rows, label, allowed)
        found = [row.point for k, row in enumerate(rows) if all(_is_there(c, k, value) for c, value in places)]
    if len(found) != 1:
        problem = f"it names the points {', '.join(map(str, found[:20]))}" if found else "the study has no such point"
        remedy = "Name more columns, or the number" if found else remedy
        raise refusal(problem, "", "point", label, allowed, remedy)
    return found[0]


def _named_places(
    study: SceneStudy, rows: Sequence[Row], label: str | Mapping[str, str | float], allowed: str
) -> list[tuple[Column, float]]:
    """Return the columns that a label names, each with the value that it gives, SI. Raises BadInput."""
    made, remedy = columns(study, rows), "Write the number of the row, or its place with its unit"
    known = {column.name: column for part in made.values() for column in part}
    first = next(iter(made["place"]), None)
    named = list[tuple[str, str | float]]()
    for name, value in arguments.table(label, "point", allowed, remedy).items() if isinstance(label, Mapping) else ():
        named.append((name, value if isinstance(value, str) else arguments.number(value, "point", allowed, remedy)))
    for text in label.split(",") if isinstance(label, str) else ():
        match = NAMED.fullmatch(text.strip())
        if match is None or first is None:
            raise refusal("it is no label of a row", "", "point", label, allowed, remedy)
        named.append((match["key"] or match["name"] or first.name, match["value"] or match["rest"] or match["bare"]))
    found = []
    for name, given in named:
        if name not in known:
            raise refusal(f"the table has no column {name}", "", "point", label, ", ".join(known), remedy)
        column = known[name]
        try:
            value = given if isinstance(given, int | float) else read(given, _kind(study, name))
        except QuantityError as error:
            if not _is_number(given):
                raise refusal(error.problem, "", "point", label, error.allowed, remedy) from None
            value = float(given) * column.size
        found.append((column, float(value)))
    return found


def _is_there(column: Column, at: int, value: float) -> bool:
    own, largest = column.values[at], max((abs(each) for each in column.values if each is not None), default=0.0)
    return own is not None and abs(own - value) <= PRINTED * largest


def _is_number(text: object) -> bool:
    try:
        return math.isfinite(float(str(text)))
    except ValueError:
        return False


def _kind(study: SceneStudy, name: str) -> str:
    return study.kinds.get(name) or Words(study.scene).kind(name)


def _place_example(study: SceneStudy, rows: Sequence[Row]) -> str:
    """Return how a row's place is written, by its first number."""
    column = next(iter(columns(study, rows)["place"]), None)
    value = next((each for each in column.shown if each is not None), None) if column else None
    if column is None or value is None:
        return '"3"'
    return f'"{value:.6g}{"" if column.unit == "1" else f" {column.unit}"}"'


def _filled(columns: Iterable[Column]) -> list[Column]:
    return [column for column in columns if any(value is not None for value in column.values)]


def _without_rounding(found: dict[str, list[Column]]) -> dict[str, list[Column]]:
    sizes: dict[str, float] = {}
    for column in itertools.chain(*found.values()):
        sizes[column.unit] = max(sizes.get(column.unit, 0.0), *(abs(value or 0.0) for value in column.values))
    return {part: [_cleaned(column, sizes[column.unit]) for column in each] for part, each in found.items()}


def _cleaned(column: Column, largest: float) -> Column:
    tiny = SHOWN_AS_ZERO * largest
    return column._replace(values=tuple(v if v is None or abs(v) > tiny else 0.0 for v in column.values))


def frame(study: SceneStudy, rows: Sequence[Row], si: bool = False) -> "pd.DataFrame":
    """Return one line per row; si: in SI, so that studies of machines in different units can be compared."""
    import pandas as pd

    from loomopt.interface.table_frame import TableFrame

    made = columns(study, rows, si)
    cells: dict[str, object] = {c.heading: _floats(c) for c in (*made["place"], *made["sought"])}
    cells |= {"status": [row.outcome for row in rows], "certified": [row.certified for row in rows]}
    for part in ("design", "figures", "multipliers"):
        cells |= {column.heading: _floats(column) for column in made[part]}
    for name in dict.fromkeys(name for row in rows for name in row.reached):
        cells[f"{name} reached"] = pd.array([row.reached.get(name) for row in rows], dtype="boolean")
    if any(row.narrows for row in rows):
        cells["narrows"] = [row.narrows for row in rows]
    cells["parent"] = pd.array([row.parent for row in rows], dtype="Int64")
    cells |= {"time [s]": [row.seconds for row in rows], "reason": [row.reason for row in rows]}
    found = TableFrame(cells, index=pd.Index([row.point for row in rows], name="point"))
    found.attrs.update(study_provenance(study))
    return found


def _floats(column: Column) -> list[float]:
    return [math.nan if value is None else value for value in column.shown]


def study_provenance(study: SceneStudy) -> dict[str, str]:
    """Return where the rows of a study come from, once for all."""
    return provenance(study.scene, study=study.name, target=study.target or "none", **study.conditions)


def units(study: SceneStudy, rows: Sequence[Row]) -> dict[str, str]:
    """Return the SI unit of everything that rows name."""
    return {column.name: column.unit for part in columns(study, rows, si=True).values() for column in part}
