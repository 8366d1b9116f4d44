"""What drawings of mechanisms share: labels that keep clear of strokes, arrows, fixed pivots, title and legend."""

import math
import textwrap
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from loomopt.picture import placing, shapes
from loomopt.picture.shapes import CHARACTER, Arc, Circle, Drawing, Line, Point, Primitive, Text, plain

POINTER = 6.0
"""How far a pointer reaches, in text heights."""


class Label(NamedTuple):
    """A text to be placed near a point, preferably on the side an angle points to, rad."""

    layer: str
    near: Point
    side: float
    text: str


def place(labels: Sequence[Label], strokes: Sequence[Primitive], height: float) -> list[Text]:
    """Return each label where it meets no earlier label and as few strokes as can be, close to its point."""
    sizes = [shapes.text_box(Text(label.layer, Point(0.0, 0.0), label.text), height) for label in labels]
    wishes = [
        placing.Wish(*label.near, label.side, size.right - size.left, size.top - size.bottom)
        for label, size in zip(labels, sizes, strict=True)
    ]
    boxes = placing.place(wishes, np.concatenate([shapes.marks(stroke, height) for stroke in strokes]), height)
    return [
        Text(label.layer, Point((box.left + box.right) / 2, (box.bottom + box.top) / 2), label.text)
        for label, box in zip(labels, boxes, strict=True)
    ]


def arrow(layer: str, tip: Point, angle: float, length: float) -> Line:
    """Return an open arrow head of a length, mm, that points in the direction of an angle, rad."""
    return Line(layer, (tip.towards(angle + 2.8, length), tip, tip.towards(angle - 2.8, length)))


def pointer(near: Point, angle: float, h: float) -> list[Primitive]:
    """Return an arrow that points away from a point in the direction of an angle, rad; h: text height, mm."""
    tip = near.towards(angle, POINTER * h)
    return [Line("notes", (near.towards(angle, 1.5 * h), tip)), arrow("notes", tip, angle, 1.2 * h)]


def angle_between(
    centre: Point, radius: float, begin: float, end: float, h: float, both: bool = False
) -> list[Primitive]:
    """Return an angle's arc from begin to end, rad, with an arrow head at its end, or at both ends."""
    turn = math.copysign(math.pi / 2, end - begin)
    found: list[Primitive] = [Arc("dimensions", centre, radius, min(begin, end), max(begin, end))]
    heads = [(end, turn), *([(begin, -turn)] if both else [])]
    return found + [arrow("dimensions", centre.towards(at, radius), at + side, 0.8 * h) for at, side in heads]


def fixed_pivot(pivot: Point, h: float) -> list[Primitive]:
    """Return a pivot on hatched ground; h: text height, mm."""
    left, right = Point(pivot.x - h, pivot.y - 1.6 * h), Point(pivot.x + h, pivot.y - 1.6 * h)
    ground = (Point(left.x - 0.6 * h, left.y), Point(right.x + 0.6 * h, right.y))
    starts = [Point(left.x + step * 0.6 * h, left.y) for step in range(5)]
    return [
        Circle("frame", pivot, 0.45 * h),
        Line("frame", (left, pivot, right)),
        Line("frame", ground),
        *(Line("frame", (start, Point(start.x - 0.6 * h, start.y - 0.6 * h))) for start in starts),
    ]


def captioned(body: Drawing, legend: Sequence[tuple[str, str]]) -> Drawing:
    """Return a drawing with its title above and a legend, lines of (layer, text), below."""
    box, h = shapes.extent(body), body.height
    columns = max(20, int((box.right - box.left) / (1.4 * CHARACTER * h)))
    title = " ".join(plain(body.title).split())
    lines = textwrap.wrap(title, columns, max_lines=3, placeholder=" …", break_on_hyphens=False)
    above = [
        Text("notes", Point(box.left + 2 * h, box.top + (len(lines) - row) * 2.4 * h), line, 1.4, "left")
        for row, line in enumerate(lines)
    ]
    below = [
        Text(layer, Point(box.left + 2 * h, box.bottom - 1.9 * h * row), text, 1.0, "left")
        for row, (layer, text) in enumerate(legend)
    ]
    return Drawing(body.title, h, (*body.primitives, *above, *below))
