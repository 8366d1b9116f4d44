"""Table of an answer: a row for each number of the design and each figure, and a sheet of its limits."""

import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from loomopt.base.units import factor
from loomopt.model.program import Alias
from loomopt.picture.table import Column, TextTable, text_table, unbroken, words
from loomopt.scenes.provenance import provenance
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Evaluated, Finding, Solution, UnitFormatter

if TYPE_CHECKING:
    from loomopt.interface.rounding import Rounding
    from loomopt.interface.table_frame import TableFrame

REACHED = {None: "", True: "yes", False: "no"}


class AnswerRow(NamedTuple):
    """Number of a design or figure, in a unit of the scene; ok: whether its limit is satisfied.

    today, low, high: today's value and the ends of the limit, or None; binds: side (min or max) on which the limit of a
    solved design binds; reached: yes or no for a goal of the target, else "".
    """

    name: str
    unit: str
    today: float | None
    value: float
    low: float | None
    high: float | None
    ok: bool
    binds: str = ""
    reached: str = ""


def frame(evaluated: Evaluated, scene: Scene) -> "TableFrame":
    """Table of an answer in the units of the scene.

    The column of the nearest design is "relaxed" where none is admissible. Of an evaluated design, today's machine and
    the limits that bind are not among the columns.
    """
    from loomopt.interface import table_frame

    more, heading = dict[str, object](), "design"
    if isinstance(evaluated, Solution):
        more = {"target": evaluated.task_name, "accuracy": evaluated.solver["accuracy"]}
        heading = "relaxed" if evaluated.relaxation else "design"
    made = columns(evaluated, rows(evaluated, scene), scene, heading, None)
    return table_frame.frame(made, provenance(scene, **more), "name")


def limits_frame(evaluated: Evaluated, scene: Scene) -> "TableFrame":
    """Table of the limits of a design, in the units of the scene: values, ends, and whether each is satisfied."""
    from loomopt.interface import table_frame

    limits = [_limit_row(limit, UnitFormatter(scene)) for limit in evaluated.limits]
    made = (
        Column("name", [row.name for row in limits]),
        Column("unit", [row.unit for row in limits]),
        Column("value", [row.value for row in limits]),
        Column("min", [row.low for row in limits]),
        Column("max", [row.high for row in limits]),
        Column("held", [row.ok for row in limits]),
    )
    return table_frame.frame(made, {})


def text(evaluated: Evaluated, scene: Scene, before: Evaluated | None, heading: str) -> TextTable:
    """Table of an answer for people: the figures of members are left out, limits of other quantities follow.

    before: today's machine, None where it is not shown; heading: that of the design's numbers.
    """
    table = [
        row for row in rows(evaluated, scene, before) if not (evaluated.members and _of_member(row.name, evaluated))
    ]
    names, rounding = {row.name for row in table}, _rounding(table)
    for limit in evaluated.limits:
        # Margins of the mechanism itself, which no scene sets, are shown only where they are violated.
        if limit.name not in names and (not limit.ok or limit.name not in scene.schema.margins):
            row = _limit_row(limit, UnitFormatter(scene))
            table.append(row._replace(value=rounding.shown(row.unit, row.value)))
    made = columns(evaluated, table, scene, heading, before)
    count = sum(column.head is not None for column in made)
    begin = 2 if before else 1
    return text_table(made, first=(0, *range(begin, count)))


def columns(
    evaluated: Evaluated, table: Sequence[AnswerRow], scene: Scene, heading: str, before: Evaluated | None
) -> tuple[Column, ...]:
    """Columns of rows for files and for people; heading: that of the design; before: today's machine for people."""
    solved, units = isinstance(evaluated, Solution), [row.unit for row in table]
    binds, reached = [row.binds for row in table], [row.reached for row in table]
    limits = {limit.name: limit for limit in evaluated.limits}
    texts = [_limit_text(row, limits.get(row.name), scene) for row in table]
    today = ["" if row.today is None else f"{row.today:.6g}" for row in table]
    return (
        words("name", [row.name for row in table], ""),
        Column("unit", units),
        Column("today" if solved else "", [row.today for row in table], "today" if before else None, today),
        Column(heading, [row.value for row in table], heading, [f"{row.value:.6g}" for row in table]),
        Column("", (), "unit", ["" if unit == "1" else unit for unit in units], right=False),
        Column("min", [row.low for row in table]),
        Column("max", [row.high for row in table]),
        Column("ok", [row.ok for row in table]),
        Column("", (), "limits", texts, right=False),
        Column("binds" if solved else "", binds, "binds" if any(binds) else None, binds, right=False),
        Column("reached" if evaluated.reached else "", reached, "reached" if any(reached) else None, reached, False),
    )


def rows(evaluated: Evaluated, scene: Scene, before: Evaluated | None = None) -> list[AnswerRow]:
    """Rows of design and figures, with rounding errors as 0; before: today's machine, that of the answer by default.

    A figure that the scene cannot have is left out.
    """
    formatter = UnitFormatter(scene)
    before = before or (evaluated.today if isinstance(evaluated, Solution) else None)
    old = {**before.design, **before.figures} if before else {}
    limits = {limit.name: limit for limit in evaluated.limits}
    prices = evaluated.binding if isinstance(evaluated, Solution) else ()
    binding = {price.limit: price.side for price in prices}
    table = []
    for name, value in {**evaluated.design, **evaluated.figures}.items():
        if value is None or getattr(name, "of", name) == "change" or name in scene.schema.lists:
            continue
        unit = formatter.unit(name)
        size, limit = factor(unit), limits.get(name)
        numbers = [old.get(name), *((limit.min, limit.max) if limit else (None, None))]
        today, low, high = (None if number is None else _as_written(number, size) for number in numbers)
        marks = binding.get(name, ""), REACHED[evaluated.reached.get(name)]
        ok = limit.ok if limit else True
        table.append(AnswerRow(name, unit, today, _as_written(value, size), low, high, ok, *marks))
        table += _per_second(table[-1], formatter.kind(name), scene, evaluated.design.get("speed"))
    return list(_without_rounding(table))


def _as_written(value: float, size: float) -> float:
    """An SI value in units of a size: with 15 digits where these are the same value, as 23.4 is for 23.4 deg."""
    exact = value / size
    short = float(f"{exact:.15g}")
    return short if math.isclose(short * size, value, rel_tol=sys.float_info.epsilon) else exact


PER_SECOND: Mapping[str, tuple[str, int]] = {
    "travel velocity": ("velocity", 1),
    "travel acceleration": ("acceleration", 2),
    "travel jerk": ("jerk", 3),
}
"""Kind of a motion per radian of the crank → its kind in time, and the power of the speed between them."""


def _per_second(row: AnswerRow, kind: str, scene: Scene, speed: float | None) -> Iterator[AnswerRow]:
    """Yield the row in time of a motion per crank angle, where the speed is known; speed: the design's."""
    known = scene.operation.get("speed")
    if kind not in PER_SECOND or known is None:
        return
    real, power = PER_SECOND[kind]
    unit = scene.shown_in(real)
    size = factor(row.unit) / factor(unit)
    today = None if row.today is None else row.today * size * known**power
    value = row.value * size * (known if speed is None else speed) ** power
    yield AnswerRow(f"{row.name}_t", unit, today, value, None, None, True, reached=row.reached)


def _rounding(table: Sequence[AnswerRow]) -> "Rounding":
    from loomopt.interface.rounding import Rounding

    return Rounding((row.unit, number) for row in table for number in (row.value, row.today))


def _without_rounding(table: Sequence[AnswerRow]) -> Iterator[AnswerRow]:
    rounding = _rounding(table)
    for row in table:
        yield row._replace(today=rounding.shown(row.unit, row.today), value=rounding.shown(row.unit, row.value))


def _limit_row(limit: Finding, formatter: UnitFormatter) -> AnswerRow:
    unit = formatter.unit(limit.name)
    low, high = (None if end is None else end / factor(unit) for end in (limit.min, limit.max))
    return AnswerRow(limit.name, unit, None, limit.value / factor(unit), low, high, limit.ok)


def _of_member(name: str, evaluated: Evaluated) -> bool:
    """Whether a name is that of one member's figure, which the table of members shows."""
    aliases = [figure for figure in evaluated.figures if isinstance(figure, Alias)]
    return name in aliases or name.removesuffix("_t") in aliases


def _limit_text(row: AnswerRow, limit: Finding | None, scene: Scene) -> str:
    """Limits of a row as text, with how they are missed, and the margin that a back-off keeps."""
    missed = "" if row.ok else "  <- exceeded by rounding" if limit and limit.rounding else "  <- not held"
    shown = unbroken(_range_text(row.low, row.high) + missed)
    apart = limit.backed_off if limit else 0.0
    return f"{shown}, {UnitFormatter(scene).shown(row.name, apart, 4)} apart" if apart else shown


def _range_text(low: float | None, high: float | None) -> str:
    if low is not None and low == high:
        return f"= {low:.6g}"
    if low is not None and high is not None:
        return f"{low:.6g} ... {high:.6g}"
    return f">= {low:.6g}" if low is not None else f"<= {high:.6g}" if high is not None else ""
