"""The press drawn at full scale: the crank above, the slide below."""

import math
from collections.abc import Mapping

from loomopt.picture.drawing import Label, Skeleton, along, place
from loomopt.picture.shapes import Drawing, Point, Units
from loomopt_press.model import BOTTOM, TOP

HALF = "half way"


def linkage(known: Mapping[str, float], title: str, units: Units) -> Drawing:
    """Press in both dead centres and half way."""
    drawn, height = skeleton(known), 0.02 * (known["crank"] + known["rod"])
    strokes, at = drawn.strokes(height), drawn.at(HALF)
    labels = [
        Label("frame", at["A"], math.pi, "A"),
        Label(HALF, at["B"], 0.0, "B"),
        Label(HALF, at["C"], 0.0, "C"),
        along(HALF, at["A"], at["B"], math.pi / 2, f"crank = {units.size(known['crank'])}"),
        along(HALF, at["B"], at["C"], 0.0, f"rod = {units.size(known['rod'])}"),
    ]
    legend = (*((event, event) for event in drawn.joints), ("notes", units.summary))
    return Drawing(title, height, (*strokes, *place(labels, strokes, height)), legend, units.length)


def skeleton(known: Mapping[str, float]) -> Skeleton:
    """Its joints in every position."""
    shaft, crank, rod = Point(0.0, 0.0), known["crank"], known["rod"]
    positions = {TOP: 0.0, HALF: math.pi / 2, BOTTOM: math.pi}
    joints = {}
    for event, phi in positions.items():
        pin = shaft.towards(math.pi / 2 - phi, crank)
        joints[event] = {"B": pin, "C": Point(0.0, pin.y - math.sqrt(rod**2 - pin.x**2))}
    return Skeleton({"A": shaft}, joints, (("A", "B"), ("B", "C")), (("A", crank),))
