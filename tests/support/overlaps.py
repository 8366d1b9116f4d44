"""What runs into each other in a figure: boxes of texts and legends, lines, the figure's border; no pixels."""

from itertools import combinations

import numpy as np
from matplotlib.path import Path
from matplotlib.transforms import Bbox

CLOSE = 0.5
"""Pixels by which boxes may touch."""


SIZES = (6.0, 4.5), (11.0, 8.0), (16.0, 9.0)
"""Inches: as in a paper, on a page, on a slide."""


def overlapping_at_every_size(figure):
    """Return what is found in a figure as it is, and at each of SIZES, smaller and larger in turn."""
    message = overlapping(figure)
    for size in (*SIZES, SIZES[0]):
        figure.set_size_inches(*size)
        message += [f"at {size}: {item}" for item in overlapping(figure)]
    return message


def overlapping(figure):
    """Return in words every text or legend that meets another, a line, or leaves the figure."""
    figure.draw_without_rendering()
    canvas = figure.canvas.get_renderer()
    axes = [inner for axis in figure.axes for inner in (axis, *axis.child_axes)]
    texts = {text: _box(text, canvas) for text in _texts(figure, axes) if text.get_visible() and text.get_text()}
    legends = [axis.get_legend() for axis in figure.axes if axis.get_legend()] + list(figure.legends)
    boxes = {legend: _box(legend, canvas) for legend in legends}
    values = {text: legend for legend in legends for text in legend.get_texts()}
    lines = [(name, path) for axis in axes for name, path in _lines(axis)]
    message = [
        f"{_name(item)} meets {_name(two)}" for item, two in combinations(texts, 2) if texts[item].overlaps(texts[two])
    ]
    message += [
        f"{_name(text)} meets the legend of {_name(legend)}"
        for text, box in texts.items()
        for legend, area in boxes.items()
        if values.get(text) is not legend and box.overlaps(area)
    ]
    message += [
        f"two legends meet: {_name(a)}, {_name(b)}" for a, b in combinations(boxes, 2) if boxes[a].overlaps(boxes[b])
    ]
    for thing, box in {**texts, **boxes}.items():
        message += [f"{_name(thing)} meets {name}" for name, path in lines if path.intersects_bbox(box, filled=False)]
        if not _inside(box, figure.bbox):
            message.append(f"{_name(thing)} leaves the figure")
    return message


def _texts(figure, axes):
    yield from (text for text in (figure._suptitle, figure._supxlabel, *figure.texts) if text)
    for legend in [*(item.get_legend() for item in axes), *figure.legends]:
        yield from legend.get_texts() if legend else ()
    for item in axes:
        yield from (item.title, item._left_title, item._right_title, *item.texts)
        for axis in (item.xaxis, item.yaxis):
            low, high = sorted(axis.get_view_interval())
            yield from (axis.label, axis.offsetText)
            for tick in axis.get_major_ticks():
                if low <= tick.get_loc() <= high:
                    yield from (tick.label1, tick.label2)


def _lines(axes):
    """Yield curves, levels, marks and the axes' own borders as paths in pixels, with a name each."""
    for line in axes.lines:
        points = line.get_transform().transform(line.get_xydata())
        known = np.isfinite(points).all(axis=1)
        if line.get_marker() not in ("None", None):
            half = line.get_markersize() / 2 * axes.figure.dpi / 72
            for x, y in points[known]:
                yield (
                    f"a point of {line.get_label()}",
                    _rectangle(Bbox.from_extents(x - half, y - half, x + half, y + half)),
                )
        for run in np.split(points, np.flatnonzero(~known)):
            run = run[np.isfinite(run).all(axis=1)]
            if len(run) > 1 and line.get_linestyle() != "None":
                yield f"the line {line.get_label()}", Path(run)
    for name, spine in axes.spines.items():
        if spine.get_visible():
            yield f"the {name} border", spine.get_path().transformed(spine.get_transform())


def _rectangle(box):
    return Path([(box.x0, box.y0), (box.x1, box.y0), (box.x1, box.y1), (box.x0, box.y1), (box.x0, box.y0)])


def _box(thing, canvas):
    return thing.get_window_extent(canvas).padded(-CLOSE)


def _inside(box, border):
    return border.x0 <= box.x0 and border.y0 <= box.y0 and box.x1 <= border.x1 and box.y1 <= border.y1


def _name(thing):
    return (
        repr(thing.get_text()) if hasattr(thing, "get_text") else f"legend {[t.get_text() for t in thing.get_texts()]}"
    )
