"""Derivatives of an optimum, for people: what moves it most, what each limit is worth and how far that holds."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from loomopt.base.units import factor
from loomopt.picture.table import TextTable
from loomopt.scenes.provenance import provenance
from loomopt.solving.answer.solution import Words
from loomopt.studies.sensitivity.study import Found, Row

if TYPE_CHECKING:
    import pandas as pd

PERCENT = 0.01
"""Share of a number by which its effect is told where it has no tolerance."""
ARROWS = {None: "", "up": "upward", "down": "downward"}


def parts(found: Found) -> list[str | TextTable]:
    """Return the parts of a study in a terminal: what moves each figure that is sought, and prices with ranges."""
    head = f"{found.scene.name}, {found.target}: how the optimum moves with each number"
    if found.refused:
        return [f"{head} cannot be told: {found.refused}"]
    grids = [_moves(found, name) for name in sought(found)]
    return [head, *grids, _prices(found), *_holding(found)]


def sought(found: Found) -> list[str]:
    """Return the figures that are sought, of which any derivative is not 0; all of them are in the JSON data."""
    names = [level.objective for level in found.answer.certificate.levels] if found.answer.certificate else []
    known = {row.of for row in found.rows if row.value}
    return [name for name in dict.fromkeys(names) if name in known]


def effect(found: Found, row: Row) -> float:
    """Return what a number does to a figure by its tolerance (one sigma), or by 1 % without one, SI."""
    return row.value * found.sizes[row.number]


def _under(unit: str) -> str:
    """Return a unit that stands after a stroke."""
    return f"({unit})" if "*" in unit or "/" in unit else unit


def ordered(found: Found, name: str) -> list[Row]:
    """Return the derivatives of a figure that are not 0, the largest effect first."""
    rows = [row for row in found.rows if row.of == name and row.value]
    return sorted(rows, key=lambda row: -abs(effect(found, row)))


def _moves(found: Found, name: str) -> TextTable:
    words, lines = Words(found.scene), []
    unit = words.unit(name)
    for row in ordered(found, name):
        own = found.scene.shown_in(found.kinds[row.number])
        slope = row.value * factor(own) / factor(unit)
        by = found.sizes[row.number] / factor(own)
        per = f"{unit}/{_under(own)}" if own != "1" else unit
        moved = effect(found, row) / factor(unit)
        lines.append((row.number, ARROWS[row.side], f"{slope:.7g}", per, f"{by:.4g}", f"{moved:.4g}"))
    heads = ("number", "", f"d {name}", "unit", "by", f"{name}\n{unit}")
    return TextTable("", heads, tuple(lines), (2, 4, 5), first=(0, 2, 3, 5), more="--json")


def _prices(found: Found) -> TextTable:
    words, lines = Words(found.scene), []
    for price in found.prices:
        unit = words.unit(price.limit)
        ends = [(f"{x / factor(unit):+.6g}" if x else "0") if math.isfinite(x) else "" for x in price.range]
        lines.append((f"{price.limit} {price.side}", ends[0], price.ends[0], ends[1], price.ends[1], unit))
    heads = ("price of", "holds\nfrom", "for then", "to", "for then", "unit")
    return TextTable("", heads, tuple(lines), (1, 3), first=(0, 1, 3, 5), more="--json")


def _holding(found: Found) -> list[str]:
    """Return between which values of a number of the operation the same limits hold the optimum."""
    said = []
    for each in found.holds:
        unit = found.scene.shown_in(found.kinds[each.number])
        low, high = (f"{end / factor(unit):.7g}" for end in each.range)
        said.append(
            f"The same limits bind from {each.number} {low} ({each.ends[0]}) to {high} {unit} ({each.ends[1]})."
        )
    return said


def frame(found: Found, si: bool) -> "pd.DataFrame":
    """Return one line per derivative; si: in SI, else in the scene's own units."""
    import pandas as pd

    words, rows = Words(found.scene), []
    for row in found.rows:
        own = found.scene.shown_in(found.kinds[row.number])
        unit = words.unit(row.of)
        value = row.value if si else row.value * factor(own) / factor(unit)
        per = row.unit if si else f"{unit}/{_under(own)}"
        rows.append({"number": row.number, "of": row.of, "side": row.side, "derivative": value, "unit": per})
    table = pd.DataFrame(rows)
    table.attrs |= provenance(found.scene, target=found.target)
    return table


def lines(found: Found, name: str) -> Sequence[tuple[str, float]]:
    """Return numbers with their effects on a figure, in its unit, the largest first: what a tornado shows."""
    size = factor(Words(found.scene).unit(name))
    return [(f"{row.number} {ARROWS[row.side]}".strip(), effect(found, row) / size) for row in ordered(found, name)]
