"""Sizes of a number that can be ordered: multiples of a step, [steps], or sizes that are sold, [stock]."""

import fnmatch
import math
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from loomopt.base.errors import nearest, refusal
from loomopt.base.quantities import Quantity
from loomopt.scenes.cursor import Cursor
from loomopt.scenes.tables import Place, SceneSchema, label_entries, quantity_of_label

WITHIN = 1e-9
"""Share of a step by which a size may lie outside its bounds: rounding of a unit."""
STEP = "number with a step"


class Sizes(NamedTuple):
    """[steps] and [stock], SI, by the designer's name of a number; sizes ascending."""

    steps: Mapping[str, float]
    stock: Mapping[str, tuple[float, ...]]


def read(scene: Cursor, schema: SceneSchema, known: Sequence[Place]) -> Sizes:
    """Tables [steps] and [stock] of a scene; known: places of its numbers."""
    steps: dict[str, float] = {}
    stock: dict[str, tuple[float, ...]] = {}
    labels = [*schema.variables, *(place.label for place in known)]
    for table in ("steps", "stock"):
        with scene.faults:
            for label, place in label_entries(scene.at(table), labels).items():
                with scene.faults:
                    quantity = Quantity(quantity_of_label(place, schema, known, STEP).kind, above=0)
                    if table == "steps":
                        steps[label] = place.number(quantity)
                    else:
                        stock[label] = _stock(place, quantity)
    return Sizes(steps, stock)


def _stock(cursor: Cursor, quantity: Quantity) -> tuple[float, ...]:
    """Sizes of one number that are sold, ascending. Raises BadInput."""
    raw = cursor.raw
    if not isinstance(raw, list | tuple) or not raw:
        raise cursor.fault("it is not a list of sizes", raw, remedy='Write wire = ["1 mm", "1.2 mm"]')
    return tuple(sorted({cursor._replace(raw=size).number(quantity) for size in raw}))


def named(given: Mapping[str, object], bounded: Collection[str]) -> dict[str, object]:
    """Steps of a call by number, a pattern such as "l*" as all bounded numbers that fit. Raises BadInput."""
    steps: dict[str, object] = {}
    for name, step in given.items():
        fitting = fnmatch.filter(bounded, name)
        if not fitting:
            near = nearest(name, bounded)
            remedy = f'Perhaps "{near}" is meant' if near else "Name a number of [bounds]"
            raise refusal(f"{name} is not a free number", "", "round", name, ", ".join(bounded), remedy)
        steps |= dict.fromkeys(fitting, step)
    return steps


def multiples(step: float, low: float, high: float) -> tuple[float, ...]:
    """Multiples of a step between two bounds, both SI."""
    first, last = math.ceil(low / step - WITHIN), math.floor(high / step + WITHIN)
    return tuple(min(max(float(f"{k * step:.15g}"), low), high) for k in range(first, last + 1))
