"""What can be ordered of a number: multiples of a step, [steps], or sizes that are sold, [stock]."""

import fnmatch
import math
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from loomopt.base.errors import Faults, misread, nearest, refusal
from loomopt.base.quantities import Quantity
from loomopt.base.units import QuantityError
from loomopt.scenes.tables import Place, SceneSchema, bounded, flat, table

WITHIN = 1e-9
"""Share of a step by which a size may lie outside its bounds: rounding of a unit."""
STEP = "number with a step"


class Sizes(NamedTuple):
    """[steps] and [stock], SI, by what a designer calls a number; sizes ascending."""

    steps: Mapping[str, float]
    stock: Mapping[str, tuple[float, ...]]


def read(raw: Mapping[str, object], schema: SceneSchema, known: Sequence[Place], origin: str, faults: Faults) -> Sizes:
    """Return [steps] and [stock]; raw: the scene's tables; known: places of its numbers."""
    steps: dict[str, float] = {}
    stock: dict[str, tuple[float, ...]] = {}
    for name in ("steps", "stock"):
        with faults:
            labels = [*schema.variables, *(place.label for place in known)]
            for number, each in flat(table(raw.get(name, {}), origin, name), labels).items():
                with faults:
                    key = f"{name}.{number}"
                    quantity = Quantity(bounded(number, schema, list(known), origin, key, STEP).kind, above=0)
                    if name == "steps":
                        steps[number] = _value(each, quantity, origin, key)
                    else:
                        stock[number] = _sold(each, quantity, origin, key)
    return Sizes(steps, stock)


def _sold(raw: object, quantity: Quantity, origin: str, key: str) -> tuple[float, ...]:
    if not isinstance(raw, list | tuple) or not raw:
        raise refusal("it is no list of sizes", origin, key, raw, remedy='Write wire = ["1 mm", "1.2 mm"]')
    return tuple(sorted({_value(each, quantity, origin, key) for each in raw}))


def _value(raw: object, quantity: Quantity, origin: str, key: str) -> float:
    try:
        return quantity.validate(raw)
    except QuantityError as error:
        raise misread(error, origin, key, raw) from None


def named(given: Mapping[str, object], bounded: Collection[str]) -> dict[str, object]:
    """Return steps of a call by number, a pattern such as "l*" as all bounded numbers that fit. Raises BadInput."""
    found: dict[str, object] = {}
    for name, step in given.items():
        fitting = fnmatch.filter(bounded, name)
        if not fitting:
            near = nearest(name, bounded)
            remedy = f'Perhaps "{near}" is meant' if near else "Name a number of [bounds]"
            raise refusal(f"{name} is no number that is free", "", "round", name, ", ".join(bounded), remedy)
        found |= dict.fromkeys(fitting, step)
    return found


def multiples(step: float, low: float, high: float) -> tuple[float, ...]:
    """Return the multiples of a step between two bounds, both SI."""
    first, last = math.ceil(low / step - WITHIN), math.floor(high / step + WITHIN)
    return tuple(min(max(float(f"{k * step:.15g}"), low), high) for k in range(first, last + 1))
