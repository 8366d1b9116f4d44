"""Drawings as plain data: lines, circles, arcs and texts on named layers, in metres; renderers write them."""

import itertools
import math
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from loomopt.base import units
from loomopt.picture.placing import STEP, Box, Floats

if TYPE_CHECKING:
    from loomopt.scenes.scene import Scene

Unit = Literal["mm", "in"]
"""What a workshop measures in."""


class Units(NamedTuple):
    """Units of a drawing's lengths, whose numbers stand without it, and of its other quantities."""

    length: Unit = "mm"
    mass: str = "kg"
    force: str = "N"
    stiffness: str = "N/m"

    @property
    def said(self) -> str:
        """What a legend says of lengths."""
        return "lengths in inches" if self.length == "in" else "lengths in mm"

    def size(self, metres: float, digits: int = 6) -> str:
        """Return a length as its number in the drawing's unit."""
        return f"{metres / units.factor(self.length) + 0.0:.{digits}g}"

    def within(self, metres: float) -> str:
        """Return a tolerance, m, with its unit: one digit, rounded up, so that it is promised and kept."""
        value = metres / units.factor(self.length)
        if not value:
            return f"0 {self.length}"
        digit = 10.0 ** math.floor(math.log10(value))
        up = math.ceil(round(value / digit, 6)) * digit
        return f"{up:.{max(0, -math.floor(math.log10(up)))}f} {self.length}"


METRIC = Units()


def drawn_units(scene: "Scene") -> Units:
    """Return the units a scene is drawn in: inches where its lengths are in whole inches, as feet are; else mm."""
    inches = units.parse_unit(scene.shown_in("length")).factor / units.parse_unit("in").factor
    kinds = {kind: scene.shown_in(kind) for kind in ("mass", "force", "stiffness")}
    return Units("in" if inches.denominator == 1 else "mm", **kinds)


class Point(NamedTuple):
    """x and y, m, y up."""

    x: float
    y: float

    def towards(self, angle: float, distance: float) -> "Point":
        """Return the point at a distance, m, in the direction of an angle, rad."""
        return Point(self.x + distance * math.cos(angle), self.y + distance * math.sin(angle))

    def part(self, other: "Point", share: float = 0.5) -> "Point":
        """Return the point that lies a share of the way to another."""
        return Point(self.x + share * (other.x - self.x), self.y + share * (other.y - self.y))


@dataclass(frozen=True)
class Layer:
    """How a layer looks: colour on white; aci: AutoCAD colour; width: of lines, mm where text is 3.5 mm high."""

    colour: str
    aci: int
    width: float
    dashed: bool = False


LAYERS: Mapping[str, Layer] = {
    "paths": Layer("#6b7280", 8, 0.18, dashed=True),
    "frame": Layer("#1f2937", 7, 0.35),
    "front dead centre": Layer("#c2410c", 30, 0.5),
    "hand-over": Layer("#7c3aed", 200, 0.35),
    "rear dead centre": Layer("#1d4ed8", 150, 0.35, dashed=True),
    "pitch curve": Layer("#0e7490", 132, 0.25),
    "profile": Layer("#1f2937", 7, 0.7),
    "far dwell": Layer("#7c3aed", 200, 0.35),
    "near dwell": Layer("#1d4ed8", 150, 0.35),
    "least cam force": Layer("#c2410c", 30, 0.35),
    "schematic": Layer("#475569", 8, 0.25),
    "masses": Layer("#9d174d", 220, 0.35),
    "joints": Layer("#1f2937", 7, 0.35),
    "leaders": Layer("#6b7280", 8, 0.13),
    "dimensions": Layer("#047857", 92, 0.18),
    "notes": Layer("#111827", 7, 0.25),
}
"""Layers from back to front."""

POSITIONS = tuple(LAYERS[name] for name in ("front dead centre", "rear dead centre", "hand-over", "pitch curve"))
"""Looks of a mechanism's positions whose names are no layers here, in turn."""

NOMINAL_HEIGHT = 3.5
"""Text height, mm, that the layers' widths and the dashes are meant for."""
DASH, GAP = 3.0, 2.0
"""Lengths in a dashed line, mm where text is 3.5 mm high."""
CAPITAL = 0.72
"""Height of capitals, which CAD calls text height, in font sizes."""
CHARACTER, CAPITAL_LETTER, WIDE = 0.88, 1.16, 1.45
"""Width to reserve for one character, in text heights; for a capital or a sign; for the widest."""


@dataclass(frozen=True)
class Line:
    """Straight strokes through points, m."""

    layer: str
    points: tuple[Point, ...]
    closed: bool = False


@dataclass(frozen=True)
class Circle:
    """A full circle; radius in m."""

    layer: str
    centre: Point
    radius: float


@dataclass(frozen=True)
class Arc:
    """A circular arc, counter-clockwise from begin to end, rad; radius in m."""

    layer: str
    centre: Point
    radius: float
    begin: float
    end: float


@dataclass(frozen=True)
class Text:
    """One level line of text; at: its centre or the middle of its left edge; size: in text heights."""

    layer: str
    at: Point
    text: str
    size: float = 1.0
    anchor: Literal["centre", "left"] = "centre"


Trace = Line | Circle | Arc
Primitive = Trace | Text


@dataclass(frozen=True)
class Drawing:
    """A mechanism at full scale in m; height: of its capitals, m, which line widths and dashes follow.

    legend: lines of (layer, text) below it. unit: in which its lengths are told, and which a workshop reads it in.
    """

    title: str
    height: float
    primitives: tuple[Primitive, ...]
    legend: tuple[tuple[str, str], ...] = ()
    unit: Unit = "mm"

    @property
    def layers(self) -> dict[str, Layer]:
        """The layers that are drawn on, from back to front; positions of other names lie behind the joints."""
        drawn = dict.fromkeys(primitive.layer for primitive in self.primitives)
        others = dict(zip((name for name in drawn if name not in LAYERS), itertools.cycle(POSITIONS), strict=False))
        front = list(LAYERS).index("joints")
        known = list(LAYERS.items())
        return {name: look for name, look in [*known[:front], *others.items(), *known[front:]] if name in drawn}


def plain(text: str) -> str:
    """Return text without control characters, which neither XML nor DXF can hold."""
    return "".join(character if character.isprintable() else " " for character in text)


def scaled(drawing: Drawing, size: float) -> Drawing:
    """Return a drawing with every length times a size, such as 1000 for one whose unit is 1 mm."""

    def of(point: Point) -> Point:
        return Point(size * point.x, size * point.y)

    def larger(primitive: Primitive) -> Primitive:
        match primitive:
            case Line(_, points):
                return replace(primitive, points=tuple(map(of, points)))
            case Circle(_, centre, radius) | Arc(_, centre, radius):
                return replace(primitive, centre=of(centre), radius=size * radius)
            case Text(_, at):
                return replace(primitive, at=of(at))

    return replace(drawing, height=size * drawing.height, primitives=tuple(map(larger, drawing.primitives)))


def text_box(text: Text, height: float) -> Box:
    """Return the room a text takes, by a generous estimate of its width; height: text height, in the same unit."""
    tall = height * text.size
    wide = tall * sum(map(_width, text.text))
    left = text.at.x - (wide / 2 if text.anchor == "centre" else 0.0)
    return Box(left, text.at.y - 0.75 * tall, left + wide, text.at.y + 0.75 * tall)


def _width(character: str) -> float:
    """Return the width to reserve for a character, in text heights."""
    if character in "mwMW@%…—" or unicodedata.east_asian_width(character) in "WF":
        return WIDE
    return CAPITAL_LETTER if character.isupper() or character in "=+−<>~" else CHARACTER


def extent(drawing: Drawing, margin: float = 2.0) -> Box:
    """Return what the drawing covers with a margin in text heights."""
    points = np.concatenate([marks(primitive, drawing.height) for primitive in drawing.primitives])
    (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
    room = margin * drawing.height
    return Box(float(left) - room, float(bottom) - room, float(right) + room, float(top) + room)


def marks(primitive: Primitive, height: float) -> Floats:
    """Return points along a primitive, no farther apart than STEP text heights, or two corners of a text, (n, 2)."""
    if isinstance(primitive, Text):
        box = text_box(primitive, height)
        return np.array([[box.left, box.bottom], [box.right, box.top]])
    if isinstance(primitive, Line):
        ends = np.array((*primitive.points, primitive.points[0]) if primitive.closed else primitive.points)
        way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ends, axis=0).T))])
        at = np.linspace(0.0, way[-1], 2 + int(way[-1] / (STEP * height)))
        return np.column_stack([np.interp(at, way, ends[:, 0]), np.interp(at, way, ends[:, 1])])
    begin, end = (primitive.begin, primitive.end) if isinstance(primitive, Arc) else (0.0, 2 * math.pi)
    angles = np.linspace(begin, end, 5 + int((end - begin) * primitive.radius / (STEP * height)))
    around = np.column_stack([np.cos(angles), np.sin(angles)])
    return np.asarray(primitive.centre) + primitive.radius * around
