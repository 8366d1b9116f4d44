"""Figures that cannot be negative and can be 0: the optimum is 0, certified, whatever bends or ends there."""

import tomllib

import pytest

import loomopt as lo

FOUR_BAR = """
[problem]
name = "balance"
job = "linkage"
title = "Full force balance of a four-bar by the places of its masses"
source = "Berkof and Lowen 1969: conditions; numbers own"
[operation]
speed = "500 rpm"
[mechanism]
a1 = "50 mm"
a2 = "150 mm"
a3 = "120 mm"
a4 = "140 mm"
[parts]
A = { kind = "pivot" }
D = { kind = "pivot", x = "a4" }
crank = { kind = "crank", at = "A", pin = "B", length = "a1" }
main = { kind = "dyad", joins = ["B", "D"], pin = "C", side = "left", links = { rod = "a2", rocker = "a3" } }
E = { kind = "point", on = "rod", radius = "a3", angle = "40 deg" }
[output]
angle = "rocker"
[events]
front = { extreme = "max" }
rear = { extreme = "min" }
[effects.mass.crank]
mass = "0.5 kg"
along = "25 mm"
[effects.mass.rod]
mass = "0.8 kg"
along = "75 mm"
J = "0.0015 kg*m^2"
[effects.mass.rocker]
mass = "0.6 kg"
along = "-60 mm"
J = "0.0007 kg*m^2"
[effects.joint_forces]
[bounds]
mass.crank.along = { min = "-100 mm", max = "50 mm" }
mass.rocker.along = { min = "-150 mm", max = "120 mm" }
[targets.t]
least = ["shaking_force"]
"""

CRANK = """
[problem]
name = "crank"
job = "linkage"
title = "A crank whose mass can be put on its shaft, with a ram that weighs nothing"
source = "numbers own"
[operation]
speed = "300 rpm"
[mechanism]
r = "100 mm"
l = "300 mm"
[parts]
A = { kind = "pivot" }
crank = { kind = "crank", at = "A", pin = "B", length = "r" }
[parts.ram]
kind = "slider"
from = "B"
through = "A"
direction = "0 deg"
pin = "P"
side = "ahead"
links = { rod = "l" }
[output]
slide = "ram"
[events]
out = { extreme = "max" }
in = { extreme = "min" }
[effects.mass.crank]
mass = "2 kg"
along = "40 mm"
[effects.joint_forces]
[available.gravity]
down = "-90 deg"
[bounds]
mass.crank.along = { min = "-90 mm", max = "60 mm" }
[targets.t]
least = ["shaking_force"]
"""

SPRING = """
[problem]
name = "spring"
job = "linkage"
title = "Static balance by a spring of no free length"
source = "static balancing (Herder, Streit): k a b = m g r; numbers own"
[operation]
speed = "10 rpm"
[mechanism]
r = "400 mm"
h = "200 mm"
l = "900 mm"
[parts]
A = { kind = "pivot" }
S = { kind = "pivot", x = "0 mm", y = "h" }
crank = { kind = "crank", at = "A", pin = "B", length = "r" }
[parts.ram]
kind = "slider"
from = "B"
through = "A"
direction = "0 deg"
pin = "P"
side = "ahead"
links = { rod = "l" }
[output]
slide = "ram"
[events]
out = { extreme = "max" }
in = { extreme = "min" }
[effects.gravity]
down = "-90 deg"
[effects.mass.B]
mass = "5 kg"
[effects.spring.up]
begins = "S"
ends = "B"
stiffness = "100 N/m"
free = "0 mm"
[bounds]
spring.up.stiffness = { min = "0 N/m", max = "1000 N/m" }
[targets.t]
least = ["peak_torque"]
"""

GRAVITY = 9.80665


def scene(text, least, changes=(), on=(), off=()):
    document = tomllib.loads(text)
    document["targets"]["t"]["least"] = list(least)
    return lo.scene(document).update(dict(changes)).with_effect(*on).without_effect(*off)


def vanished(answer, name, size):
    assert answer.status == "optimal", answer.message
    assert answer.certificate.passed
    assert abs(answer.figures[name]) <= 1e-9 * size
    assert answer.binding == ()
    assert f"{name} is 0 " in answer.message


def test_a_four_bar_is_balanced_by_the_places_of_two_masses():
    answer = lo.solve(scene(FOUR_BAR, ["shaking_force"]))
    vanished(answer, "shaking_force", 119.7)
    assert answer.design["crank.along"] == pytest.approx(-0.040, abs=1e-10)
    assert answer.design["rocker.along"] == pytest.approx(-0.080, abs=1e-10)


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("lengths", "masses", "along"),
    [
        ((59.1, 129.71, 145.45, 133.49), (0.69, 0.39, 0.76), 28.0),
        ((54.2, 136.03, 120.59, 154.27), (0.44, 1.77, 1.64), 63.7),
        ((54.24, 142.34, 194.68, 175.83), (1.59, 0.37, 1.75), 62.6),
    ],
)
def test_a_balance_where_a_mass_stands_at_its_bound_is_0_to_all_digits(lengths, masses, along):
    a1, a2, a3, _ = lengths
    crank, rod, rocker = masses
    share = along / a2
    ends = {"crank": -rod * (1 - share) * a1 / crank, "rocker": -rod * share * a3 / rocker}  # Berkof and Lowen
    changes = {f"mechanism.a{k + 1}": f"{length} mm" for k, length in enumerate(lengths)}
    changes |= {
        f"effects.mass.{name}.mass": f"{mass} kg" for name, mass in zip(("crank", "rod", "rocker"), masses, strict=True)
    }
    changes |= {"operation.speed": "900 rpm", "effects.mass.rod.along": f"{along} mm"}
    changes |= {f"effects.mass.{name}.along": f"{begin} mm" for name, begin in (("crank", 20), ("rocker", -10))}
    bounds = {"crank": (ends["crank"] - 50.0, 20.0), "rocker": (ends["rocker"], max(ends["rocker"] + 50.0, 20.0))}
    for name, (low, high) in bounds.items():
        changes |= {f"bounds.mass.{name}.along.min": f"{low!r} mm", f"bounds.mass.{name}.along.max": f"{high!r} mm"}
    balanced = scene(FOUR_BAR, ["shaking_force"], changes)
    today = lo.evaluate(balanced).figures["shaking_force"]
    vanished(lo.solve(balanced), "shaking_force", today)


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("name", "size", "on"),
    [
        ("shaking_force", 79.0, ()),
        ("force_A", 79.0, ()),
        ("peak_torque", 0.78, ("gravity",)),
        ("rms_torque", 0.55, ("gravity",)),
        ("peak_power", 24.6, ("gravity",)),
    ],
)
def test_every_figure_that_a_mass_on_the_shaft_takes_away_is_0_and_certified(name, size, on):
    answer = lo.solve(scene(CRANK, [name], on=on))
    vanished(answer, name, size)
    assert answer.design["crank.along"] == pytest.approx(0.0, abs=1e-9)


def test_where_today_has_nothing_that_is_sought_it_stays():
    answer = lo.solve(scene(CRANK, ["shaking_moment"]))
    vanished(answer, "shaking_moment", 1.0)
    assert answer.design["crank.along"] == pytest.approx(0.040, abs=1e-15)
    assert answer.solver["starts"] == 0


def test_a_machine_that_is_balanced_already_has_its_size_from_other_forces():
    answer = lo.solve(scene(CRANK, ["shaking_force"], {"effects.mass.crank.along": "0 mm"}))
    assert answer.status == "optimal", answer.message
    assert answer.figures["shaking_force"] <= 1e-7


@pytest.mark.few(1)
@pytest.mark.parametrize("least", [["peak_torque", "rms_torque"], ["rms_torque", "peak_torque"], ["peak_power"]])
def test_a_spring_balances_a_weight(least):
    answer = lo.solve(scene(SPRING, least))
    for name in least:
        vanished(answer, name, 8.0)
    assert answer.design["up.stiffness"] == pytest.approx(5 * GRAVITY / 0.2, rel=1e-9)


@pytest.mark.parametrize("least", [["peak_torque", "rms_torque"], ["rms_torque", "peak_torque"], ["peak_power"]])
def test_a_sum_that_vanishes_at_a_bound_is_certified_without_a_price(least):
    answer = lo.solve(scene(SPRING, least, off=["mass.B"]))
    for name in least:
        vanished(answer, name, 8.0)
    assert answer.design["up.stiffness"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
def test_a_later_level_has_what_a_first_one_at_0_leaves_it():
    room = {
        "bounds.mass.rod.J": {"min": "0.001 kg*m^2", "max": "0.003 kg*m^2"},
        "bounds.mass.rocker.J": {"min": "0.0005 kg*m^2", "max": "0.003 kg*m^2"},
    }
    answer = lo.solve(scene(FOUR_BAR, ["shaking_force", "peak_torque"], room))
    assert answer.status == "optimal", answer.message
    assert answer.figures["shaking_force"] <= 1e-9 * 119.7
    assert answer.design["crank.along"] == pytest.approx(-0.040, abs=1e-10)
    assert answer.design["rocker.along"] == pytest.approx(-0.080, abs=1e-10)
    # By hand: the places are given, and less inertia of either link is less torque.
    assert {price.limit for price in answer.binding} == {"rod.J", "rocker.J"}
    assert answer.design["rod.J"] == pytest.approx(0.001, rel=1e-9)
    assert answer.design["rocker.J"] == pytest.approx(0.0005, rel=1e-9)
