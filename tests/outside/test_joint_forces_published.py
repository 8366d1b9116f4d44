"""Forces in the pins of planar linkages that others have published, and the power identity of each at ω ≠ 0.

PMKS: github.com/PMKS-Web/PMKS_Verification, reference-data v1, Watt I and Stephenson III example 2 with masses, loads
and gravity (`pmks_*_forces.csv`, SI): masses in the mean of each link's joints, 10 rpm. A pin's force acts there on the
link nearer the crank. Static four-bar: lengths 1, 3, 2, frame 4 m, uniform bars of 2, 3, 2 kg, g 9.81, crank at 30 deg;
the program that printed it leaves −m ω² s out of its dynamics. The inertias of those, about the centres, are printed
nowhere: 0.05 kg·m² of the rod and 0.02 of the rocker give both of its numbers, right and wrong. A program's own numbers
prove nothing by themselves: power in is power out in every row here.
"""

import math

import pytest
from support.linkages import chain
from test_linkages import four_bar, rows, stephenson, watt

from loomopt.maths.systems import FLOAT
from loomopt.physics.effects.kinds import Applied
from loomopt.physics.mechanisms.chain_forces import solve_forces
from loomopt.physics.mechanisms.dyad import Vector

SPEED, G = 10 * math.pi / 30, 9.81
LINKS = {
    "watt_i": {"AB": "AB", "BCD": "BCD", "DE": "DE", "EF": "EF", "CFG": "CFG"},
    "stephenson_iii": {"AB": "AB", "BCE": "BCE", "CD": "CD", "EF": "EF", "FG": "FG"},
}
MASSES, INERTIAS = (5.0, 10.0, 5.0, 10.0, 5.0), (0.1, 0.2, 0.1, 0.2, 0.1)
LOADED = {"watt_i": ("CFG", (50.0, 25.0)), "stephenson_iii": ("FG", (50.0, 0.0))}
SIGNS = {
    "watt_i": {"A": ("AB", 1), "B": ("one", -1), "C": ("one", -1), "D": ("two", -1), "E": ("two", -1), "F": ("two", 1)},
    "stephenson_iii": {
        "A": ("AB", 1),
        "B": ("one", -1),
        "C": ("one", -1),
        "D": ("one", 1),
        "E": ("two", -1),
        "F": ("two", -1),
    },
}
SIGNS["watt_i"]["G"], SIGNS["stephenson_iii"]["G"] = ("one", 1), ("two", 1)
"""Joint → the part that has its force here, and the sign with which the file has it."""
LINKAGES = {"watt_i": watt, "stephenson_iii": stephenson}


def mean(vectors):
    known = [vector for vector in vectors if vector is not None]
    return Vector(*(sum(getattr(v, axis) for v in known) / len(vectors) for axis in "xy"))


def loads(pose, name, speed, gravity):
    """Return what acts on each link in the mean of its joints, and what power it takes."""
    result, power = [], 0.0
    for link, mass, inertia in zip(LINKS[name], MASSES, INERTIAS, strict=True):
        joints = [pose.joints[joint] for joint in LINKS[name][link]]
        place, velocity, bend = (mean([joint.at(order) for joint in joints]) for order in (0, 1, 2))
        rates = [pose.links[link].rates(order) or 0.0 for order in (1, 2)]
        force = Vector(-mass * bend.x * speed**2, -mass * bend.y * speed**2 - (mass * G if gravity else 0.0))
        if link == LOADED[name][0]:
            force = Vector(force.x + LOADED[name][1][0], force.y + LOADED[name][1][1])
        couple = -inertia * rates[1] * speed**2
        result.append(Applied(link, force, place, couple))
        power += (force.x * velocity.x + force.y * velocity.y + couple * rates[0]) * speed
    return result, power


@pytest.mark.parametrize("gravity", [False, True])
@pytest.mark.parametrize("name", LINKAGES)
def test_pmks_torque_and_every_pin(name, gravity):
    published = rows(f"pmks_{name}_forces")
    kind = "newton_gravity" if gravity else "newton_no_gravity"
    # The crank swings to where it stops: forces grow as the triangle vanishes, and so does what rounding leaves.
    close = 5e-7 if name == "watt_i" else 1e-4
    for row in published:
        linked = chain(LINKAGES[name](row, published[0]))
        pose, speed = linked.pose(FLOAT, {}, row["input_angle_rad"]), row["direction"] * SPEED
        applied, power = loads(pose, name, speed, gravity)
        walk = solve_forces(linked, pose, applied)
        assert walk.torque * speed == pytest.approx(-power, rel=1e-11)
        size = max(abs(row[f"{kind} {joint}_f{axis}"]) for joint in SIGNS[name] for axis in "xy")
        assert walk.torque == pytest.approx(row[f"{kind} torque"], rel=close)
        for joint, (part, sign) in SIGNS[name].items():
            force = walk.forces[joint, part]
            for axis, value in zip("xy", force, strict=True):
                assert sign * value == pytest.approx(row[f"{kind} {joint}_f{axis}"], rel=close, abs=close * size)


def test_pmks_first_row_of_watt_i():
    row = rows("pmks_watt_i_forces")[0]
    linked = chain(watt(row, row))
    pose = linked.pose(FLOAT, {}, row["input_angle_rad"])
    plain, heavy = (solve_forces(linked, pose, loads(pose, "watt_i", SPEED, gravity)[0]) for gravity in (False, True))
    assert plain.torque == pytest.approx(1474.5549914, rel=3e-7)
    assert heavy.torque == pytest.approx(1844.3174730, rel=3e-7)
    assert tuple(heavy.forces["A", "AB"]) == pytest.approx((-617.288707, -176.534838), rel=3e-7)
    assert tuple(heavy.forces["G", "one"]) == pytest.approx((152.235762, -150.958054), rel=3e-7)


BARS = {"crank": (2.0, 1.0), "rod": (3.0, 3.0), "rocker": (2.0, 2.0)}
FOUR_BAR = {
    "A": {"kind": "pivot"},
    "D": {"kind": "pivot", "x": 4.0},
    "crank": {"kind": "crank", "at": "A", "pin": "B", "length": 1.0},
    "drive": {"kind": "dyad", "joins": ["B", "D"], "pin": "C", "side": "left", "links": {"rod": 3.0, "rocker": 2.0}},
}


def bars(pose, speed, inertias=None, left_out=()):
    """Return the weights of bars with what they resist, and the power that these take.

    inertias: link → kg·m² about its centre, of uniform bars without it; left_out: links whose −ω² s is left out.
    """
    result, power = [], 0.0
    for link, (mass, length) in BARS.items():
        inertia = mass * length**2 / 12 if inertias is None else inertias[link]
        centre, along = pose.links[link].point(length / 2), pose.links[link].unit()
        rates = [pose.links[link].rates(order) or 0.0 for order in (1, 2)]
        velocity, bend = centre.at(1), centre.at(2)
        towards = rates[0] ** 2 * length / 2 if link in left_out else 0.0
        x, y = bend.x + towards * along.x, bend.y + towards * along.y
        force = Vector(-mass * x * speed**2, -mass * y * speed**2 - mass * G)
        couple = -inertia * rates[1] * speed**2
        result.append(Applied(link, force, centre.place, couple))
        power += force.x * velocity.x + force.y * velocity.y + couple * rates[0]
    return result, power


def test_static_four_bar_and_its_equation_of_motion():
    linked = chain(FOUR_BAR)
    pose = linked.pose(FLOAT, {}, math.radians(30))
    still = solve_forces(linked, pose, bars(pose, 0.0)[0])
    assert still.torque == pytest.approx(21.085597076442, rel=1e-12)
    # Printed as the frame feels them.
    assert tuple(still.forces["A", "crank"]) == pytest.approx((5.552977629, 37.363563425), rel=1e-9)
    assert tuple(still.forces["D", "drive"]) == pytest.approx((-5.552977629, 31.306436575), rel=1e-9)
    applied, power = bars(pose, 1.0)
    moving = solve_forces(linked, pose, applied)
    assert moving.torque == pytest.approx(-power, rel=1e-12)
    assert moving.torque != pytest.approx(still.torque, rel=1e-2)
    # Printed at 1 rad/s to seven digits, right and as the program has it.
    inertias = {"crank": 0.0, "rod": 0.05, "rocker": 0.02}
    for left_out, torque in (((), 21.4194636), (("rod",), 21.4074709), (tuple(BARS), 21.4074709)):
        result = solve_forces(linked, pose, bars(pose, 1.0, inertias, left_out)[0])
        assert result.torque == pytest.approx(torque, abs=5e-8)


@pytest.mark.parametrize("sense", [1, -1])
def test_the_teaching_four_bar_with_uniform_bars_takes_the_power_that_it_gives(sense):
    """10.31 rpm, forwards and backwards; bars of 2 kg a metre, with weights."""
    published, speed = rows("pmks_teaching_four_bar"), sense * 10.31 * math.pi / 30
    linked = chain(four_bar(published[0], published[0]))
    ends = {"ABH": "AB", "BCFG": "BC", "CDEI": "DC"}
    for row in published:
        pose = linked.pose(FLOAT, {}, row["input_angle_rad"])
        applied, power = [], 0.0
        for link, joints in ends.items():
            at = [pose.joints[joint] for joint in joints]
            centre, velocity, bend = (mean([joint.at(order) for joint in at]) for order in (0, 1, 2))
            length = math.dist(at[0].place, at[1].place)
            rates = [pose.links[link].rates(order) or 0.0 for order in (1, 2)]
            force = Vector(-2 * length * bend.x * speed**2, -2 * length * (bend.y * speed**2 + G))
            couple = -2 * length**3 / 12 * rates[1] * speed**2
            applied.append(Applied(link, force, centre, couple))
            power += (force.x * velocity.x + force.y * velocity.y + couple * rates[0]) * speed
        walk = solve_forces(linked, pose, applied)
        assert walk.torque * speed == pytest.approx(-power, rel=1e-11, abs=1e-11)
