"""Quantities: the unit table against pint, exact conversion, and every way to misread one."""

import math
from decimal import Decimal
from fractions import Fraction

import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import BaseModel

from loomopt.base import quantities, units
from loomopt.base.quantities import (
    NARROWEST,
    Length,
    PulseAngle,
    PureNumber,
    Quantity,
    Speed,
    quantity_of,
    read,
    shortest_text,
    unit_of,
)
from loomopt.base.units import DISPLAY_UNIT, SI_UNIT, UNITS, QuantityError, factor, parse_unit, show

COMPOUND_UNITS = [
    "turn/min",
    "deg/s",
    "rad/s^2",
    "deg/s**2",
    "N*mm",
    "kN*m",
    "lbf*in",
    "lbf*ft",
    "kg*mm^2",
    "g*cm^2",
    "lb*in^2",
    "N/m",
    "N/mm",
    "lbf/in",
    "N*s/mm",
    "N*m/rad",
    "N*m/deg",
    "N*m*s/rad",
    "N*m/(rad/s)",
    "kg/m^3",
    "g/cm^3",
    "kgf/mm^2",
    "1/s",
    "s^-2",
    "m^4/(s^2*kg)",
]


@pytest.fixture(scope="module")
def registry():
    return pint.UnitRegistry()


OURS_ALONE = {"1": "", "lbm": "lb", "rev": "turn"}
"""Units that pint calls otherwise."""


@pytest.mark.parametrize("name", [*UNITS, *COMPOUND_UNITS, *DISPLAY_UNIT.values()])
def test_units_agree_with_pint(registry, name):
    ours = parse_unit(name)
    theirs = registry.Quantity(1, OURS_ALONE.get(name, name)).to_base_units()
    powers = dict(theirs.unit_items())
    assert float(ours.factor) == pytest.approx(theirs.magnitude, rel=4e-16)
    assert ours.powers == tuple(powers.get(base, 0) for base in ("meter", "kilogram", "second", "radian"))


@pytest.mark.parametrize(
    ("written", "plain"),
    [
        ("°", "deg"),
        ("µm", "um"),
        ("μm", "um"),
        ("kg·m²", "kg*m^2"),
        ("N·m·s·rad⁻¹", "N*m*s/rad"),
        ("m**2", "m^2"),
    ],
)
def test_units_as_they_are_printed(written, plain):
    assert parse_unit(written) == parse_unit(plain)


def test_a_unit_outside_the_table_comes_from_pint():
    assert read("2 inches", "length") == read("2 in", "length") == 0.0508
    assert read("60 arcminute", "angle") == pytest.approx(math.radians(1), rel=1e-15)


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("155 mm", "length", 0.155),
        ("0.155 m", "length", 0.155),
        ("0.000155 km", "length", 0.155),
        ("155000um", "length", 0.155),
        ("1.55e2mm", "length", 0.155),
        ("-3.1E+1 mm", "length", -0.031),
        (".5 m", "length", 0.5),
        ("5. m", "length", 5.0),
        ("8.375 in", "length", 0.212725),
        ("180 deg", "angle", math.pi),
        ("0.5 turn", "angle", math.pi),
        ("360°", "angle", 2 * math.pi),
        ("360º", "angle", 2 * math.pi),
        ("360 ˚", "angle", 2 * math.pi),
        ("600 rpm", "angular speed", 62.83185307179586),
        ("600 turn/min", "angular speed", 62.83185307179586),
        ("600 rev/min", "angular speed", 62.83185307179586),
        ("600 r/min", "angular speed", 62.83185307179586),
        ("600U/min", "angular speed", 62.83185307179586),
        ("600 picks/min", "angular speed", 62.83185307179586),
        ("600 pick/min", "angular speed", 62.83185307179586),
        ("600 ppm", "angular speed", 62.83185307179586),
        ("10 rev/s", "angular speed", 62.83185307179586),
        ("1 rev", "angle", 2 * math.pi),
        ("3 lbm", "mass", 1.36077711),
        ('8"', "length", 0.2032),
        ("8.5 ″", "length", 0.2159),
        ("2'", "length", 0.6096),
        ("2 ′", "length", 0.6096),
        ("360 deg/s", "angular speed", 2 * math.pi),
        ("1 kgf*m", "torque", 9.80665),
        ("0.62 kg*m^2", "inertia", 0.62),
        ("0.035 N*s/mm", "damping", 35.0),
        ("8000 N*m/rad", "rotary stiffness", 8000.0),
        ("8000 N*m", "rotary stiffness", 8000.0),
        ("2 N*m*s", "rotary damping", 2.0),
        ("7.85 g/cm^3", "density", 7850.0),
        ("81.5 GPa", "pressure", 8.15e10),
        ("1e999", "number", None),
        ("300/18", "number", 300 / 18),
        ("1.5", "number", 1.5),
        ("0 kg", "mass", 0.0),
        ("0e99999999 kg", "mass", 0.0),
    ],
)
def test_reading(text, kind, value):
    if value is None:
        with pytest.raises(QuantityError):
            read(text, kind)
    else:
        assert read(text, kind) == value


@given(st.decimals("0.001", "100000", places=6, allow_nan=False))
@settings(deadline=None, derandomize=True)
def test_one_length_in_every_unit(millimetres):
    in_metres = float(Fraction(millimetres) / 1000)
    for unit, size in (("mm", "1"), ("cm", "10"), ("m", "1000"), ("km", "1000000"), ("um", "0.001")):
        assert read(f"{millimetres / Decimal(size):f} {unit}", "length") == in_metres
    for unit, size in (("in", "25.4"), ("ft", "304.8")):
        assert read(f"{millimetres / Decimal(size):f} {unit}", "length") == pytest.approx(in_metres, rel=1e-15)


MISREADINGS = [
    ("31,5 mm", "length", "comma", "decimal point"),
    ("1,234.5 mm", "length", "comma", "thousands"),
    ("8 3/8 in", "length", "fraction", '"8.375 in"'),
    ("3/8 in", "length", "fraction", '"0.375 in"'),
    ("3/0 in", "length", "fraction", "decimal number"),
    ("10 Hz", "angular speed", "turns or radians", '"600 rpm"'),
    ("600 1/min", "angular speed", "turns or radians", '"600 rpm"'),
    ("10 s^-1", "angular speed", "turns or radians", '"600 rpm"'),
    ("600/min", "angular speed", "turns or radians", "rpm"),
    ("65", "angle", "unit is missing", '"65 deg"'),
    ("600", "angular speed", "unit is missing", '"600 rpm"'),
    ("65 mm + 3 in", "length", "arithmetic", "one number"),
    ("65 mm+3 in", "length", "arithmetic", "one number"),
    ("65 mm - 3 mm", "length", "arithmetic", "one number"),
    ("2*31 mm", "length", "arithmetic", "one number"),
    ("9**9**9**9 mm", "length", "arithmetic", "one number"),
    ("2*3", "number", "arithmetic", "one number"),
    ("sqrt(2) m", "length", "number is missing", "number"),
    ("nan mm", "length", "finite", ""),
    ("-inf mm", "length", "finite", ""),
    ("Infinity", "number", "finite", ""),
    ("1e999 mm", "length", "too large", ""),
    ("1e-999 mm", "length", "too small", ""),
    ("1e300 km", "length", "too large", ""),
    ("1e999999999999 m", "length", "too large", ""),
    ("9" * 101 + " m", "length", "characters long", ""),
    ("300/0", "number", "divides by zero", ""),
    ("5 mm", "number", "has no unit", "off"),
    ("65 kg", "length", '"kg" is a unit of mass, not of length', "mm"),
    ("65 deg", "angular speed", "unit of angle", '"deg/s"'),
    ("65 N*m", "force", "unit of torque", "N"),
    ("65 rad*m", "length", "not a unit of length", "mm"),
    ("65 m^2", "length", "not a unit of length", "mm"),
    ("65 degC", "angle", "not a unit", "deg"),
    ("65 dB", "length", "not a unit of length", "mm"),
    ("65 Nm", "torque", '"Nm" is not a unit', '"N*m"'),
    ("65 N m", "torque", "not a unit", '"N*m"'),
    ("5 kg m^2", "inertia", "not a unit", '"kg*m^2"'),
    ("5 Ns/m", "damping", "not a unit", '"N*s/m"'),
    ("23 grad", "angle", "not a unit", '"deg"'),
    ("600 RPM", "angular speed", "not a unit", '"rpm"'),
    ("65 milimetre", "length", "not a unit", "case-sensitive"),
    ("65 mm^9", "length", "not a unit", "powers up to 4"),
    ("65 mm^9**9", "length", "arithmetic", "one number"),
    ("65 N/(m", "stiffness", "not a unit", ""),
    ("65 (km/m)^4", "length", "not a unit", ""),
    ("65 mm*", "length", "not a unit", ""),
    ('8 in"', "length", "not a unit", ""),
    ('8"', "angle", 'the sign " is of a length', '"8 arcsec"'),
    ("8'", "angle", "the sign ' is of a length", '"8 arcmin"'),
    ('8"', "mass", "a unit of length, not of mass", "kg, g or lb"),
    ("8'3\"", "length", "feet and inches are two numbers", '"99 in"'),
    ("8 ft 3 in", "length", "feet and inches are two numbers", '"99 in"'),
    ('3 3/8"', "length", "a fraction", '"3.375 in"'),
    ("600 mm", "angular speed", "a unit of length, not of angular speed", "rpm, rad/s, deg/s"),
    ("600 kg", "torque", "a unit of mass, not of torque", "N*m, N*mm"),
    ("5 r", "angle", "not a unit", "An angle is written in deg, rad or turn"),
    ("5 U", "angle", "not a unit", "An angle is written in deg, rad or turn"),
    ("5 ppm", "number", "this number has no unit", "Take the unit off"),
    ("5 ppm", "mass", "a unit of angular speed, not of mass", "kg, g or lb"),
    ("600 picks", "angular speed", "not a unit", "picks/min"),
    ("600,5 ppm", "angular speed", "a comma", "decimal point"),
    ('31,5"', "length", "a comma", "decimal point"),
    ("1_000 mm", "length", "grouped", "without separators"),
    ("1 000 mm", "length", "grouped", "without separators"),
    ("0x10 mm", "length", "not a unit", ""),
    ("٣ mm", "length", "number is missing", ""),
    ("mm", "length", "number is missing", ""),
    ("", "length", "empty", ""),
    ("65\nmm", "length", "not a unit", ""),
]


@pytest.mark.parametrize(("text", "kind", "problem", "remedy"), MISREADINGS)
def test_misreadings_are_refused_by_name(text, kind, problem, remedy):
    with pytest.raises(QuantityError) as caught:
        read(text, kind)
    assert problem in caught.value.problem
    assert remedy in caught.value.remedy
    assert caught.value.allowed
    assert caught.value.remedy


@pytest.mark.slow
@given(st.text(max_size=40) | st.from_regex(r"[0-9]{1,3} ?[ a-zµ°·²*/^().0-9+-]{1,12}", fullmatch=True))
@settings(deadline=None, derandomize=True, max_examples=400)
def test_any_text_is_a_finite_number_or_refused(text):
    for kind in ("length", "angular speed", "number"):
        try:
            value = read(text, kind)
        except QuantityError as error:
            value = 0.0 if error.problem and error.allowed and error.remedy else math.nan
        assert math.isfinite(value)


class Model(BaseModel):
    length: Length = 0.0
    speed: Speed | None = None
    weights: dict[str, PureNumber] = {}
    pulse: PulseAngle = 1.0
    name: str = ""


def test_a_field_knows_its_kind():
    kinds = [quantity_of(Model, name).kind for name in ("length", "speed", "weights")]
    assert kinds == ["length", "angular speed", "number"]
    assert quantity_of(Model, "pulse") == Quantity("angle", least=NARROWEST, below=2 * math.pi)
    assert quantity_of(Model, "name") is None


@pytest.mark.parametrize(
    ("quantity", "raw", "problem"),
    [
        (Quantity("length", least=0), "-1 mm", "out of range"),
        (Quantity("length", above=0), "0 mm", "out of range"),
        (Quantity("angle", above=0, below=2 * math.pi), "360 deg", "out of range"),
        (Quantity("length"), 31, "unit is missing"),
        (Quantity("length"), True, "not a quantity"),
        (Quantity("length"), None, "not a quantity"),
        (Quantity("number"), math.nan, "finite"),
        (Quantity("number"), 10**400, "too large"),
    ],
)
def test_ranges_and_sorts(quantity, raw, problem):
    with pytest.raises(QuantityError, match=problem):
        quantity.validate(raw)


def test_a_range_is_told_in_display_units():
    with pytest.raises(QuantityError) as caught:
        Quantity("angle", above=0, below=2 * math.pi).validate("400 deg")
    assert caught.value.allowed == "more than 0 deg, less than 360 deg"


def test_showing():
    assert show(0.03, "mm") == "30 mm"
    assert show(-0.0, "mm") == "0 mm"
    assert show(62.83185307179586, "rpm") == "600 rpm"
    assert show(300 / 18, "1", digits=4) == "16.67"
    assert unit_of("0.62 kg·m²") == "kg·m²"
    assert unit_of("300/18") == "1"
    assert factor("rpm") == pytest.approx(math.pi / 30, rel=3e-16)
    with pytest.raises(QuantityError):
        unit_of("mm")


@pytest.mark.parametrize("kind", SI_UNIT)
def test_every_kind_has_units_of_its_own_kind(kind):
    assert parse_unit(SI_UNIT[kind]).factor == 1
    assert units.fits(DISPLAY_UNIT[kind], kind)
    if kind != "number":
        assert read(f"2 {DISPLAY_UNIT[kind]}", kind) == pytest.approx(2 * factor(DISPLAY_UNIT[kind]), rel=3e-16)
        assert DISPLAY_UNIT[kind] in quantities.described(kind)


@given(st.floats(1e-12, 1e12), st.sampled_from(["mm", "in", "m", "um"]), st.sampled_from([1, -1]))
def test_exact_text_reads_back_as_the_same_number(value, unit, sign):
    assert read(shortest_text(sign * value, unit, "length"), "length") == sign * value


@pytest.mark.parametrize(
    ("value", "unit", "kind", "text"),
    [
        (0.03, "mm", "length", "30 mm"),
        (0.0, "mm", "length", "0 mm"),
        (-0.0, "kg", "mass", "0 kg"),
        (0.084060312345, "mm", "length", "84.060312345 mm"),
        (read("-2.2 deg", "angle"), "deg", "angle", "-2.2 deg"),
        (62.83185307179586, "rpm", "angular speed", "600 rpm"),
        (50 / 3, "1", "number", "16.666666666666668"),
        (1e-9, "m", "length", "0.000000001 m"),
        (1e-30, "m", "length", "1E-30 m"),
        (1e25, "N/m", "stiffness", "1E+25 N/m"),
    ],
)
def test_exact_text_is_as_short_as_it_can_be(value, unit, kind, text):
    assert shortest_text(value, unit, kind) == text


def test_a_kilopond_is_no_kilonewton():
    with pytest.raises(QuantityError) as refused:
        read("12 kp", "force")
    assert '"kgf"' in refused.value.remedy
