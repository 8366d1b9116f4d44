"""The load at an extreme of the output falls to 0 where it turns back no more: its least has a margin, and a price."""

import math
import tomllib

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.linkage.program import TURNING_SHARE

SIX_BAR = """
[problem]
name = "s91"
job = "linkage"
title = "Four-bar with a ram whose front can vanish"
source = "drawn at random"
[operation]
speed = "347.1 rpm"
[mechanism]
l1 = "489.521 mm"
l2 = "1176.240 mm"
l3 = "1774.634 mm"
l4 = "2108.276 mm"
e = "687.433 mm"
eps = "112.597 deg"
st = "1431.882 mm"
Gx = "1419.357 mm"
Gy = "-1526.228 mm"
[parts]
A = { kind = "pivot" }
D = { kind = "pivot", x = "l4" }
crank = { kind = "crank", at = "A", pin = "B", length = "l1" }
drive = { kind = "dyad", joins = ["B", "D"], pin = "C", side = "left", links = { rod = "l2", rocker = "l3" } }
E = { kind = "point", on = "rocker", radius = "e", angle = "eps" }
G = { kind = "pivot", x = "Gx", y = "Gy" }
[parts.ram]
kind = "slider"
from = "E"
through = "G"
direction = "138.684 deg"
pin = "P"
side = "behind"
links = { strut = "st" }
[output]
slide = "ram"
sense = "backward"
[events]
front = { extreme = "max", near = "294 deg" }
rear = { extreme = "min", near = "55 deg" }
[effects.inertia]
mass = "0.7850 kg"
[effects.gravity]
down = "-147 deg"
[bounds]
l1 = { min = "214.246 mm", max = "764.795 mm" }
l2 = { min = "514.800 mm", max = "1837.680 mm" }
l3 = { min = "776.696 mm", max = "2772.572 mm" }
l4 = { min = "922.720 mm", max = "3293.833 mm" }
e = { min = "300.866 mm", max = "1074.000 mm" }
st = { min = "626.685 mm", max = "2237.078 mm" }
[limits]
swing = { min = "126.65469 mm" }
mu = { drive = { min = "52.585 deg" }, ram = { min = "28.255 deg" } }
peak_acceleration = { max = "223.803750 mm" }
[targets.t]
least = ["force.front", "peak_torque"]
[targets.smooth]
least = ["peak_acceleration"]
"""

WEAK = {
    "l1": "365.86818102406643 mm",
    "l2": "715.3288261340724 mm",
    "l3": "2030.106646811201 mm",
    "l4": "2097.4857132016322 mm",
    "e": "1060.3727356311181 mm",
    "eps": "122.55285994040243 deg",
    "st": "1037.7123901214043 mm",
    "Gx": "1907.1024569003105 mm",
    "Gy": "-1042.3744089683926 mm",
}
"""A design whose front turns back with a hundred-thousandth of its largest acceleration."""
OMEGA = 347.1 * math.pi / 30
TEXT = "the output turns back at front"


def scene(sense="backward", **changes):
    document = tomllib.loads(SIX_BAR)
    document["output"]["sense"] = sense
    return registry.scene(document).update(changes) if changes else registry.scene(document)


def rows(scene, target):
    return [limit for limit in registry.of(scene).program(scene, target).limits if limit.name.startswith("the output")]


@pytest.mark.slow
def test_the_least_load_at_an_extreme_is_certified_and_names_the_margin():
    answer = lo.solve(scene())
    today = lo.evaluate(scene()).figures["peak_acceleration"]
    assert answer.status == "optimal"
    assert TEXT in {limit.limit for limit in answer.binding}
    mass_force = -0.785 * OMEGA**2 * TURNING_SHARE * today
    assert answer.figures["force.front"] == pytest.approx(mass_force, rel=1e-6)


def test_only_a_target_that_seeks_the_load_has_the_margin():
    (row,) = rows(scene(), "t")
    assert row.name == TEXT
    assert not row.relaxable
    assert not rows(scene(), "smooth")


def test_todays_machine_is_never_outside_the_margin():
    weak = scene(**{f"mechanism.{name}": value for name, value in WEAK.items()})
    (row,) = rows(weak, "t")
    figures = lo.evaluate(weak).figures
    bend = figures["force.front"] / (0.785 * OMEGA**2)
    assert -TURNING_SHARE * figures["peak_acceleration"] < bend < row.value < 0


REST = """
[problem]
name = "rest-sley"
job = "linkage"
title = "Six-bar sley with a rest"
source = "numbers own"
[operation]
speed = "480 rpm"
[mechanism]
r = "40 mm"
c1 = "120 mm"
k1 = "95 mm"
fx = "130 mm"
fy = "20 mm"
arm = "80 mm"
off = "-60 deg"
c2 = "150 mm"
sl = "170 mm"
gx = "180 mm"
gy = "-150 mm"
[parts]
A = { kind = "pivot" }
F = { kind = "pivot", x = "fx", y = "fy" }
G = { kind = "pivot", x = "gx", y = "gy" }
drive = { kind = "crank", at = "A", pin = "B", length = "r" }
first = { kind = "dyad", joins = ["B", "F"], pin = "C", side = "left", links = { rod = "c1", bell = "k1" } }
E = { kind = "point", on = "bell", radius = "arm", angle = "off" }
second = { kind = "dyad", joins = ["E", "G"], pin = "H", side = "left", links = { strut = "c2", sley = "sl" } }
[output]
angle = "sley"
[events]
front = { extreme = "max" }
rear = { extreme = "min" }
[effects.inertia]
J = "0.8 kg*m^2"
[bounds]
r = { min = "30 mm", max = "55 mm" }
c1 = { min = "100 mm", max = "160 mm" }
k1 = { min = "80 mm", max = "120 mm" }
arm = { min = "60 mm", max = "100 mm" }
off = { min = "-100 deg", max = "0 deg" }
c2 = { min = "120 mm", max = "190 mm" }
sl = { min = "150 mm", max = "190 mm" }
[windows]
rest = { after = "rear", begins = "-35 deg", ends = "35 deg", level = "rear" }
[limits]
swing = { min = "20 deg", max = "24 deg" }
mu.first = { min = "35 deg" }
mu.second = { min = "35 deg" }
[targets.t]
least = ["travel.rest"]
"""


@pytest.mark.slow
def test_the_least_travel_of_a_rest_is_certified():
    """Without the margin every start ended elsewhere, the best at 1.207 degrees."""
    answer = lo.solve(registry.scene(tomllib.loads(REST)))
    assert answer.status == "optimal"
    assert answer.figures["travel.rest"] <= math.radians(0.68)


@pytest.mark.slow
def test_an_event_at_a_travel_keeps_away_from_where_it_jumps():
    # Where the output comes back to the travel before its extreme, the event jumps there: without a margin the best
    # start ends on the edge of this jump, at 4.143 rad, without a certificate.
    press = registry.scene({**lo.load("knuckle-press").document, "targets": {"t": {"least": ["angle.touch"]}}})
    answer = lo.solve(press, target="t")
    assert answer.status == "optimal"
    assert answer.figures["angle.touch"] < 4.0665
    edge = next(price for price in answer.binding if price.limit == "the output passes the travel of touch once")
    assert edge.worth["angle.touch"] > 0.0
