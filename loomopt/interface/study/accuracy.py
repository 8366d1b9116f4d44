"""Work–precision study: a table of runs, error over time, the advice."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from loomopt.base import arguments
from loomopt.base.records import attribute
from loomopt.interface.progress import cell_progress
from loomopt.interface.study_result import Presentation
from loomopt.picture.chart import COLOURS, Chart, Charts, Series, decades
from loomopt.picture.table import Column, TextTable, text_table, unbroken, words
from loomopt.scenes.scene import Scene
from loomopt.studies.accuracy import accuracy
from loomopt.studies.accuracy.accuracy import AccuracyResult, in_time
from loomopt.studies.accuracy.readings import NUMBERS
from loomopt.studies.accuracy.subject import LadderRow, group_rows, setting_text

if TYPE_CHECKING:
    import pandas as pd

LEAST = 1e-17
"""Errors below this, zero among them, are drawn here."""


@dataclass(frozen=True, repr=False)
class AccuracyStudy(Presentation):
    """Error and time of each numerical method; it shows itself in Jupyter."""

    result: AccuracyResult
    problem = attribute[str]()
    rows = attribute[Any]()
    orders = attribute[Any]()
    knees = attribute[Any]()
    advice = attribute[str]()
    provenance = attribute[Any]()
    as_dict = attribute[Callable[[], dict[str, Any]]]()
    heading = "Cost of accuracy"

    def table(self) -> "pd.DataFrame":
        """Table of one line per row; times in seconds."""
        from loomopt.interface.table_frame import frame

        return frame(_columns(self.result.rows), self.result.provenance)

    def tables(self) -> list[str | TextTable]:
        """Rows, the measured orders, the advice."""
        result = self.result
        rows = [row for ladder in group_rows(result.rows).values() for row in ladder]
        named = dict.fromkeys([*result.orders, *result.knees])
        orders = [f"{result.orders[name]:.2f}" if name in result.orders else "" for name in named]
        knees = [setting_text(result.knees[name]) if name in result.knees else "" for name in named]
        measured = [
            words("", list(map(unbroken, named)), ""),
            Column("", (), "order", orders),
            Column("", (), "knee", knees),
        ]
        title = "Measured orders, and the settings (knees) beyond which errors no longer decrease"
        return [
            f"{result.problem}: relative errors against references at least 100 times more precise, and times",
            text_table(_columns(rows), (0, 1, 2, 3, 4, 6), "--json, --out F.csv"),
            text_table(measured, more="", title=title),
            *(text for text in (result.advice, in_time(result.rows)) if text),
        ]

    def charts(self) -> Charts:
        """Error of each method over time, or over its setting, a chart for each quantity."""
        ladders: dict[str, list[list[LadderRow]]] = {}
        for rows in group_rows(self.result.rows).values():
            known = [row for row in rows if row.error is not None and row.seconds]
            if known:
                ladders.setdefault(known[0].quantity, []).append(known)
        sized = {name: row_sets for name, row_sets in ladders.items() if any(_has_sizes(rows) for rows in row_sets)}
        shown = [_chart(self.result, name, row_sets) for name, row_sets in sized.items()]
        return Charts(f"{self.result.problem}: cost of accuracy", shown, missing="no method has an error at sizes")

    def __repr__(self) -> str:
        return f"<AccuracyStudy {self.result.problem}: {len(self.result.rows)} rows; {self.result.advice}>"


def run_accuracy(scene: Scene, full: bool, on_step: Callable[[str], None] | None) -> AccuracyStudy:
    """Measure error and time for a scene; on_step(text): called before each step. Raises BadInput."""
    if on_step is not None:
        arguments.called(on_step, "on_step", "a function of a text", "Give a function, or leave it out")
    with cell_progress() as say:
        return AccuracyStudy(accuracy.study(scene, full, on_step or say))


def _columns(rows: Sequence[LadderRow]) -> list[Column]:
    first = [
        k == 0 or (row.quantity, row.method) != (rows[k - 1].quantity, rows[k - 1].method) for k, row in enumerate(rows)
    ]
    quantities, methods = ([getattr(row, part) for row in rows] for part in ("quantity", "method"))
    errors, seconds = ([getattr(row, part) for row in rows] for part in ("error", "seconds"))
    settings, counts = [setting_text(row.setting) for row in rows], [row.evaluations for row in rows]
    return [
        Column("quantity", quantities, "quantity", _where(first, quantities), right=False),
        Column("method", methods, "method", _where(first, methods), right=False),
        Column("setting", settings, "setting", settings),
        Column("error [1]", errors, "error", ["" if error is None else f"{error:.1e}" for error in errors]),
        Column("time [s]", seconds, "time [s]", ["" if time is None else f"{time:.1e}" for time in seconds]),
        Column("evaluations", counts, "positions", list(map(str, counts))),
        Column("status", [row.status for row in rows], "status", list(map(_status, rows)), right=False),
    ]


def _where(first: Sequence[bool], names: Sequence[str]) -> list[str]:
    return [name if shown else "" for shown, name in zip(first, names, strict=True)]


def _status(row: LadderRow) -> str:
    """Status of a row; empty for the usual one."""
    return "" if row.status in ("done", "optimal") else row.status.removeprefix("Solve_Succeeded, ")


def _has_sizes(rows: Sequence[LadderRow]) -> bool:
    return len(rows) > 1 and not isinstance(rows[0].setting, str)


def _chart(result: AccuracyResult, quantity: str, ladders: Sequence[Sequence[LadderRow]]) -> Chart:
    """Errors of one quantity's methods, over the setting where all settings of a method cost alike."""
    alike = any(_has_sizes(rows) and len({row.evaluations for row in rows}) == 1 for rows in ladders)
    ladders = [rows for rows in ladders if rows[0].method != NUMBERS]
    places = [[_place(row, alike) for row in rows if _has_sizes(rows) or not alike] for rows in ladders]
    errors = [[max(row.error or 0.0, LEAST) for row in rows] for rows in ladders]
    across = decades([x for values in places for x in values], "step [rad]" if alike else "time of one run [s]")
    series, key = [], []
    for place, (rows, x, y) in enumerate(zip(ladders, places, errors, strict=True)):
        kind, name = f"c{place % COLOURS}", f"{quantity}, {rows[0].method}"
        order = f", order {result.orders[name]:.2f}" if name in result.orders else ""
        if alike and not _has_sizes(rows):  # a method without settings has one error at all of them
            series.append(Series(np.array([across.low, across.high]), np.array(2 * y[:1]), kind))
        else:
            series += [Series(np.array(x), np.array(y), kind)] if _has_sizes(rows) else []
            series.append(Series(np.array(x), np.array(y), kind, points=True))
        key.append((kind, f"{rows[0].method}{order}"))
    upright = decades([error for values in errors for error in values], "relative error")
    return Chart(quantity, across, series, key=key, upright=upright)


def _place(row: LadderRow, alike: bool) -> float:
    """Abscissa of a row: its setting, or its time, s."""
    return float(row.setting if alike else row.seconds or 0.0)
