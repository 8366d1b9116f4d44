"""Every part's derivatives against 60 digits, in several number systems; the four-bar and the drive as chains."""

import gc
import math
import time
import weakref

import casadi as ca
import mpmath
import numpy as np
import pytest
from support.linkages import chain, four_bar

from loomopt.maths import interval_series, intervals, jets, systems
from loomopt.physics.mechanisms import chain as chains
from loomopt.physics.mechanisms import crank_rocker, rapier_drive
from loomopt.physics.mechanisms.chain import Chain, closes, fault, provides, wants

EPS = 2.0**-52
MP = mpmath.MPContext()
MP.dps = 60

DRIVE = {
    "A": {"kind": "pivot"},
    "D": {"kind": "pivot", "x": 0.167, "y": 0.011},
    "crank": {"kind": "crank", "at": "A", "pin": "B", "length": 0.031, "start": 0.4},
    "drive": {
        "kind": "dyad",
        "joins": ["B", "D"],
        "pin": "C",
        "side": "left",
        "links": {"rod": 0.065, "rocker": 0.155},
    },
}
"""A crank-rocker on which the parts of every case hang: its joints and links all move."""

PIN = {"pin": "P", "length": 0.03}
G = {"G": {"kind": "pivot", "x": 0.30, "y": 0.21}}
E = {"E": {"kind": "point", "on": "rod", "radius": 0.05, "angle": 0.7}}

CASES = {
    "crank twice as fast": {"second": {"kind": "crank", "at": "D", "pin": "P", "length": 0.02, "ratio": -2}},
    "dyad between moving joints": {
        "fast": {"kind": "crank", "at": "D", "pin": "F", "length": 0.01, "ratio": -2, "start": 1.1},
        "own": {
            "kind": "dyad",
            "joins": ["C", "F"],
            "pin": "P",
            "side": "right",
            "links": {"one": 0.14, "other": 0.12},
        },
    },
    "point of a coupler": E | {"P": {"kind": "point", "on": "rod", "along": 0.04, "across": -0.02}},
    "slider on the frame": {
        "own": {
            "kind": "slider",
            "from": "C",
            "through": "A",
            "direction": -0.3,
            "offset": 0.05,
            "pin": "P",
            "side": "ahead",
            "links": {"strut": 0.25},
        }
    },
    "slider behind, along x": {
        "own": {"kind": "slider", "from": "C", "through": "A", "pin": "P", "side": "behind", "links": {"strut": 0.25}}
    },
    "slider on a moving guide": E
    | {
        "own": {
            "kind": "slider",
            "from": "E",
            "through": "D",
            "guide": "rocker",
            "direction": 0.9,
            "offset": -0.03,
            "pin": "P",
            "side": "ahead",
            "links": {"strut": 0.35},
        }
    },
    "slider on a guide that moves, without offset": {
        "own": {
            "kind": "slider",
            "from": "B",
            "through": "D",
            "guide": "rocker",
            "pin": "P",
            "side": "behind",
            "links": {"strut": 0.35},
        }
    },
    "slot about a pivot": G
    | {"own": {"kind": "slot", "at": "G", "through": "C", "link": "arm", "pin": "P", "length": 0.1}},
    "slot with an offset about a moving joint": E
    | G
    | {
        "own": {
            "kind": "slot",
            "at": "C",
            "through": "G",
            "link": "arm",
            "offset": 0.02,
            "pin": "P",
            "length": 0.1,
        }
    },
    "gear on the rocker, with the crank": {
        "wheel": {
            "kind": "gear",
            "at": "C",
            "with": "crank",
            "carrier": "rocker",
            "ratio": -3,
            "pin": "P",
            "length": 0.03,
        }
    },
    "gear on the rod, with a moving mate": {
        "wheel": {
            "kind": "gear",
            "at": "C",
            "with": "rod",
            "carrier": "rocker",
            "ratio": 2,
            "start": 0.3,
            "zero": 0.2,
            "pin": "P",
            "length": 0.03,
        }
    },
    "gear of no whole ratio": {
        "wheel": {
            "kind": "gear",
            "at": "C",
            "with": "rocker",
            "ratio": -1.375,
            "start": 0.3,
            "zero": 1.9,
            "pin": "P",
            "length": 0.03,
        }
    },
    "gear of no whole ratio on a carrier": {
        "wheel": {
            "kind": "gear",
            "at": "C",
            "with": "rod",
            "carrier": "rocker",
            "ratio": 0.75,
            "zero": -1.0,
            "pin": "P",
            "length": 0.03,
        }
    },
    "gear on the rod, held by the frame": {
        "wheel": {"kind": "gear", "at": "C", "with": "frame", "carrier": "rod", "ratio": 3, "pin": "P", "length": 0.03}
    },
    "groups between joints of one link": (
        CARRIED := E
        | {
            "plate": {
                "kind": "dyad",
                "joins": ["E", "C"],
                "pin": "F",
                "side": "left",
                "links": {"up": 0.05, "to": 0.06},
            },
            "H": {"kind": "point", "on": "up", "along": 0.02, "across": 0.01},
            "brace": {
                "kind": "dyad",
                "joins": ["H", "B"],
                "pin": "K",
                "side": "right",
                "links": {"a": 0.07, "b": 0.04},
            },
            "way": {
                "kind": "slider",
                "from": "K",
                "through": "E",
                "guide": "rod",
                "direction": 0.4,
                "offset": 0.01,
                "pin": "L",
                "side": "ahead",
                "links": {"strut": 0.2},
            },
            "side": {
                "kind": "slider",
                "from": "H",
                "through": "C",
                "guide": "up",
                "pin": "N",
                "side": "behind",
                "links": {"prop": 0.2},
            },
            "own": {
                "kind": "slot",
                "at": "L",
                "through": "F",
                "link": "arm",
                "offset": 0.02,
                "pin": "P",
                "length": 0.1,
            },
        }
    ),
    "gear of a crank on a crank": {
        "wheel": {
            "kind": "gear",
            "at": "B",
            "with": "frame",
            "carrier": "crank",
            "ratio": 2,
            "pin": "P",
            "length": 0.03,
        }
    },
}
"""Parts by what they show; P is the joint that all of them move."""

ANGLES = (0.15, 1.2, 2.9, 4.4, 5.9)
every_case = pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())


def linked(case):
    return chain(DRIVE | case)


def readings(pose, order, only):
    """Yield every number of a pose whose derivatives are in closed form: places, link angles' sines, slides."""
    for name, joint in pose.joints.items():
        vector = joint.at(order)
        yield f"{name}.x", 0 if vector is None else vector.x
        yield f"{name}.y", 0 if vector is None else vector.y
    for name in only.slides:
        yield name, pose.slides[name].at(order)


def linear(pose, only):
    """Yield every link's angle as sine and cosine, and its derivatives by the chain rule."""
    for name in only.links:
        link, (c, s) = pose.links[name], pose.links[name].unit()
        w, a, j = (0 if link.rates(k) is None else link.rates(k) for k in (1, 2, 3))
        yield f"sin {name}", (s, c * w, c * a - s * w**2, c * j - 3 * s * w * a - c * w**3)


@every_case
def test_derivatives_are_those_of_the_places_in_60_digits(case):
    """Within 1e-12 of the largest derivative of its order."""
    only, digits = linked(case), systems.mpmath(60)

    def everything(phi):
        pose = only.pose(digits, {}, phi)
        return dict(readings(pose, 0, only)) | {name: result[0] for name, result in linear(pose, only)}

    for angle in ANGLES:
        pose = only.pose(systems.FLOAT, {}, angle)
        around = [everything(digits.number(angle) + k * STEP) for k in (-2, -1, 0, 1, 2)]
        for order in range(4):
            exact = {name: difference(order, [at[name] for at in around]) for name in around[2]}
            size = max(map(abs, exact.values()))
            result = dict(readings(pose, order, only)) | {name: at[order] for name, at in linear(pose, only)}
            for name, value in result.items():
                assert abs(value - exact[name]) <= 1e-12 * size, (angle, order, name)


STEP = MP.mpf(10) ** -14
"""rad: differences are right to STEP² of what comes two orders later, and their rounding of 1e-60/STEP³."""


def difference(order, five):
    """Return a derivative from five values STEP apart."""
    low2, low, here, high, high2 = five
    return (
        here,
        (high - low) / (2 * STEP),
        (high - 2 * here + low) / STEP**2,
        (high2 - 2 * high + 2 * low - low2) / (2 * STEP**3),
    )[order]


@every_case
def test_two_number_systems_say_the_same(case):
    only, phi = linked(case), ca.SX.sym("phi")
    arrays = only.pose(systems.numpy(), {}, np.array(ANGLES))
    symbols = only.pose(systems.casadi(), {}, phi)
    for order in range(4):
        by_arrays = dict(readings(arrays, order, only))
        names, result = zip(*readings(symbols, order, only), strict=True)
        read = ca.Function("f", [phi], [ca.vertcat(*result)])
        by_symbols = dict(zip(names, np.array(read.map(len(ANGLES))(np.array(ANGLES)[None])), strict=True))
        size = max(float(np.max(np.abs(value))) for value in by_symbols.values())
        for name, value in by_arrays.items():
            assert np.all(np.abs(value - by_symbols[name]) <= 1e-12 * size), (order, name)


@every_case
def test_jets_carry_the_next_two_derivatives(case):
    """The slope and curvature of what has order k are what the closed forms say of k + 1 and k + 2."""
    only = linked(case)
    (phi,) = jets.variables([np.array(ANGLES)], np.eye(1), curved=True)
    pose, arrays = only.pose(systems.jets(), {}, phi), only.pose(systems.numpy(), {}, np.array(ANGLES))
    for order in (0, 1):
        first, second = (dict(readings(arrays, order + more, only)) for more in (1, 2))
        size = max(float(np.max(np.abs(value))) for value in second.values())
        for name, value in readings(pose, order, only):
            if isinstance(value, jets.Jet):
                assert np.allclose(value.g[..., 0], first[name], rtol=0, atol=1e-12 * size), (order, name)
                assert np.allclose(value.h[..., 0, 0], second[name], rtol=0, atol=1e-12 * size), (order, name)


@every_case
def test_balls_and_boxes_hold_what_60_digits_say(case):
    """Over crank angles of widths from 0 to 1/100 rad, the series along them with slope and half the curvature."""
    only, digits, half = linked(case), systems.mpmath(60), np.array([0.0, 1e-12, 1e-6, 1e-2])
    balls = systems.balls()
    for angle in ANGLES[::2]:
        low, high = angle - half, angle + half
        boxed = only.pose(systems.boxes(), {}, intervals.Interval(low, high))
        series = only.pose(systems.box_series(), {}, interval_series.along(low, high))
        ball = only.pose(balls, {}, balls.number(angle))
        pose = only.pose(digits, {}, digits.number(angle))
        exact = [dict(readings(pose, order, only)) for order in range(4)]
        for order in range(4):
            for name, result in readings(boxed, order, only):
                assert holds(result, exact[order][name]), (angle, order, name)
            for name, result in readings(ball, order, only):
                assert result == exact[order][name] or result.overlaps(enclosed(exact[order][name])), (
                    angle,
                    order,
                    name,
                )
        for order in range(2):
            for name, result in readings(series, order, only):
                terms = result.terms if isinstance(result, interval_series.IntervalSeries) else (result,)
                for more, term in enumerate(terms):
                    assert holds(term, exact[order + more][name] / (1 + (more == 2))), (angle, order, more, name)


def holds(result, value):
    box = intervals.interval(result)
    ends = zip(np.ravel(box.low), np.ravel(box.high), strict=True)
    return all((low == -math.inf or low <= value) and (high == math.inf or value <= high) for low, high in ends)


def enclosed(value):
    """Return the ball of a number of 60 digits."""
    flint = pytest.importorskip("flint")
    near = float(value)
    return flint.arb(near, max(abs(float(value - near)) * (1 + 1e-9), 1e-300))


def test_groups_between_joints_of_one_link_keep_their_angles():
    """Their spans and transmission angles are constants, bit by bit, and those of the groups without a carrier."""
    only, digits = linked(CARRIED), systems.mpmath(60)
    groups = {"plate": "rod", "brace": "rod", "way": "rod", "side": "rod", "own": "rod"}
    assert dict(only.carriers) == groups
    constants = set()
    for angle in ANGLES:
        pose = only.pose(systems.FLOAT, {}, angle)
        free = chains.ChainPose(digits, {}, digits.number(angle))
        for part in only.parts:
            free.place(part)
        for group in groups:
            spans = free.margins[group].spans
            values = [pose.obliquity(group), *(span() for span in pose.margins[group].spans.values())]
            expected = [free.obliquity(group), *(span() for span in spans.values())]
            assert values[:3] == pytest.approx([float(value) for value in expected[:3]], abs=1e-13)
        for group in ("plate", "brace"):
            for way, exact_way in zip(pose.closed[group]()[:2], free.closed[group]()[:2], strict=True):
                assert tuple(way) == pytest.approx([float(part) for part in exact_way], abs=1e-15)
        constants.add(tuple(pose.obliquity(group) for group in groups))
        for order in range(4):
            exact = dict(readings(free, order, only))
            for name, value in readings(only.pose(digits, {}, digits.number(angle)), order, only):
                assert abs(value - exact[name]) < 1e-50, (order, name)
    assert len(constants) == 1


def test_groups_whose_guide_or_joint_moves_on_its_own_have_no_carrier():
    """A slider along the rocker between joints of the rod, and every other case, closes as it did."""
    moving = E | {
        "own": {
            "kind": "slider",
            "from": "E",
            "through": "C",
            "guide": "rocker",
            "pin": "P",
            "side": "ahead",
            "links": {"strut": 0.35},
        }
    }
    assert not linked(moving).carriers
    for name, case in CASES.items():
        assert bool(linked(case).carriers) == (case is CARRIED), name


@pytest.mark.few(3)
@every_case
def test_equations_of_every_part_can_be_printed_and_derived(case):
    sp = pytest.importorskip("sympy")
    only, phi = linked(case), sp.Symbol("phi")
    symbolic, floats = only.pose(systems.sympy(), {}, phi).joints["P"], only.pose(systems.FLOAT, {}, 1.2).joints["P"]
    assert sp.latex(symbolic.place.x)
    for order in (0, 1):
        for result, right in zip(symbolic.at(order), floats.at(order), strict=True):
            assert float(result.subs(phi, 1.2)) == pytest.approx(right, rel=1e-12, abs=1e-13)
    assert float(sp.diff(symbolic.place.x, phi).subs(phi, 1.2)) == pytest.approx(floats.at(1).x, rel=1e-12, abs=1e-13)


LENGTHS = (0.031, 0.065, 0.155, 0.167)
TURN = np.linspace(0, 2 * math.pi, 400)


@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
def test_a_four_bar_as_a_chain_is_the_crank_rocker(side, sign):
    pose = four_bar(*LENGTHS, side).pose(systems.numpy(), {}, TURN)
    values = crank_rocker.CrankRockerPose(systems.numpy(), crank_rocker.Lengths(*LENGTHS, sign), TURN)
    rocker, unit = pose.links["rocker"], pose.links["rocker"].unit()
    assert np.allclose(np.arctan2(unit.y, unit.x), values.psi, rtol=0, atol=4 * EPS)
    for order, right in enumerate((values.psi_1, values.psi_2, values.psi_3), 1):
        assert np.allclose(rocker.rates(order), right, rtol=0, atol=16 * EPS * np.max(np.abs(right)))
    for order, right in ((1, values.rod_1), (2, values.rod_2)):
        assert np.allclose(pose.links["rod"].rates(order), right, rtol=0, atol=16 * EPS * np.max(np.abs(right)))
    assert np.allclose(pose.obliquity("drive"), values.obliquity, rtol=0, atol=8 * EPS)
    lengths, spans = values.lengths, pose.margins["drive"].spans
    for name, right in (("span_far", crank_rocker.span_far), ("span_near", crank_rocker.span_near)):
        assert np.allclose(spans[name](), right(systems.numpy(), lengths, TURN), rtol=16 * EPS)


BUILT = rapier_drive.Dimensions(
    l1=0.0764, l2=0.2757, l3=0.684, l71=0.773, phi30=1.4046, l3p=0.18, alpha=0.5, l4=0.02, l5=0.49, l6=0.185,
    C0x=0.461, C0y=0.234, phi40=2.8, i1=17.0, i2=1.1, wheel=0.24,
)  # fmt: skip
"""A drive near that of [Hong17] with every number different from its neighbours."""


def test_a_rapier_drive_as_a_chain_is_the_rapier_drive():
    """Within 1e-14 of the largest value of each kind, the rounding of both."""
    d = BUILT
    stand = rapier_drive.Sley(systems.FLOAT, d).stand
    values = rapier_drive.RapierPose(systems.numpy(), d, stand, TURN)
    A0 = rapier_drive.polar(systems.FLOAT, -d.l71, stand.frame_angle)
    drive = chain(
        {
            "B0": {"kind": "pivot"},
            "A0": {"kind": "pivot", "x": A0.x, "y": A0.y},
            "C0": {"kind": "pivot", "x": d.C0x, "y": d.C0y},
            "main": {"kind": "crank", "at": "A0", "pin": "A", "length": d.l1, "start": stand.beta + stand.frame_angle},
            "second": {"kind": "crank", "at": "C0", "pin": "C", "length": d.l4, "ratio": -2, "start": d.phi40},
            "beat": {
                "kind": "dyad",
                "joins": ["A", "B0"],
                "pin": "B1",
                "side": "right",
                "links": {"rod": d.l2, "sley": d.l3},
            },
            "B2": {"kind": "point", "on": "sley", "radius": d.l3p, "angle": d.alpha},
            "five": {
                "kind": "dyad",
                "joins": ["C", "B2"],
                "pin": "D",
                "side": "right",
                "links": {"link": d.l5, "driving": d.l6},
            },
        }
    )
    pose = drive.pose(systems.numpy(), {}, TURN)
    sley, driving = pose.links["sley"], pose.links["driving"]
    results = {
        "phi3_1": (sley.rates(1), values.phi3_1),
        "phi3_2": (sley.rates(2), values.phi3_2),
        "phi3_3": (sley.rates(3), values.phi3_3),
        "phi63_1": (driving.rates(1) - sley.rates(1), values.phi63_1),
        "phi63_2": (driving.rates(2) - sley.rates(2), values.phi63_2),
        "phi63_3": (driving.rates(3) - sley.rates(3), values.phi63_3),
        "obliquity": (pose.obliquity("five"), values.obliquity),
    }
    for name in ("A", "B1", "B2", "C", "D"):
        results |= {
            f"{name}.{axis}": (getattr(pose.joints[name].place, axis), getattr(values.joints[name], axis))
            for axis in "xy"
        }
    for name, (here, right) in results.items():
        assert np.allclose(here, right, rtol=0, atol=1e-13 * np.max(np.abs(right))), name


def fault_at(parts):
    """Return what a chain's fault says, and at which crank angle, deg."""
    message, _, angle = fault(parts, {}).partition(" fails at crank angle ")
    return message, float(angle.removesuffix(" deg"))


def test_a_closed_chain_has_no_fault_and_one_that_does_not_names_part_and_crank_angle():
    assert fault(four_bar(*LENGTHS), {}) == ""
    assert fault(four_bar(0.031, 0.065, 0.12, 0.167), {}) == "drive: B to D < rod + rocker fails at crank angle 180 deg"
    assert fault_at(four_bar(0.031, 0.3, 0.155, 0.167)) == ("drive: B to D > |rod - rocker|", 0)


@pytest.mark.parametrize("start", [0.0, 0.004363, 1.0, 2.5])
def test_a_dyad_that_only_touches_its_singular_position_between_samples_is_told(start):
    """A change point: l1 + l4 = l2 + l3 stretches it in one position; what closes by 1e-9 does not touch."""
    message, angle = fault_at(four_bar(1, 2, 3, 4, start=start))
    assert message == "drive: B to D < rod + rocker"
    assert angle == pytest.approx(math.degrees(math.pi - start), abs=1e-3)
    assert fault(four_bar(1, 2 + 1e-9, 3, 4, start=start), {}) == ""


def test_a_slot_whose_pin_passes_over_its_pivot_is_told_in_any_unit():
    def slotted(size, length):
        return chain(
            {
                "A": {"kind": "pivot"},
                "O": {"kind": "pivot", "x": 0.3 * size},
                "crank": {"kind": "crank", "at": "A", "pin": "B", "length": length * size, "start": 1.0},
                "slot": {"kind": "slot", "at": "O", "through": "B", "link": "arm"},
            }
        )

    for size in (1e-3, 1.0, 1e3):
        message, angle = fault_at(slotted(size, 0.3))
        assert message == "slot: B keeps away from O"
        assert angle == pytest.approx(math.degrees(2 * math.pi - 1), abs=1e-3)
        assert fault(slotted(size, 0.299), {}) == ""


def test_a_kite_whose_joints_meet_is_told():
    """Links of one length close over any base but none: a crank as long as the frame passes over the other joint."""
    assert fault_at(four_bar(0.3, 0.4, 0.4, 0.3, start=1.0)) == (
        "drive: B keeps away from D",
        pytest.approx(302.704, abs=1e-3),
    )
    assert fault(four_bar(0.3, 0.4, 0.4, 0.301), {}) == ""
    tied = four_bar(0.3, "l", "l", 0.301).parts[-1]
    assert list(closes(tied)) == ["drive: B to D < rod + rocker", "drive: B keeps away from D"]


def test_a_gear_that_counts_past_its_end_or_does_not_come_back_is_told():
    def geared(**gear):
        return linked({"wheel": {"kind": "gear", "at": "C", **gear}})

    assert fault(geared(ratio=-1.375, zero=1.9, **{"with": "rocker"}), {}) == ""
    unit = linked({}).pose(systems.FLOAT, {}, 2.0).links["rocker"].unit()
    passed = math.atan2(unit.y, unit.x)
    message, angle = fault_at(geared(ratio=-1.375, zero=passed + math.pi, **{"with": "rocker"}))
    assert message == "wheel: rocker keeps within half a turn of zero"
    unit = linked({}).pose(systems.FLOAT, {}, math.radians(angle)).links["rocker"].unit()
    assert math.atan2(unit.y, unit.x) == pytest.approx(passed, abs=0.01)
    sentence = fault(geared(ratio=0.5, **{"with": "crank"}), {})
    assert (
        sentence
        == "wheel: its angle does not repeat after a turn of the crank, because its ratio is not a whole number"
    )
    assert fault(geared(ratio=2, **{"with": "crank"}), {}) == ""


def test_a_cam_of_more_than_a_turn_is_told():
    parts = {
        "A": {"kind": "pivot"},
        "arm": {"kind": "cam", "at": "A", "law": "harmonic", "lift": 0.1, "rise": "a", "return": "a"},
    }
    assert fault(chain(parts), {"a": 3.1}) == ""
    sentence = fault(chain(parts), {"a": math.radians(190)})
    assert sentence == "arm: rise, far_dwell and return take 380 deg, more than one turn"


def test_a_slider_that_stands_across_its_guide_is_told():
    parts = {
        "A": {"kind": "pivot"},
        "crank": {"kind": "crank", "at": "A", "pin": "B", "length": 0.1, "start": 0.3},
        "ram": {"kind": "slider", "from": "B", "through": "A", "pin": "P", "side": "ahead", "links": {"rod": 0.1}},
    }
    assert (
        fault(chain(parts), {}) == f"ram: rod reaches its guide fails at crank angle {90 - math.degrees(0.3):.6g} deg"
    )


def test_every_part_says_what_it_places_and_hangs_on():
    only = linked(CASES["slider on a moving guide"])
    assert {part.name: (provides(part), wants(part)) for part in only.parts} == {
        "A": (("A",), ()),
        "D": (("D",), ()),
        "crank": (("B", "crank"), ("A",)),
        "drive": (("C", "rod", "rocker"), ("B", "D")),
        "E": (("E",), ("rod",)),
        "own": (("P", "strut"), ("E", "D", "rocker")),
    }
    assert only.bodies == {
        "frame": ("A", "D"),
        "crank": ("A", "B"),
        "rod": ("B", "C", "E"),
        "rocker": ("D", "C"),
        "strut": ("E", "P"),
    }
    assert [span for part in only.parts for span in closes(part).values()] == ["span_far", "span_near", "span"]
    assert set(only.joints) | set(only.links) == {name for part in only.parts for name in provides(part)}


def test_a_number_is_a_name_its_opposite_or_a_literal():
    only = Chain(
        tuple(
            part
            for part in chain(
                {
                    "A": {"kind": "pivot"},
                    "B": {"kind": "pivot", "x": "d", "y": "-d"},
                    "C": {"kind": "pivot", "x": 0.0, "y": 2.0},
                }
            ).parts
        )
    )
    pose = only.pose(systems.FLOAT, {"d": 3.0}, 0.0)
    assert [tuple(pose.joints[name].place) for name in "ABC"] == [(0, 0), (3.0, -3.0), (0, 2.0)]
    assert pose.joints["A"].at(0) is None


def test_what_is_not_read_is_not_computed():
    """A pose whose first group does not close still says where the crank is."""
    pose = four_bar(1.0, 1.0, 1.0, 9.0).pose(systems.FLOAT, {}, 0.5)
    assert pose.joints["B"].place.x == math.cos(0.5)
    with pytest.raises(ValueError, match=r"math domain|nonnegative"):
        _ = pose.joints["C"].place
    assert chains.ChainPose is type(pose)


@every_case
def test_a_pose_frees_its_arrays_at_once(case):
    """No ring of references: else every array waits for the collector, and positions take twice as long."""
    only = linked(case)

    def run():
        pose = only.pose(systems.numpy(), {}, np.array(ANGLES))
        for order in range(4):
            dict(readings(pose, order, only))
        for margin in pose.margins.values():
            _ = [span() for span in margin.spans.values()], margin.across(), margin.inward()
        return weakref.ref(pose.joints["P"].place.x)

    run()
    gc.disable()
    try:
        assert run()() is None
    finally:
        gc.enable()


@pytest.mark.slow
@pytest.mark.parametrize("size", [721, 8192])
def test_a_chain_is_at_most_twice_as_slow_on_arrays_as_the_crank_rockers_own_kernel(size):
    """CPU time of q to q'', the least of many turns, one kernel after the other; 1.3 to 1.7 on a quiet machine."""
    phi, only, names = np.linspace(0, 2 * math.pi, size), four_bar("l1", "l2", "l3", "l4"), ("l1", "l2", "l3", "l4")
    values, maths = dict(zip(names, LENGTHS, strict=True)), systems.numpy()

    def as_chain():
        pose = only.pose(maths, values, phi)
        vector = pose.vector("rocker")
        return maths.atan2(vector.y, vector.x), pose.links["rocker"].rates(1), pose.links["rocker"].rates(2)

    def closed_form():
        pose = crank_rocker.CrankRockerPose(maths, crank_rocker.Lengths(*LENGTHS), phi)
        return pose.psi, pose.psi_1, pose.psi_2

    least = [math.inf, math.inf]
    for _ in range(60):
        for k, run in enumerate((as_chain, closed_form)):
            began = time.process_time()
            for _ in range(20):
                run()
            least[k] = min(least[k], time.process_time() - began)
    assert least[0] <= 2.1 * least[1]
