"""Quantities as JSON Schema: the pattern of a number with its unit, and the units that another kind would have.

A pattern cannot do arithmetic with units: it refuses the usual units of other kinds, and leaves what is rare to the
program, which reads it anyway. It never refuses what the program takes.
"""

import functools
import math
import re
from typing import Any

from loomopt.units import DISPLAY_UNIT, SI_UNIT, UNITS, fits, show

NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
QUANTITY = "x-quantity"
_UNIT = r"(?:1/)?[^\s0-9.,+-][^\s,]*"
_NEVER = (r"k?N(?:m|cm|mm)", "1/(?:s|ms|us|min|h)")
"""Often written, and no unit of any quantity: torques without their *, and what says neither turns nor radians."""
_NEGATIVE, _ZERO = r"^[ \t]*-[0-9.]*[1-9]", r"^[ \t]*[+-]?[0.]+(?:[eE][+-]?[0-9]+)?(?:[^0-9.eE].*)?$"
_RATIO = rf"^[ \t]*{NUMBER}(?: */ *{NUMBER})?[ \t]*$"


def schema(kind: str, least: float, above: float, below: float, allowed: str) -> dict[str, Any]:
    """Return the JSON Schema of a quantity's raw value; least, above, below: its range, SI; allowed: it in words.

    Under the key `QUANTITY` stands a name that equal ones share.
    """
    refused = [_NEGATIVE] if max(least, above) >= 0 else []
    refused += [_ZERO] if above >= 0 else []
    text: dict[str, Any] = {"type": "string", "pattern": _RATIO}
    if kind != "number":
        text["pattern"] = rf"^[ \t]*{NUMBER} *{_UNIT}[ \t]*$"
        refused.append(rf"^[ \t]*{NUMBER} *(?:{foreign(kind)})[ \t]*$")
    if refused:
        text["not"] = {"anyOf": [{"pattern": pattern} for pattern in refused]}
    head = {QUANTITY: _name(kind, least, above, below), "description": allowed}
    if kind != "number":
        return {**head, **text}
    ends = {"minimum": least, "exclusiveMinimum": above, "exclusiveMaximum": below}
    number = {"type": "number"} | {name: end for name, end in ends.items() if math.isfinite(end)}
    return {**head, "anyOf": [number, text]}


def _name(kind: str, least: float, above: float, below: float) -> str:
    """Return a name for quantities of a kind and a range."""
    unit, ends = DISPLAY_UNIT[kind], (("from", least), ("above", above), ("below", below))
    return " ".join([kind, *(f"{word} {show(end, unit)}" for word, end in ends if math.isfinite(end))])


@functools.cache
def foreign(kind: str) -> str:
    """Return a pattern of units that are usual for other kinds of quantity and wrong for this one."""
    single = [re.escape(name) for name in UNITS if not fits(name, kind)]
    composed = {_usual(unit) for unit in SI_UNIT.values() if unit not in UNITS and unit != "1" and not fits(unit, kind)}
    return "|".join([*single, *sorted(composed), *_NEVER])


def _usual(unit: str) -> str:
    """Return a pattern of an SI unit with each of its names exchanged for any other of the same dimension."""

    def names(match: re.Match[str]) -> str:
        alike = [name for name in UNITS if UNITS[name].powers == UNITS[match[0]].powers]
        return f"(?:{'|'.join(alike)})"

    return re.sub("[A-Za-z]+", names, re.sub(r"([*^()])", r"\\\1", unit))
