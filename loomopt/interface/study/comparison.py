"""Comparison of designs: dimensions, figures, limits and curves in common units, with marked differences."""

import functools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from loomopt.base import arguments
from loomopt.base.errors import refusal
from loomopt.base.units import factor
from loomopt.interface import results, tables
from loomopt.interface.results import Evaluation
from loomopt.interface.rounding import Rounding
from loomopt.interface.study_result import Presentation
from loomopt.jobs import registry
from loomopt.model.session import working
from loomopt.picture import turn
from loomopt.picture.chart import COLOURS, Chart, Charts, Series, heading
from loomopt.picture.job_views import Marks
from loomopt.picture.panels import in_units
from loomopt.picture.panels import single_panels as each_alone
from loomopt.picture.table import Column, TextTable, text_table, words
from loomopt.scenes import designs
from loomopt.scenes.designs import Design, flat
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Finding, UnitFormatter

if TYPE_CHECKING:
    import pandas as pd

DIFFERS = 1e-6
"""Share of the largest from which on numbers of a row differ; an answer is right to 1e-8, and machines round."""
TODAY = "today"


class Named(NamedTuple):
    """A named design, evaluated in a scene."""

    name: str
    evaluation: Evaluation


class ComparedRow(NamedTuple):
    """Number of all designs, in one unit; None where a design does not have it; differs: whether the values differ.

    limits: as of each design: whether it holds; None where there is none.
    """

    name: str
    unit: str
    values: tuple[float | None, ...]
    limits_ok: tuple[bool | None, ...]
    differs: bool


@dataclass(frozen=True, repr=False)
class Comparison(Presentation):
    """Designs side by side, in the units of the first one's scene."""

    designs: tuple[Named, ...]
    heading = "Designs side by side"

    @property
    def scene(self) -> Scene:
        """The scene whose units all are shown in: the first design's."""
        return self.designs[0].evaluation.scene

    @functools.cached_property
    def rows(self) -> tuple[ComparedRow, ...]:
        """Dimensions, then figures, then limits of other quantities."""
        formatter = UnitFormatter(self.scene)
        parts = (
            [design.evaluation.design for design in self.designs],
            [design.evaluation.figures for design in self.designs],
        )
        limits = [{limit.name: limit for limit in design.evaluation.limits} for design in self.designs]
        rows, taken = [], set[str]()
        for numbers in parts:
            for name in dict.fromkeys(name for row in numbers for name in row):
                values = [_number(row.get(name)) for row in numbers]
                if name not in taken and any(value is not None for value in values):
                    rows.append(_row(name, values, limits, formatter))
                    taken.add(name)
        margins = self.scene.schema.margins
        for name in dict.fromkeys(
            name for design_limits in limits for name in design_limits if name not in taken and name not in margins
        ):
            limit_row = [design_limits.get(name) for design_limits in limits]
            rows.append(_row(name, [limit.value if limit else None for limit in limit_row], limits, formatter))
        return tuple(_clean(rows))

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Table of one row per number, a column per design, with whether they differ; si: in SI."""
        from loomopt.interface.table_frame import frame
        from loomopt.scenes.provenance import provenance

        attrs = provenance(self.scene, designs=", ".join(design.name for design in self.designs))
        return frame(self._columns(arguments.flag(si, "si")), attrs, "name")

    def _columns(self, si: bool = False) -> list[Column]:
        rows, units = self.rows, UnitFormatter(self.scene)
        shown = [units.si(row.name) if si else row.unit for row in rows]
        sizes = [factor(row.unit) if si else 1.0 for row in rows]
        columns = [words("name", [row.name for row in rows], ""), Column("unit", shown)]
        for place, design in enumerate(self.designs):
            values = [row.values[place] for row in rows]
            in_unit = [None if value is None else value * size for value, size in zip(values, sizes, strict=True)]
            cells = [_cell(value, row.limits_ok[place]) for value, row in zip(values, rows, strict=True)]
            columns.append(Column(design.name, in_unit, design.name, cells))
        names = ["" if row.unit == "1" else row.unit for row in rows]
        return [
            *columns,
            Column("", (), "unit", names, right=False),
            Column("differs", [row.differs for row in rows], "", ["differs" if r.differs else "" for r in rows], False),
            Column("not held by", [", ".join(_broken(row, self.designs)) for row in rows]),
        ]

    def charts(self) -> Charts:
        """Curves of all designs over the cycle, one chart for each quantity."""
        return _overlaid([(design.name, design.evaluation.scene, design.evaluation.design) for design in self.designs])

    def as_dict(self) -> dict[str, object]:
        """Object that `compare --json` prints, SI."""
        documents = [(design.name, design.evaluation.as_dict()) for design in self.designs]
        units = {name: unit for _, document in documents for name, unit in document["units"].items()}
        keys = ("problem", "design", "figures", "limits")
        entries = [{"name": name, **{key: document[key] for key in keys}} for name, document in documents]
        return {"designs": entries, "units": units, "differs": [row.name for row in self.rows if row.differs]}

    def tables(self) -> list[str | TextTable]:
        """Which limits each design holds, and all numbers side by side."""
        lines: list[str | TextTable] = []
        for design in self.designs:
            broken = [limit.name for limit in design.evaluation.limits if not limit.ok and not limit.rounding]
            verdict = f"NOT admissible (!): {', '.join(broken)}" if broken else "all limits held"
            lines.append(
                f"{design.name}: {design.evaluation.problem}, {design.evaluation.task_name or 'no target'}: {verdict}"
            )
        count = len(self.designs)
        return [*lines, text_table(self._columns(), (0, *range(1, count + 1), count + 1))]

    def __repr__(self) -> str:
        count = sum(row.differs for row in self.rows)
        names = ", ".join(design.name for design in self.designs)
        return f"<Comparison of {names}: {count} of {len(self.rows)} rows differ>"


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def _row(
    name: str, values: Sequence[float | None], limits: Sequence[Mapping[str, Finding]], formatter: UnitFormatter
) -> ComparedRow:
    """A row in the unit that a reader of the first design's scene sees it in."""
    unit, known = formatter.unit(name), [abs(value) for value in values if value is not None]
    size = max(known, default=0.0)
    first = next((value for value in values if value is not None), None)
    differs = any(value is None or abs(value - (first or 0.0)) > DIFFERS * size for value in values) and size > 0.0
    satisfied = tuple((limit.ok or limit.rounding) if (limit := entry.get(name)) else None for entry in limits)
    shown = tuple(None if value is None else value / factor(unit) for value in values)
    return ComparedRow(name, unit, shown, satisfied, differs)


def _clean(rows: Sequence[ComparedRow]) -> list[ComparedRow]:
    """Rows with 0 for values that are rounding relative to the largest of their unit."""
    rounding, cleaned = Rounding((row.unit, value) for row in rows for value in row.values), []
    for row in rows:
        values = tuple(rounding.shown(row.unit, value) for value in row.values)
        cleaned.append(row._replace(values=values, differs=row.differs and len(set(values)) > 1))
    return cleaned


def _cell(value: float | None, satisfied: bool | None) -> str:
    return "" if value is None else f"{value:.6g}{' !' if satisfied is False else ''}"


def _broken(row: ComparedRow, designs: Sequence[Named]) -> list[str]:
    return [design.name for design, satisfied in zip(designs, row.limits_ok, strict=True) if satisfied is False]


def compare(given_designs: Sequence[object], within: Scene | None = None, names: Sequence[str] = ()) -> Comparison:
    """Designs side by side: answers, evaluations, or "today" for the first one's machine as it is.

    within: scene in which all designs are evaluated; by default each in its own. names: name of each design. Raises
    BadInput for another type, for a single design, and for designs of different jobs.
    """
    known = [design for design in given_designs if isinstance(design, Evaluation)]
    stray = next((design for design in given_designs if not isinstance(design, Evaluation) and design != TODAY), None)
    allowed = f'answers, evaluations, and "{TODAY}"'
    if stray is not None:
        raise refusal("it cannot be compared", "", "compare", type(stray).__name__, allowed, "Give answers")
    if not known or len(given_designs) < 2:
        raise refusal("there is nothing to compare", "", "compare", allowed=allowed, remedy="Give two designs at least")
    first = known[0]
    home = within or first.scene
    evaluations = []
    for design in given_designs:
        if not isinstance(design, Evaluation):
            target = first.target if home.job == first.scene.job else None
            evaluations.append(results.evaluate_design(home, None, target or None))
            continue
        designs.check_job(design.scene.job, home, f"<{design.problem}>")
        evaluations.append(_within(design, within) if within else design)
    called = [
        name or _design_name(design)
        for name, design in zip([*names, *[""] * len(given_designs)], given_designs, strict=False)
    ]
    counts, seen = Counter(called), Counter[str]()
    unique = []
    for name in called:
        seen[name] += 1
        unique.append(f"{name} {seen[name]}" if counts[name] > 1 else name)
    return Comparison(tuple(map(Named, unique, evaluations)))


def _within(evaluation: Evaluation, scene: Scene) -> Evaluation:
    """Evaluation of a design in another scene, with the same target if that scene has it."""
    target = evaluation.target if evaluation.target in scene.schema.targets else None
    return results.evaluate_design(scene, designs.checked(evaluation.design, scene), target)


def _design_name(design: object) -> str:
    return f"{design.problem}, {design.task_name}" if isinstance(design, Evaluation) else TODAY


@working()
def _overlaid(designs: Sequence[tuple[str, Scene, Design]]) -> Charts:
    """Curves of designs, named, in their scenes and in the units of the first one's scene."""
    scene, first = designs[0][1:]
    view, unit = registry.of(scene).views, scene.shown_in("angle")
    turns = [turn.from_table(tables.curves(home, design), _marks(home, design), unit) for _, home, design in designs]
    columns = tuple(dict.fromkeys(column for curves in turns for column in curves.columns.columns))
    known = view.panels(scene, flat(first), tuple(turns[0].columns.columns))
    panels = [*known, *(panel for panel in each_alone(columns) if panel.columns[0] not in turns[0].columns)]
    axis = turn.axis(turns, view.angle)
    key = [(f"c{place % COLOURS}", name) for place, (name, *_) in enumerate(designs)]
    shown = []
    for panel in (in_units(scene, panel) for panel in panels):
        for column, label in zip(panel.columns, panel.labels, strict=True):
            size = factor(panel.shown_unit)
            drawn = [
                Series(curves.shown(curves.angles), curves.of(column) / size, kind, name)
                for curves, (kind, name) in zip(turns, key, strict=True)
                if column in curves.columns
            ]
            shown.append(Chart(heading(label, panel.shown_unit), axis, drawn, key=key, cursor=True))
    return Charts(f"{scene.name}: designs compared, curves over the cycle", shown, shared=True)


def _marks(scene: Scene, design: Design) -> Marks:
    job = registry.of(scene)
    return job.views.marks(scene, {**job.today(scene), **flat(design)})
