"""A study as a table: a row per point, units in the column names, provenance once for all."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from loomopt.provenance import provenance
from loomopt.quantities import SI_UNIT, factor
from loomopt.scenes import Scene
from loomopt.solving.words import SIDES, Words, grouped
from loomopt.studies.rows import Row
from loomopt.studies.sweep import Sweep, priced
from loomopt.tolerances import SHOWN_AS_ZERO

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


class Units:
    """The units of a study's columns, those of its scene or SI."""

    def __init__(self, study: Sweep, si: bool) -> None:
        self.study, self.si, self.words = study, si, Words(study.scene)
        self.limits = _limits(study.scene)

    def of(self, name: str) -> str:
        """Return the unit of a key that is swept, a design variable or a figure."""
        kind = self.study.kinds.get(name) or self.words.kind(name)
        return SI_UNIT[kind] if self.si else self.study.scene.shown_in(kind)

    def price(self, name: str) -> tuple[str, float]:
        """Return the unit of a multiplier, and its size in SI."""
        figure, limit, _ = self.limits[name]
        over, under = self.of(figure), self.of(limit)
        return (over if under == "1" else f"{over}/{grouped(under)}"), factor(over) / factor(under)


def _limits(scene: Scene) -> dict[str, tuple[str, str, str]]:
    """Return every multiplier's name → the figure that it tells of, the limit and its side."""
    schema = scene.schema
    names = [*schema.variables, *schema.figures, *schema.margins, *scene.bounds, *scene.limits]
    names += [*schema.operation.model_fields, *schema.mechanism.model_fields]
    figures = [*schema.figures, *schema.variables]
    return {priced(*each): each for each in itertools.product(figures, names, SIDES.values())}


def columns(study: Sweep, rows: Sequence[Row], si: bool = False) -> dict[str, list[Column]]:
    """Return the numbers of rows as columns: "place", "design", "figures", "multipliers"; none that is empty.

    In the units of the scene, where what is only rounding beside the largest of its unit is 0; si: in SI, as they are.
    """
    units, found = Units(study, si), dict[str, list[Column]]()
    for part in ("place", "design", "figures", "multipliers"):
        names = dict.fromkeys(name for row in rows for name in getattr(row, part))
        skipped = {"change"} if part == "figures" else set()
        made = (_column(units, part, name, rows) for name in names if name not in skipped)
        found[part] = [column for column in made if any(value is not None for value in column.values)]
    return found if si else _without_rounding(found)


def _column(units: Units, part: str, name: str, rows: Sequence[Row]) -> Column:
    values = tuple(getattr(row, part).get(name) for row in rows)
    if part == "multipliers":
        return Column(name, *units.price(name), values)
    return Column(name, units.of(name), factor(units.of(name)), values)


def _without_rounding(found: dict[str, list[Column]]) -> dict[str, list[Column]]:
    sizes: dict[str, float] = {}
    for column in itertools.chain(*found.values()):
        sizes[column.unit] = max(sizes.get(column.unit, 0.0), *(abs(value or 0.0) for value in column.values))
    return {part: [_cleaned(column, sizes[column.unit]) for column in each] for part, each in found.items()}


def _cleaned(column: Column, largest: float) -> Column:
    tiny = SHOWN_AS_ZERO * largest
    return column._replace(values=tuple(v if v is None or abs(v) > tiny else 0.0 for v in column.values))


def frame(study: Sweep, rows: Sequence[Row], si: bool = False) -> "pd.DataFrame":
    """Return one line per row; si: in SI, so that studies of machines in different units can be compared."""
    import pandas as pd

    from loomopt.table_frame import TableFrame

    parts = columns(study, rows, si)
    cells: dict[str, object] = {column.heading: _floats(column) for column in parts["place"]}
    cells |= {"status": [row.status for row in rows], "certified": [row.certified for row in rows]}
    for part in ("design", "figures", "multipliers"):
        cells |= {column.heading: _floats(column) for column in parts[part]}
    for name in dict.fromkeys(name for row in rows for name in row.reached):
        cells[f"{name} reached"] = pd.array([row.reached.get(name) for row in rows], dtype="boolean")
    cells["parent"] = pd.array([row.parent for row in rows], dtype="Int64")
    cells |= {"time [s]": [row.seconds for row in rows], "reason": [row.reason for row in rows]}
    found = TableFrame(cells, index=pd.Index([row.point for row in rows], name="point"))
    found.attrs.update(told(study))
    return found


def _floats(column: Column) -> list[float]:
    return [math.nan if value is None else value for value in column.shown]


def told(study: Sweep) -> dict[str, str]:
    """Return where the rows of a study come from, once for all."""
    return provenance(study.scene, study=study.name, target=study.target, **study.asked)


def units(study: Sweep, rows: Sequence[Row]) -> dict[str, str]:
    """Return the SI unit of everything that rows name."""
    return {column.name: column.unit for part in columns(study, rows, si=True).values() for column in part}


class Change(NamedTuple):
    """Between which two values of the one number that is swept, SI, other limits bind: those that come or go."""

    at: tuple[float, float]
    kind: str
    limits: tuple[str, ...]


def changes(study: Sweep, rows: Sequence[Row]) -> Iterator[Change]:
    """Yield where the active set changes along a sweep over one number; nothing of a sweep over several."""
    known = _limits(study.scene)
    for (one, row), (other, after) in itertools.pairwise(_line(study, rows)):
        before, now = ({known[name][1:] for name in each.multipliers} for each in (row, after))
        if row.certified and after.certified and before != now:
            yield Change((one, other), "active set", tuple(sorted({limit for limit, _ in before ^ now})))


def gaps(study: Sweep, rows: Sequence[Row]) -> list[tuple[float, float]]:
    """Return the stretches of a sweep over one number, SI, where no admissible design exists."""
    found: list[tuple[float, float]] = []
    last = False
    for value, row in _line(study, rows):
        empty = row.status == "infeasible"
        if empty:
            found = [*found[:-1], (found[-1][0], value)] if last else [*found, (value, value)]
        last = empty
    return found


def _line(study: Sweep, rows: Sequence[Row]) -> list[tuple[float, Row]]:
    """Return rows along the one number that is swept, by its value; nothing of a sweep over several."""
    if len(study.kinds) != 1:
        return []
    key = next(iter(study.kinds))
    return sorted(((row.place[key], row) for row in rows), key=lambda pair: (pair[0], pair[1].point))
