"""Charts of a design's curves over the turn, today's machine dashed beside it, from the panels that figures draw."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from loomopt.base.units import factor, show
from loomopt.interface import tables
from loomopt.interface.figures.curves import ROUNDING, SAME, WORDS, DrawnTurn, drawn_turn, marked_row, shown_unit
from loomopt.interface.report.charts import block
from loomopt.interface.report.markup import Markup, Part, text
from loomopt.jobs import registry
from loomopt.model.session import working
from loomopt.picture.chart import COLOURS, TICKS, Axis, Chart, Series, heading, thin_rows
from loomopt.picture.job_views import Span
from loomopt.picture.panels import Panel, in_units
from loomopt.scenes.designs import Design, flat
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray


@working()
def part(scene: Scene, design: Design) -> Part:
    """Curves of a design, SI, over the turn, beside today's machine where it is another."""
    job, view, full_design = registry.of(scene), registry.of(scene).views, flat(design)
    now = job.today(scene)
    full = {**now, **full_design}
    unit = scene.shown_in("angle")
    shown = _turn(scene, full, unit)
    before = None if full == now else _turn(scene, now, unit)
    known = view.panels(scene, full_design, tuple(shown.columns.columns))
    panels = [in_units(scene, panel) for panel in sorted(known, key=lambda panel: not panel.wide)]
    key = _key(shown, before is not None)
    intro = f"Over the {view.angle} phi, {unit}."
    charts = block([chart(panel, shown, before) for panel in panels])
    return Part("Curves over the turn", (Markup(f'<p class="marks">{text(intro)} {key}</p>'), *charts))


def _turn(scene: Scene, full: Design, unit: str) -> DrawnTurn:
    return drawn_turn(tables.curves(scene, full), registry.of(scene).views.marks(scene, flat(full)), unit)


def _key(shown: DrawnTurn, with_today: bool) -> str:
    """Legend of vertical lines and shaded intervals."""
    sentences = []
    for name, mark in shown.marks.items():
        if isinstance(mark, Span):
            ends = f"{shown.place_text(math.degrees(mark.begin))} to {shown.place_text(math.degrees(mark.end))}"
            sentences.append(f'<span class="k-span"><i></i>{text(f"{name} {ends}")}</span>')
        elif math.isfinite(mark):
            sentences.append(
                f'<span class="k-place"><i></i>{text(f"{name} {shown.place_text(math.degrees(mark))}")}</span>'
            )
    sentences += ['<span class="k-today"><i></i>today, dashed</span>'] if with_today else []
    return " ".join(sentences)


def chart(panel: Panel, shown: DrawnTurn, before: DrawnTurn | None) -> Chart:
    """A panel as a chart."""
    unit = shown_unit(panel)
    size, angle = factor(unit), math.degrees(factor(shown.unit))
    sampled = _drawn_rows(panel, shown)
    series = [
        Series(shown.angles[sampled] / angle, shown.of(column)[sampled] / size, f"c{place % COLOURS}", label)
        for place, (column, label) in enumerate(zip(panel.columns, panel.labels, strict=True))
    ]
    key = [(curve.kind, curve.label) for curve in series if len(series) > 1 or curve.label != panel.title]
    ghosts = []
    if before:
        old = _drawn_rows(panel, before)
        old = old[before.angles[old] <= shown.angles.max() + SAME]  # one that parts may repeat after several turns
        ghosts = [
            Series(
                before.angles[old] / angle,
                before.of(column)[old] / size,
                f"today c{place % COLOURS}" if len(series) > 1 else "today",
            )
            for place, column in enumerate(panel.columns)
            if column in before.columns
        ]
    dots = []
    for turn, kind, word in ((shown, "c0", ""), (before, "ghost", "today: ")):
        for place_mark in _marks(panel, turn, unit) if turn else ():
            dots.append((place_mark[0] / angle, place_mark[1], kind))
            key.append((f"dot {kind}", f"{word}{place_mark[2]}"))
    levels = [value / size for values in panel.levels.values() for value in values]
    key += [("k-level", f"{name} {show(values[0], unit)}") for name, values in panel.levels.items()]
    whole = shown.whole
    places = [math.degrees(m) for m in shown.marks.values() if not isinstance(m, Span) and math.isfinite(m)]
    low, high = float(shown.angles.min()), float(shown.angles.max())
    spans = [span for mark in shown.marks.values() if isinstance(mark, Span) for span in _parts(mark, low, high, whole)]
    step = TICKS * whole / 360.0
    numbered = [step * k / angle for k in range(math.ceil(low / step), math.floor(high / step + 1e-9) + 1)]
    return Chart(
        heading(panel.title, unit),
        Axis(low / angle, high / angle, numbered),
        [*ghosts, *series],
        levels,
        [(a / angle, b / angle) for a, b in spans],
        [(low + (place - low) % whole) / angle for place in places],
        dots,
        key,
        cursor=True,
    )


def _drawn_rows(panel: Panel, turn: DrawnTurn) -> "NDArray[np.intp]":
    """Rows a curve is drawn through: every so many degrees, corners, the last, and what is marked."""
    sampled = thin_rows(turn.angles)
    for how in panel.marked:
        row = marked_row(turn.of(panel.columns[0]), turn, how)
        if row is not None:
            sampled[row] = True
    return np.flatnonzero(sampled)


def _marks(panel: Panel, turn: DrawnTurn, unit: str) -> list[tuple[float, float, str]]:
    """Marked points of a panel's first column: angle, deg, value in the unit, and label."""
    values, marks = turn.of(panel.columns[0]), []
    for how in panel.marked:
        row = marked_row(values, turn, how)
        if row is not None:
            value = float(values[row])
            value = 0.0 if abs(value) <= ROUNDING * float(np.nanmax(np.abs(values))) else value
            where = f" at {turn.place_text(float(turn.angles[row]))}" if how in WORDS else ""
            label = f"{WORDS.get(how, f'at {how}')} {show(value, unit)}{where}"
            marks.append((float(turn.angles[row]), value / factor(unit), label))
    return marks


def _parts(span: Span, low: float, high: float, whole: float) -> Sequence[tuple[float, float]]:
    """Parts of an interval that lie between two angles, deg."""
    begin = low + (math.degrees(span.begin) - low) % whole
    end = begin + (math.degrees(span.end) - math.degrees(span.begin)) % whole
    both = ((max(a, low), min(b, high)) for a, b in ((begin, end), (begin - whole, end - whole)))
    return [(a, b) for a, b in both if a < b]
