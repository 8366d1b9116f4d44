"""Limits, prices and relaxations in the designer's own words and units."""

import math

import pytest

import loomopt as lo
from loomopt.model.limits import BoundLimit
from loomopt.model.objectives import Magnitude, Peak, Value
from loomopt.solving.answer.solution import Relaxation, UnitFormatter, outward, remedies
from loomopt.solving.certificate.records import Binding


@pytest.mark.parametrize(
    ("value", "side", "expected"),
    [
        (1.2345671, 1, 1.23457),
        (1.2345671, -1, 1.23456),
        (-1.2345671, 1, -1.23456),
        (-1.2345671, -1, -1.23457),
        (123456.1, 1, 123457.0),
        (123456.1, 0, 123456.0),
        (1.5, 1, 1.5),
        (0.0, 1, 0.0),
        (9.999999e-7, 1, 1e-6),
    ],
)
def test_a_value_is_rounded_to_the_side_that_gives_no_less_room(value, side, expected):
    assert outward(value, side) == pytest.approx(expected, rel=1e-12)


@pytest.fixture
def words():
    return UnitFormatter(lo.load("beatup"))


@pytest.mark.parametrize(
    ("name", "kind", "unit"),
    [
        ("l1", "length", "mm"),
        ("m4e", "mass", "kg"),
        ("theta", "angle", "deg"),
        ("peak_torque", "torque", "N*m"),
        ("M0", "torque", "N*m"),
        ("speed", "angular speed", "rpm"),
        ("s", "number", "1"),
        ("no such name", "number", "1"),
    ],
)
def test_every_name_has_a_kind_and_a_unit(words, name, kind, unit):
    assert (words.kind(name), words.unit(name)) == (kind, unit)


def test_a_number_of_an_effect_is_known_by_its_label():
    formatter = UnitFormatter(lo.load("shedding").with_effect("coil"))
    assert formatter.kind("wire") == "length"
    assert formatter.kind("initial_tension") == "force"
    assert formatter.kind("law") == "number"


def test_values_are_shown_as_the_scene_writes_them():
    formatter = UnitFormatter(lo.load("beatup").set("mechanism.l1", "3.15 cm"))
    assert formatter.shown("l1", 0.0305) == "3.05 cm"
    assert formatter.shown("theta", math.radians(2.2)) == "2.2 deg"
    assert formatter.shown("peak_torque", 88.68941349, 3) == "88.7 N*m"
    assert formatter.shown("peak_torque", 88.68941349) == "88.6894 N*m"
    assert formatter.si("theta") == "rad"


def limit(name="l1", sign=-1, value=0.03, scale=1.0):
    return BoundLimit(name, sign, name, value, scale)


@pytest.mark.parametrize(("sign", "text"), [(-1, "l1 >= 30 mm"), (0, "l1 = 30 mm"), (1, "l1 <= 30 mm")])
def test_a_limit_is_a_phrase(words, sign, text):
    assert words.limit(limit(sign=sign)) == text


def test_a_margin_is_its_own_phrase(words):
    name = next(iter(words.scene.schema.margins))
    assert words.limit(limit(name)) == name


def test_a_price_is_what_all_rows_of_a_limit_are_worth_together(words):
    torque = Peak("peak_torque", "peak_torque", 1.0)
    other = Magnitude("M3_fdc", "M3_fdc", 1.0)
    bindings = [Binding(limit(), -1, torque, 3000.0), Binding(limit(), -1, torque, 1160.0)]
    price = words.price([*bindings, Binding(limit(), -1, other, 7.0)])
    assert (price.limit, price.side, price.value, price.text) == ("l1", "min", 0.03, "l1 >= 30 mm")
    assert price.worth == {"peak_torque": pytest.approx(4160.0)}
    assert price.unit == {"peak_torque": "N*m/m"}
    assert price.reading == "4.16 N*m per mm"
    angle = words.price([Binding(limit("theta", 1, 0.04), 1, torque, 180 / math.pi)])
    assert (angle.side, angle.reading, angle.unit) == ("max", "1 N*m per deg", {"peak_torque": "N*m/rad"})


def test_a_compound_unit_stands_in_brackets_after_the_stroke():
    formatter = UnitFormatter(lo.load("shedding"))
    stiffness = Value("K1", "K1", 1.0)
    price = formatter.price([Binding(limit("K1", 1, 9e4), 1, stiffness, 1.0)])
    assert price.unit == {"K1": "N/m/(N/m)"}


@pytest.mark.parametrize(
    ("sign", "need", "side", "needed", "text"),
    [
        (-1, 0.0012345678, "min", 0.0287654322, "l1 >= 30 mm -> 28.7654 mm (by 1.23 mm)"),
        (1, 0.0012345678, "max", 0.0312345678, "l1 <= 30 mm -> 31.2346 mm (by 1.23 mm)"),
        (0, 0.0012345678, "max", 0.0312345678, "l1 = 30 mm -> 31.2346 mm (by 1.23 mm)"),
        (0, -0.0012345678, "min", 0.0287654322, "l1 = 30 mm -> 28.7654 mm (by 1.23 mm)"),
    ],
)
def test_a_relaxation_says_how_far_a_limit_must_give_way(words, sign, need, side, needed, text):
    result = words.relaxation(limit(sign=sign), need, alone=True)
    assert (result.limit, result.value, result.alone, result.text) == ("l1", 0.03, True, text)
    assert result.needed == pytest.approx(needed, rel=1e-12)
    assert result.side == side


@pytest.mark.parametrize(
    ("name", "sign", "value", "need", "fair"),
    [
        ("l1", 1, 0.035, 0.01499, True),
        ("l1", 1, 0.035, 0.01501, False),
        ("l1", -1, 0.03, 0.01501, False),
        ("mu_min", -1, 1.0, 2.9, True),
        ("mu_min", -1, 1.0, 3.1, False),
        ("M3_fdc", 0, 0.0, 149.0, True),
        ("M3_fdc", 0, 0.0, 151.0, False),
    ],
)
def test_more_than_three_widths_are_out_of_proportion(words, name, sign, value, need, fair):
    """Bounds of 5 mm by their width, a figure by its limit, and what should vanish by its scale (50 N m)."""
    result = words.relaxation(limit(name, sign, value, scale=50.0), need, alone=True)
    assert result.in_proportion == fair
    assert result.text.endswith(")" if fair else ", out of proportion)")
    assert ("out of proportion" in result.text) != fair


@pytest.mark.parametrize(("noise", "text"), [(1e-9, "-> 0 N"), (-1e-9, "-> 0 N"), (0.5, "-> -0.5 N")])
def test_a_relaxation_that_ends_at_rounding_ends_at_zero(noise, text):
    result = UnitFormatter(lo.load("shedding")).relaxation(limit("N_min", -1, 9000.0), 9000.0 + noise, alone=True)
    assert text in result.text
    assert (result.needed == 0.0) == (abs(noise) < 0.1)


def relaxation(limit, fair, alone):
    return Relaxation(limit, "max", 1.0, 2.0, alone, limit, fair)


@pytest.mark.parametrize(
    ("relaxations", "order"),
    [
        ("a b", [("a",), ("b",)]),
        ("A b", [("b",), ("A",)]),
        ("x,y a", [("x", "y"), ("a",)]),
        ("x,Y A b", [("b",), ("x", "Y"), ("A",)]),
        ("X", [("X",)]),
    ],
)
def test_what_is_out_of_proportion_is_told_last(relaxations, order):
    """Capitals are out of proportion; joined by a comma, limits give way together."""
    results = [relaxation(n, n.islower(), "," not in group) for group in relaxations.split() for n in group.split(",")]
    assert [tuple(item.limit for item in remedy) for remedy in remedies(results)] == order


@pytest.mark.parametrize(("side", "text"), [(-1, "76.9041 N*m"), (1, "76.9042 N*m")])
def test_what_is_never_passed_is_outward(side, text):
    assert UnitFormatter(lo.load("beatup")).outward("M3_fdc", 76.90412098, side) == text
