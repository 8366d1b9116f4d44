"""Figures by matplotlib: drawings, and common parts of all figures. No window, no global state."""

import functools
import math
import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from loomopt.base import files
from loomopt.interface.files import svg
from loomopt.picture.drawing import sheet
from loomopt.picture.shapes import (
    CAPITAL,
    DASH,
    GAP,
    NOMINAL_HEIGHT,
    Arc,
    Circle,
    Drawing,
    Layer,
    Line,
    Primitive,
    Text,
    extent,
    plain,
)

SUFFIXES = (".png", ".pdf", ".svg")
"""Formats a figure can be written in."""

_PAGE = 240 / 25.4
"""Longer side of a drawing's page, inches."""
_STYLE = {
    "svg.hashsalt": "loomopt",
    "pdf.fonttype": 42,
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    # The common factor of an axis would overlap the names above it.
    "axes.formatter.limits": (-5, 8),
    "axes.formatter.useoffset": False,
}
COLOURS = ("#1d4ed8", "#c2410c", "#047857", "#7c3aed", "#b91c1c", "#0e7490", "#a16207")
STYLES = ("-", (0, (1, 1)), (0, (6, 1.5, 1, 1.5)), (0, (6, 1.5, 1, 1.5, 1, 1.5)), (0, (1, 3)))
"""Lines of several charts in the order of a common key: the first of each, the second of each, and so on."""


def draw(drawing: Drawing, path: Path) -> None:
    """Write the drawing as PNG or PDF fitted to a page, or as SVG at full scale.

    Raises BadInput for any other suffix.
    """
    if files.suffix(path, SUFFIXES) == ".svg":
        path.write_text(svg.render(drawing), encoding="utf-8")
        return
    drawing = sheet(drawing)
    box = extent(drawing)
    inches = _PAGE / max(box.right - box.left, box.top - box.bottom)
    with drawing_style(*(primitive.text for primitive in drawing.primitives if isinstance(primitive, Text))):
        figure = blank((box.right - box.left) * inches, (box.top - box.bottom) * inches)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), aspect="equal", frame_on=False)
        axes.set(xlim=(box.left, box.right), ylim=(box.bottom, box.top), xticks=[], yticks=[])
        for order, (name, layer) in enumerate(drawing.layers.items()):
            for primitive in drawing.primitives:
                if primitive.layer == name:
                    put(axes, primitive, layer, drawing.height, 72 * inches, order)
        _save(figure, path)


def save(figure: Any, path: Path) -> None:
    """Write a figure as PNG, PDF or SVG, by the path's ending, independent of the user's settings."""
    with drawing_style():
        _save(figure, path)


def put(axes: Any, primitive: Primitive, layer: Layer, text_height: float, points: float, order: int) -> None:
    """Add a primitive to axes in m; points: printer's points per m of the drawing."""
    from matplotlib import lines, patches

    unit = text_height / NOMINAL_HEIGHT * points
    dash = (0.0, (DASH / layer.width, GAP / layer.width)) if layer.dashed else "solid"
    stroke: dict[str, Any] = {"linewidth": layer.width * unit, "linestyle": dash, "zorder": order}
    match primitive:
        case Line(_, ends, closed):
            x, y = zip(*(ends + ends[:1] if closed else ends), strict=True)
            axes.add_line(lines.Line2D(x, y, color=layer.colour, **stroke))
        case Circle(_, centre, radius):
            axes.add_patch(patches.Circle(centre, radius, fill=False, edgecolor=layer.colour, **stroke))
        case Arc(_, centre, radius, begin, end):
            angles = {"theta1": math.degrees(begin), "theta2": math.degrees(end)}
            arc = patches.Arc(centre, 2 * radius, 2 * radius, edgecolor=layer.colour, **angles, **stroke)
            axes.add_patch(arc)
        case Text(_, at, text, size, anchor):
            axes.text(
                *at,
                plain(text),
                color=layer.colour,
                fontsize=size * text_height / CAPITAL * points,
                ha="center" if anchor == "centre" else "left",
                va="center_baseline",
                zorder=order,
                parse_math=False,
            )


@contextmanager
def drawing_style(*texts: str) -> Iterator[None]:
    """Draw texts with matplotlib's defaults, independent of the user's settings; an unknown character is a box."""
    from matplotlib import style

    settings = {**_STYLE, "font.family": families("".join(texts))}
    with warnings.catch_warnings(), style.context(["default", settings]):
        warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
        yield


def blank(width: float, height: float) -> Any:
    """An empty figure, inches, that belongs to no window."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from loomopt.interface.figures.shown_figure import ShownFigure

    figure = ShownFigure(figsize=(width, height), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def _save(figure: Any, path: Path) -> None:
    """Write the figure without dates, so that the same figure gives the same bytes."""
    kind = path.suffix.lower().removeprefix(".")
    metadata = {"png": {"Software": None}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}[kind]
    figure.savefig(path, format=kind, dpi=150, metadata=metadata)


FONT, BOXES = "DejaVu Sans", "Last Resort High-Efficiency"
"""Fonts that come with matplotlib: the usual one, and one that has a box for every character."""


def families(text: str) -> list[str]:
    """Fonts for the characters of a text, in order of use; a character without a font is an empty box."""
    from matplotlib import font_manager

    lacking = {character for character in text if character.isprintable()} - _characters(font_manager.findfont(FONT))
    fonts = [FONT]
    if lacking:
        plain = (entry for entry in font_manager.fontManager.ttflist if entry.style == "normal" and entry.weight == 400)
        for name, path in sorted({(entry.name, entry.fname) for entry in plain if entry.name not in (FONT, BOXES)}):
            had = lacking & _characters(path)
            if had:
                fonts.append(name)
                lacking -= had
    return list(dict.fromkeys(fonts))


@functools.cache
def _characters(path: str) -> frozenset[str]:
    """Characters that a font file has; none where it cannot be read, or holds pictures of one size."""
    from matplotlib.ft2font import FT2Font

    try:
        font = FT2Font(path)
        return frozenset(map(chr, font.get_charmap())) if font.scalable else frozenset()
    except (OSError, RuntimeError):
        return frozenset()


Entry = tuple[Any, str]
"""Entry of a legend: its line or point, and its text."""
HEAD_SIZE, TITLE_SIZE = 8.0, 9.0
"""Of texts, and of the title above them, pt."""
HEAD_GAP = 4.0
"""Between rows, pt."""
ROOMY = 0.95
"""Share of a width that a legend of several columns may take: the numbers of axes may get wider."""
HEAD_COLOUR = "#374151"
HEAD_LEGEND: dict[str, Any] = {"frameon": False, "borderpad": 0.0, "labelspacing": 0.25}
HEAD_LEGEND |= {"columnspacing": 1.4, "handlelength": 2.6}
"""Style of every legend."""


def page(width: float, height: float, title: str) -> Any:
    """An empty figure, inches, laid out by matplotlib at every size it is given; its title is wrapped to it."""
    figure = blank(width, height)
    figure.laid_out()
    written = figure.suptitle("", fontsize=11, parse_math=False)
    for characters in range(200, 20, -10):
        written.set_text("\n".join(textwrap.wrap(plain(title), characters)))
        if written.get_window_extent(figure.canvas.get_renderer()).width <= figure.bbox.width - 2 * HEAD_GAP:
            break
    return figure


def frame(axes: Any) -> None:
    """Give axes a grid, their ticks, and no border above and on the right."""
    from loomopt.interface.figures.shown_figure import TICK

    axes.grid(color="#e5e7eb", linewidth=0.5)
    axes.tick_params(**TICK)
    axes.spines[["top", "right"]].set_visible(False)


def head(axes: Any, title: str, entries: Sequence[Entry] = (), names: Sequence[tuple[float, str]] = ()) -> float:
    """Write names at their places on the axis, above them a legend, above that a title; return the height, pt.

    The figure's layout must have given the axes their width.
    """
    above = _names(axes, names)
    columns = _columns(entries, axes, axes.get_window_extent().width)
    return float(_page(axes).write(functools.partial(_head, axes, title, entries, columns, above)))


def _head(axes: Any, title: str, entries: Sequence[Entry], columns: int, above: float, scale: float) -> float:
    """Write legend and title above axes; above: height already used, pt at full scale; return the height."""
    from matplotlib.transforms import ScaledTranslation

    high = scale * above
    if entries:
        up = ScaledTranslation(0.0, (high + scale * HEAD_GAP) / 72.0, axes.figure.dpi_scale_trans)
        place = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "bbox_transform": axes.transAxes + up}
        legend = _legend(axes, entries, columns, scale, **place, borderaxespad=0.0)
        high += _high(legend) + scale * HEAD_GAP
    pad = high + scale * HEAD_GAP
    if title:
        axes.set_title(plain(title), loc="left", fontsize=scale * TITLE_SIZE, pad=pad, parse_math=False)
    return pad + 12.0 * scale * bool(title)


def below(figure: Any, entries: Sequence[Entry], title: str = "") -> float:
    """Write a legend below all axes of a figure; return its height, inches."""
    columns = _columns(entries, figure, figure.bbox.width - 4 * HEAD_GAP)
    return float(_page(figure).write(functools.partial(_below, figure, entries, columns, title)))


def _below(figure: Any, entries: Sequence[Entry], columns: int, title: str, scale: float) -> float:
    for legend in list(figure.legends):
        legend.remove()
    made = _legend(figure, entries, columns, scale, loc="outside lower center", title=plain(title) or None)
    return (_high(made) + 2 * HEAD_GAP * scale) / 72.0


def _legend(where: Any, entries: Sequence[Entry], columns: int, scale: float, **more: Any) -> Any:
    """A legend of axes or of a figure."""
    legend = where.legend(
        [line for line, _ in entries],
        [plain(text) for _, text in entries],
        ncols=columns,
        fontsize=scale * HEAD_SIZE,
        title_fontsize=scale * HEAD_SIZE,
        **HEAD_LEGEND,
        **more,
    )
    for text in (*legend.get_texts(), legend.get_title()):
        text.set_parse_math(False)
    return legend


def _high(legend: Any) -> float:
    """Height of a legend, pt."""
    root = _page(legend)
    return float(legend.get_window_extent(root.canvas.get_renderer()).height) * 72.0 / float(root.dpi)


def _page(artist: Any) -> Any:
    """Figure that contains axes or a subfigure."""
    return artist.get_figure(root=True)


def _columns(entries: Sequence[Entry], where: Any, width: float) -> int:
    """Number of columns of a legend that fit a width, pixels."""
    root = _page(where)
    for count in range(min(len(entries), 4), 1, -1):
        legend = _legend(where, entries, count, 1.0)
        box = legend.get_window_extent(root.canvas.get_renderer())
        legend.remove()
        if box.width <= ROOMY * width:
            return count
    return 1


def _names(axes: Any, names: Sequence[tuple[float, str]]) -> float:
    """Write names above an axis, each in the lowest row where it meets no other; return the height of all rows, pt."""
    canvas, box = _page(axes).canvas.get_renderer(), axes.get_window_extent()
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
            fontsize=HEAD_SIZE,
            color=HEAD_COLOUR,
            parse_math=False,
        )
        half = wide * text.get_window_extent(canvas).width / 2
        centre = min(max(place, low + half), high - half)
        row = next((row for row, end in enumerate(ends) if centre - half > end), len(ends))
        ends[row : row + 1] = [centre + half + wide * HEAD_SIZE / 2]
        text.xy, text.xyann = (centre, 1.0), (0.0, 3.0 + 1.35 * HEAD_SIZE * row)
    return HEAD_GAP / 2 + 1.35 * HEAD_SIZE * len(ends) if ends else 0.0
