"""Drawings as SVG at full scale, on a white sheet so that they read the same in light and dark notebooks."""

import math
from xml.etree import ElementTree

from loomopt.base.units import factor
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
    Point,
    Primitive,
    Text,
    extent,
    plain,
    scale_drawing,
)

NAMESPACE = "http://www.w3.org/2000/svg"


def render(drawing: Drawing) -> str:
    """Drawing as an SVG document: one user unit is 1 mm, its size in the drawing's own unit, y turned up."""
    size, unit = factor("mm") / factor(drawing.unit), drawing.unit
    drawing = scale_drawing(sheet(drawing), 1 / factor("mm"))
    box = extent(drawing)
    width, height = box.right - box.left, box.top - box.bottom
    root = ElementTree.Element(
        "svg",
        {
            "xmlns": NAMESPACE,
            "width": f"{_number(size * width)}{unit}",
            "height": f"{_number(size * height)}{unit}",
            "viewBox": f"{_pair(Point(box.left, box.top))} {_pair(Point(width, -height))}",
            "role": "img",
            "font-family": "Helvetica, Arial, sans-serif",
        },
    )
    ElementTree.SubElement(root, "title").text = plain(drawing.title)
    paper = {
        "x": _number(box.left),
        "y": _number(-box.top),
        "width": _number(width),
        "height": _number(height),
    }
    ElementTree.SubElement(root, "rect", paper | {"fill": "#ffffff"})
    for name, layer in drawing.layers.items():
        group = ElementTree.SubElement(root, "g", _style(name, layer, drawing.height))
        for primitive in drawing.primitives:
            if primitive.layer == name:
                _append(group, primitive, layer, drawing.height)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _style(name: str, layer: Layer, text_height: float) -> dict[str, str]:
    unit = text_height / NOMINAL_HEIGHT
    style = {
        "data-layer": name,
        "fill": "none",
        "stroke": layer.colour,
        "stroke-width": _number(layer.width * unit),
    }
    style |= {"stroke-linecap": "round", "stroke-linejoin": "round"}
    return style | ({"stroke-dasharray": f"{_number(DASH * unit)} {_number(GAP * unit)}"} if layer.dashed else {})


def _append(group: ElementTree.Element, primitive: Primitive, layer: Layer, text_height: float) -> None:
    match primitive:
        case Line(_, points, closed):
            data = "M" + " L".join(_pair(point) for point in points) + (" Z" if closed else "")
            ElementTree.SubElement(group, "path", {"d": data})
        case Circle(_, centre, radius):
            place = {"cx": _number(centre.x), "cy": _number(-centre.y), "r": _number(radius)}
            ElementTree.SubElement(group, "circle", place)
        case Arc(_, centre, radius, begin, end):
            large, r = int(end - begin > math.pi), _number(radius)
            start, stop = _pair(centre.towards(begin, radius)), _pair(centre.towards(end, radius))
            ElementTree.SubElement(group, "path", {"d": f"M{start} A{r} {r} 0 {large} 0 {stop}"})
        case Text(_, at, text, size, anchor):
            tall = size * text_height
            style = {"fill": layer.colour, "stroke": "none", "font-size": _number(tall / CAPITAL)}
            style["text-anchor"] = "middle" if anchor == "centre" else "start"
            place = {"x": _number(at.x), "y": _number(tall / 2 - at.y)}
            ElementTree.SubElement(group, "text", place | style).text = plain(text)


def _pair(point: Point) -> str:
    return f"{_number(point.x)} {_number(-point.y)}"


def _number(value: float) -> str:
    return f"{value + 0.0:.12g}"
