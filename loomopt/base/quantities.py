"""Quantities: a number with its unit, as text, read by one strict pattern; inside, every number is SI.

Numbers and unit factors are exact fractions until the last step, so "155 mm", "0.155 m" and "0.000155 km"
give the same float64. Angle is a dimension of its own: an angle and an angular speed must name their unit.
"""

import functools
import math
import re
import typing
from collections.abc import Mapping
from decimal import Context, Decimal
from fractions import Fraction
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from loomopt.base.units import (
    DISPLAY_UNIT,
    PRIMES,
    SI_UNIT,
    SPEEDS,
    UNITS,
    QuantityError,
    Unit,
    ascii_unit,
    fits,
    meant_unit,
    parse_unit,
    show,
    usual_units,
)

NARROWEST = 1e-10
"""rad: the least pulse, rise and return; a hundred times SAME_ANGLE."""

NUMBER_PATTERN = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
QUANTITY_PATTERN = "x-quantity"
_UNIT_PATTERN = r"(?:1/)?[^\s0-9.,+-][^\s,]*"
_NEVER = (r"k?N(?:m|cm|mm)", "1/(?:s|ms|us|min|h)")
"""Often written, and no unit of any quantity: torques without their *, and what says neither turns nor radians."""
_NEGATIVE, _ZERO = r"^[ \t]*-[0-9.]*[1-9]", r"^[ \t]*[+-]?[0.]+(?:[eE][+-]?[0-9]+)?(?:[^0-9.eE].*)?$"
_RATIO_PATTERN = rf"^[ \t]*{NUMBER_PATTERN}(?: */ *{NUMBER_PATTERN})?[ \t]*$"


def pattern_schema(kind: str, least: float, above: float, below: float, allowed: str) -> dict[str, Any]:
    """JSON Schema of a quantity's raw value; least, above, below: range, SI; allowed: range in words.

    The key `QUANTITY` has a name that equal quantities share. `message_schema` adds the message.
    """
    refused = [_NEGATIVE] if max(least, above) >= 0 else []
    refused += [_ZERO] if above >= 0 else []
    text: dict[str, Any] = {"type": "string", "pattern": _RATIO_PATTERN}
    if kind != "number":
        text["pattern"] = rf"^[ \t]*{NUMBER_PATTERN} *{_UNIT_PATTERN}[ \t]*$"
        refused.append(rf"^[ \t]*{NUMBER_PATTERN} *(?:{foreign(kind)})[ \t]*$")
    if refused:
        text["not"] = {"anyOf": [{"pattern": pattern} for pattern in refused]}
    head = {QUANTITY_PATTERN: _name(kind, least, above, below), "description": allowed}
    if kind != "number":
        return {**head, **message_schema(text, allowed)}
    ends = {"minimum": least, "exclusiveMinimum": above, "exclusiveMaximum": below}
    number = {"type": "number"} | {name: end for name, end in ends.items() if math.isfinite(end)}
    return {**head, **message_schema({"anyOf": [number, text]}, allowed)}


def message_schema(check: dict[str, Any], allowed: str) -> dict[str, Any]:
    """JSON Schema that accepts the same values as `check`, with the allowed values as its message.

    Editors repeat the part that fails: a pattern says nothing to a person, the one value that would be taken does.
    """
    return {"if": check, "else": {"const": allowed}}


def _name(kind: str, least: float, above: float, below: float) -> str:
    """Name for quantities of a kind and a range."""
    unit, ends = DISPLAY_UNIT[kind], (("from", least), ("above", above), ("below", below))
    return " ".join([kind, *(f"{word} {show(end, unit)}" for word, end in ends if math.isfinite(end))])


@functools.cache
def foreign(kind: str) -> str:
    """Pattern of units that are usual for other kinds of quantity and wrong for this one."""
    single = [re.escape(name) for name in (*UNITS, *SPEEDS, *PRIMES) if not fits(name, kind)]
    composed = {_usual(unit) for unit in SI_UNIT.values() if unit not in UNITS and unit != "1" and not fits(unit, kind)}
    return "|".join([*single, *sorted(composed), *_NEVER])


def _usual(unit: str) -> str:
    """Pattern of an SI unit with each of its names exchanged for any other of the same dimension."""

    def names(match: re.Match[str]) -> str:
        alike = [name for name in UNITS if UNITS[name].powers == UNITS[match[0]].powers]
        return f"(?:{'|'.join(alike)})"

    return re.sub("[A-Za-z]+", names, re.sub(r"([*^()])", r"\\\1", unit))


_SHOWN_NUMBER = {"length": "31", "angle": "23", "angular speed": "600", "torque": "745", "inertia": "0.62"}
_LONGEST_TEXT = 100
_MOST_DIGITS, _MOST_ZEROS = 20, 16
_MOST_REMEMBERED = 4096
_SMALLEST, _LARGEST = Fraction(1, 10**60), Fraction(10**60)
_PLAIN = re.compile(NUMBER_PATTERN)
_QUANTITY = re.compile(rf"({NUMBER_PATTERN}) *(.*)", re.DOTALL)
_RATIO = re.compile(rf"({NUMBER_PATTERN})(?: */ *({NUMBER_PATTERN}))?")
_FRACTION = r"(?:([0-9]{1,9}) +)?([0-9]{1,9}) */ *([0-9]{1,9}) *([a-z]*|[\"'″′])"
_FEET = r"([0-9]{1,9}(?:\.[0-9]+)?) *(?:ft|['′’])[ -]*([0-9]{1,9}(?:\.[0-9]+)?) *(?:in|inch|[\"″”])?"
_GROUPED = r"[+-]?[0-9]{1,3}(?:[ _'’\u00a0\u202f][0-9]{3})+(?![0-9])"
_ARITHMETIC = r"[0-9.] *(?:\*\*|[-+*/^]) *\(?[0-9.]|(?<![eE])\+ *[0-9]|[-*/^] +[0-9]"


@functools.lru_cache(maxsize=_MOST_REMEMBERED)
def read(text: str, kind: str) -> float:
    """Quantity that text gives, in SI units, correctly rounded; kind: a key of `SI_UNIT`.

    Raises QuantityError for anything but one number and one unit of that kind (a pure number may be a ratio).
    """
    text = text.strip(" \t")
    if len(text) > _LONGEST_TEXT:
        raise _refusal(kind, f"the text is {len(text)} characters long")
    if kind == "number":
        return _pure_number(text)
    match = _QUANTITY.fullmatch(text)
    if not match:
        raise _misreading(text, kind)
    number, unit_text = match.groups()
    if not unit_text:
        raise _refusal(kind, "the unit is missing", f'Write the unit too, such as "{number} {DISPLAY_UNIT[kind]}"')
    try:
        unit = parse_unit(unit_text)
    except QuantityError as error:
        meant = meant_unit(unit_text, kind)
        problem = f'"{unit_text}" is not a unit' if meant else error.problem
        near = re.match('Perhaps "(.*?)"', error.remedy)
        fitting = near and fits(near[1], kind)
        other = "Units are case-sensitive and joined by * or /" if near else error.remedy
        remedy = _perhaps(meant) or (error.remedy if fitting else f"{_units_of(kind)}. {other}")
        raise _misreading(text, kind, problem, remedy) from None
    _check_dimension(unit, unit_text, number, kind)
    return _rounded(_as_written(number, kind) * unit.factor, kind)


def shortest_text(value: float, unit_text: str, kind: str) -> str:
    """Shortest text in `unit_text` that `read` turns into the same SI float64; without a unit for "1"."""
    shared = Fraction(value) / parse_unit(unit_text).factor
    for digits in range(1, _MOST_DIGITS):
        number = Context(prec=digits).divide(Decimal(shared.numerator), Decimal(shared.denominator)).normalize()
        plain = f"{number:f}" if -_MOST_ZEROS < number.adjusted() < _MOST_ZEROS else str(number)
        text = plain if unit_text == "1" else f"{plain} {unit_text}"
        if _reads_as(text, kind, value):
            break
    return text


def _reads_as(text: str, kind: str, value: float) -> bool:
    try:
        return read(text, kind) == value
    except QuantityError:
        return False


def plain_number(text: str) -> float | None:
    """Number that text is by the same pattern, without a unit; None for anything else."""
    if len(text) > _LONGEST_TEXT or not _PLAIN.fullmatch(text):
        return None
    value, nothing = float(text), not re.search("[1-9]", re.split("[eE]", text)[0])
    return value if nothing or _SMALLEST < abs(value) < _LARGEST else None


def is_beyond(text: str) -> bool:
    """Whether text is a number by the same pattern that is too large or too small to compute with."""
    return plain_number(text) is None and bool(_PLAIN.fullmatch(text)) and len(text) <= _LONGEST_TEXT


def unit_of(text: str) -> str:
    """Unit of a quantity as written, "1" for a pure number. Raises QuantityError without one."""
    text = text.strip(" \t")
    if _RATIO.fullmatch(text):
        return "1"
    match = _QUANTITY.fullmatch(text)
    if not match:
        raise QuantityError("there is no number", "a number and a unit", 'Write a number and a unit, such as "31 mm"')
    return match[2]


def described(kind: str) -> str:
    """Example of a kind of quantity: 'a length such as "31 mm"'."""
    if kind == "number":
        return "a number without unit, such as 1.5 or a ratio such as 300/18"
    article = "an" if kind[0] in "aeiou" else "a"
    return f'{article} {kind} such as "{_SHOWN_NUMBER.get(kind, "1.5")} {DISPLAY_UNIT[kind]}"'


def _pure_number(text: str) -> float:
    match = _RATIO.fullmatch(text)
    if not match:
        raise _misreading(text, "number")
    over, under = _as_written(match[1], "number"), _as_written(match[2] or "1", "number")
    if under == 0:
        raise _refusal("number", "the ratio divides by zero")
    return _rounded(over / under, "number")


def _as_written(number: str, kind: str) -> Fraction:
    """Number as written, its size checked before any digits are expanded."""
    mantissa = re.split("[eE]", number)[0]
    if not re.search("[1-9]", mantissa):
        return Fraction(0)
    if float(number) == 0 or math.isinf(float(number)):
        raise _refusal(kind, "the number is too large or too small to compute with")
    return Fraction(number)


def _rounded(value: Fraction, kind: str) -> float:
    """SI value as float64, within a range whose fourth powers float64 can still hold."""
    if value and not _SMALLEST < abs(value) < _LARGEST:
        raise _refusal(kind, "the number is too large or too small to compute with")
    return float(value)


def _check_dimension(unit: Unit, unit_text: str, number: str, kind: str) -> None:
    if fits(unit_text, kind):
        return
    if kind == "angular speed" and unit.powers == (0, 0, -1, 0):
        turns = float(number) * float(unit.factor) * 60
        raise QuantityError(
            f'"{unit_text}" does not say whether turns or radians are counted',
            "an angular speed in rpm, turn/min, deg/s or rad/s",
            f'If turns are meant, write "{turns:g} rpm"',
        )
    if kind == "angle" and ascii_unit(unit_text) in PRIMES.values() and not unit_text.isalpha():
        arcs = "arcsec" if ascii_unit(unit_text) == "in" else "arcmin"
        remedy = f'{_units_of(kind)}; arc seconds and minutes are written "{number} {arcs}"'
        raise _refusal(kind, f"the sign {unit_text} is of a length, not of an angle", remedy)
    # Of units that there are, one of two letters is a slip for nearly any other.
    remedy = _perhaps(meant_unit(unit_text, kind, shortest=3)) or f"Write it in {usual_units(kind)}"
    raise _refusal(kind, misfit(unit_text, kind), remedy)


def _units_of(kind: str) -> str:
    return f"{'An' if kind[0] in 'aeiou' else 'A'} {kind} is written in {usual_units(kind)}"


def _perhaps(unit: str) -> str:
    return f'Perhaps "{unit}" is meant; units are case-sensitive and joined by * or /' if unit else ""


def misfit(unit_text: str, kind: str) -> str:
    """Kind of a unit that does not fit the kind of quantity, in words."""
    others = [other for other in SI_UNIT if other != "number" and fits(unit_text, other)]
    meaning = f"a unit of {others[0]}, not of {kind}" if others else f"not a unit of {kind}"
    return f'"{unit_text}" is {meaning}'


def _refusal(kind: str, problem: str, remedy: str = "") -> QuantityError:
    return QuantityError(problem, described(kind), remedy or "Correct the value")


def _misreading(text: str, kind: str, problem: str = "", remedy: str = "") -> QuantityError:
    """Name the likely mistake in text that is no quantity; problem and remedy where none is recognised."""
    if not text:
        return _refusal(kind, "the text is empty")
    if text.lstrip("+-").lower().startswith(("nan", "inf")):
        return _refusal(kind, "it is not a finite number")
    if re.match(r"[+-]?[0-9. ]*,", text):
        return _refusal(kind, "the number has a comma", "Write a decimal point and no thousands separators")
    if re.match(_GROUPED, text):
        return _refusal(kind, "the digits are grouped", "Write the digits without separators")
    if kind == "angular speed" and re.fullmatch(rf"{NUMBER_PATTERN} */ *(min|s|sec)", text):
        return _refusal(kind, "it does not say whether turns or radians are counted", "Write rpm or rad/s")
    fraction = re.fullmatch(_FRACTION, text)
    if fraction:
        whole, over, under = (int(digits or 0) for digits in fraction.groups()[:3])
        decimal = f': "{whole + over / under:.10g} {ascii_unit(fraction[4])}"' if under else ""
        return _refusal(kind, "the number is a fraction", f"Write a decimal number{decimal}")
    feet = re.fullmatch(_FEET, text) if kind == "length" else None
    if feet:
        inches = 12 * float(feet[1]) + float(feet[2])
        return _refusal(kind, "feet and inches are two numbers", f'Write one number: "{inches:.10g} in"')
    if re.search(_ARITHMETIC, text):
        return _refusal(kind, "arithmetic is not evaluated", "Write the result as one number")
    if not re.match(r"[+\- .]*[0-9]", text):
        return _refusal(
            kind,
            "the number is missing",
            "Write a number" if kind == "number" else "Write a number and its unit",
        )
    if kind == "number" and _QUANTITY.fullmatch(text):
        return _refusal(kind, "this number has no unit", "Take the unit off")
    return _refusal(kind, problem or "it is not one number with one unit", remedy)


class Quantity(NamedTuple):
    """Kind of a scene's number and its range in SI units."""

    kind: str
    least: float = -math.inf
    above: float = -math.inf
    below: float = math.inf

    def validate(self, raw: object) -> float:
        """Value in SI units of raw text (a pure number may be a number). Raises QuantityError."""
        if isinstance(raw, str):
            value = read(raw, self.kind)
        elif isinstance(raw, bool) or not isinstance(raw, int | float):
            raise _refusal(self.kind, "it is not a quantity")
        elif self.kind != "number":
            # Python writes no whole number of thousands of digits.
            long = isinstance(raw, int) and raw.bit_length() > 3 * _MOST_DIGITS
            written = f'"{"NUMBER" if long else str(raw)[:_MOST_DIGITS]} {DISPLAY_UNIT[self.kind]}"'
            raise _refusal(self.kind, "the unit is missing", f"Write number and unit as text, in quotes: {written}")
        elif isinstance(raw, float) and not math.isfinite(raw):
            raise _refusal(self.kind, "it is not a finite number")
        else:
            value = _rounded(Fraction(raw), self.kind)
        if not (value >= self.least and value > self.above and value < self.below):
            raise QuantityError("it is out of range", self.range, "Correct the value")
        return value

    @property
    def range(self) -> str:
        """The range in words: "more than 0 deg, less than 360 deg"."""
        limits = (("at least", self.least), ("more than", self.above), ("less than", self.below))
        unit = DISPLAY_UNIT[self.kind]
        return ", ".join(f"{word} {show(limit, unit)}" for word, limit in limits if math.isfinite(limit))

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Let pydantic read a field of this type by `validate`."""
        return core_schema.no_info_plain_validator_function(self.validate)

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """JSON Schema with which an editor checks the value."""
        return self.schema()

    def schema(self) -> dict[str, Any]:
        """JSON Schema of its raw value."""
        kind, least, above, below = self
        text = f"{described(kind)}, {self.range}" if self.range else described(kind)
        return pattern_schema(kind, least, above, below, text)


class NumberList(NamedTuple):
    """A list of pure numbers, as in TOML or as JSON text; at most `longest` of them."""

    longest: int = 1000

    def validate(self, raw: object) -> tuple[float, ...]:
        """Numbers of a raw value. Raises QuantityError."""
        values = _parsed(raw) if isinstance(raw, str) else raw
        numbers = values if isinstance(values, list | tuple) else []
        if not numbers or len(numbers) > self.longest or not all(_is_number(value) for value in numbers):
            allowed = f"a list of up to {self.longest} numbers, such as [0, 6.28, -6.28, 0]"
            raise QuantityError("it is not a list of numbers", allowed, "Write numbers between brackets")
        return tuple(float(value) for value in numbers)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Let pydantic read a field of this type by `validate`."""
        return core_schema.no_info_plain_validator_function(self.validate)

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """JSON Schema with which an editor checks the value."""
        return {"type": "array", "items": {"type": "number"}, "minItems": 1, "maxItems": self.longest}


def _parsed(text: str) -> object:
    import json

    try:
        return json.loads(text[: 100 * _LONGEST_TEXT])
    except (ValueError, RecursionError):
        return None


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e60


MOST_MODELS = 256
"""Number of models whose fields are cached: each scene has models of its own, and all of them are read."""


def quantity_of(model: type[BaseModel], field: str) -> Quantity | None:
    """Quantity of a model's field, also for `X | None`; None for a field without a quantity."""
    info = model.model_fields[field]
    return _find_quantity(*info.metadata, info.annotation)


@functools.lru_cache(maxsize=MOST_MODELS)
def quantities_of(model: type[BaseModel]) -> Mapping[str, Quantity]:
    """Quantities of a model's fields; those of a table inside the model under "table.key"."""
    quantities: dict[str, Quantity] = {}
    for name in model.model_fields:
        quantity, inner = quantity_of(model, name), table_inside(model, name)
        if quantity:
            quantities[name] = quantity
        elif inner:
            quantities |= {f"{name}.{key}": inner_quantity for key, inner_quantity in quantities_of(inner).items()}
    return MappingProxyType(quantities)


def table_inside(model: type[BaseModel], field: str) -> type[BaseModel] | None:
    """Model of a field that is a table, also for `X | None`; None for another field."""
    annotation = model.model_fields[field].annotation
    parts = (annotation, *(part for part in typing.get_args(annotation) if typing.get_origin(annotation) is not tuple))
    return next((part for part in parts if isinstance(part, type) and issubclass(part, BaseModel)), None)


def _find_quantity(*parts: object) -> Quantity | None:
    for part in parts:
        if isinstance(part, Quantity):
            return part
        quantity = _find_quantity(*typing.get_args(part))
        if quantity:
            return quantity
    return None


Length = Annotated[float, Quantity("length", least=0)]
Coordinate = Annotated[float, Quantity("length")]
PositiveLength = Annotated[float, Quantity("length", above=0)]
Angle = Annotated[float, Quantity("angle")]
PulseAngle = Annotated[float, Quantity("angle", least=NARROWEST, below=2 * math.pi)]
SegmentAngle = Annotated[float, Quantity("angle", least=0, below=2 * math.pi)]
MoveAngle = Annotated[float, Quantity("angle", least=NARROWEST, below=2 * math.pi)]
DwellAngle = Annotated[float, Quantity("angle", above=0, below=math.pi)]
Mass = Annotated[float, Quantity("mass", least=0)]
PositiveMass = Annotated[float, Quantity("mass", above=0)]
Inertia = Annotated[float, Quantity("inertia", least=0)]
PositiveInertia = Annotated[float, Quantity("inertia", above=0)]
Torque = Annotated[float, Quantity("torque", least=0)]
PositiveTorque = Annotated[float, Quantity("torque", above=0)]
Force = Annotated[float, Quantity("force", least=0)]
SignedForce = Annotated[float, Quantity("force")]
Stiffness = Annotated[float, Quantity("stiffness", least=0)]
PositiveStiffness = Annotated[float, Quantity("stiffness", above=0)]
Damping = Annotated[float, Quantity("damping", least=0)]
PositivePressure = Annotated[float, Quantity("pressure", above=0)]
PositiveDensity = Annotated[float, Quantity("density", above=0)]
Speed = Annotated[float, Quantity("angular speed", above=0)]
RotaryDamping = Annotated[float, Quantity("rotary damping", least=0)]
RotaryStiffness = Annotated[float, Quantity("rotary stiffness", least=0)]
PositiveRotaryStiffness = Annotated[float, Quantity("rotary stiffness", above=0)]
PositiveRotaryDamping = Annotated[float, Quantity("rotary damping", above=0)]
PureNumber = Annotated[float, Quantity("number", least=0)]
Numbers = Annotated[tuple[float, ...], NumberList()]
PositiveNumber = Annotated[float, Quantity("number", above=0)]
Share = Annotated[float, Quantity("number", above=0, below=1)]
