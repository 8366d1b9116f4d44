"""An accuracy study for people: its table in the terminal, and the log-log figure of error over cost."""

import functools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from loomopt.base.files import atomically, suffix
from loomopt.base.files import check as check_file
from loomopt.interface.figures.figure import COLOURS, STYLES, Entry, frame, head, own_style, page, save
from loomopt.interface.files import sheets
from loomopt.picture.table import TextTable, joined
from loomopt.studies.accuracy.accuracy import AccuracyResult, in_time
from loomopt.studies.accuracy.readings import NUMBERS
from loomopt.studies.accuracy.subject import LadderRow, grouped, setting_text

FORMATS = (".png", ".svg", ".pdf", ".csv", ".xlsx")
LEAST = 1e-17
"""Errors below this, zero among them, are drawn here."""
COLUMNS = 2
MARKS = "os^Dv"


def parts(study: AccuracyResult) -> list[str | TextTable]:
    """Return the parts of a study in a terminal: a table of rows, the measured orders, the advice."""
    lines = []
    for rows in grouped(study.rows).values():
        for place, row in enumerate(rows):
            name = (row.quantity, row.method) if place == 0 else ("", "")
            error, seconds = ("" if value is None else f"{value:.1e}" for value in (row.error, row.seconds))
            lines.append((*name, setting_text(row.setting), error, seconds, str(row.evaluations), _words(row)))
    head = ("quantity", "method", "setting", "error", "time [s]", "positions", "status")
    named = dict.fromkeys([*study.orders, *study.knees])
    found = tuple((joined(name), _order(study, name), _knee(study, name)) for name in named)
    return [
        f"{study.problem}: relative errors against references at least 100 times tighter, and what they cost",
        TextTable("", head, tuple(lines), right=(2, 3, 4, 5), first=(0, 1, 2, 3, 4, 6), more="--json, --out F.csv"),
        TextTable(
            "Measured orders, and the settings from which on errors stop falling", ("", "order", "knee"), found, (1, 2)
        ),
        *(text for text in (study.advice, in_time(study.rows)) if text),
    ]


def _words(row: LadderRow) -> str:
    """Return a row's status; what everything is, is not said."""
    return "" if row.status in ("done", "optimal") else row.status.removeprefix("Solve_Succeeded, ")


def _order(study: AccuracyResult, name: str) -> str:
    return f"{study.orders[name]:.2f}" if name in study.orders else ""


def _knee(study: AccuracyResult, name: str) -> str:
    return setting_text(study.knees[name]) if name in study.knees else ""


def check(path: Path) -> None:
    """Raise BadInput, before anything is computed, where a study cannot be written as this file."""
    suffix(path, FORMATS)
    check_file(path)


def write(study: AccuracyResult, path: Path, comma: bool = False) -> None:
    """Write a study's table or its figure, by the file's ending; comma: whether CSV has decimal commas."""
    if suffix(path, FORMATS) in sheets.ENDINGS:
        sheets.write(path, {"accuracy": study.table()}, comma)
    else:
        atomically(path, functools.partial(draw, study))


def draw(study: AccuracyResult, path: Path) -> None:
    """Write the figure as PNG, PDF or SVG."""
    save(drawn(study), path)


def drawn(study: AccuracyResult) -> Any:
    """Return the figure: a panel per quantity, error over time, or over the method's own setting."""
    panels = _panels(study)
    with own_style(study.problem, *panels):
        high = math.ceil(len(panels) / COLUMNS)
        figure = page(9.0, 2.5 * high + 0.5, f"{study.problem}: what accuracy costs")
        placed = []
        for place, (quantity, ladders) in enumerate(panels.items()):
            axes = figure.add_subplot(high, COLUMNS, place + 1)
            placed.append((axes, quantity, _panel(axes, study, quantity, ladders)))
        figure.get_layout_engine().execute(figure)
        heights = [head(axes, quantity, entries) for axes, quantity, entries in placed]
        rows = [max(heights[place : place + COLUMNS]) for place in range(0, len(heights), COLUMNS)]
        figure.finish(2.3 * high + sum(rows) / 72 + 0.5)
    return figure


def _panels(study: AccuracyResult) -> dict[str, list[list[LadderRow]]]:
    """Return quantity → its ladders' rows that have an error; only quantities that some method tells at sizes."""
    found: dict[str, list[list[LadderRow]]] = {}
    for rows in grouped(study.rows).values():
        known = [row for row in rows if row.error is not None and row.seconds]
        if known:
            found.setdefault(known[0].quantity, []).append(known)
    return {name: ladders for name, ladders in found.items() if any(_sized(rows) for rows in ladders)}


def _sized(rows: Sequence[LadderRow]) -> bool:
    return len(rows) > 1 and not isinstance(rows[0].setting, str)


def _panel(axes: Any, study: AccuracyResult, quantity: str, ladders: Sequence[Sequence[LadderRow]]) -> list[Entry]:
    """Draw one quantity's methods, over the setting where all of one cost alike; return what its legend says."""
    from matplotlib.ticker import NullFormatter

    alike = any(_sized(rows) and len({row.evaluations for row in rows}) == 1 for rows in ladders)
    ladders = [rows for rows in ladders if rows[0].method != NUMBERS]
    entries: list[Entry] = []
    thin = {"markersize": 4.0, "linewidth": 1.2}
    for place, rows in enumerate(ladders):
        method, colour, mark = rows[0].method, COLOURS[place % len(COLOURS)], MARKS[place % len(MARKS)]
        style = STYLES[place % len(STYLES)]
        errors = [max(row.error or 0.0, LEAST) for row in rows]
        name = f"{quantity}, {method}"
        label = f"{method}, order {study.orders[name]:.2f}" if name in study.orders else method
        if alike and not _sized(rows):
            entries.append((axes.axhline(errors[0], color=colour, linestyle=style, linewidth=1.2), label))
            continue
        x = [row.setting if alike else row.seconds for row in rows]
        line = style if _sized(rows) else ""
        entries += [(each, label) for each in axes.plot(x, errors, linestyle=line, color=colour, marker=mark, **thin)]
    axes.set(xscale="log", yscale="log")
    axes.set_xlim(_decades(axes.get_xlim()))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("step [rad]" if alike else "time of one run [s]")
    axes.set_ylabel("relative error")
    frame(axes)
    return entries


def _decades(ends: tuple[float, float]) -> tuple[float, float]:
    """Return the whole decades around the positive ends of an axis, so that at least two powers of ten are named."""
    low, high = ends
    return 10.0 ** math.floor(math.log10(low)), 10.0 ** math.ceil(math.log10(high))
