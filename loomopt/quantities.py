"""Quantities: a number with its unit, as text, read by one strict pattern; inside, every number is SI.

Numbers and unit factors are exact fractions until the last step, so "155 mm", "0.155 m" and "0.000155 km"
give the same float64. Angle is a dimension of its own: an angle and an angular speed must name their unit.
"""

import difflib
import functools
import math
import re
import typing
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel, GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema


class QuantityError(ValueError):
    """Text that is not the quantity asked for: problem, what is allowed, remedy; each in plain words."""

    def __init__(self, problem: str, allowed: str, remedy: str) -> None:
        super().__init__(problem)
        self.problem, self.allowed, self.remedy = problem, allowed, remedy


class Unit(NamedTuple):
    """A unit: its size in SI units; its powers of m, kg, s, rad."""

    factor: Fraction
    powers: tuple[int, int, int, int]


_PI = Fraction("3.14159265358979323846264338327950288419716939937511")
_INCH, _POUND, _GRAVITY = Fraction("0.0254"), Fraction("0.45359237"), Fraction("9.80665")
_PSI = _POUND * _GRAVITY / _INCH**2

_TABLE: tuple[tuple[tuple[int, int, int, int], dict[str, Fraction | str]], ...] = (
    ((1, 0, 0, 0), {"m": "1", "mm": "1e-3", "cm": "1e-2", "dm": "0.1", "km": "1000", "um": "1e-6"}),
    ((1, 0, 0, 0), {"in": _INCH, "inch": _INCH, "ft": 12 * _INCH}),
    ((0, 1, 0, 0), {"kg": "1", "g": "1e-3", "mg": "1e-6", "t": "1000", "lb": _POUND}),
    ((0, 0, 1, 0), {"s": "1", "ms": "1e-3", "us": "1e-6", "min": "60", "h": "3600"}),
    ((0, 0, 0, 1), {"rad": "1", "mrad": "1e-3", "deg": _PI / 180, "turn": 2 * _PI}),
    ((0, 0, -1, 1), {"rpm": _PI / 30}),
    ((0, 0, -1, 0), {"Hz": "1"}),
    ((1, 1, -2, 0), {"N": "1", "mN": "1e-3", "kN": "1000", "lbf": _POUND * _GRAVITY, "kgf": _GRAVITY}),
    ((-1, 1, -2, 0), {"Pa": "1", "kPa": "1e3", "MPa": "1e6", "GPa": "1e9", "bar": "1e5", "psi": _PSI}),
)
UNITS = {name: Unit(Fraction(factor), powers) for powers, names in _TABLE for name, factor in names.items()}
"""Common units by name; any other is looked up in pint, which is imported only then."""

SI_UNIT: dict[str, str] = {
    "length": "m",
    "angle": "rad",
    "mass": "kg",
    "time": "s",
    "force": "N",
    "torque": "N*m",
    "inertia": "kg*m^2",
    "angular speed": "rad/s",
    "angular acceleration": "rad/s^2",
    "stiffness": "N/m",
    "rotary stiffness": "N*m/rad",
    "damping": "N*s/m",
    "rotary damping": "N*m*s/rad",
    "number": "1",
    "pressure": "Pa",
    "density": "kg/m^3",
}
"""Kind of quantity → the SI unit its numbers have inside the program."""

DISPLAY_UNIT = SI_UNIT | {"length": "mm", "angle": "deg", "angular speed": "rpm", "pressure": "MPa"}
"""Kind of quantity → the unit it is shown in where a scene writes none."""

_SHOWN_NUMBER = {"length": "31", "angle": "23", "angular speed": "600", "torque": "745", "inertia": "0.62"}
_LONGEST_TEXT, _LARGEST_EXPONENT = 100, 4
_SMALLEST, _LARGEST = Fraction(1, 10**60), Fraction(10**60)
_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_QUANTITY = re.compile(rf"({_NUMBER}) *(.*)", re.DOTALL)
_RATIO = re.compile(rf"({_NUMBER})(?: */ *({_NUMBER}))?")
_FRACTION = re.compile(r"(?:([0-9]{1,9}) +)?([0-9]{1,9}) */ *([0-9]{1,9}) *([a-z]*)")
_GROUPED = re.compile(r"[+-]?[0-9]{1,3}(?:[ _'’\u00a0\u202f][0-9]{3})+(?![0-9])")
_ARITHMETIC = re.compile(r"[0-9.] *(?:\*\*|[-+*/^]) *\(?[0-9.]|(?<![eE])\+ *[0-9]|[-*/^] +[0-9]")
_TOKEN = re.compile(r"\*\*|[*/^()]|[+-]?[0-9]+|[^\W\d_]+|.", re.DOTALL)
_SUPERSCRIPT = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_MISTAKEN = {"Nm": "N*m", "Nmm": "N*mm", "kNm": "kN*m", "Ns": "N*s", "Nms": "N*m*s", "grad": "deg"}
"""What pint would take for a yarn count, a plural or a gon → what is meant."""
_LOOKALIKE = str.maketrans({"·": "*", "⋅": "*", "µ": "u", "μ": "u", "°": "deg"})


def read(text: str, kind: str) -> float:
    """Return the quantity that text gives, in SI units, correctly rounded; kind: a key of `SI_UNIT`.

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
        raise _misreading(text, kind, error.problem, error.remedy) from None
    _check_dimension(unit, unit_text, number, kind)
    return _rounded(_exact(number, kind) * unit.factor, kind)


def unit_of(text: str) -> str:
    """Return the unit of a quantity as written, "1" for a pure number. Raises QuantityError without one."""
    text = text.strip(" \t")
    if _RATIO.fullmatch(text):
        return "1"
    match = _QUANTITY.fullmatch(text)
    if not match:
        raise QuantityError("there is no number", "a number and a unit", 'Write a number and a unit, such as "31 mm"')
    return match[2]


def factor(unit_text: str) -> float:
    """Return how many SI units one `unit_text` is. Raises QuantityError for an unknown unit."""
    return float(parse_unit(unit_text).factor)


def show(value: float, unit_text: str, digits: int = 6) -> str:
    """Return an SI value as text in `unit_text`, such as "30 mm"; digits: significant digits."""
    number = f"{value / factor(unit_text) + 0.0:.{digits}g}"
    return number if unit_text == "1" else f"{number} {unit_text}"


def fits(unit_text: str, kind: str) -> bool:
    """Say whether a unit is one of a kind of quantity. Raises QuantityError for an unknown unit."""
    *mechanical, angle = parse_unit(unit_text).powers
    *asked, asked_angle = parse_unit(SI_UNIT[kind]).powers
    return mechanical == asked and (angle == asked_angle or angle == 0 > asked_angle)


def described(kind: str) -> str:
    """Return what a quantity of a kind looks like: 'a length such as "31 mm"'."""
    if kind == "number":
        return "a number without unit, such as 1.5 or a ratio such as 300/18"
    article = "an" if kind[0] in "aeiou" else "a"
    return f'{article} {kind} such as "{_SHOWN_NUMBER.get(kind, "1.5")} {DISPLAY_UNIT[kind]}"'


@functools.lru_cache(maxsize=512)
def parse_unit(text: str) -> Unit:
    """Return the unit that an expression gives: names joined by * or /, powers ^ or ** up to 4, parentheses.

    Raises QuantityError for an unknown unit and for anything else, a space or arithmetic included.
    """
    if text == "1":
        return Unit(Fraction(1), (0, 0, 0, 0))
    plain = re.sub("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+", lambda power: "^" + power[0].translate(_SUPERSCRIPT), text).translate(_LOOKALIKE)
    tokens = _TOKEN.findall(plain)
    reciprocal = tokens[:2] == ["1", "/"]
    if reciprocal:
        tokens[:2] = []
    unit = _product(tokens, text)
    if tokens:
        raise _unit_error(text)
    return _times(parse_unit("1"), unit, -1) if reciprocal else unit


def _product(tokens: list[str], text: str) -> Unit:
    """Take a product from the front of `tokens`; text: the whole unit, for messages."""
    unit = _operand(tokens, text)
    while tokens and tokens[0] in ("*", "/"):
        sign = 1 if tokens.pop(0) == "*" else -1
        unit = _times(unit, _operand(tokens, text), sign)
    return unit


def _operand(tokens: list[str], text: str) -> Unit:
    """Take a name with its power, or a parenthesis, from the front of `tokens`."""
    token = tokens.pop(0) if tokens else ""
    if token == "(":
        unit = _product(tokens, text)
        if not tokens or tokens.pop(0) != ")":
            raise _unit_error(text)
        return unit
    if not token.isalpha():
        raise _unit_error(text)
    unit = UNITS.get(token) or _from_pint(token)
    if not tokens or tokens[0] not in ("^", "**"):
        return unit
    del tokens[0]
    exponent = tokens.pop(0) if tokens else ""
    if not re.fullmatch(r"[+-]?[0-9]+", exponent) or abs(int(exponent)) > _LARGEST_EXPONENT:
        raise _unit_error(text, f"Write whole powers up to {_LARGEST_EXPONENT}, such as kg*m^2")
    return _times(parse_unit("1"), unit, int(exponent))


def _times(unit: Unit, other: Unit, exponent: int) -> Unit:
    a, b = unit.powers, other.powers
    return Unit(
        unit.factor * other.factor**exponent,
        (a[0] + exponent * b[0], a[1] + exponent * b[1], a[2] + exponent * b[2], a[3] + exponent * b[3]),
    )


@functools.lru_cache(maxsize=64)
def _from_pint(name: str) -> Unit:
    """Look one name up in pint, which never sees a number."""
    near = [_MISTAKEN[name]] if name in _MISTAKEN else difflib.get_close_matches(name, UNITS, n=1, cutoff=0.5)
    near = difflib.get_close_matches(name.lower(), UNITS, n=1, cutoff=0.9) or near
    meant = f'Perhaps "{near[0]}" is meant; units' if near else "Units"
    unknown = _unit_error(name, f"{meant} are case-sensitive and joined by * or /")
    if name in _MISTAKEN:
        raise unknown
    pint, registry = _pint_registry()
    try:
        size = registry.Quantity(1, registry.parse_units(name)).to_base_units()
    except (pint.errors.PintError, AssertionError):
        raise unknown from None
    bases = {"meter": 0, "kilogram": 1, "second": 2, "radian": 3}
    powers = [0, 0, 0, 0]
    for base, power in size.unit_items():
        if base not in bases or power != int(power):
            raise unknown
        powers[bases[base]] = int(power)
    if not 0 < size.magnitude < math.inf:
        raise unknown
    return Unit(Fraction(repr(float(size.magnitude))), (powers[0], powers[1], powers[2], powers[3]))


@functools.cache
def _pint_registry() -> tuple[Any, Any]:
    import pint

    return pint, pint.UnitRegistry()


def _pure_number(text: str) -> float:
    match = _RATIO.fullmatch(text)
    if not match:
        raise _misreading(text, "number")
    over, under = _exact(match[1], "number"), _exact(match[2] or "1", "number")
    if under == 0:
        raise _refusal("number", "the ratio divides by zero")
    return _rounded(over / under, "number")


def _exact(number: str, kind: str) -> Fraction:
    """Return the number as written, its size checked before any digits are expanded."""
    mantissa = re.split("[eE]", number)[0]
    if not re.search("[1-9]", mantissa):
        return Fraction(0)
    if float(number) == 0 or math.isinf(float(number)):
        raise _refusal(kind, "the number is too large or too small to compute with")
    return Fraction(number)


def _rounded(value: Fraction, kind: str) -> float:
    """Return an SI value as float64, within a range whose fourth powers float64 can still hold."""
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
    others = [other for other in SI_UNIT if other != "number" and fits(unit_text, other)]
    what = f"a unit of {others[0]}, not of {kind}" if others else f"not a unit of {kind}"
    raise _refusal(kind, f'"{unit_text}" is {what}', f"Write it in {DISPLAY_UNIT[kind]}")


def _refusal(kind: str, problem: str, remedy: str = "") -> QuantityError:
    return QuantityError(problem, described(kind), remedy or "Correct the value")


def _unit_error(unit_text: str, remedy: str = "") -> QuantityError:
    joined = re.sub(r" *([*/^]) *| +", lambda gap: gap[1] or "*", unit_text)
    hint = f'Join units by * or / without spaces: "{joined}"' if re.fullmatch("[a-zA-Z*/^2-4 ]+", unit_text) else ""
    spaced = hint if " " in unit_text else ""
    return QuantityError(
        f'"{unit_text}" is not a unit',
        "units such as mm, deg, kg, N*m, rpm",
        remedy or spaced or "Correct the unit",
    )


def _misreading(text: str, kind: str, problem: str = "", remedy: str = "") -> QuantityError:
    """Name the likely mistake in text that is no quantity; problem and remedy where none is recognised."""
    if not text:
        return _refusal(kind, "the text is empty")
    if text.lstrip("+-").lower().startswith(("nan", "inf")):
        return _refusal(kind, "it is not a finite number")
    if re.match(r"[+-]?[0-9. ]*,", text):
        return _refusal(kind, "a comma stands in the number", "Write a decimal point and no thousands separators")
    if _GROUPED.match(text):
        return _refusal(kind, "the digits are grouped", "Write the digits without separators")
    if kind == "angular speed" and re.fullmatch(rf"{_NUMBER} */ *(min|s|sec)", text):
        return _refusal(kind, "it does not say whether turns or radians are counted", "Write rpm or rad/s")
    fraction = _FRACTION.fullmatch(text)
    if fraction:
        whole, over, under = (int(digits or 0) for digits in fraction.groups()[:3])
        decimal = f': "{whole + over / under:.10g} {fraction[4]}"' if under else ""
        return _refusal(kind, "a fraction stands for the number", f"Write a decimal number{decimal}")
    if _ARITHMETIC.search(text):
        return _refusal(kind, "arithmetic is not worked out here", "Write the result as one number")
    if not re.match(r"[+\- .]*[0-9]", text):
        return _refusal(
            kind,
            "the number is missing",
            "Write a number" if kind == "number" else "Write a number and its unit",
        )
    if kind == "number" and _QUANTITY.fullmatch(text):
        return _refusal(kind, "a unit stands after a number that has none", "Take the unit off")
    return _refusal(kind, problem or "it is not one number with one unit", remedy)


@dataclass(frozen=True)
class Quantity:
    """What a scene's number may be: its kind, and its range in SI units."""

    kind: str
    least: float = -math.inf
    above: float = -math.inf
    below: float = math.inf

    def validate(self, raw: object) -> float:
        """Return raw text (a pure number may be a number) in SI units. Raises QuantityError."""
        if isinstance(raw, str):
            value = read(raw, self.kind)
        elif isinstance(raw, bool) or not isinstance(raw, int | float):
            raise _refusal(self.kind, "it is not a quantity")
        elif self.kind != "number":
            raise _refusal(self.kind, "the unit is missing", 'Write number and unit as text, in "quotes"')
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


def quantity_of(model: type[BaseModel], field: str) -> Quantity | None:
    """Return what a model's field may be, also for `X | None`; None for a field that holds no quantity."""
    info = model.model_fields[field]
    return _find_quantity(*info.metadata, info.annotation)


def _find_quantity(*parts: object) -> Quantity | None:
    for part in parts:
        if isinstance(part, Quantity):
            return part
        found = _find_quantity(*typing.get_args(part))
        if found:
            return found
    return None


def kind_of(model: type[BaseModel], field: str) -> str:
    """Return the kind of quantity a model's field holds. Raises LookupError where it holds none."""
    quantity = quantity_of(model, field)
    if quantity is None:
        raise LookupError(f"{model.__name__}.{field} is no quantity")
    return quantity.kind


Length = Annotated[float, Quantity("length", least=0)]
PositiveLength = Annotated[float, Quantity("length", above=0)]
SignedLength = Annotated[float, Quantity("length")]
Angle = Annotated[float, Quantity("angle")]
PulseAngle = Annotated[float, Quantity("angle", above=0, below=2 * math.pi)]
Mass = Annotated[float, Quantity("mass", least=0)]
PositiveMass = Annotated[float, Quantity("mass", above=0)]
Inertia = Annotated[float, Quantity("inertia", least=0)]
PositiveInertia = Annotated[float, Quantity("inertia", above=0)]
Torque = Annotated[float, Quantity("torque", least=0)]
Force = Annotated[float, Quantity("force", least=0)]
Speed = Annotated[float, Quantity("angular speed", above=0)]
RotaryDamping = Annotated[float, Quantity("rotary damping", least=0)]
PureNumber = Annotated[float, Quantity("number", least=0)]
