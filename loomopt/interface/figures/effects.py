"""What each effect is worth as a figure: bars of shift and regret, a panel per objective, beside the tolerance."""

import functools
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from loomopt.base.errors import BadInput
from loomopt.base.files import atomically, suffix
from loomopt.interface.figures.figure import COLOURS, Entry, head, own_style, page, save
from loomopt.interface.files import outputs
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.picture.shapes import plain
from loomopt.studies.effects.study import Found

WIDTH, BAR, ROOM = 7.0, 0.34, 1.25
"""Inches: of the page, of an effect's bars, beside those of a panel."""
DECADES = 4
"""Powers of ten on either side of 0, at most: below them, and below a tenth of the tolerance, the scale is linear."""
SHIFTED, EXCEEDED = "shift at the reference's design", "worst excess of the design found without"
ROOMY = 1.3
"""Beyond the longest bars."""
DASHES: dict[str, Any] = {"linestyle": (0, (4, 2)), "linewidth": 0.9}
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
        panels["limits"] = {EXCEEDED: excesses}
    title = f"{found.scene.name}, {found.target}: what each effect is worth"
    with own_style(title, *names):
        high = len(panels) * (BAR * len(names) + ROOM) + 0.4
        figure = page(WIDTH, high, title)
        all_axes = [figure.add_subplot(len(panels), 1, place + 1) for place in range(len(panels))]
        entries = [
            _panel(axes, bars, names, found.tolerance, (LIMIT,) if name == "limits" else (SHIFT, REGRET))
            for axes, (name, bars) in zip(all_axes, panels.items(), strict=True)
        ]
        all_axes[-1].set_xlabel("share of the natural size [%]")
        figure.get_layout_engine().execute(figure)
        heads = [head(axes, name, told) for axes, name, told in zip(all_axes, panels, entries, strict=True)]
        figure.finish(high + sum(heads) / 72 - 0.45 * len(heads))
    return figure


def _panel(
    axes: Any,
    bars: Mapping[str, Sequence[float | None]],
    names: Sequence[str],
    tolerance: float,
    colours: Sequence[str],
) -> list[Entry]:
    """Draw bars for each effect from 0 to either side, logarithmic where they are long; return what the legend says."""
    ends = {label: [_end(value, label) for value in values] for label, values in bars.items()}
    known = [end for each in ends.values() for end in each]
    signed = EXCEEDED not in bars
    least, most = min([-100 * tolerance * signed, *known]), max([100 * tolerance, *known])
    linear = max(100 * tolerance / 10, max(most, -least) / 10**DECADES)
    axes.set_xscale("symlog", linthresh=linear)
    axes.set(xlim=(ROOMY * least, ROOMY * most), ylim=(len(names) - 0.4, -0.6))
    axes.set_yticks(range(len(names)), list(map(plain, names)))
    axes.tick_params(axis="y", length=0)
    thick = 0.76 / len(bars)
    entries: list[Entry] = []
    for place, ((label, values), colour) in enumerate(zip(bars.items(), colours, strict=True)):
        middle = (place - (len(bars) - 1) / 2) * thick
        at = [k + middle for k in range(len(names))]
        drawn = axes.barh(at, ends[label], 0.9 * thick, color=colour)
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
    axes.axvline(0.0, color="#111827", linewidth=0.8)
    either = [
        axes.axvline(sign * 100 * tolerance, color="#111827", zorder=0.5, **DASHES) for sign in (1, -1)[: 1 + signed]
    ]
    axes.xaxis.set_major_formatter(lambda value, place: f"{value:g}")
    axes.minorticks_off()
    axes.spines[["top", "right", "left"]].set_visible(False)
    return [*entries, (either[0], f"tolerance {100 * tolerance:g} %")]


def _end(value: float | None, label: str) -> float:
    """Return where a bar ends, %: at 0 where nothing is known, where all is rounding, and where limits are held."""
    if value is None or not math.isfinite(value) or abs(value) <= SHOWN_AS_ZERO:
        return 0.0
    return max(100 * value, 0.0) if label == EXCEEDED else 100 * value


def _share_text(value: float | None) -> str:
    """Return a share as the number beside a bar."""
    if value is None:
        return "none"
    return "0" if abs(value) <= SHOWN_AS_ZERO else f"{100 * value:+.3g} %"
