"""[display] and the units a scene is seen in: the first of each kind that is written, else composed of the others."""

import math

import pytest
from support import inch

import loomopt as lo
from loomopt.base.quantities import read
from loomopt.base.units import DISPLAY_UNIT, SI_UNIT, QuantityError, fits
from loomopt.scenes.display import KINDS

SHEDDING = lo.load("shedding")
RAPIER = lo.load("rapier")
BEATUP = lo.load("beatup")


def units(scene, *kinds):
    return [scene.shown_in(kind) for kind in kinds]


def rewritten(name, **changes):
    """Return a packaged scene with some of its numbers written in other units."""
    return lo.load(name).update({key.replace("__", "."): value for key, value in changes.items()})


def test_every_kind_of_quantity_has_a_key_and_a_unit():
    assert set(KINDS.values()) == set(SI_UNIT) - {"number"}
    assert {"length", "force", "torque", "mass", "stiffness", "pressure", "angle", "speed"} <= set(KINDS)
    assert KINDS["speed"] == "angular speed"
    assert all(key.isidentifier() for key in KINDS)
    for scene in (BEATUP, RAPIER, SHEDDING, inch.scene("beatup"), inch.scene("shedding")):
        assert set(scene.units) == set(SI_UNIT)
        assert all(fits(scene.shown_in(kind), kind) for kind in SI_UNIT)
        assert all(scene.shown_in(kind).isascii() for kind in SI_UNIT)


def test_the_first_unit_counts_of_the_mechanism_then_the_operation_then_the_effects():
    kinds = ("length", "force", "angle", "mass")
    assert units(SHEDDING, *kinds) == ["mm", "N", "deg", "kg"]
    assert units(rewritten("shedding", operation__N_min="0 kN"), *kinds) == ["mm", "kN", "deg", "kg"]
    assert units(rewritten("shedding", mechanism__travel="6.56 cm"), *kinds) == ["cm", "N", "deg", "kg"]
    assert units(rewritten("shedding", effects__weight__G="369.55e-3 kN"), "force") == ["N"], "N_min comes first"
    assert units(rewritten("shedding", effects__inertia__M="37683 g"), "mass") == ["g"]
    assert units(rewritten("rapier", operation__stroke="85 cm"), "length") == ["mm"], "the mechanism comes first"


def test_a_bound_or_a_limit_names_the_unit_of_a_kind_that_nothing_else_is_written_in():
    assert units(rewritten("rapier", limits__peak_acceleration__max="900 mm/rad^2"), "travel acceleration") == [
        "mm/rad^2"
    ]
    assert units(rewritten("beatup", limits__peak_torque__max="1 kN*m"), "torque") == ["N*m"], "M0 comes first"


def test_a_length_is_no_unit_of_an_acceleration_per_angle_and_a_torque_none_of_a_stiffness():
    """Read as quantities "m" and "m/rad^2" may stand for each other: as units of tables they never do."""
    assert units(RAPIER, "length", "travel acceleration", "travel jerk") == ["mm", "m/rad^2", "m/rad^3"]


@pytest.mark.parametrize(("unit", "si"), [("m/rad", 1.0), ("mm/deg", 0.18 / math.pi), ("in/rad", 0.0254)])
def test_a_velocity_per_radian_of_the_crank_is_a_kind_of_its_own(unit, si):
    """As its acceleration and jerk are: of what slides, not of what swings."""
    assert read(f"3 {unit}", "travel velocity") == pytest.approx(3 * si, rel=1e-15)
    assert RAPIER.set("display.travel_velocity", unit).shown_in("travel velocity") == unit
    assert RAPIER.set("display.length", "in").unit_for("m/rad") == "in/rad"
    with pytest.raises(QuantityError, match="a unit of velocity"):
        read("3 m/s", "travel velocity")
    assert units(BEATUP, "torque", "rotary stiffness", "rotary damping") == ["N*m", "N*m/rad", "N*m*s/rad"]


def test_units_are_spelled_in_ascii():
    scene = rewritten("beatup", operation__M0="745 N·m", effects__inertia__J4="0.62 kg·m²", mechanism__l1="31000 µm")
    assert units(scene, "torque", "inertia", "length") == ["N*m", "kg*m^2", "um"]
    assert BEATUP.set("display.angle", "°").shown_in("angle") == "deg"


COMPOSED = ("torque", "stiffness", "inertia", "curvature", "pressure", "damping", "density", "travel acceleration")
BARE = {
    "problem": {"name": "bare", "job": "rapier", "title": "Bare"},
    "operation": {},
    "mechanism": dict(RAPIER.document["mechanism"]),
}


@pytest.mark.parametrize(
    ("display", "expected"),
    [
        ({}, ["N*m", "N/m", "kg*m^2", "1/m", "MPa", "N*s/m", "kg/m^3", "m/rad^2"]),
        ({"length": "cm", "force": "kN"}, ["N*m", "N/m", "kg*m^2", "1/m", "MPa", "N*s/m", "kg/m^3", "m/rad^2"]),
        ({"length": "in"}, ["lbf*in", "lbf/in", "lb*in^2", "1/in", "psi", "lbf*s/in", "lb/in^3", "in/rad^2"]),
        ({"length": "ft"}, ["lbf*ft", "lbf/ft", "lb*ft^2", "1/ft", "psi", "lbf*s/ft", "lb/ft^3", "ft/rad^2"]),
        (
            {"force": "lbf", "mass": "kg"},
            ["lbf*mm", "lbf/mm", "kg*m^2", "1/m", "psi", "lbf*s/mm", "kg/m^3", "m/rad^2"],
        ),
        ({"force": "kgf"}, ["kgf*mm", "kgf/mm", "kg*m^2", "1/m", "kgf/mm^2", "kgf*s/mm", "kg/m^3", "m/rad^2"]),
        (
            {"force": "kgf", "length": "cm"},
            ["kgf*cm", "kgf/cm", "kg*m^2", "1/m", "kgf/cm^2", "kgf*s/cm", "kg/m^3", "m/rad^2"],
        ),
        (
            {"length": "in", "pressure": "MPa", "torque": "N*m"},
            ["N*m", "lbf/in", "lb*in^2", "1/in", "MPa", "lbf*s/in", "lb/in^3", "in/rad^2"],
        ),
    ],
    ids=["metric", "decimal", "inches", "feet", "pounds-force", "kilopond", "kilopond and cm", "named"],
)
def test_a_kind_that_nobody_wrote_is_composed_of_the_scenes_own_units(display, expected):
    """In the SI and its decimal multiples the composed units are the SI's own: N*m, N/m, 1/m."""
    assert units(lo.scene({**BARE, "display": display}), *COMPOSED) == expected


def test_a_curve_of_no_kind_is_seen_in_the_scenes_own_units_too():
    assert [RAPIER.unit_for(si) for si in ("m", "m/rad", "rad", "1")] == ["mm", "m/rad", "deg", "1"]
    inches = inch.scene("shedding")
    assert [inches.unit_for(si) for si in ("m/rad", "N*m", "rad", "1")] == ["in/rad", "lbf*in", "deg", "1"]


def test_an_inch_scene_has_pounds_of_both_kinds_where_it_writes_none():
    assert units(lo.scene({**BARE, "display": {"length": "inch"}}), "force", "mass") == ["lbf", "lb"]
    assert units(lo.scene(BARE), "force", "mass") == ["N", "kg"]


def test_rotary_units_follow_the_torques_own():
    scene = BEATUP.update({"operation.M0": "745000 N*mm"})
    assert units(scene, "torque", "rotary stiffness", "rotary damping") == ["N*mm", "N*mm/rad", "N*mm*s/rad"]


def test_what_display_says_goes_before_what_is_written():
    shown = {"length": "in", "speed": "rad/s", "angular_acceleration": "deg/s^2"}
    scene = lo.scene({**BEATUP.document, "display": shown})
    assert units(scene, "length", "angular speed", "angular acceleration") == ["in", "rad/s", "deg/s^2"]
    assert units(scene, "torque", "angle") == ["N*m", "deg"], "as written"
    assert BEATUP.set("display.length", "in").shown_in("length") == "in"


def test_display_changes_no_number_no_hash_and_is_kept_in_the_document():
    scene = BEATUP.update({"display.length": "in", "display.torque": "lbf*in"})
    assert scene.hash == BEATUP.hash
    assert (scene.mechanism, scene.bounds, scene.limits) == (BEATUP.mechanism, BEATUP.bounds, BEATUP.limits)
    assert scene.document["display"] == {"length": "in", "torque": "lbf*in"}
    evaluation = lo.evaluate(scene)
    assert evaluation.as_dict() == lo.evaluate(BEATUP).as_dict()


def test_a_value_is_told_in_the_unit_of_its_kind():
    assert inch.scene("beatup").show(0.0254, "length") == "1 in"
    assert BEATUP.show(0.0254, "length", 2) == "25 mm"
    assert DISPLAY_UNIT["length"] == "mm"


@pytest.mark.parametrize(
    ("display", "text"),
    [
        ({"lenght": "in"}, ['unknown kind of quantity "lenght"', 'Perhaps "length" is meant']),
        ({"angular_speed": "rpm"}, ["unknown kind of quantity", "speed"]),
        ({"number": "1"}, ["unknown kind of quantity"]),
        ({"length": "lbf"}, ['"lbf" is a unit of force, not of length', 'a unit of length such as "mm"']),
        ({"speed": "Hz"}, ['"Hz" is not a unit of angular speed', "rpm"]),
        ({"length": "inn"}, ['"inn" is not a unit', 'Perhaps "in" is meant']),
        ({"length": ""}, ["is not a unit"]),
        ({"length": "1"}, ["not a unit of length"]),
        ({"length": "25.4 mm"}, ['"25.4 mm" is not a unit']),
        ({"length": 25.4}, ["it is not a unit", "25.4"]),
        ({"length": {"unit": "in"}}, ["it is not a unit", "a table"]),
        ({"length": "m*" * 40 + "m"}, ["it is not a unit"]),
        ("in", ["it is not a table"]),
    ],
)
def test_bad_input_is_one_plain_message(display, text):
    with pytest.raises(lo.BadInput) as caught:
        lo.scene({**BEATUP.document, "display": display})
    message = str(caught.value)
    assert "display" in message
    assert "\n" not in message
    assert len(message) < 900
    for words in text:
        assert words in message


def test_a_message_about_a_machine_that_does_not_assemble_speaks_its_own_units():
    with pytest.raises(lo.BadInput, match=r"fails \(.* in against .* in\)"):
        inch.scene("beatup", mechanism__l2="1 in")
    with pytest.raises(lo.BadInput, match=r"fails \(.* in against .* in\)"):
        lo.evaluate(inch.scene("beatup"), {"l2": 0.03})
    with pytest.raises(lo.BadInput, match=r"base_radius 0\.2 in must be greater"):
        inch.scene("shedding", mechanism__base_radius="0.2 in")
    with pytest.raises(lo.BadInput, match=r"base_radius 5 mm must be greater"):
        SHEDDING.set("mechanism.base_radius", "5 mm")
    with pytest.raises(lo.BadInput, match=r"from [\d.]+ rad to [\d.]+ rad"):
        RAPIER.set("display.angle", "rad").set("mechanism.l5", "340 mm")


@pytest.mark.parametrize(
    ("kind", "given", "shown"),
    [
        ("length", '"', "1.22047 in"),
        ("length", "'", "0.101706 ft"),
        ("speed", "ppm", "600 ppm"),
        ("mass", "lbm", "2 lbm"),
    ],
)
def test_signs_and_names_of_the_trade_are_units_of_display(kind, given, shown):
    value = {"length": 0.031, "speed": 62.83185307179586, "mass": 0.90718474}[kind]
    quantity = {"speed": "angular speed"}.get(kind, kind)
    assert lo.load("beatup").set(f"display.{kind}", given).show(value, quantity) == shown
