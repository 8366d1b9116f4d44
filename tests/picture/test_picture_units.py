import pytest
from support import inch

import loomopt as lo
from loomopt.picture.shapes import Units, drawn_units

SHARES = {"l1": 0.2, "l2": 0.4, "l3": 0.9, "l4": 1.0}


@pytest.mark.parametrize(
    ("text", "unit"),
    [("140 mm", "mm"), ("14 cm", "mm"), ("0.14 m", "mm"), ("140000 um", "mm"), ("5.5 in", "in"), ("0.46 ft", "in")],
)
def test_a_scene_in_inches_or_feet_is_drawn_in_inches_and_every_other_in_mm(text, unit):
    size, unit_given = text.split()
    lengths = {name: f"{float(size) * share:.9g} {unit_given}" for name, share in SHARES.items()}
    scene = lo.scene({"problem": {"name": "x", "job": "beatup", "title": "x"}, "mechanism": lengths})
    assert drawn_units(scene).length == unit


def test_other_quantities_are_told_as_the_scene_writes_them():
    assert drawn_units(lo.load("shedding")) == Units("mm", "kg", "N", "N/m")
    assert drawn_units(inch.scene("shedding")) == Units("in", "lb", "lbf", "lbf/in")


def test_lengths_are_told_in_the_unit_without_its_name():
    assert (Units("mm").size(0.031), Units("in").size(0.0254)) == ("31", "1")
    assert (Units("mm").summary, Units("in").summary) == ("lengths in mm", "lengths in inches")


@pytest.mark.parametrize(
    ("metres", "millimetres", "inches"),
    [
        (1e-6, "0.001 mm", "0.00004 in"),
        (2.1e-7, "0.0003 mm", "0.000009 in"),
        (9.5e-3, "10 mm", "0.4 in"),
        (0, "0 mm", "0 in"),
    ],
)
def test_a_tolerance_is_rounded_up_to_one_digit(metres, millimetres, inches):
    assert Units("mm").within(metres) == millimetres
    assert Units("in").within(metres) == inches
    if metres:
        assert float(millimetres.split()[0]) >= 999.999999 * metres
