"""What stands above axes: names of angles, a legend, a title; there it hides no curve."""

from collections.abc import Sequence
from typing import Any

from loomopt.picture.shapes import plain

Entry = tuple[Any, str]
"""What a legend shows a line or a point as, and what it says of it."""
SIZE = 8.0
"""Of texts, pt."""
GAP = 4.0
"""Between rows, pt."""
COLOUR = "#374151"
LEGEND: dict[str, Any] = {"fontsize": SIZE, "frameon": False, "borderpad": 0.0, "labelspacing": 0.25}
LEGEND |= {"columnspacing": 1.4, "handlelength": 2.6}
"""What every legend looks like."""


def head(axes: Any, title: str, entries: Sequence[Entry] = (), names: Sequence[tuple[float, str]] = ()) -> float:
    """Write names at their places on the axis, above them a legend, above that a title; return the height, pt.

    The figure's layout must have given the axes their width.
    """
    high = _names(axes, names)
    if entries:
        high += _legend(axes, entries, high) + GAP
    axes.set_title(plain(title), loc="left", fontsize=9.0, pad=high + GAP, parse_math=False)
    return high + GAP + 12.0


def _points(axes: Any) -> float:
    """Return how many points a pixel is."""
    return 72.0 / float(axes.figure.dpi)


def _legend(axes: Any, entries: Sequence[Entry], above: float) -> float:
    """Write a legend that begins so many points above the axes, in as many columns as have room; return its height."""
    from matplotlib.transforms import ScaledTranslation

    canvas, width = axes.figure.canvas.get_renderer(), axes.get_window_extent().width
    place = axes.transAxes + ScaledTranslation(0.0, (above + GAP) / 72.0, axes.figure.dpi_scale_trans)
    for count in range(min(len(entries), 4), 0, -1):
        legend = axes.legend(
            [line for line, _ in entries],
            [plain(text) for _, text in entries],
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            bbox_transform=place,
            ncols=count,
            borderaxespad=0.0,
            **LEGEND,
        )
        for text in legend.get_texts():
            text.set_parse_math(False)
        box = legend.get_window_extent(canvas)
        if box.width <= width:
            break
    return float(box.height) * _points(axes)


def _names(axes: Any, names: Sequence[tuple[float, str]]) -> float:
    """Write names above an axis, each in the lowest row where it meets no other; return the height of all rows, pt."""
    canvas, box = axes.figure.canvas.get_renderer(), axes.get_window_extent()
    low, high = axes.get_xlim()
    wide = (high - low) / box.width
    ends: list[float] = []
    for place, name in sorted(names):
        text = axes.annotate(
            plain(name),
            (place, 1.0),
            (0.0, 3.0),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha="center",
            fontsize=SIZE,
            color=COLOUR,
            parse_math=False,
        )
        half = wide * text.get_window_extent(canvas).width / 2
        centre = min(max(place, low + half), high - half)
        row = next((row for row, end in enumerate(ends) if centre - half > end), len(ends))
        ends[row : row + 1] = [centre + half + wide * SIZE / 2]
        text.xy, text.xyann = (centre, 1.0), (0.0, 3.0 + 1.35 * SIZE * row)
    return GAP / 2 + 1.35 * SIZE * len(ends) if ends else 0.0
