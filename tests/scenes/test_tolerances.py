"""[tolerances] and [accept]: read by the names of numbers, refused in one line each."""

import pytest

from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.scenes import tolerances
from loomopt.scenes.scene import cursor, places
from loomopt.scenes.tolerance_classes import plus_minus

BEATUP = registry.load("beatup")


def read_tolerances(**given):
    scene = BEATUP.update({"tolerances": given})
    return {e.number: e for e in tolerances.read(cursor(scene).at("tolerances"), scene.schema, places(scene))}


def test_half_widths_and_standard_deviations():
    result = read_tolerances(
        l1={"plus_minus": "0.06 mm", "sigmas": 2},
        l2="0.06 mm",
        l3={"plus_minus": "0.06 mm", "spread": "uniform"},
        M0="5 %",
        J4={"plus_minus": "2 %", "group": "reed", "correlation": 0.5},
    )
    assert result["l1"].sigma(0.03) == pytest.approx(3e-5, rel=1e-15)
    assert result["l2"].sigma(0.08) == pytest.approx(2e-5, rel=1e-15)
    assert result["l3"].sigma(0.15) == pytest.approx(6e-5 / 3**0.5, rel=1e-15)
    assert result["M0"].plus_minus(745.0) == pytest.approx(37.25, rel=1e-15)
    assert (result["J4"].group, result["J4"].correlation) == ("reed", 0.5)


@pytest.mark.parametrize(
    ("name", "nominal", "half"),
    [
        ("IT7", 0.03, 10.5e-6),  # 30 mm is in 18 to 30
        ("IT7", 0.0300001, 12.5e-6),
        ("IT5", 0.003, 2e-6),
        ("IT14", 3.15, 2700e-6),
        ("ISO 2768-m", 0.151, 0.5e-3),
        ("ISO 2768-f", 0.120, 0.15e-3),
        ("ISO 2768-v", 0.0035, 0.5e-3),
    ],
)
def test_classes_go_by_the_nominal(name, nominal, half):
    assert plus_minus(name, nominal) == pytest.approx(half, rel=1e-12)
    assert read_tolerances(l1={"class": name})["l1"].plus_minus(nominal) == pytest.approx(half, rel=1e-12)


@pytest.mark.parametrize(("name", "nominal"), [("IT7", 4.0), ("ISO 2768-f", 2.5), ("ISO 2768-v", 0.002)])
def test_a_class_that_says_nothing_of_a_size_is_refused(name, nominal):
    with pytest.raises(BadInput, match="does not cover"):
        read_tolerances(l1={"class": name})["l1"].plus_minus(nominal)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("tolerances", {"l9": "1 mm"}, "l9"),
        ("tolerances", {"l1": "1 kg"}, "kg"),
        ("tolerances", {"l1": "-1 mm"}, "out of range"),
        ("tolerances", {"l1": {"plus_minus": "1 mm", "class": "IT7"}}, "twice"),
        ("tolerances", {"l1": {"sigmas": 3}}, "plus_minus is missing"),
        ("tolerances", {"l1": {"plus": "1 mm"}}, "minus is missing"),
        ("tolerances", {"l1": {"plus": "-1 mm", "minus": "0"}}, "upper end of the band"),
        ("tolerances", {"l1": {"fit": "H17"}}, "unknown tolerance class"),
        ("tolerances", {"l1": {"fit": "K9"}}, "unknown tolerance class"),
        ("tolerances", {"M0": {"fit": "H7"}}, "needs a length"),
        ("tolerances", {"l1": {"plus": "1 %", "minus": "1 mm"}}, "one side is a percentage"),
        ("tolerances", {"l1": {"class": "IT77"}}, "IT7"),
        ("tolerances", {"M0": {"class": "IT7"}}, "a tolerance class needs a length"),
        ("tolerances", {"l1": {"plus_minus": "1 mm", "spread": "uniform", "sigmas": 3}}, "no sigmas"),
        ("tolerances", {"l1": {"plus_minus": "1 mm", "spread": "flat"}}, "normal, uniform"),
        ("tolerances", {"l1": {"plus_minus": "1 mm", "group": "machine"}}, "correlation is missing"),
        ("tolerances", {"l1": {"plus_minus": "1 mm", "correlation": 0.5}}, "group is missing"),
        ("tolerances", {"l1": {"plus_minus": "1 mm", "group": "machine", "correlation": 1.5}}, "more than 1"),
        ("tolerances", {"l1": {"plus_minus": "1 mm", "sigma": 3}}, "sigmas"),
        ("tolerances", {"l1": 3}, "unit"),
        ("tolerances", "l1", "not a table"),
        ("accept", {"M3": "1 N*m"}, "M3_fdc"),
        ("accept", {"M3_fdc": "0 N*m"}, "out of range"),
    ],
)
def test_what_is_wrong_is_said(key, value, message):
    with pytest.raises(BadInput, match=message.replace("*", r"\*")) as error:
        BEATUP.update({key: value})
    assert key in str(error.value)


def test_neither_table_decides_an_answer():
    assert BEATUP.update({"tolerances": {"l1": "1 mm"}, "accept": {"M3_fdc": "1 N*m"}}).hash == BEATUP.hash


def test_that_of_an_effect_that_is_off_waits_for_it():
    waiting = BEATUP.without_effect("resistance").update({"tolerances": {"pulse": "2 deg"}})
    assert waiting.with_effect("resistance").given("tolerances.pulse") == "2 deg"
    with pytest.raises(BadInput, match="pulse"):
        BEATUP.without_effect("resistance").update({"tolerances": {"pulse": "2 mm"}})


def test_a_band_that_is_not_even_has_its_middle_and_half_width():
    result = read_tolerances(
        l1={"plus": "0", "minus": "0.05 mm"},
        l2={"plus": "-0.02 mm", "minus": "0.06 mm", "spread": "uniform"},
        l3={"plus": "1 %", "minus": 0},
    )
    assert result["l1"].band(0.03) == (-5e-5, 0.0)
    assert (result["l1"].shift(0.03), result["l1"].plus_minus(0.03)) == pytest.approx((-2.5e-5, 2.5e-5), rel=1e-14)
    assert result["l1"].sigma(0.03) == pytest.approx(2.5e-5 / 3, rel=1e-14)
    assert (result["l2"].shift(0.08), result["l2"].plus_minus(0.08)) == pytest.approx((-4e-5, 2e-5), rel=1e-14)
    assert result["l3"].band(0.15) == pytest.approx((0.0, 1.5e-3), rel=1e-14)


FITS = """
H7 25 0 21 | g6 25 -20 -7 | H7 50 0 25 | g6 50 -25 -9 | h6 30 -13 0 | f7 40 -50 -25 | H8 40 0 39 | k6 25 2 15
n6 25 15 28 | p6 25 22 35 | s6 25 35 48 | m6 20 8 21 | K7 25 -15 6 | N7 25 -28 -7 | P7 25 -35 -14 | S7 25 -48 -27
M7 25 -21 0 | js6 25 -6.5 6.5 | d9 60 -174 -100 | e8 60 -106 -60 | H11 60 0 190 | r6 60 41 60 | k5 40 2 13
F8 20 20 53 | G7 20 7 28 | D10 30 65 149 | E9 10 25 61 | P6 25 -31 -18 | R7 60 -60 -30 | k6 3 0 6 | K8 25 -23 10
N8 25 -36 -3 | M6 300 -41 -9 | N6 300 -57 -25 | h9 100 -87 0 | H7 500 0 63 | JS7 100 -17.5 17.5
"""
"""Class, size in mm, lower and upper deviation in um: of the tables of limits in ISO 286-2 as handbooks print them."""


@pytest.mark.parametrize("row", FITS.replace("\n", "|").strip("|").split("|"))
def test_fits_have_the_printed_limits(row):
    name, size, low, high = row.split()
    result = read_tolerances(l1={"fit": name})["l1"].band(float(size) / 1000)
    assert result == pytest.approx((float(low) * 1e-6, float(high) * 1e-6), abs=1e-15)


def test_a_fit_says_nothing_beyond_500_mm():
    with pytest.raises(BadInput, match="does not cover 600 mm"):
        read_tolerances(l1={"fit": "H7"})["l1"].band(0.6)
