"""Drawings of designs at the charts of a front or a sweep: at both ends and in the middle, each with its letter."""

import textwrap
from collections.abc import Sequence
from dataclasses import replace

from loomopt.interface import study_table
from loomopt.interface.files import outputs
from loomopt.interface.study_table import NumberColumn, value_text
from loomopt.jobs import registry
from loomopt.picture.chart import Chart, Charts
from loomopt.picture.shapes import Drawing, Text, plain
from loomopt.studies.run.rows import Findings, Row, SceneStudy

LEFT_OUT = ("dimensions", "leaders", "notes")
"""Layers that are nothing without their texts."""
LETTERS = "ABC"
NAMED = 42
"""Characters of a line above a design."""


def letter_designs(
    study: SceneStudy, findings: Findings, charts: Charts
) -> tuple[Charts, Sequence[tuple[str, Drawing]]]:
    """Charts of a study with letters at three designs, and these designs with headings."""
    certified = [row for row in findings.rows if row.certified]
    if not charts.charts:
        return charts, ()
    chosen = {row.point: row for row in (certified[0], _middle(study, certified), certified[-1])}
    spots = {letter: findings.rows.index(row) for letter, row in zip(LETTERS, chosen.values(), strict=False)}
    columns = study_table.columns(study, findings.rows)
    first = columns["place"][0]
    panels = [*columns["optimised"], *study_table.shown_columns(study, findings.rows)]
    by_heading = {panel.heading: panel for panel in panels}
    marked = [
        _mark_designs(chart, first, by_heading[chart.title], spots)
        for chart in charts.charts
        if isinstance(chart, Chart)
    ]
    charts = replace(charts, charts=marked, title=study.heading)
    if len(findings.rows) == 1:  # why there is no front
        charts = replace(charts, title=f"{study.heading}. {findings.message}".rstrip(". "))
    if registry.of(study.scene).views.missing(study.scene):
        return charts, ()
    headings = [*columns["place"], *columns["optimised"]]
    return charts, [
        (_heading(letter, headings, findings.rows[k], k), _sketch(study, findings.rows[k]))
        for letter, k in spots.items()
    ]


def _middle(study: SceneStudy, rows: Sequence[Row]) -> Row:
    """The row in the middle, over one number the one nearest to it."""
    places = [list(study.place(row).values()) for row in rows]
    if len(places[0]) > 1:
        return rows[len(rows) // 2]
    middle = (places[0][0] + places[-1][0]) / 2
    return min(reversed(list(zip(places, rows, strict=True))), key=lambda pair: abs(pair[0][0] - middle))[1]


def _mark_designs(chart: Chart, first: NumberColumn, panel: NumberColumn, spots: dict[str, int]) -> Chart:
    """A chart with a ring around the points of letters, and these above it."""
    at = {letter: (first.shown[k] or 0.0, panel.shown[k]) for letter, k in spots.items()}
    rings = [(x, y, "chosen") for x, y in at.values() if y is not None]
    names = [(x, letter) for letter, (x, y) in at.items() if y is not None]
    return replace(chart, dots=(*chart.dots, *rings), names=names)


def _heading(letter: str, columns: Sequence[NumberColumn], row: Row, at: int) -> str:
    """Heading of a design, in lines: letter, place, objective, missed goals."""
    first, *others = (value_text(column, at) for column in columns)
    lines = (line for text in (f"{letter}: {first}", *others, row.shortfall) for line in textwrap.wrap(text, NAMED))
    return "\n".join(map(plain, lines))


def _sketch(study: SceneStudy, row: Row) -> Drawing:
    """A row's mechanism without its texts: it is drawn small."""
    drawing = outputs.drawing(study.scene_at(row.point), row.design)
    primitives = (
        primitive
        for primitive in drawing.primitives
        if not isinstance(primitive, Text) and primitive.layer not in LEFT_OUT
    )
    return replace(drawing, primitives=tuple(primitives), legend=())
