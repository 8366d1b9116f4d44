"""Units: exact size of each unit in SI, and parser of expressions of units.

Factors are exact fractions. Angle is a dimension of its own, so that rpm and Hz cannot be mistaken for each other.
"""

import difflib
import functools
import math
import re
from fractions import Fraction
from typing import Any, NamedTuple, Protocol


class QuantityError(ValueError):
    """Text that is not the expected quantity: problem, allowed values and remedy in plain words."""

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
_HORSEPOWER = 550 * 12 * _INCH * _POUND * _GRAVITY

_TABLE: tuple[tuple[tuple[int, int, int, int], dict[str, Fraction | str]], ...] = (
    ((1, 0, 0, 0), {"m": "1", "mm": "1e-3", "cm": "1e-2", "dm": "0.1", "km": "1000", "um": "1e-6"}),
    ((1, 0, 0, 0), {"in": _INCH, "inch": _INCH, "ft": 12 * _INCH}),
    ((0, 1, 0, 0), {"kg": "1", "g": "1e-3", "mg": "1e-6", "t": "1000", "lb": _POUND, "lbm": _POUND}),
    ((0, 0, 1, 0), {"s": "1", "ms": "1e-3", "us": "1e-6", "min": "60", "h": "3600"}),
    ((0, 0, 0, 1), {"rad": "1", "mrad": "1e-3", "deg": _PI / 180, "turn": 2 * _PI, "rev": 2 * _PI}),
    ((0, 0, -1, 1), {"rpm": _PI / 30}),
    ((0, 0, -1, 0), {"Hz": "1"}),
    ((1, 1, -2, 0), {"N": "1", "mN": "1e-3", "kN": "1000", "MN": "1e6", "lbf": _POUND * _GRAVITY, "kgf": _GRAVITY}),
    ((2, 1, -2, 0), {"J": "1"}),
    ((2, 1, -3, 0), {"W": "1", "kW": "1000", "hp": _HORSEPOWER}),
    ((-1, 1, -2, 0), {"Pa": "1", "kPa": "1e3", "MPa": "1e6", "GPa": "1e9", "bar": "1e5", "psi": _PSI}),
)
UNITS = {name: Unit(Fraction(factor), powers) for powers, names in _TABLE for name, factor in names.items()}
"""Common units by name; any other is looked up in pint, which is imported only then."""
SPEEDS = dict.fromkeys(("r/min", "U/min", "picks/min", "pick/min", "ppm"), UNITS["rpm"])
"""Angular speeds that are read as a whole, by name; a pick is a turn of the shaft."""
PRIMES = {'"': "in", "'": "ft"}
"""Signs of a length → its unit."""

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
    "travel velocity": "m/rad",
    "travel acceleration": "m/rad^2",
    "travel jerk": "m/rad^3",
    "curvature": "1/m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "jerk": "m/s^3",
    "power": "W",
    "energy": "J",
}
"""Kind of quantity → the SI unit its numbers have inside the program."""

DISPLAY_UNIT = SI_UNIT | {"length": "mm", "angle": "deg", "angular speed": "rpm", "pressure": "MPa"}
"""Kind of quantity → the unit it is shown in where a scene writes none."""


class ShowValue(Protocol):
    """shown(value, kind, digits): an SI value as text in the unit in which a person sees its kind of quantity."""

    def __call__(self, value: float, kind: str, digits: int = 6, /) -> str:
        """Text; digits: significant ones."""


_USUAL: dict[str, str] = {
    "length": "mm cm m in ft",
    "angle": "deg rad turn",
    "mass": "kg g lb",
    "time": "s ms min",
    "force": "N kN lbf",
    "torque": "N*m N*mm N*cm kN*m lbf*in lbf*ft",
    "inertia": "kg*m^2 kg*mm^2 kg*cm^2 g*mm^2 lb*in^2",
    "angular speed": "rpm rad/s deg/s turn/min rev/min r/min U/min picks/min ppm",
    "angular acceleration": "rad/s^2 deg/s^2",
    "stiffness": "N/m N/mm kN/m lbf/in",
    "rotary stiffness": "N*m/rad N*m/deg lbf*in/rad",
    "damping": "N*s/m N*s/mm",
    "pressure": "MPa Pa bar psi",
    "density": "kg/m^3 g/cm^3 lb/in^3",
    "velocity": "m/s mm/s in/s",
    "acceleration": "m/s^2 mm/s^2 in/s^2",
    "power": "W kW hp",
    "energy": "J N*m lbf*in",
}
"""Units that people write, by kind of quantity, in addition to those of `SI_UNIT`."""


def usual_units(kind: str) -> str:
    """Units of a kind of quantity that people write, in words: "rpm, rad/s or deg/s"."""
    *others, last = dict.fromkeys([DISPLAY_UNIT[kind], *_USUAL.get(kind, "").split(), SI_UNIT[kind]])
    return f"{', '.join(others)} or {last}" if others else last


_LARGEST_EXPONENT, _LONGEST_UNIT = 4, 20
_TOKEN = re.compile(r"\*\*|[*/^()]|[+-]?[0-9]+|[^\W\d_]+|.", re.DOTALL)
_SUPERSCRIPT = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_MISTAKEN = {"Nm": "N*m", "Nmm": "N*mm", "kNm": "kN*m", "Ns": "N*s", "Nms": "N*m*s", "grad": "deg", "kp": "kgf"}
"""Text that pint would read as a yarn count, plural or gon, or that is close to a wrong unit → the intended unit."""
_QUOTES = str.maketrans({"″": '"', "”": '"', "′": "'", "’": "'"})
_LOOKALIKE = str.maketrans({"·": "*", "⋅": "*", "µ": "u", "μ": "u", "°": "deg", "º": "deg", "˚": "deg"})


def factor(unit_text: str) -> float:
    """Number of SI units in one `unit_text`. Raises QuantityError for an unknown unit."""
    return float(parse_unit(unit_text).factor)


def show(value: float, unit_text: str, digits: int = 6) -> str:
    """SI value as text in `unit_text`, such as "30 mm"; digits: significant digits."""
    number = f"{value / factor(unit_text) + 0.0:.{digits}g}"
    return number if unit_text == "1" else f"{number} {unit_text}"


def usual(value: float, kind: str, digits: int = 6) -> str:
    """SI value as text in the usual unit of its kind of quantity."""
    return show(value, DISPLAY_UNIT[kind], digits)


def fits(unit_text: str, kind: str) -> bool:
    """Whether a unit is one of a kind of quantity. Raises QuantityError for an unknown unit."""
    *mechanical, angle = parse_unit(unit_text).powers
    *wanted, wanted_angle = parse_unit(SI_UNIT[kind]).powers
    return mechanical == wanted and (angle == wanted_angle or angle == 0 > wanted_angle)


@functools.lru_cache(maxsize=512)
def parse_unit(text: str) -> Unit:
    """Unit that an expression gives: names joined by * or /, powers ^ or ** up to 4, parentheses.

    Raises QuantityError for an unknown unit and for anything else, a space or arithmetic included.
    """
    if text == "1":
        return Unit(Fraction(1), (0, 0, 0, 0))
    if text in SPEEDS:
        return SPEEDS[text]
    tokens = _TOKEN.findall(ascii_unit(text))
    reciprocal = tokens[:2] == ["1", "/"]
    if reciprocal:
        tokens[:2] = []
    unit = _product(tokens, text)
    if tokens:
        raise _unit_error(text)
    return _times(parse_unit("1"), unit, -1) if reciprocal else unit


def ascii_unit(text: str) -> str:
    """Unit's text in ASCII: N·m² as N*m^2, ° as deg, " as in."""
    text = PRIMES.get(text.translate(_QUOTES), text)
    return re.sub("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+", lambda power: "^" + power[0].translate(_SUPERSCRIPT), text).translate(_LOOKALIKE)


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


def meant_unit(text: str, kind: str, shortest: int = 2) -> str:
    """Unit of a kind of quantity that differs from a wrong text by one typing error; "" if there is none.

    Case, and what joins units, count for nothing; a slip is a letter more, less, another one, or two exchanged.
    shortest: letters of text in which there may be one.
    """
    usual = [DISPLAY_UNIT[kind], SI_UNIT[kind], *_USUAL.get(kind, "").split(), *(u for u in UNITS if fits(u, kind))]
    given = _letters(_MISTAKEN.get(text, text))
    powers = sum(map(str.isdigit, given))
    alike = (unit for unit in dict.fromkeys(usual) if sum(map(str.isdigit, unit)) >= powers)
    slips = {unit: _slips(given, _letters(unit)) for unit in alike}
    best = min(slips, key=lambda unit: (slips[unit], abs(len(_letters(unit)) - len(given))), default="")
    return best if slips and slips[best] <= (len(given) >= shortest) else ""


def _letters(unit: str) -> str:
    """Unit's letters and digits, all small."""
    return re.sub(r"[^a-z0-9]", "", ascii_unit(unit[:_LONGEST_UNIT]).lower())


def _slips(first: str, second: str) -> int:
    """Edit distance of two words: letters to insert, delete, change or exchange."""
    before: list[int] = []
    row = list(range(len(second) + 1))
    for i, a in enumerate(first):
        last, before, row = before, row, [i + 1]
        for j, b in enumerate(second):
            row.append(min(before[j] + (a != b), before[j + 1] + 1, row[j] + 1))
            if i and j and a == second[j - 1] and b == first[i - 1]:
                row[-1] = min(row[-1], last[j - 1] + 1)
    return row[-1]


@functools.cache
def _pint_registry() -> tuple[Any, Any]:
    import pint

    return pint, pint.UnitRegistry()


def _unit_error(unit_text: str, remedy: str = "") -> QuantityError:
    joined = re.sub(r" *([*/^]) *| +", lambda gap: gap[1] or "*", unit_text)
    hint = f'Join units by * or / without spaces: "{joined}"' if re.fullmatch("[a-zA-Z*/^2-4 ]+", unit_text) else ""
    spaced = hint if " " in unit_text else ""
    return QuantityError(
        f'"{unit_text}" is not a unit',
        "units such as mm, deg, kg, N*m, rpm",
        remedy or spaced or "Correct the unit",
    )
