"""Packaged scenes written in inches, pounds and pounds-force, every number the same float64 in SI."""

from collections.abc import Mapping
from typing import Any

import loomopt as lo
from loomopt.base.quantities import read, shortest_text
from loomopt.base.units import SI_UNIT, QuantityError, parse_unit
from loomopt.scenes import packaged

UNITS = {
    "length": "in",
    "mass": "lb",
    "force": "lbf",
    "torque": "lbf*in",
    "inertia": "lb*in^2",
    "stiffness": "lbf/in",
    "damping": "lbf*s/in",
    "pressure": "psi",
    "density": "lb/in^3",
    "rotary stiffness": "lbf*in/rad",
    "rotary damping": "lbf*in*s/rad",
}


def scene(name: str, **changes: str) -> lo.Scene:
    """Return a packaged scene in inches; changes: keys with "__" for the dot, such as operation__speed="350 rpm"."""
    document = _converted(lo.load(name).document)
    for entry in document.get("targets", {}).values():
        if "table" in entry:  # a scene that is no file has no folder
            entry["table"] = str(packaged.problems()[name].parent / entry["table"])
    second_scene = lo.scene(document)
    return (
        second_scene.update({key.replace("__", "."): value for key, value in changes.items()})
        if changes
        else second_scene
    )


def _converted(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: item if key in ("problem", "expected") else _converted(item) for key, item in value.items()}
    return _text(value) if isinstance(value, str) else value


def _text(text: str) -> str:
    """Return a quantity in the inch system; any other text as it is."""
    number, _, unit = text.partition(" ")
    try:
        powers = parse_unit(unit).powers if unit else None
        kind = next((kind for kind in UNITS if powers == parse_unit(SI_UNIT[kind]).powers), None)
        return shortest_text(read(text, kind), UNITS[kind], kind) if kind and number else text
    except QuantityError:
        return text
