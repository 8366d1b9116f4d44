"""Drawings as DXF for the workshop: R2010, mm or inches, full scale, one coloured layer for each of the drawing's."""

import importlib
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from loomopt.base.units import factor
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
    plain,
    scaled,
)

_TEXT_STYLE, _DASHES = "LABELS", "DASHES"


def write(drawing: Drawing, path: Path) -> None:
    """Write the drawing as a DXF file; the same drawing gives the same bytes."""
    with _fixed_stamps():
        _document(drawing).saveas(str(path))


@contextmanager
def _fixed_stamps() -> Iterator[None]:
    """Have ezdxf write constant dates and identifiers instead of today's."""
    ezdxf: Any = importlib.import_module("ezdxf")

    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


def _document(drawing: Drawing) -> Any:
    ezdxf: Any = importlib.import_module("ezdxf")

    document = ezdxf.new("R2010")
    inches, drawing = drawing.unit == "in", scaled(sheet(drawing), 1 / factor(drawing.unit))
    document.units = ezdxf.units.IN if inches else ezdxf.units.MM
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
        _append(space, primitive, drawing.height)
    for name in sorted(document.entitydb.dxf_types_in_use()):
        document.classes.add_class(name)  # else ezdxf adds them in the order of a set
    return document


def _append(space: Any, primitive: Primitive, text_height: float) -> None:
    from ezdxf.enums import TextEntityAlignment

    layer = {"layer": primitive.layer}
    match primitive:
        case Line(_, (start, end), False):
            space.add_line(start, end, dxfattribs=layer)
        case Line(_, points, closed):
            space.add_lwpolyline(points, close=closed, dxfattribs=layer)
        case Circle(_, centre, radius):
            space.add_circle(centre, radius, dxfattribs=layer)
        case Arc(_, centre, radius, begin, end):
            space.add_arc(centre, radius, math.degrees(begin), math.degrees(end), dxfattribs=layer)
        case Text(_, at, text, size, anchor):
            style = layer | {"style": _TEXT_STYLE}
            entity = space.add_text(plain(text), height=size * text_height, dxfattribs=style)
            centred, left = TextEntityAlignment.MIDDLE_CENTER, TextEntityAlignment.MIDDLE_LEFT
            entity.set_placement(at, align=centred if anchor == "centre" else left)
