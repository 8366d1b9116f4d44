"""Fronts and sweeps: their tables, a row per point, and their charts, over the number that varies."""

import itertools
import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from loomopt.base import arguments
from loomopt.base.errors import refusal
from loomopt.base.quantities import read
from loomopt.base.units import SI_UNIT, QuantityError, factor, show
from loomopt.interface.rounding import Rounding
from loomopt.picture.chart import COLOURS, Axis, Chart, Charts, Series, fit_axis
from loomopt.picture.shapes import Floats
from loomopt.picture.table import TextTable, unbroken
from loomopt.scenes.provenance import provenance
from loomopt.solving.answer.solution import UnitFormatter, grouped
from loomopt.studies.run.rows import Change, Findings, Multiplier, Row, SceneStudy, counted

if TYPE_CHECKING:
    import pandas as pd


class NumberColumn(NamedTuple):
    """Column of numbers: name, unit, and values, SI, None where a row has no value; size: of the unit, SI."""

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
        self.study, self.si, self.words = study, si, UnitFormatter(study.scene)

    def of(self, name: str) -> str:
        """Unit of a key that varies, a design variable or a figure."""
        kind = _kind(self.study, name)
        return SI_UNIT[kind] if self.si else self.study.scene.shown_in(kind)

    def price(self, multiplier: Multiplier) -> tuple[str, float]:
        """Unit of a multiplier, and its size in SI."""
        over, under = self.of(multiplier.figure), self.of(multiplier.side.limit)
        return (over if under == "1" else f"{over}/{grouped(under)}"), factor(over) / factor(under)


def columns(study: SceneStudy, rows: Sequence[Row], si: bool = False) -> dict[str, list[NumberColumn]]:
    """Numbers of rows as columns: "place", "optimised", "design", "figures", "multipliers"; none that is empty.

    In the units of the scene, with rounding errors as 0; si: in SI, without a change.
    """
    numbers_of: dict[str, Sequence[Mapping[str, float | None]]] = {
        "place": [study.place(row) for row in rows],
        "optimised": [study.optimised(row) for row in rows],
        "design": [row.design for row in rows],
        "figures": [row.figures for row in rows],
    }
    units, parts = ColumnUnits(study, si), dict[str, list[NumberColumn]]()
    for part, numbers in numbers_of.items():
        taken = {column.name for columns in parts.values() for column in columns}
        taken |= {"change"} if part == "figures" else set()
        names = dict.fromkeys(name for row in numbers for name in row if name not in taken)
        parts[part] = _nonempty(
            NumberColumn(name, units.of(name), factor(units.of(name)), tuple(row.get(name) for row in numbers))
            for name in names
        )
    multipliers = dict.fromkeys(multiplier for row in rows for multiplier in row.multipliers)
    parts["multipliers"] = _nonempty(
        NumberColumn(price.text, *units.price(price), tuple(row.multipliers.get(price) for row in rows))
        for price in multipliers
    )
    return parts if si else _without_rounding(parts)


PRINTED = 1e-5
"""Share of a column's largest number by which a place may differ from its row's: tables print six digits."""
NAMED = re.compile(r"(?P<key>[^\s=]+)\s*=\s*(?P<value>.+)|(?P<name>[A-Za-z_]\S*)\s+(?P<rest>.+)|(?P<bare>.+)")


def labelled_point(
    study: SceneStudy, rows: Sequence[Row], solved: Sequence[Row], label: int | str | Mapping[str, str | float]
) -> int:
    """Number of the point that a label names. Raises BadInput for none, and for more than one.

    rows: those that the table shows, of which a place is one; solved: all, of which a number is one.
    label: the number, also as the table prints it ("3", "3*"); the place, as "715 N*m", or of several columns
    "operation.M0 = 715 N*m, peak_torque = 86 N*m"; or a mapping, column → text with its unit or a number in SI.
    """
    numbers = [row.point for row in solved]
    allowed = f"{', '.join(map(str, numbers[:20]))}, or a place such as {_place_example(study, rows)}"
    remedy = "Choose one of them"
    if not isinstance(label, str | Mapping):
        points = [k for k in numbers if k == arguments.whole(label, "point", allowed, remedy)]
    elif isinstance(label, str) and (mark := label.strip().removeprefix("point ").rstrip("*")) in map(str, numbers):
        points = [int(mark)]
    else:
        places = _named_places(study, rows, label, allowed)
        points = [row.point for k, row in enumerate(rows) if all(_is_there(c, k, value) for c, value in places)]
    if len(points) != 1:
        problem = (
            f"it names the points {', '.join(map(str, points[:20]))}"
            if points
            else "the study does not have this point"
        )
        remedy = "Name more columns, or the number" if points else remedy
        raise refusal(problem, "", "point", label, allowed, remedy)
    return points[0]


def _named_places(
    study: SceneStudy, rows: Sequence[Row], label: str | Mapping[str, str | float], allowed: str
) -> list[tuple[NumberColumn, float]]:
    """Columns that a label names, each with the value that it gives, SI. Raises BadInput."""
    made, remedy = columns(study, rows), "Write the number of the row, or its place with its unit"
    known = {column.name: column for part in made.values() for column in part}
    first = next(iter(made["place"]), None)
    named = list[tuple[str, str | float]]()
    for name, value in arguments.table(label, "point", allowed, remedy).items() if isinstance(label, Mapping) else ():
        named.append((name, value if isinstance(value, str) else arguments.number(value, "point", allowed, remedy)))
    for text in label.split(",") if isinstance(label, str) else ():
        match = NAMED.fullmatch(text.strip())
        if match is None or first is None:
            raise refusal("it is not the label of a row", "", "point", label, allowed, remedy)
        named.append((match["key"] or match["name"] or first.name, match["value"] or match["rest"] or match["bare"]))
    places = []
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
        places.append((column, float(value)))
    return places


def _is_there(column: NumberColumn, at: int, value: float) -> bool:
    point_value, largest = (
        column.values[at],
        max((abs(number) for number in column.values if number is not None), default=0.0),
    )
    return point_value is not None and abs(point_value - value) <= PRINTED * largest


def _is_number(text: object) -> bool:
    try:
        return math.isfinite(float(str(text)))
    except ValueError:
        return False


def _kind(study: SceneStudy, name: str) -> str:
    return study.kinds.get(name) or UnitFormatter(study.scene).kind(name)


def _place_example(study: SceneStudy, rows: Sequence[Row]) -> str:
    """Example of a row's place, by its first number."""
    column = next(iter(columns(study, rows)["place"]), None)
    value = next((number for number in column.shown if number is not None), None) if column else None
    if column is None or value is None:
        return '"3"'
    return f'"{value:.6g}{"" if column.unit == "1" else f" {column.unit}"}"'


def _nonempty(columns: Iterable[NumberColumn]) -> list[NumberColumn]:
    return [column for column in columns if any(value is not None for value in column.values)]


def _without_rounding(parts: dict[str, list[NumberColumn]]) -> dict[str, list[NumberColumn]]:
    every = list(itertools.chain(*parts.values()))
    rounding = Rounding((column.unit, value) for column in every for value in column.values)
    return {part: [_clean(column, rounding) for column in columns] for part, columns in parts.items()}


def _clean(column: NumberColumn, rounding: Rounding) -> NumberColumn:
    return column._replace(values=tuple(rounding.shown(column.unit, value) for value in column.values))


def frame(study: SceneStudy, rows: Sequence[Row], si: bool = False) -> "pd.DataFrame":
    """Table of a line per row; si: in SI, for comparison with machines in other units."""
    import pandas as pd

    from loomopt.interface.table_frame import TableFrame

    made = columns(study, rows, si)
    cells: dict[str, object] = {c.heading: _floats(c) for c in (*made["place"], *made["optimised"])}
    cells |= {"status": [row.outcome for row in rows], "certified": [row.certified for row in rows]}
    for part in ("design", "figures", "multipliers"):
        cells |= {column.heading: _floats(column) for column in made[part]}
    for name in dict.fromkeys(name for row in rows for name in row.reached):
        cells[f"{name} reached"] = pd.array([row.reached.get(name) for row in rows], dtype="boolean")
    if any(row.narrows for row in rows):
        cells["narrows"] = [row.narrows for row in rows]
    cells["parent"] = pd.array([row.parent for row in rows], dtype="Int64")
    cells |= {"time [s]": [row.seconds for row in rows], "reason": [row.reason for row in rows]}
    table = TableFrame(cells, index=pd.Index([row.point for row in rows], name="point"))
    table.attrs.update(study_provenance(study))
    return table


def _floats(column: NumberColumn) -> list[float]:
    return [math.nan if value is None else value for value in column.shown]


def study_provenance(study: SceneStudy) -> dict[str, str]:
    """Provenance of the rows of a study."""
    return provenance(study.scene, study=study.name, target=study.target or "none", **study.conditions)


def units(study: SceneStudy, rows: Sequence[Row]) -> dict[str, str]:
    """SI unit of everything that rows name."""
    return {column.name: column.unit for part in columns(study, rows, si=True).values() for column in part}


SAME = 1e-9
"""Relative spread of a column below which its number is the same in all rows."""

KINDS = {"jump": "jump", "kink": "kink", "active set": "binding limits change"}
"""Name of a kind of change."""
NARROWS = "*"
"""Mark of an added point that locates a change."""
MOST_REASONS = 5
"""Largest number of reasons below a table."""


def shown_columns(study: SceneStudy, rows: Sequence[Row], si: bool = False) -> list[NumberColumn]:
    """Main columns of a study: objectives, shown figures, and the numbers of the design that differ."""
    made = columns(study, rows, si)
    known = [*made["design"], *made["figures"], *made["multipliers"]]
    shown = [column for name in study.shown for column in known if column.name == name]
    differing = [column for column in made["design"] if _differs(column) and column not in shown]
    return [*made["optimised"], *shown, *differing]


def _differs(column: NumberColumn) -> bool:
    known = [value for value in column.values if value is not None]
    return max(known) - min(known) > SAME * max(map(abs, known))


def tables(study: SceneStudy, rows: Sequence[Row], si: bool = False) -> list[str | TextTable]:
    """Tables of a study: a line per row, the changes along it, and the outcome.

    rows: of all points that were solved.
    """
    findings = study.read(rows)
    shown = [*columns(study, findings.rows, si)["place"], *shown_columns(study, findings.rows, si)]
    heads = ["", *(column.name if column.unit == "1" else f"{column.name}\n{column.unit}" for column in shown)]
    lines = []
    for place, row in enumerate(findings.rows):
        cells = ["" if value is None else f"{value:.6g}" for value in (column.shown[place] for column in shown)]
        mark = f"{row.point}{NARROWS}" if row.narrows else str(row.point)
        lines.append((mark, *cells, row.shortfall or ("" if row.status == "optimal" else row.status)))
    counts = Counter(row.outcome for row in findings.rows)
    outcome = ", ".join(f"{count} {status}" for status, count in counts.items())
    whole = study.size is None or len(rows) == study.size
    narrowing = sum(row.narrows for row in findings.rows)
    number = len(findings.rows) - narrowing
    count = f"{number} point{'' if number == 1 else 's'}" if whole else counted(study, len(rows))
    count += f" and {narrowing} that locate{'s' * (narrowing == 1)} changes ({NARROWS})" if narrowing else ""
    first_columns = range(min(len(study.kinds) + 2, len(heads)))  # the point, its place, what is optimised there
    right = tuple(range(len(heads)))
    grid = TextTable(
        "", (*heads, "status"), tuple(lines), right, first=(*first_columns, len(heads)), more="--out F.csv, --json"
    )
    reasons = [f"point {row.point}, {row.status}: {row.reason}" for row in findings.rows if row.reason]
    more = [f"and {len(reasons) - MOST_REASONS} more, in the table's last column"] if reasons[MOST_REASONS:] else []
    count += f", {findings.bettered} improved from a neighbour's design" if findings.bettered else ""
    message = [findings.message] if findings.message else []
    sentences = [change_sentence(study, change, si) for change in findings.changes]
    conditions = study.conditions
    words = {"held": "with", "not held": "without"}
    condition_text = "".join(f"; {words[name]} {conditions[name]}" for name in words if name in conditions)
    return [
        f"{study.heading}: {count}, {outcome}{condition_text}",
        *message,
        grid,
        *sentences,
        *reasons[:MOST_REASONS],
        *more,
    ]


def change_sentence(study: SceneStudy, change: Change, si: bool) -> str:
    """A change as a sentence."""
    key = next(iter(study.kinds))
    unit = ColumnUnits(study, si).of(key)
    limits = [unbroken(side.text) for side in change.limits]
    low, high = (unbroken(show(value, unit)) for value in change.interval)
    if change.at is None:
        return f"{unbroken(key)} from {low} to {high}: binding limits change, {', '.join(limits)}"
    where = f"{low} to {high}" if change.kind == "jump" else unbroken(show(change.at, unit))
    return f"{unbroken(key)} {where}: {', '.join([KINDS[change.kind], *limits])}"


LINES = 7
"""Lines of a chart at most: of more every second, third, ..."""


def charts(study: SceneStudy, findings: Findings) -> Charts:
    """Charts of a study over the first number that varies, a line for each combination of the others."""
    rows = findings.rows
    made = columns(study, rows)
    places = made["place"]
    missing = "no row is certified"
    if not places or not any(row.certified for row in rows):
        return Charts(study.heading, [], missing=missing)
    panels = made["optimised"] or shown_columns(study, rows)
    others = [column for column in shown_columns(study, rows) if column not in panels]
    drawn = [_chart(panel, places, findings) for panel in [*panels, *others]]
    notes = [change_sentence(study, change, False) for change in findings.changes if change.at is not None]
    return Charts(study.heading, drawn, shared=True, first=len(panels), notes=notes, missing=missing)


def _chart(panel: NumberColumn, places: Sequence[NumberColumn], findings: Findings) -> Chart:
    """A number over the first that varies; where there is no certified design its line has a gap."""
    first, others, rows = places[0], places[1:], findings.rows
    x = np.array([math.nan if value is None else value for value in first.shown])
    known = zip(panel.shown, rows, strict=True)
    y = np.array([value if value is not None and row.certified else math.nan for value, row in known])
    gaps = [(low / first.size, high / first.size) for low, high in findings.gaps]
    lines: dict[tuple[float, ...], list[int]] = {}
    for k in (k for k in np.argsort(x, kind="stable").tolist() if np.isfinite(x[k])):
        lines.setdefault(tuple(column.shown[k] or 0.0 for column in others), []).append(k)
    step = max(1, -(-len(lines) // LINES))
    series, key = list[Series](), list[tuple[str, str]]()
    dots = list[tuple[float, float, str]]()
    for place, (values, point_row) in enumerate(sorted(lines.items())[::step]):
        kind = f"c{place % COLOURS}"
        label = ", ".join(value_text(column, point_row[0]) for column, _ in zip(others, values, strict=True))
        series += [
            Series(*_broken(x[point_row], y[point_row], gaps), kind, label),
            Series(x[point_row], y[point_row], kind, points=True),
        ]
        key += [(kind, label)] if label else []
        missed = [k for k in point_row if rows[k].shortfall]
        dots += [(x[k], y[k], "missed") for k in missed]
        key += [("dot missed", " and ".join(dict.fromkeys(rows[k].shortfall for k in missed)))] if missed else []
    if step > 1:
        key.append(("", f"{-(-len(lines) // step)} of {len(lines)} lines are drawn, one in {step}; the table has all"))
    changes = [change for change in findings.changes if change.at is not None]
    at = [(change.at or 0.0) / first.size for change in changes]
    if not others:
        curve = series[0]
        seen = np.isfinite(curve.y)
        kinks = [place for place, change in zip(at, changes, strict=True) if change.kind != "jump"]
        dots += [(place, float(np.interp(place, curve.x[seen], curve.y[seen])), "kink") for place in kinks]
    across = _axis(x, first.heading)
    return Chart(
        panel.heading, across, series, (), gaps, at, dots, list(dict.fromkeys(key)),
        numbered=True, upright=_axis(y) if len(set(x[np.isfinite(x)])) == 1 else None,
    )  # fmt: skip


def check_comparable(study: SceneStudy, others: Sequence[SceneStudy]) -> None:
    """Raise BadInput for a study over other numbers, which cannot be in the same chart."""
    for other in others:
        if list(other.kinds.items()) != list(study.kinds.items()):
            problem = f"the study of {other.scene.name} is over {' and '.join(other.kinds)}"
            remedy = "Give studies over the same numbers"
            raise refusal(problem, study.scene.origin, "others", allowed=" and ".join(study.kinds), remedy=remedy)


def with_studies(charts: Charts, study: SceneStudy, others: Sequence[tuple[SceneStudy, Findings]]) -> Charts:
    """Charts with the lines of other studies over the same number, each under the name of its scene."""
    drawn = [chart for chart in charts.charts if isinstance(chart, Chart)]
    if not others or not drawn:
        return charts
    units, lines = ColumnUnits(study, False), dict[str, list[Series]]()
    width, key = factor(units.of(next(iter(study.kinds)))), [("c0", study.scene.name)]
    for place, (other, findings) in enumerate(others, 1):
        kind, made = f"c{place % COLOURS}", columns(other, findings.rows, si=True)
        key.append((kind, other.scene.name))
        over = np.array(made["place"][0].values, dtype=float) / width
        order, certified = np.argsort(over, kind="stable"), [row.certified for row in findings.rows]
        for column in (column for name, part in made.items() if name != "place" for column in part):
            values = np.where(certified, np.array(column.values, dtype=float), math.nan) / factor(units.of(column.name))
            at = over[order], values[order]
            lines.setdefault(column.name, []).extend(
                [Series(*at, kind, other.scene.name), Series(*at, kind, points=True)]
            )
    more = [lines.get(chart.title.rpartition(" [")[0], []) for chart in drawn]
    curves = [curve.x for group in (*(chart.series for chart in drawn), *more) for curve in group]
    across = fit_axis(curves, name=drawn[0].x.name)
    new = [
        replace(chart, x=across, series=[*chart.series, *group], key=[*key, *chart.key], upright=None)
        for chart, group in zip(drawn, more, strict=True)
    ]
    return replace(charts, charts=new)


def _axis(values: Floats, name: str = "") -> Axis:
    """Axis that shows all values; of one or two alone that are all at one place, numbered where they are."""
    known = sorted({round(value, 12) for value in values[np.isfinite(values)].tolist()})
    if len(known) != 1:
        return fit_axis([values], name=name)
    room = 0.1 * abs(known[0]) or 1.0
    return Axis(known[0] - room, known[0] + room, known, name)


def _broken(x: Floats, y: Floats, gaps: Sequence[tuple[float, float]]) -> tuple[Floats, Floats]:
    """A line with a break in every gap between two of its points, in the units of x."""
    middles = [(low + high) / 2 for low, high in gaps]
    places = {int(np.searchsorted(x, middle)): middle for middle in middles}
    inner = {k: middle for k, middle in places.items() if 0 < k < len(x) and np.isfinite([y[k - 1], y[k]]).all()}
    return np.insert(x, list(inner), list(inner.values())), np.insert(y, list(inner), np.nan)


def value_text(column: NumberColumn, at: int, digits: int = 6) -> str:
    """A number of a row with its name and its unit."""
    return f"{column.name} {column.shown[at] or 0.0:.{digits}g}{'' if column.unit == '1' else ' ' + column.unit}"
