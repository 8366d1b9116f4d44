"""A study as a table: a row per point, units in the column names, provenance once for all."""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from loomopt.base.units import SI_UNIT, factor
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
        kind = self.study.kinds.get(name) or self.words.kind(name)
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
