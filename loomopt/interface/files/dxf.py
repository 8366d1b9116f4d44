"""Drawings as DXF for the workshop: R2010 or R12, mm or inches, full scale, a coloured layer for each of the drawing's.

Lengths between joints are dimensions too, which follow their points, on a layer of their own."""

import importlib
import logging
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from loomopt.base.units import factor
from loomopt.maths.arcs import reach
from loomopt.picture.drawing import sheet
from loomopt.picture.shapes import (
    DASH,
    GAP,
    NOMINAL_HEIGHT,
    Arc,
    Circle,
    Drawing,
    Line,
    Primitive,
    Text,
    extent,
    marks,
    plain,
    scale_drawing,
)

MEASURES, MEASURED, DECIMALS, AWAY = "measures", 94, 4, 6.0
"""Layer of dimensions with its AutoCAD colour, their decimals, and how far they stand off, in text heights."""
_TEXT_STYLE, _DASHES = "LABELS", "DASHES"


R2010, R12 = "r2010", "r12"
VERSIONS = {R2010: "R2010", R12: "R12"}
"""Versions of the format, by the words of the option."""


def write(drawing: Drawing, path: Path, version: str = R2010) -> None:
    """Write the drawing as a DXF file of a version (`VERSIONS`); the same drawing gives the same bytes."""
    with _fixed_stamps():
        _document(drawing, version).saveas(str(path))


@contextmanager
def _fixed_stamps() -> Iterator[None]:
    """Have ezdxf write constant dates and identifiers, and log no warning that R12 has no unit."""
    ezdxf: Any = importlib.import_module("ezdxf")

    log = logging.getLogger("ezdxf")
    before, level = ezdxf.options.write_fixed_meta_data_for_testing, log.level
    ezdxf.options.write_fixed_meta_data_for_testing = True
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before
        log.setLevel(level)


def _document(drawing: Drawing, version: str) -> Any:
    ezdxf: Any = importlib.import_module("ezdxf")

    document = ezdxf.new(VERSIONS[version])
    inches, drawing = drawing.unit == "in", scale_drawing(sheet(drawing), 1 / factor(drawing.unit))
    # R12 has no word for its unit.
    document.units = 0 if version == R12 else ezdxf.units.IN if inches else ezdxf.units.MM
    document.header["$MEASUREMENT"] = 0 if inches else 1
    document.header["$LTSCALE"] = drawing.height / NOMINAL_HEIGHT
    document.linetypes.add(_DASHES, [DASH + GAP, DASH, -GAP], description="__ __ __ __")
    document.styles.add(_TEXT_STYLE, font="arial.ttf")
    for name, layer in drawing.layers.items():
        line_type = _DASHES if layer.dashed else "CONTINUOUS"
        document.layers.add(name, color=layer.aci, linetype=line_type, lineweight=round(100 * layer.width))
    box = extent(drawing)
    centre = ((box.left + box.right) / 2, (box.bottom + box.top) / 2)
    document.set_modelspace_vport(height=1.1 * (box.top - box.bottom), center=centre)
    space = document.modelspace()
    for primitive in drawing.primitives:
        _append(space, primitive, drawing.height, version)
    corners = [corner for primitive in drawing.primitives for corner in _reach(primitive, drawing.height)]
    if drawing.measures:
        corners += _add_dimensions(document, space, drawing)
    least, most = (tuple(pick(axis) for axis in zip(*corners, strict=True)) for pick in (min, max))
    space.reset_extents((*least, 0.0), (*most, 0.0))
    # ezdxf copies the extents of the space to the header, but not a corner at the origin.
    document.header["$EXTMIN"], document.header["$EXTMAX"] = (*least, 0.0), (*most, 0.0)
    for name in sorted(document.entitydb.dxf_types_in_use()):
        document.classes.add_class(name)  # else ezdxf adds them in the order of a set
    return document


def _add_dimensions(document: Any, space: Any, drawing: Drawing) -> list[tuple[float, float]]:
    """Add each measure as an aligned dimension that follows its points, on a layer of their own.

    Returns the ends of their lines.
    """
    reached: list[tuple[float, float]] = []
    document.layers.add(MEASURES, color=MEASURED, lineweight=18)
    h = drawing.height
    sizes = {"dimtxt": h, "dimasz": 0.8 * h, "dimexo": 0.5 * h, "dimexe": 0.5 * h, "dimgap": 0.4 * h}
    style = sizes | {"dimtxsty": _TEXT_STYLE, "dimdec": DECIMALS, "dimzin": 8, "dimtad": 1, "dimlunit": 2}
    style |= {"dimscale": 1.0, "dimclrd": MEASURED, "dimclre": MEASURED, "dimclrt": MEASURED}
    ends = [point for measure in drawing.measures for point in (measure.first, measure.second)]
    middle = [sum(axis) / len(ends) for axis in zip(*ends, strict=True)]
    for name, *both, band in drawing.measures:
        first, second = sorted(both)  # from left to right, so that no text is upside down
        across = (second.x - first.x) * (middle[1] - first.y) - (second.y - first.y) * (middle[0] - first.x)
        made = space.add_aligned_dim(
            first,
            second,
            distance=-AWAY * h if across > 0 else AWAY * h,
            text=f"{name} = <>{_band_text(band)}",
            dimstyle="STANDARD",
            override=style,
            dxfattribs={"layer": MEASURES},
        )
        made.render()
        lines = [entity for entity in made.dimension.get_geometry_block() if entity.dxftype() == "LINE"]
        reached += [(end.x, end.y) for line in lines for end in (line.dxf.start, line.dxf.end)]
    return reached


def _band_text(band: tuple[float, float]) -> str:
    """Tolerance of a dimension as text: " %%p0.05", " +0 -0.05", "" without any."""
    low, high = band
    if low == -high:
        return f" %%p{high:.{DECIMALS}g}" if high else ""
    return " " + " ".join("0" if not end else f"{end:+.{DECIMALS}g}" for end in (high, low))


def _reach(primitive: Primitive, text_height: float) -> list[tuple[float, float]]:
    """Points that bound a primitive along both axes."""
    match primitive:
        case Line(_, points, closed, bulges):
            ends = [complex(*point) for point in points]
            bent = zip(ends, [*ends[1:], ends[0]], bulges or (0.0,) * len(ends), strict=True)
            stretches = list(bent) if closed else list(bent)[:-1]
            return [(at.real, at.imag) for a, b, bulge in stretches for at in reach(a, b, bulge)]
        case Circle(_, (x, y), radius):
            return [(x - radius, y - radius), (x + radius, y + radius)]
        case _:
            return [(float(x), float(y)) for x, y in marks(primitive, text_height)]


def _append(space: Any, primitive: Primitive, text_height: float, version: str) -> None:
    from ezdxf.enums import TextEntityAlignment

    layer = {"layer": primitive.layer}
    match primitive:
        case Line(_, (start, end), False):
            space.add_line(start, end, dxfattribs=layer)
        case Line(_, points, closed, bulges):
            # Each point of a polyline has the bulge of the stretch that begins there.
            add = space.add_polyline2d if version == R12 else space.add_lwpolyline
            bent = [(*point, bulge) for point, bulge in zip(points, bulges or (0.0,) * len(points), strict=True)]
            add(bent, format="xyb", close=closed, dxfattribs=layer)
        case Circle(_, centre, radius):
            space.add_circle(centre, radius, dxfattribs=layer)
        case Arc(_, centre, radius, begin, end):
            space.add_arc(centre, radius, math.degrees(begin), math.degrees(end), dxfattribs=layer)
        case Text(_, at, text, size, anchor):
            style = layer | {"style": _TEXT_STYLE}
            entity = space.add_text(plain(text), height=size * text_height, dxfattribs=style)
            centred, left = TextEntityAlignment.MIDDLE_CENTER, TextEntityAlignment.MIDDLE_LEFT
            entity.set_placement(at, align=centred if anchor == "centre" else left)
