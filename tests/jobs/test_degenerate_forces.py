"""Forces at the edge: groups in line, change points, no mass, no load, and a shaft that turns the other way."""

import math
from dataclasses import replace

import pytest
from support.linkages import four_bar

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.maths import systems
from loomopt.physics.effects.kinds import Applied
from loomopt.physics.mechanisms.chain import Chain
from loomopt.physics.mechanisms.chain_forces import solve_forces
from loomopt.physics.mechanisms.dyad import Dyad, Vector, cross
from loomopt.physics.mechanisms.joint_forces import Wrench, link_and_slider, slotted_lever, two_links

SCENE = lo.load("beatup").with_effect("joint_forces")
CHANGE_POINT = "133 mm"
"""l3 with which l1 + l4 = l2 + l3."""
FORCES = ("force_A", "force_B", "force_C", "force_D", "shaking_force", "shaking_moment")


def test_today_s_machine_at_a_change_point_is_one_message():
    with pytest.raises(BadInput) as caught:
        lo.evaluate(SCENE.set("mechanism.l3", CHANGE_POINT))
    assert "not a crank-rocker: l1 + l4 < l2 + l3 fails (198 mm against 198 mm)" in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_next_to_a_change_point_forces_are_numbers_that_grow():
    near, nearer = (lo.evaluate(SCENE.set("mechanism.l3", f"133.{digits} mm")).figures for digits in ("01", "001"))
    for name in FORCES:
        assert math.isfinite(nearer[name])
    assert nearer["force_C"] > 3 * near["force_C"]


CHANGES = {
    "rapier": {"mechanism.l2": "165.385 mm"},
    "sixbar-sley": {"mechanism.l3": "99 mm"},
    "shedding": {"mechanism.base_radius": "10 mm"},
}
"""Packaged scene → what puts today's machine at a change point; a cam's roller in line with its arm and its shaft."""
MESSAGES = {
    "rapier": "does not turn all round: the sley four-bar is not a crank-rocker",
    "sixbar-sley": "does not turn all round",
    "shedding": "base_radius 10 mm must be greater than the difference 10 mm",
}
LOADED = {"rapier": ("head_inertia",), "sixbar-sley": (), "shedding": (), "beatup": ()}
OF_FORCES = ("force_", "gear_force", "roller_", "cam_shaft_force", "lever_", "shaking_")


def loaded(name):
    return lo.load(name).with_effect("joint_forces", *LOADED[name])


def forces_of(scene):
    evaluation = lo.evaluate(scene)
    return {
        name: value for name, value in evaluation.figures.items() if name.startswith(OF_FORCES)
    }, evaluation.undefined


@pytest.mark.parametrize("name", CHANGES)
def test_every_machine_at_a_change_point_is_one_message(name):
    with pytest.raises(BadInput, match=MESSAGES[name]) as caught:
        lo.evaluate(loaded(name).update(CHANGES[name]))
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("name", LOADED)
def test_a_shaft_that_does_not_turn_forward_is_refused(name):
    for speed in ("-600 rpm", "0 rpm"):
        with pytest.raises(BadInput, match=r"operation.speed: it is out of range"):
            loaded(name).set("operation.speed", speed)


@pytest.mark.parametrize("name", ["beatup", "rapier", "shedding"])
def test_without_a_load_pins_carry_nothing_or_say_what_is_missing(name):
    scene = loaded(name)
    scene = scene.without_effect(*(effect for effect in scene.effects if effect != "joint_forces"))
    result, undefined = forces_of(scene)
    fixed = {"beatup": ("force_A", "force_B", "force_C"), "rapier": tuple(result), "shedding": ()}[name]
    assert {item: result[item] for item in fixed} == dict.fromkeys(fixed, 0.0)
    assert all((value is None) == (item in undefined) for item, value in result.items())
    missing = {"beatup": {"shaking_moment"}, "rapier": set(), "shedding": {"shaking_force", "lever_pivot_force"}}
    assert {item for item, value in result.items() if value is None} == missing[name]


def test_a_linkage_without_a_load_carries_nothing():
    scene = lo.load("sixbar-sley").with_effect("joint_forces")
    document = scene.without_effect(*(effect for effect in scene.effects if effect not in ("joint_forces", "inertia")))
    result, undefined = forces_of(document.set("effects.inertia", {"J": "1e-30 kg*m^2"}))
    assert set(undefined) == {"friction_loss"}
    assert all(value == pytest.approx(0.0, abs=1e-24) for value in result.values())


def test_masses_of_nothing_are_refused_or_weigh_nothing():
    for name, key in (("rapier", "effects.head_inertia.mass"), ("beatup", "mechanism.m4")):
        with pytest.raises(BadInput, match=f"{key}: it is out of range"):
            loaded(name).set(key, "0 kg")
    scene = loaded("shedding").set("effects.inertia.M", "0 kg")
    result, undefined = forces_of(scene)
    assert result["shaking_force"] == 0.0
    assert set(undefined) == {"friction_loss", "lever_pivot_force"}
    assert result["roller_force"] > 0.0


@pytest.mark.parametrize("system", [systems.FLOAT, systems.mpmath()])
def test_a_group_in_line_says_so_in_the_formulas_too(system):
    at = [(system.number(x), system.number(y)) for x, y in ((3.0, 0.0), (2.0, 0.0), (0.0, 1.0))]
    stretched, neighbour, up = (Vector(*item) for item in at)
    dyad = Dyad(stretched, neighbour, 2 * cross(stretched, neighbour))
    load = Wrench(Vector(system.number(1.0), system.number(2.0)), system.number(3.0))
    for solve in (
        lambda: two_links(dyad, None, load),
        lambda: link_and_slider(stretched, up, load, load.force),
        lambda: slotted_lever(stretched, up, load, load),
    ):
        with pytest.raises(ZeroDivisionError, match="no force holds a group in a singular position"):
            solve()


def test_a_whole_chain_in_line_says_so():
    """Folded at crank angle 0: l4 - l1 = l2 - l3, where coordinates are exact."""
    folded = four_bar(1.0, 5.0, 2.0, 4.0)
    with pytest.raises(ZeroDivisionError, match="singular position"):
        solve_forces(folded, folded.pose(systems.FLOAT, {}, 0.0), [Applied("C", Vector(10.0, 5.0))])
    neighbour = solve_forces(folded, folded.pose(systems.FLOAT, {}, 1e-3), [Applied("C", Vector(10.0, 5.0))])
    assert all(math.isfinite(force.x) and math.isfinite(force.y) for force in neighbour.forces.values())


def test_a_crank_that_turns_the_other_way_has_the_same_forces():
    """Past the same positions, with the same load: the same forces, and the torque by a ratio of -1."""
    values = four_bar(1.0, 3.0, 2.5, 3.5)
    parts = [
        replace(part, words=(*part.words, ("ratio", -1))) if part.kind == "crank" else part for part in values.parts
    ]
    other = Chain(tuple(parts))
    for phi in (0.4, 2.0, 5.0):
        load = [Applied("C", Vector(30.0, -70.0))]
        first = solve_forces(values, values.pose(systems.FLOAT, {}, phi), load)
        two = solve_forces(other, other.pose(systems.FLOAT, {}, -phi), load)
        for place, force in first.forces.items():
            assert two.forces[place] == pytest.approx(force, rel=1e-12)
        assert two.torque == pytest.approx(-first.torque, rel=1e-12)
