"""Drawings of mechanisms: joints and links, signs, labels clear of strokes, title and legend."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from loomopt.base.units import factor
from loomopt.picture import shapes
from loomopt.picture.shapes import (
    CHARACTER,
    METRIC,
    Arc,
    Circle,
    Drawing,
    Line,
    Point,
    Primitive,
    Text,
    Trace,
    Units,
    plain,
)

LEADER = 2.0
"""Text heights between a label and its point from which on a thin line joins the two."""


class Label(NamedTuple):
    """Text to be placed near a point, preferably in the direction of an angle, rad; also: further possible points."""

    layer: str
    near: Point
    side: float
    text: str
    also: tuple[Point, ...] = ()


def along(layer: str, first: Point, second: Point, side: float, text: str) -> Label:
    """Label of a link between two joints: at its middle, or else nearer to an end."""
    return Label(
        layer, first.part(second), side, text, tuple(first.part(second, share) for share in (0.62, 0.38, 0.75, 0.25))
    )


def around(layer: str, centre: Point, radius: float, begin: float, end: float, text: str) -> Label:
    """Label of an arc from begin to end, rad: outside its middle, else nearer to an end."""
    first, *also = (centre.towards(begin + share * (end - begin), radius) for share in (0.5, 0.7, 0.3, 0.9, 0.1))
    return Label(layer, first, (begin + end) / 2, text, tuple(also))


def place(labels: Sequence[Label], strokes: Sequence[Primitive], height: float) -> list[Text | Line]:
    """Labels placed close to their points, clear of strokes and earlier labels; far ones with a leader."""
    sizes = [shapes.text_box(Text(label.layer, Point(0.0, 0.0), label.text), height) for label in labels]
    wishes = [
        shapes.LabelWish((label.near, *label.also), label.side, size.right - size.left, size.top - size.bottom)
        for label, size in zip(labels, sizes, strict=True)
    ]
    drawn = np.concatenate([np.empty((0, 2)), *(shapes.marks(stroke, height) for stroke in strokes)])
    spots = shapes.place(wishes, drawn, height, LEADER)
    return [part for label, spot in zip(labels, spots, strict=True) for part in _written(label, spot, height)]


def _written(label: Label, spot: shapes.LabelSpot, h: float) -> list[Text | Line]:
    """Placed label, with a leader from its point if it is far away; h: text height, m."""
    box, near = spot.box, Point(spot.x, spot.y)
    text = Text(label.layer, Point((box.left + box.right) / 2, (box.bottom + box.top) / 2), label.text)
    end = Point(*box.nearest(*near))
    far = math.dist(near, end)
    leader = Line("leaders", (near.part(end, 0.5 * h / far), near.part(end, 1 - 0.1 * h / far))) if far else None
    return [text, leader] if leader and far > LEADER * h else [text]


def sheet(body: Drawing) -> Drawing:
    """Drawing for a renderer, with the title above and the legend below as texts."""
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


POINTER = 6.0
"""Length of a pointer, in text heights."""
MASS = 0.7
"""Radius of the sign of a centre of mass, in text heights."""
HEAD = 0.8
"""Length of a dimension's arrow head, in text heights."""
COILS = 8
"""Coils of a spring's sign."""


def arrow(layer: str, tip: Point, angle: float, length: float) -> Line:
    """An open arrow head of a length, m, that points in the direction of an angle, rad."""
    return Line(layer, (tip.towards(angle + 2.8, length), tip, tip.towards(angle - 2.8, length)))


def pointer(near: Point, angle: float, h: float) -> list[Primitive]:
    """An arrow that points away from a point in the direction of an angle, rad; h: text height, m."""
    tip = near.towards(angle, POINTER * h)
    return [Line("notes", (near.towards(angle, 1.5 * h), tip)), arrow("notes", tip, angle, 1.2 * h)]


def angle_arc(centre: Point, radius: float, begin: float, end: float, h: float, both: bool = False) -> list[Primitive]:
    """An angle's arc from begin to end, rad, with an arrow head at its end, or at both ends."""
    turn = math.copysign(math.pi / 2, end - begin)
    primitives: list[Primitive] = [Arc("dimensions", centre, radius, min(begin, end), max(begin, end))]
    heads = [(end, turn), *([(begin, -turn)] if both else [])]
    return primitives + [arrow("dimensions", centre.towards(at, radius), at + side, HEAD * h) for at, side in heads]


def fixed_pivot(pivot: Point, h: float) -> list[Primitive]:
    """A pivot on hatched ground; h: text height, m."""
    left, right = Point(pivot.x - h, pivot.y - 1.6 * h), Point(pivot.x + h, pivot.y - 1.6 * h)
    return [
        Circle("frame", pivot, 0.45 * h),
        Line("frame", (left, pivot, right)),
        *ground("frame", left.part(right), -math.pi / 2, h),
    ]


def ground(layer: str, middle: Point, side: float, h: float) -> list[Line]:
    """A straight piece of hatched ground; side: direction, rad, in which the hatched side lies."""
    along = side - math.pi / 2
    starts = [middle.towards(along, (1.0 - 0.6 * step) * h) for step in range(5)]
    return [
        Line(layer, (middle.towards(along, -1.6 * h), middle.towards(along, 1.6 * h))),
        *(Line(layer, (at, at.towards(side, 0.6 * h).towards(along, 0.6 * h))) for at in starts),
    ]


def mass(centre: Point, h: float) -> list[Primitive]:
    """Sign of a centre of mass: a circle with a cross; h: text height, m."""
    r = MASS * h
    return [
        Circle("masses", centre, r),
        Line("masses", (Point(centre.x - r, centre.y), Point(centre.x + r, centre.y))),
        Line("masses", (Point(centre.x, centre.y - r), Point(centre.x, centre.y + r))),
    ]


def spring(layer: str, first: Point, second: Point, width: float) -> Line:
    """A tension spring between two points as a zigzag of a width, m, with a straight hook at either end."""
    along = math.atan2(second.y - first.y, second.x - first.x)
    hook, turn = 0.1, (1.0 - 0.2) / (2 * COILS)
    zigzag = [
        first.part(second, hook + turn * (k + 0.5)).towards(along + math.copysign(math.pi / 2, (-1) ** k), width / 2)
        for k in range(2 * COILS)
    ]
    return Line(layer, (first, first.part(second, hook), *zigzag, first.part(second, 1 - hook), second))


def dimension(first: Point, second: Point, h: float) -> list[Primitive]:
    """A straight dimension line with an arrow head at either end; nothing where the two points are one."""
    length, along = math.dist(first, second), math.atan2(second.y - first.y, second.x - first.x)
    if not length:
        return []
    head = min(HEAD * h, length / 3)
    heads = [arrow("dimensions", second, along, head), arrow("dimensions", first, along + math.pi, head)]
    return [Line("dimensions", (first, second)), *heads]


JOINT = 0.35
"""Radius of a joint's circle, in text heights."""


class Mass(NamedTuple):
    """A centre of mass: mass, kg; radius: its distance from the joint it turns about, m."""

    mass: float
    radius: float


@dataclass(frozen=True)
class Skeleton:
    """Joints and links; each event of the motion is drawn on the layer of its name.

    pivots: fixed joints; joints: event → moving joints. links: pairs of joints, the frame between two pivots.
    guides: joint and radius, m, of a circle about it, which moves with it. traces: curves that stand still.
    sizes: radius of a joint's own circle, in text heights, where it is another; 0 for none.
    masses: which of the joints are centres of mass.
    """

    pivots: Mapping[str, Point]
    joints: Mapping[str, Mapping[str, Point]]
    links: tuple[tuple[str, str], ...]
    guides: tuple[tuple[str, float], ...] = ()
    traces: tuple[Trace, ...] = ()
    sizes: Mapping[str, float] = field(default_factory=dict)
    masses: Mapping[str, Mass] = field(default_factory=dict)

    @property
    def primes(self) -> dict[str, str]:
        """Primes of the names of moving joints, by event."""
        return {event: "'" * k for k, event in enumerate(self.joints)}

    def at(self, event: str) -> dict[str, Point]:
        """Positions of all joints at an event."""
        return {**self.pivots, **self.joints[event]}

    def strokes(self, h: float) -> list[Primitive]:
        """Strokes that every drawing shows; h: text height, m."""
        frame = [link for link in self.links if set(link) <= set(self.pivots)]
        primitives: list[Primitive] = [
            Line("paths", (self.pivots[first], self.pivots[second])) for first, second in frame
        ]
        for pivot in self.pivots.values():
            primitives += fixed_pivot(pivot, h)
        primitives += [
            Circle("paths", self.pivots[name], radius) for name, radius in self.guides if name in self.pivots
        ]
        primitives += self.traces
        for event, joints in self.joints.items():
            at = self.at(event)
            primitives += [
                Line(event, (at[first], at[second])) for first, second in self.links if (first, second) not in frame
            ]
            primitives += [Circle(event, joints[name], radius) for name, radius in self.guides if name in joints]
            sizes = {name: self.sizes.get(name, JOINT) for name in joints if name not in self.masses}
            primitives += [Circle("joints", joints[name], size * h) for name, size in sizes.items() if size]
            primitives += [part for name in joints if name in self.masses for part in mass(joints[name], h)]
        return primitives

    def csv(self, units: Units = METRIC) -> str:
        """Joints and centres of mass as CSV, the latter with mass and radius. Digits round-trip."""
        length, mass = units.length, units.mass
        heading = f"joint,position,x [{length}],y [{length}]"
        lines = [f"{heading},mass [{mass}],radius [{length}]" if self.masses else heading]
        placed = [("frame", "", self.pivots), *((e, self.primes[e], joints) for e, joints in self.joints.items())]
        for event, prime, joints in placed:
            for name, point in joints.items():
                numbers = [axis / factor(length) for axis in point]
                if name in self.masses:
                    joint_mass = self.masses[name]
                    numbers += [joint_mass.mass / factor(mass), joint_mass.radius / factor(length)]
                blank = "" if name in self.masses or not self.masses else ",,"
                lines.append(f"{name}{prime},{event},{','.join(map(repr, numbers))}{blank}")
        return "".join(f"{line}\n" for line in lines)
