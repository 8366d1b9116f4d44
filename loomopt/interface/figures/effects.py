"""What each effect is worth as a figure: bars of shift and regret, a panel per objective, beside the tolerance."""

import functools
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from loomopt.base.errors import BadInput
from loomopt.base.files import atomically, suffix
from loomopt.interface.figures.figure import COLOURS, Entry, blank, head, own_style, save
from loomopt.interface.files import outputs
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.picture.shapes import plain
from loomopt.studies.effects.study import Found

WIDTH, BAR, ROOM = 7.0, 0.34, 1.25
"""Inches: of the page, of an effect's bars, beside those of a panel."""
DECADES = 5
"""How far below the larger of tolerance and largest share a bar is still seen."""
SHIFTED = "shift at the reference's design"
SHIFT, REGRET, LIMIT = COLOURS[0], COLOURS[1], COLOURS[3]
QUIET = "#6b7280"
NUMBER = 7.0
"""Size of the numbers beside bars, pt."""


def plot(found: Found, path: Path | None = None) -> Any:
    """Return a study's figure; path: a file to write it to as well. Raises BadInput."""
    if path:
        suffix(path, outputs.PICTURES)
    if not found.reference.scales or not found.rows:
        raise BadInput("there is nothing to draw: no effect was measured", remedy="Look at the reasons in the table")
    drawn = _drawn(found)
    if path:
        atomically(path, functools.partial(save, drawn))
    return drawn


def _drawn(found: Found) -> Any:
    """Return the figure: a panel for each objective, and one for limits where any is exceeded."""
    names = [f"{row.effect}{' (may go)' if row.effect in found.left_out else ''}" for row in found.rows]
    panels: dict[str, Mapping[str, Sequence[float | None]]] = {
        figure: {
            SHIFTED: [row.shift.get(figure) for row in found.rows],
            "regret of the design found without": [row.regret.get(figure) for row in found.rows],
        }
        for figure in found.reference.scales
    }
    excesses = [row.excess for row in found.rows]
    if any(value is not None and value > SHOWN_AS_ZERO for value in excesses):
        panels["limits"] = {"worst excess of the design found without": excesses}
    title = f"{found.scene.name}, {found.target}: what each effect is worth"
    with own_style(title, *names):
        high = len(panels) * (BAR * len(names) + ROOM) + 0.4
        figure = blank(WIDTH, high)
        figure.set_layout_engine("constrained")
        figure.suptitle(plain(title), fontsize=11, parse_math=False)
        all_axes = [figure.add_subplot(len(panels), 1, place + 1) for place in range(len(panels))]
        entries = [
            _panel(axes, bars, names, found.tolerance, (LIMIT,) if name == "limits" else (SHIFT, REGRET))
            for axes, (name, bars) in zip(all_axes, panels.items(), strict=True)
        ]
        all_axes[-1].set_xlabel("share of the natural size [%]")
        figure.get_layout_engine().execute(figure)
        for axes, name, told in zip(all_axes, panels, entries, strict=True):
            head(axes, name, told)
    return figure


def _panel(
    axes: Any,
    bars: Mapping[str, Sequence[float | None]],
    names: Sequence[str],
    tolerance: float,
    colours: Sequence[str],
) -> list[Entry]:
    """Draw bars for each effect, logarithmic, from DECADES below the largest; return what the legend says."""
    sizes = [abs(value) for values in bars.values() for value in values if value is not None and math.isfinite(value)]
    largest = max([tolerance, *sizes])
    most = 100 * largest
    least = min(100 * tolerance / 10, most / 10**DECADES)
    axes.set(xscale="log", xlim=(least, most * (most / least) ** 0.03), ylim=(len(names) - 0.4, -0.6))
    axes.set_yticks(range(len(names)), list(map(plain, names)))
    axes.tick_params(axis="y", length=0)
    thick = 0.76 / len(bars)
    entries: list[Entry] = []
    for place, ((label, values), colour) in enumerate(zip(bars.items(), colours, strict=True)):
        middle = (place - (len(bars) - 1) / 2) * thick
        lengths = [_length(value, label, least, most) for value in values]
        at = [k + middle for k in range(len(names))]
        drawn = axes.barh(at, [length - least for length in lengths], 0.9 * thick, left=least, color=colour)
        entries.append((drawn, label))
        for y, value in zip(at, values, strict=True):
            axes.annotate(
                _share_text(value),
                (1.0, y),
                (4.0, 0.0),
                xycoords=("axes fraction", "data"),
                textcoords="offset points",
                va="center",
                fontsize=NUMBER,
                color=colour if value is not None else QUIET,
                parse_math=False,
            )
    line = axes.axvline(100 * tolerance, color="#111827", linestyle=(0, (4, 2)), linewidth=0.9, zorder=0.5)
    axes.xaxis.set_major_formatter(lambda value, place: f"{value:g}")
    axes.minorticks_off()
    axes.spines[["top", "right"]].set_visible(False)
    return [*entries, (line, f"tolerance {100 * tolerance:g} %")]


def _length(value: float | None, label: str, least: float, most: float) -> float:
    """Return where a bar ends, %: of a shift at its size, of what else is none the worse at the beginning."""
    size = 0.0 if value is None else abs(value) if label == SHIFTED else value
    return min(max(100 * size, least), most)


def _share_text(value: float | None) -> str:
    """Return a share as the number beside a bar."""
    if value is None:
        return "none"
    return "0" if abs(value) <= SHOWN_AS_ZERO else f"{100 * value:+.3g} %"
