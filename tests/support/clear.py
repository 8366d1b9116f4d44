"""Whether a drawing's texts are clear of each other, of every stroke, and on the sheet: by boxes, exactly."""

import itertools
import math
from xml.etree import ElementTree

import numpy as np

from loomopt.interface.files import svg
from loomopt.picture.drawing import sheet
from loomopt.picture.shapes import Box, Drawing, Line, Text, text_box

FINE = 500
"""Straight parts of a circle, each of which is exact to 5e-6 of its radius."""


def segments(primitive):
    """Return a primitive's strokes as straight segments, (n, 2, 2)."""
    if isinstance(primitive, Line):
        points = np.array((*primitive.points, primitive.points[0]) if primitive.closed else primitive.points)
    else:
        begin, end = getattr(primitive, "begin", 0.0), getattr(primitive, "end", 2 * math.pi)
        turns = np.linspace(begin, end, FINE + 1)
        points = np.array(primitive.centre) + primitive.radius * np.column_stack([np.cos(turns), np.sin(turns)])
    return np.stack([points[:-1], points[1:]], axis=1)


def overlap(first, other):
    """Say whether the insides of two boxes have a point in common."""
    return (
        first.left < other.right and other.left < first.right and first.bottom < other.top and other.bottom < first.top
    )


def meets(box, strokes):
    """Say which segments, (n, 2, 2), have a point inside a box: what is left of each between the box's sides."""
    start, way = strokes[:, 0], strokes[:, 1] - strokes[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.sort(np.stack([(np.array(side) - start) / way for side in (box[:2], box[2:])]), axis=0)
    still = way == 0.0
    inside = (start > box[:2]) & (start < box[2:])
    ends[0][still], ends[1][still] = (
        np.where(inside, -np.inf, np.inf)[still],
        np.where(inside, np.inf, -np.inf)[still],
    )
    enter, leave = np.maximum(ends[0].max(axis=1), 0.0), np.minimum(ends[1].min(axis=1), 1.0)
    return enter < leave


def paper(drawing: Drawing) -> Box:
    """Return the sheet of a drawing, m, as its SVG has it."""
    left, top, width, height = map(float, ElementTree.fromstring(svg.render(drawing)).attrib["viewBox"].split())
    return Box(*(side / 1000 for side in (left, -top - height, left + width, -top)))


def faults(drawing: Drawing, on: Box | None = None) -> list[str]:
    """Return what is wrong with a drawing, title and legend apart unless they are in it: texts on texts, on strokes,
    beside the sheet `on`."""
    texts = [primitive for primitive in drawing.primitives if isinstance(primitive, Text)]
    strokes = [primitive for primitive in drawing.primitives if not isinstance(primitive, Text)]
    lines = np.concatenate([segments(stroke) for stroke in strokes])
    owner = np.repeat(np.arange(len(strokes)), [len(segments(stroke)) for stroke in strokes])
    boxes = [text_box(text, drawing.height) for text in texts]
    results = []
    for (item, box), (other, second) in itertools.combinations(zip(texts, boxes, strict=True), 2):
        results += [f"{item.text!r} overlaps {other.text!r}"] if overlap(box, second) else []
    for text, box in zip(texts, boxes, strict=True):
        crossing = {strokes[k].layer for k in owner[meets(box, lines)]}
        results += [f"{text.text!r} lies on a stroke of {layer}" for layer in sorted(crossing)]
        inside = not on or (on.left < box.left and box.right < on.right and on.bottom < box.bottom and box.top < on.top)
        results += [] if inside else [f"{text.text!r} lies beside the sheet"]
    return results


def faults_of(drawing: Drawing) -> list[str]:
    """Return what is wrong with a drawing as a job returns it, once its title and legend stand on its sheet."""
    return faults(sheet(drawing), paper(drawing))
