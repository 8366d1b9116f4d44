"""Planar linkages that others have published with their numbers, as chains.

PMKS: github.com/PMKS-Web/PMKS_Verification, reference-data v1, "teaching four-bar", "Watt I" and "Stephenson III
example 2", every second row and fewer: place of each joint, ω and α of each link (`pmks_*.csv`, SI; `direction` is
that of the input crank, which in the six-bars cannot turn but swings). Marghitu D. B., Dupac M., Advanced Dynamics,
E5_5, the mechanism R-RTR-RRT. pylinkage 1.3.0 from PyPI: its places of a six-bar with a slider (RRRDyad, FixedDyad,
RRRDyad, RRPDyad), worked out once and written down.
"""

import csv
import math
from pathlib import Path

import pytest
from support.linkages import chain

from loomopt.maths.systems import FLOAT

HERE = Path(__file__).parent


def rows(name):
    with (HERE / f"{name}.csv").open(encoding="utf-8") as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def place(row, joint):
    return row[f"{joint}_x"], row[f"{joint}_y"]


def length(row, *ends):
    return math.dist(*(place(row, joint) for joint in ends))


def side(row, first, second, pin):
    """Return on which side of the line from the first joint to the second the pin lies."""
    (ax, ay), (bx, by), (cx, cy) = (place(row, joint) for joint in (first, second, pin))
    return "left" if (bx - ax) * (cy - ay) > (by - ay) * (cx - ax) else "right"


def seen(row, origin, end, joint):
    """Return where a joint lies on the line from origin to end, and to its left, m."""
    (ox, oy), (ex, ey), (jx, jy) = (place(row, item) for item in (origin, end, joint))
    u, v, x, y = ex - ox, ey - oy, jx - ox, jy - oy
    size = math.hypot(u, v)
    return {"along": (u * x + v * y) / size, "across": (u * y - v * x) / size}


def pivot(row, joint):
    x, y = place(row, joint)
    return {"kind": "pivot", "x": x, "y": y}


def dyad(row, dimensions, first, second, pin, *links):
    ends = dict(zip(links, (length(dimensions, first, pin), length(dimensions, second, pin)), strict=True))
    return {"kind": "dyad", "joins": [first, second], "pin": pin, "side": side(row, first, second, pin), "links": ends}


def four_bar(row, first):
    """Return the teaching four-bar: A and D are fixed."""
    return {
        "A": pivot(first, "A"),
        "D": pivot(first, "D"),
        "ABH": {"kind": "crank", "at": "A", "pin": "B", "length": length(first, "A", "B")},
        "drive": dyad(row, first, "B", "D", "C", "BCFG", "CDEI"),
    }


def watt(row, first):
    """Return Watt I: the plates BCD and CFG carry the second dyad."""
    return {
        "A": pivot(first, "A"),
        "G": pivot(first, "G"),
        "AB": {"kind": "crank", "at": "A", "pin": "B", "length": length(first, "A", "B")},
        "one": dyad(row, first, "B", "G", "C", "BCD", "CFG"),
        "D": {"kind": "point", "on": "BCD"} | seen(first, "B", "C", "D"),
        "F": {"kind": "point", "on": "CFG"} | seen(first, "G", "C", "F"),
        "two": dyad(row, first, "D", "F", "E", "DE", "EF"),
    }


def stephenson(row, first):
    """Return Stephenson III: the second dyad joins the coupler's point E to the frame."""
    return {
        "A": pivot(first, "A"),
        "D": pivot(first, "D"),
        "G": pivot(first, "G"),
        "AB": {"kind": "crank", "at": "A", "pin": "B", "length": length(first, "A", "B")},
        "one": dyad(row, first, "B", "D", "C", "BCE", "CD"),
        "E": {"kind": "point", "on": "BCE"} | seen(first, "B", "C", "E"),
        "two": dyad(row, first, "E", "G", "F", "EF", "FG"),
    }


@pytest.mark.parametrize(
    ("name", "linkage"),
    [("teaching_four_bar", four_bar), ("watt_i", watt), ("stephenson_iii_example_2", stephenson)],
)
def test_pmks_places_angular_velocities_and_accelerations(name, linkage):
    published = rows(f"pmks_{name}")
    joints = [key.removesuffix("_x") for key in published[0] if key.endswith("_x")]
    links = [key.removesuffix("_omega") for key in published[0] if key.endswith("_omega")]
    for row in published:
        pose = chain(linkage(row, published[0])).pose(FLOAT, {}, row["input_angle_rad"])
        speed = row[f"{links[0]}_omega"]
        for joint in joints:
            assert tuple(pose.joints[joint].place) == pytest.approx(place(row, joint), rel=1e-12, abs=1e-12)
        for link in links:
            rates = pose.links[link].rates
            omega, alpha = rates(1) * speed, 0 if rates(2) is None else rates(2) * speed**2
            assert omega == pytest.approx(row[f"{link}_omega"], rel=1e-12, abs=1e-12)
            assert alpha == pytest.approx(row[f"{link}_alpha"], rel=1e-12, abs=1e-12)


def test_marghitu_r_rtr_rrt():
    """AB .15, AC .30, CD .20, DE .14, a .25 m, crank at 200 deg, 700 rpm; printed to three decimals."""
    mechanism = chain(
        {
            "A": {"kind": "pivot"},
            "C": {"kind": "pivot", "x": -0.30},
            "F": {"kind": "pivot", "x": -0.55},
            "crank": {"kind": "crank", "at": "A", "pin": "B", "length": 0.15},
            "slot": {"kind": "slot", "at": "C", "through": "B", "link": "arm"},
            "D": {"kind": "point", "on": "arm", "along": -0.20},
            "ram": {
                "kind": "slider",
                "from": "D",
                "through": "F",
                "direction": math.pi / 2,
                "pin": "E",
                "side": "ahead",
                "links": {"rod": 0.14},
            },
        }
    )
    pose, w = mechanism.pose(FLOAT, {}, math.radians(200)), 700 * math.pi / 30
    arm, rod, D, E = pose.links["arm"], pose.links["rod"], pose.joints["D"], pose.joints["E"]
    half = 0.5e-3
    assert (arm.rates(1) * w, arm.rates(2) * w**2) == pytest.approx((-51.934, 7157.347), rel=0, abs=half)
    assert (rod.rates(1) * w, rod.rates(2) * w**2) == pytest.approx((25.176, 882.339), rel=0, abs=half)
    assert [v * w for v in D.at(1)] == pytest.approx([3.189, 9.885], rel=0, abs=half)
    assert [v * w**2 for v in D.at(2)] == pytest.approx([73.937, -1527.948], rel=0, abs=half)
    assert [v * w for v in E.at(1)] == pytest.approx([0, 8.383], rel=0, abs=half)
    assert [v * w**2 for v in E.at(2)] == pytest.approx([0, -1660.866], rel=0, abs=half)
    assert pose.slides["ram"].at(2) * w**2 == pytest.approx(-1660.866, rel=0, abs=half)


def test_pylinkage_positions():
    sley = chain(
        {
            "A": {"kind": "pivot"},
            "D": {"kind": "pivot", "x": 166.8},
            "G": {"kind": "pivot", "x": 379.5, "y": 348.4},
            "L": {"kind": "pivot", "x": 300.0, "y": 50.0},
            "crank": {"kind": "crank", "at": "A", "pin": "B", "length": 57.7},
            "drive": {
                "kind": "dyad",
                "joins": ["B", "D"],
                "pin": "C",
                "side": "left",
                "links": {"rod": 125.5, "rocker": 123.1},
            },
            "E": {"kind": "point", "on": "rocker", "radius": 121.0, "angle": math.radians(-74.8)},
            "beat": {
                "kind": "dyad",
                "joins": ["E", "G"],
                "pin": "F",
                "side": "left",
                "links": {"link": 214.1, "sley": 155.1},
            },
            "ram": {
                "kind": "slider",
                "from": "F",
                "through": "L",
                "direction": math.atan2(-20, 100),
                "pin": "P",
                "side": "ahead",
                "links": {"strut": 260.0},
            },
        }
    )
    for row in rows("pylinkage_six_bar"):
        pose = sley.pose(FLOAT, {}, math.radians(row["crank_deg"]))
        for name in "CEFP":
            assert tuple(pose.joints[name].place) == pytest.approx(place(row, name), rel=1e-12, abs=0)
