"""What drawings of mechanisms share: labels that keep clear of strokes, title and legend."""

import math
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from loomopt.picture import placing, shapes
from loomopt.picture.shapes import CHARACTER, Drawing, Line, Point, Primitive, Text, plain

LEADER = 2.0
"""Text heights between a label and its point from which on a thin line joins the two."""


class Label(NamedTuple):
    """A text to be placed near a point, preferably on the side an angle points to, rad; also: other points that do."""

    layer: str
    near: Point
    side: float
    text: str
    also: tuple[Point, ...] = ()


def along(layer: str, one: Point, other: Point, side: float, text: str) -> Label:
    """Return the label of a link between two joints: beside its middle, else nearer to an end."""
    return Label(
        layer, one.part(other), side, text, tuple(one.part(other, share) for share in (0.62, 0.38, 0.75, 0.25))
    )


def around(layer: str, centre: Point, radius: float, begin: float, end: float, text: str) -> Label:
    """Return the label of an arc from begin to end, rad: outside its middle, else nearer to an end."""
    first, *also = (centre.towards(begin + share * (end - begin), radius) for share in (0.5, 0.7, 0.3, 0.9, 0.1))
    return Label(layer, first, (begin + end) / 2, text, tuple(also))


def place(labels: Sequence[Label], strokes: Sequence[Primitive], height: float) -> list[Text | Line]:
    """Return each label where it meets no stroke and no earlier label, close to its point; far ones with a leader."""
    sizes = [shapes.text_box(Text(label.layer, Point(0.0, 0.0), label.text), height) for label in labels]
    wishes = [
        placing.Wish((label.near, *label.also), label.side, size.right - size.left, size.top - size.bottom)
        for label, size in zip(labels, sizes, strict=True)
    ]
    drawn = np.concatenate([shapes.marks(stroke, height) for stroke in strokes])
    spots = placing.place(wishes, drawn, height, LEADER)
    return [part for label, spot in zip(labels, spots, strict=True) for part in _written(label, spot, height)]


def _written(label: Label, spot: placing.Spot, h: float) -> list[Text | Line]:
    """Return a label in its spot, and the leader from its point where it stands far off; h: text height, m."""
    box, near = spot.box, Point(spot.x, spot.y)
    text = Text(label.layer, Point((box.left + box.right) / 2, (box.bottom + box.top) / 2), label.text)
    end = Point(*box.nearest(*near))
    far = math.dist(near, end)
    leader = Line("leaders", (near.part(end, 0.5 * h / far), near.part(end, 1 - 0.1 * h / far))) if far else None
    return [text, leader] if leader and far > LEADER * h else [text]


def sheet(body: Drawing) -> Drawing:
    """Return a drawing with its title above and its legend below as texts: what a renderer draws."""
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
        for row, (layer, text) in enumerate(body.legend)
    ]
    return replace(body, primitives=(*body.primitives, *above, *below), legend=())
