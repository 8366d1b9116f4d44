"""Drawings as plain data: lines, circles, arcs and texts on named layers, in metres; renderers write them."""

import itertools
import math
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base import units

Floats = NDArray[np.float64]

STEP = 0.2
"""Distance of points along a stroke, in text heights."""
CLEAR = 0.6 * STEP
"""Least distance of a label from them, in text heights: more than half of STEP, so that nothing slips between two."""
RINGS = (0.5, 1.0, 1.6, 2.4, 3.4, 4.6, 6.0, 8.0)
"""Distances of a label from its point that are tried first, in text heights; then ever more."""
FARTHER = 1.3
"""Factor from each further distance to the next."""
OUTSIDE = 100.0
"""Distance, in text heights, from which on a leader may run over a label: that point is walled in by labels."""
TURNS = (0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6, 7, -7, 8)
"""Eighths of a half turn from the side that is wished for, in the order they are tried in."""
BEHIND = 3.0
"""Cost of a label, in text heights, for a stroke between it and its point."""


class Box(NamedTuple):
    """An upright rectangle."""

    left: float
    bottom: float
    right: float
    top: float

    def nearest(self, x: float, y: float) -> tuple[float, float]:
        """Point of the box nearest to another point."""
        return min(max(x, self.left), self.right), min(max(y, self.bottom), self.top)


class LabelWish(NamedTuple):
    """Request for a label box near a point: the first of `near` is preferred; side: preferred direction, rad."""

    near: Sequence[tuple[float, float]]
    side: float
    width: float
    height: float


class LabelSpot(NamedTuple):
    """Position of a label box near the point (x, y)."""

    box: Box
    x: float
    y: float


def place(wishes: Iterable[LabelWish], strokes: Floats, unit: float, leader: float = math.inf) -> list[LabelSpot]:
    """Positions of labels in the order of the requests; strokes: (n, 2) points of the drawing; unit: text height.

    No box overlaps a stroke or another box. leader: distance of a box from its point, in text heights, above which a
    straight line joins both; this line overlaps no box either.
    """
    taken: list[LabelSpot] = []
    for wish in wishes:
        spot = _label_spot(wish, strokes, taken, unit, leader)
        taken.append(spot)
        if _gap(spot) > leader * unit:
            strokes = np.concatenate([strokes, _leader_points(spot, unit)])
    return taken


def _label_spot(wish: LabelWish, strokes: Floats, taken: Sequence[LabelSpot], unit: float, leader: float) -> LabelSpot:
    """Free position of a label with the least cost, in text heights, of distance, direction and crossed strokes."""
    best, least = None, math.inf
    for ring in itertools.chain(RINGS, (RINGS[-1] * FARTHER**k for k in itertools.count(1))):
        if best and ring >= least:
            return best
        for which, near in enumerate(wish.near):
            spots = [_candidate(wish, near, ring * unit, wish.side + turn * math.pi / 8) for turn in TURNS]
            free = _free(np.array([spot.box for spot in spots]), strokes, taken, CLEAR * unit)
            for turn, spot in itertools.compress(zip(TURNS, spots, strict=True), free):
                cost = ring + (abs(turn) + which) / 3
                way = _leader_points(spot, unit)
                has_leader = leader * unit < _gap(spot) < OUTSIDE * unit
                if cost < least and not (has_leader and _meets(way, taken, unit)):
                    cost += BEHIND if _crosses(way, strokes, unit) else 0.0
                    best, least = (spot, cost) if cost < least else (best, least)
    raise AssertionError("rings go on without end")


def _candidate(wish: LabelWish, near: tuple[float, float], gap: float, side: float) -> LabelSpot:
    """Label box at a gap from a point in the direction of an angle, rad."""
    across, up = math.cos(side), math.sin(side)
    half_width, half_height = wish.width / 2, wish.height / 2
    reach = gap + min(half_width / max(abs(across), 1e-9), half_height / max(abs(up), 1e-9))
    x, y = near[0] + reach * across, near[1] + reach * up
    return LabelSpot(Box(x - half_width, y - half_height, x + half_width, y + half_height), *near)


def _free(boxes: Floats, strokes: Floats, taken: Sequence[LabelSpot], room: float) -> NDArray[np.bool_]:
    """Mask of the boxes, (n, 4), that are farther than `room` from all strokes and occupied boxes."""
    left, bottom, right, top = (boxes + np.array([-room, -room, room, room])).T[:, :, None]
    x, y = strokes[_within(strokes, left.min(), bottom.min(), right.max(), top.max())].T
    hit = np.any((x > left) & (x < right) & (y > bottom) & (y < top), axis=1)
    for other in (spot.box for spot in taken):
        across = (left < other.right) & (right > other.left)
        hit |= (across & (bottom < other.top) & (top > other.bottom))[:, 0]
    return np.asarray(~hit)


def _within(points: Floats, left: float, bottom: float, right: float, top: float) -> NDArray[np.bool_]:
    """Mask of the points, (n, 2), that lie between four sides."""
    x, y = points.T
    return np.asarray((x > left) & (x < right) & (y > bottom) & (y < top))


def _gap(spot: LabelSpot) -> float:
    """Distance of a label box from its point."""
    return math.dist(spot.box.nearest(spot.x, spot.y), (spot.x, spot.y))


def _leader_points(spot: LabelSpot, unit: float) -> Floats:
    """Points of the leader from a label's point to its box, (n, 2)."""
    end = spot.box.nearest(spot.x, spot.y)
    return np.linspace((spot.x, spot.y), end, 2 + int(_gap(spot) / (STEP * unit)))


def _meets(way: Floats, taken: Sequence[LabelSpot], unit: float) -> bool:
    """Whether a leader comes too near to an occupied box."""
    r = CLEAR * unit
    boxes = (spot.box for spot in taken)
    return any(np.any(_within(way, box.left - r, box.bottom - r, box.right + r, box.top + r)) for box in boxes)


def _crosses(way: Floats, strokes: Floats, unit: float) -> bool:
    """Whether a stroke crosses the leader from a point to its box, strokes at the point excepted."""
    inner = way[np.hypot(*(way - way[0]).T) > 0.8 * unit]
    if not len(inner):
        return False
    low, high = inner.min(axis=0) - STEP * unit, inner.max(axis=0) + STEP * unit
    near = strokes[_within(strokes, *low, *high)]
    apart = near[:, None] - inner
    return bool(np.any(np.hypot(apart[..., 0], apart[..., 1]) < 0.7 * STEP * unit))


if TYPE_CHECKING:
    from loomopt.scenes.scene import Scene

Unit = Literal["mm", "in"]
"""Length units of a workshop."""


class Units(NamedTuple):
    """Units of a drawing: lengths are written without their unit, other quantities with it."""

    length: Unit = "mm"
    mass: str = "kg"
    force: str = "N"
    stiffness: str = "N/m"

    @property
    def summary(self) -> str:
        """Text of a legend on lengths."""
        return "lengths in inches" if self.length == "in" else "lengths in mm"

    def size(self, metres: float, digits: int = 6) -> str:
        """Number of a length in the unit of the drawing."""
        return f"{metres / units.factor(self.length) + 0.0:.{digits}g}"

    def within(self, metres: float) -> str:
        """Text of a tolerance, m, with its unit: one digit, rounded up."""
        value = metres / units.factor(self.length)
        if not value:
            return f"0 {self.length}"
        digit = 10.0 ** math.floor(math.log10(value))
        up = math.ceil(round(value / digit, 6)) * digit
        return f"{up:.{max(0, -math.floor(math.log10(up)))}f} {self.length}"


METRIC = Units()


def drawn_units(scene: "Scene") -> Units:
    """Units of a scene's drawings: inches if its lengths are in inches or feet, else mm."""
    inches = units.parse_unit(scene.shown_in("length")).factor / units.parse_unit("in").factor
    kinds = {kind: scene.shown_in(kind) for kind in ("mass", "force", "stiffness")}
    return Units("in" if inches.denominator == 1 else "mm", **kinds)


class Point(NamedTuple):
    """x and y, m, y up."""

    x: float
    y: float

    def towards(self, angle: float, distance: float) -> "Point":
        """Point at a distance, m, in the direction of an angle, rad."""
        return Point(self.x + distance * math.cos(angle), self.y + distance * math.sin(angle))

    def part(self, other: "Point", share: float = 0.5) -> "Point":
        """Point at a share of the way to another point."""
        return Point(self.x + share * (other.x - self.x), self.y + share * (other.y - self.y))


@dataclass(frozen=True)
class Layer:
    """Style of a layer: colour on white; aci: AutoCAD colour; width: line width, mm, for text of 3.5 mm height."""

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
    "forces": Layer("#b91c1c", 10, 0.35),
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
    """Strokes through points, m; bulges: tan(angle/4) of each arc, positive to the left, empty for straight lines."""

    layer: str
    points: tuple[Point, ...]
    closed: bool = False
    bulges: tuple[float, ...] = ()


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


class Measure(NamedTuple):
    """Dimension: a length between two points, m, and its name; band: lower and upper deviation, m, 0 by default."""

    name: str
    first: Point
    second: Point
    band: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Drawing:
    """Drawing of a mechanism at full scale in m; height: text height, m, which also scales line widths and dashes.

    legend: lines of (layer, text) below the drawing. unit: unit of its lengths. measures: dimensions, for formats that
    have them.
    """

    title: str
    height: float
    primitives: tuple[Primitive, ...]
    legend: tuple[tuple[str, str], ...] = ()
    unit: Unit = "mm"
    measures: tuple[Measure, ...] = ()

    @property
    def layers(self) -> dict[str, Layer]:
        """Layers of the drawing from back to front; positions with other names are behind the joints."""
        drawn = dict.fromkeys(primitive.layer for primitive in self.primitives)
        others = dict(zip((name for name in drawn if name not in LAYERS), itertools.cycle(POSITIONS), strict=False))
        front = list(LAYERS).index("joints")
        known = list(LAYERS.items())
        return {name: look for name, look in [*known[:front], *others.items(), *known[front:]] if name in drawn}


def plain(text: str) -> str:
    """Text without control characters, which neither XML nor DXF can hold."""
    return "".join(character if character.isprintable() else " " for character in text)


def scale_drawing(drawing: Drawing, size: float) -> Drawing:
    """Drawing with every length multiplied by a size, such as 1000 for the unit mm."""

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

    measures = tuple(
        Measure(name, of(first), of(second), (size * band[0], size * band[1]))
        for name, first, second, band in drawing.measures
    )
    primitives = tuple(map(larger, drawing.primitives))
    return replace(drawing, height=size * drawing.height, primitives=primitives, measures=measures)


def text_box(text: Text, height: float) -> Box:
    """Box of a text, by a generous estimate of its width; height: text height, in the same unit."""
    tall = height * text.size
    wide = tall * sum(map(_width, text.text))
    left = text.at.x - (wide / 2 if text.anchor == "centre" else 0.0)
    return Box(left, text.at.y - 0.75 * tall, left + wide, text.at.y + 0.75 * tall)


def _width(character: str) -> float:
    """Width to reserve for a character, in text heights."""
    if character in "mwMW@%…—" or unicodedata.east_asian_width(character) in "WF":
        return WIDE
    return CAPITAL_LETTER if character.isupper() or character in "=+−<>~" else CHARACTER


def extent(drawing: Drawing, margin: float = 2.0) -> Box:
    """Box of the drawing with a margin in text heights."""
    points = np.concatenate([marks(primitive, drawing.height) for primitive in drawing.primitives])
    (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
    room = margin * drawing.height
    return Box(float(left) - room, float(bottom) - room, float(right) + room, float(top) + room)


def marks(primitive: Primitive, height: float) -> Floats:
    """Points along a primitive, at most STEP text heights apart, or two corners of a text, (n, 2)."""
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
