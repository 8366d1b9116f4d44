"""Sensitivity of an optimum to the numbers of its scene: tables, a tornado chart, ranges of prices."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from loomopt.base import arguments
from loomopt.base.records import attribute
from loomopt.base.units import factor
from loomopt.interface.progress import cell_progress
from loomopt.interface.study_result import Presentation
from loomopt.picture.chart import Bars, Charts, heading
from loomopt.picture.table import Column, TextTable, text_table, words
from loomopt.scenes.provenance import provenance
from loomopt.solving.answer.solution import UnitFormatter
from loomopt.studies.sensitivity import study as sensitivity
from loomopt.studies.sensitivity.study import Row, SensitivityResult

if TYPE_CHECKING:
    import pandas as pd

ARROWS = {None: "", "up": "upward", "down": "downward"}
MOST = 20
"""Bars of a chart at most."""


@dataclass(frozen=True, repr=False)
class SensitivityStudy(Presentation):
    """Derivatives of an optimum by every number of its scene, and ranges of its prices; SI inside."""

    result: SensitivityResult
    scene = attribute[Any]()
    target = attribute[str]()
    answer = attribute[Any]()
    rows = attribute[Any]()
    prices = attribute[Any]()
    refused = attribute[str | None]()
    sizes = attribute[Any]()
    kinds = attribute[Any]()
    holds = attribute[Any]()
    as_dict = attribute[Callable[[], dict[str, Any]]]()
    heading = "How the optimum moves with each number"

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Table of one line per derivative; si: in SI, else in the scene's own units."""
        from loomopt.interface.table_frame import frame

        attrs = provenance(self.result.scene, target=self.result.target)
        return frame(_columns(self.result, self.result.rows, si=arguments.flag(si, "si")), attrs)

    def tables(self) -> list[str | TextTable]:
        """Derivatives of the objectives, and prices with their ranges."""
        result = self.result
        head = f"{result.scene.name}, {result.target}: how the optimum moves with each number"
        if result.refused:
            return [f"{head} cannot be computed: {result.refused}"]
        moves = [
            text_table(_columns(result, sort_rows(result, name), name), (0, 2, 3, 5))
            for name in moved_objectives(result)
        ]
        return [head, *moves, _prices(result), *_valid(result)]

    def charts(self) -> Charts:
        """Tornado chart of each optimised figure: by one sigma of a number's tolerance, or by 1 % of it."""
        result = self.result
        shown = []
        for name in moved_objectives(result):
            unit = UnitFormatter(result.scene).unit(name)
            rows = sort_rows(result, name)[:MOST]
            bars = [(f"{row.number} {ARROWS[row.side]}".strip(), (effect(result, row) / factor(unit),)) for row in rows]
            shown.append(Bars(f"{heading(name, unit)}, by one sigma of a number or by 1 %", bars))
        title = f"{result.scene.name}, {result.target}: what moves the optimum, a number up by one sigma or 1 %"
        return Charts(title, shown, missing="no number changes an objective")

    def __repr__(self) -> str:
        result = self.result
        summary = result.refused or f"{len(result.rows)} derivatives, {len(result.prices)} prices"
        return f"<SensitivityStudy {result.scene.name}, {result.target}: {summary}>"


def run_sensitivity(study: sensitivity.Study, on_step: Callable[[str], None] | None = None) -> SensitivityStudy:
    """Run a study of sensitivity. Raises BadInput, and KeyboardInterrupt on Ctrl-C."""
    with cell_progress() as cell:
        return SensitivityStudy(sensitivity.run(study, on_step or cell))


def moved_objectives(result: SensitivityResult) -> list[str]:
    """Optimised figures that have a derivative other than 0; the JSON data have all of them."""
    names = [level.objective for level in result.answer.certificate.levels] if result.answer.certificate else []
    known = {row.of for row in result.rows if row.value}
    return [name for name in dict.fromkeys(names) if name in known]


def effect(result: SensitivityResult, row: Row) -> float:
    """Change that a number makes to a figure by its tolerance (one sigma), or by 1 % without one, SI."""
    return row.value * result.sizes[row.number]


def _under(unit: str) -> str:
    """Unit after a slash."""
    return f"({unit})" if "*" in unit or "/" in unit else unit


def sort_rows(result: SensitivityResult, name: str) -> list[Row]:
    """Derivatives of a figure that are not 0, the largest effect first."""
    rows = [row for row in result.rows if row.of == name and row.value]
    return sorted(rows, key=lambda row: -abs(effect(result, row)))


def _columns(result: SensitivityResult, rows: Sequence[Row], name: str = "", si: bool = False) -> list[Column]:
    """Derivatives of figures; name: the one figure that people read of."""
    units = UnitFormatter(result.scene)
    numbers = [result.scene.shown_in(result.kinds[row.number]) for row in rows]
    sizes = [(factor(unit), factor(units.unit(row.of))) for row, unit in zip(rows, numbers, strict=True)]
    slopes = [row.value * size / of for row, (size, of) in zip(rows, sizes, strict=True)]
    per = [f"{units.unit(row.of)}/{_under(unit)}" for row, unit in zip(rows, numbers, strict=True)]
    shown = [units.unit(row.of) if unit == "1" else text for row, unit, text in zip(rows, numbers, per, strict=True)]
    steps = [f"{result.sizes[row.number] / size:.4g}" for row, (size, _) in zip(rows, sizes, strict=True)]
    moved = [f"{effect(result, row) / of:.4g}" for row, (_, of) in zip(rows, sizes, strict=True)]
    return [
        words("number", [row.number for row in rows]),
        Column("of", [row.of for row in rows]),
        Column("side", [row.side for row in rows], "", [ARROWS[row.side] for row in rows], right=False),
        Column("derivative", [r.value for r in rows] if si else slopes, f"d {name}", [f"{s:.7g}" for s in slopes]),
        Column("unit", [row.unit for row in rows] if si else per, "unit", shown, right=False),
        Column("", (), "by", steps),
        Column("", (), f"{name}\n{units.unit(name)}" if name else "", moved),
    ]


def _prices(result: SensitivityResult) -> TextTable:
    formatter, lines = UnitFormatter(result.scene), []
    for price in result.prices:
        unit = formatter.unit(price.limit)
        ends = [(f"{x / factor(unit):+.6g}" if x else "0") if math.isfinite(x) else "" for x in price.range]
        worth = formatter.price_reading(price.figure, price.limit, price.worth)
        lines.append((f"{price.limit} {price.side}", worth, ends[0], price.ends[0], ends[1], price.ends[1], unit))
    heads = ("price of", "price", "valid\nfrom", "what changes", "to", "what changes", "unit")
    return TextTable("", heads, tuple(lines), (2, 4), first=(0, 1, 2, 4, 6), more="--json")


def _valid(result: SensitivityResult) -> list[str]:
    """Sentences on between which values of a number of the operation the same limits hold the optimum."""
    sentences = []
    for validity in result.holds:
        unit = result.scene.shown_in(result.kinds[validity.number])
        low, high = (f"{end / factor(unit):.7g}" for end in validity.range)
        first, last = validity.ends
        sentences.append(f"The same limits bind from {validity.number} {low} ({first}) to {high} {unit} ({last}).")
    return sentences
