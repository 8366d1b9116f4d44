"""What is marked along the one number that a study varies: where other limits bind, numbered and listed, and gaps."""

import itertools
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from loomopt.picture import placing
from loomopt.picture.shapes import plain
from loomopt.studies.run.findings import Change, Findings, SceneStudy
from loomopt.views import study_files
from loomopt.views.layout import spaced

ROOM = 0.16
"""Share of the curve's height that is left above it for the numbers."""
BELOW, AT = 0.925, 0.955
"""Heights in the panel where leaders to the numbers end, and where these stand."""
APART = 0.032
"""Least distance of two numbers, as a share of the panel's width."""
EDGE = 0.015
"""Least distance of a number from either side of the panel, as a share of its width."""
SMALL = 7.0
"""Height of numbers and of the list, printer's points."""
LETTER, PIXELS = 8.0, 72.0
LINE = 1.45 * SMALL / PIXELS
"""Inches from one line of the list to the next."""
LONGEST = 105
"""Characters of a line of the list."""
INK = "#374151"


def named(findings: Findings) -> list[Change]:
    """Return the changes that are marked: those whose place is known."""
    return [change for change in findings.changes if change.at is not None]


def lines(study: SceneStudy, changes: Sequence[Change]) -> list[str]:
    """Return the list of changes, numbered, wrapped to the page."""
    found: list[str] = []
    for number, change in enumerate(changes, 1):
        said = study_files.change_said(study, change, False)
        first, *others = (plain(spaced(line)) for line in textwrap.wrap(said, LONGEST, break_long_words=False))
        found += [f"{number}  {first}", *(f"     {line}" for line in others)]
    return found


def listed(axes: Any, text: Sequence[str]) -> None:
    """Write the list of changes into axes of its own."""
    axes.set_axis_off()
    axes.text(0.0, 1.0, "\n".join(text), fontsize=SMALL, linespacing=1.45, va="top", transform=axes.transAxes,
              parse_math=False, color=INK)  # fmt: skip


def broken(x: Sequence[float], y: Sequence[float], gaps: Sequence[tuple[float, float]]) -> tuple[Any, Any]:
    """Return a curve with a break in every gap between two of its points, in the units of x."""
    middles = [(low + high) / 2 for low, high in gaps]
    places = {int(np.searchsorted(x, middle)): middle for middle in middles}
    inner = {k: middle for k, middle in places.items() if 0 < k < len(x) and np.isfinite([y[k - 1], y[k]]).all()}
    return np.insert(np.array(x), list(inner), list(inner.values())), np.insert(np.array(y), list(inner), np.nan)


def marked(
    axes: Any, x: Any, y: Any, changes: Sequence[Change], gaps: Sequence[tuple[float, float]], size: float
) -> None:
    """Mark changes and gaps, in the unit of x, along a curve that is drawn; size: of that unit, SI."""
    for low, high in gaps:
        axes.axvspan(low, high, color="#f3f4f6", zorder=0)
    low, high = float(np.nanmin(y)), float(np.nanmax(y))
    height = high - low or abs(high) or 1.0
    axes.set_ylim(low - 0.08 * height, high + (ROOM if changes else 0.08) * height)
    places = [(change.at or 0.0) / size for change in changes]
    spread = _spread([_share(axes.get_xlim(), place) for place in places])
    known = np.isfinite(y)
    for number, (place, top, change) in enumerate(zip(places, spread, changes, strict=True), 1):
        value = float(np.interp(place, x[known], y[known]))
        foot, head = _share(axes.get_xlim(), place), _share(axes.get_ylim(), value)
        way = (foot, foot, top), (head, BELOW - 0.025, BELOW)
        axes.plot(*way, ":", color=INK, linewidth=0.7, transform=axes.transAxes, scalex=False, scaley=False)
        if change.kind != "jump":
            axes.plot(place, value, "D", color=INK, markersize=3.5, fillstyle="none")
        axes.text(top, AT, str(number), fontsize=SMALL, ha="center", va="center", transform=axes.transAxes, color=INK)


def _share(ends: tuple[float, float], value: float) -> float:
    """Return where a value lies between two ends, from 0 to 1."""
    return (value - ends[0]) / (ends[1] - ends[0])


def _spread(places: Sequence[float]) -> list[float]:
    """Return places, in rising order, moved as little as keeps them apart and within the panel."""
    apart = min(APART, 0.97 / max(len(places), 1))
    groups: list[list[float]] = []  # runs of places whose numbers touch
    for place in places:
        groups.append([place])
        while len(groups) > 1 and _run(groups[-1], apart)[0] - _run(groups[-2], apart)[-1] < apart:
            groups[-2:] = [groups[-2] + groups[-1]]
    return [place for group in groups for place in _run(group, apart)]


def _run(places: Sequence[float], apart: float) -> list[float]:
    """Return places that stand side by side round the middle of others, within the panel."""
    half = apart * (len(places) - 1) / 2
    middle = min(max(sum(places) / len(places), EDGE + half), 1 - EDGE - half)
    return [middle - half + apart * k for k in range(len(places))]


def lettered(figure: Any, axes: Any, points: Sequence[tuple[str, float, float]]) -> None:
    """Name points of a curve by letters beside them, clear of what is drawn in the axes."""
    figure.draw_without_rendering()
    unit = LETTER * figure.dpi / PIXELS
    step = placing.STEP * unit
    ways = [_drawn(line) for line in axes.lines]
    ways += [_corners(each.get_window_extent()) for each in (axes, *axes.texts)]
    strokes = np.concatenate([_followed(way, step) for way in ways])
    at = axes.transData.transform([(x, y) for _, x, y in points])
    wishes = [placing.Wish([(float(x), float(y))], np.pi / 4, 0.9 * unit, unit) for x, y in at]
    for (letter, x, y), spot in zip(points, placing.place(wishes, strokes, unit), strict=True):
        axes.plot(x, y, "o", color="#111827", markersize=5, fillstyle="none")
        middle = ((spot.box.left + spot.box.right) / 2, (spot.box.bottom + spot.box.top) / 2)
        place = axes.transAxes.inverted().transform(middle)
        axes.text(*place, letter, fontsize=LETTER, ha="center", va="center", transform=axes.transAxes, in_layout=False)


def _drawn(line: Any) -> Any:
    """Return the points of a line, pixels."""
    points = line.get_transform().transform(line.get_xydata())
    return points[np.isfinite(points).all(axis=1)]


def _corners(box: Any) -> Any:
    """Return the corners of a box, pixels, the first one again at the end."""
    return np.array([(box.x0, box.y0), (box.x1, box.y0), (box.x1, box.y1), (box.x0, box.y1), (box.x0, box.y0)])


def _followed(points: Any, step: float) -> Any:
    """Return points along the way from each point to the next, closer than a step."""
    legs = (np.linspace(a, b, 2 + int(np.hypot(*(b - a)) / step)) for a, b in itertools.pairwise(points))
    return np.concatenate([points, *legs])
