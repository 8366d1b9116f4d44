"""Axes in rows and columns on a page: each as high as it is asked to be, as wide as what stands beside it lets it."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

EDGE, TITLE, FOOT = 0.08, 0.3, 0.25
"""Inches: around what stands on a page, of its title, of the name below its axes."""
TICKS, ROW = 0.22, 0.1
"""Inches below axes with numbers, and below axes without."""
SPACE = 0.3
"""Inches between columns."""


class Cell(NamedTuple):
    """Axes on a page: row, column (of `wide` ones every column), height, inches; numbered: whether numbers stand below.

    first: whether they are the first of their column.
    """

    axes: Any
    row: int
    column: int
    high: float
    wide: bool
    numbered: bool
    first: bool


def widen(page: Any, cells: Sequence[Cell]) -> None:
    """Give axes their height, and the width that numbers beside them leave."""
    width, height = page.get_size_inches()
    count = max(cell.column for cell in cells) + 1
    canvas = page.canvas.get_renderer()
    left, right = [0.0] * count, [0.0] * count
    for cell in cells:
        cell.axes.tick_params(labelbottom=cell.numbered)
        cell.axes.set_position((0.2, 0.1, 0.5 / count, cell.high / height))
    for cell in cells:
        inner, outer = cell.axes.bbox, cell.axes.get_tightbbox(canvas)
        last = count - 1 if cell.wide else cell.column
        left[cell.column] = max(left[cell.column], (inner.x0 - outer.x0) / page.dpi)
        right[last] = max(right[last], (outer.x1 - inner.x1) / page.dpi)
    free = (width - 2 * EDGE - sum(left) - sum(right) - SPACE * (count - 1)) / count
    begins = [EDGE + sum(left[: k + 1]) + sum(right[:k]) + k * (free + SPACE) for k in range(count)]
    for cell in cells:
        end = begins[-1] + free if cell.wide else begins[cell.column] + free
        begin = begins[cell.column]
        cell.axes.set_position((begin / width, 0.1, (end - begin) / width, cell.high / height))


def stack(page: Any, cells: Sequence[Cell], heads: Mapping[Any, float]) -> None:
    """Stand axes one below the other, and make the page as high; heads: of what stands above each, pt."""
    rows: dict[int, tuple[float, float, float]] = {}
    for cell in cells:
        above, high, below = rows.get(cell.row, (0.0, 0.0, 0.0))
        room = TICKS if cell.numbered else ROW
        rows[cell.row] = max(above, heads[cell.axes] / 72), max(high, cell.high), max(below, room)
    height = EDGE + TITLE + sum(sum(row) for row in rows.values()) + FOOT + EDGE
    width, top, bottoms = page.get_figwidth(), height - EDGE - TITLE, dict[int, float]()
    for row in sorted(rows):
        above, high, below = rows[row]
        bottoms[row] = top - above - high
        top = bottoms[row] - below
    page.set_size_inches(width, height)
    for cell in cells:
        box = cell.axes.get_position()
        cell.axes.set_position((box.x0, bottoms[cell.row] / height, box.width, cell.high / height))
