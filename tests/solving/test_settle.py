"""The silent levels: least added mass, then least change from today, and only along what costs nothing."""

import numpy as np
import pytest
import toy
from plain_beatup import DESIGN, LENGTHS, Machine

import loomopt as lo
from loomopt.program.program import Move, Wish
from loomopt.solving.settle import settle


def slide(goal, low=-100.0, high=100.0):
    """Return the move of y alone that wants it at goal."""
    return Move("slide", ("y",), "axis", (Wish("today", "tidier"),), {"y": goal}, {"y": (low, high)})


def scene_of(M0):
    return lo.load("beatup").set("operation.M0", f"{M0} N*m")


def change(scene, design):
    bounds, today = scene.bounds, scene.mechanism
    return sum(((design[n] - today[n]) / (bounds[n].max - bounds[n].min)) ** 2 for n in LENGTHS)


@pytest.mark.parametrize("M0", [800, 900])
def test_of_all_common_factors_the_lengths_take_the_one_nearest_today(M0):
    scene = scene_of(M0)
    answer = lo.solve(scene)
    machine, best = Machine(scene), None
    for factor in np.linspace(0.985, 1.015, 30_001):
        scaled = answer.design | {name: factor * answer.design[name] for name in LENGTHS}
        inside = all(scene.bounds[n].min - 1e-12 <= scaled[n] <= scene.bounds[n].max + 1e-12 for n in LENGTHS)
        if inside and (best is None or change(scene, scaled) < change(scene, best)):
            best = scaled
    assert change(scene, answer.design) <= change(scene, best) * (1 + 1e-9)
    assert machine.peaks(best, 10_000)["peak_torque"] == pytest.approx(answer.figures["peak_torque"], rel=1e-6)
    assert any("scale" in text for text in answer.certificate.settled)
    assert not answer.certificate.unique


@pytest.mark.parametrize("M0", [700, 745, 780])
def test_a_counterweight_is_as_light_as_its_largest_radius_allows(M0):
    answer = lo.solve(scene_of(M0))
    assert 0 < answer.design["m4e"] < 12.4
    assert answer.design["r4e"] == 0.08
    assert any("added mass" in text for text in answer.certificate.settled)


@pytest.mark.parametrize("radius", ["0 mm", "50 mm"])
@pytest.mark.parametrize("target", ["balance", "pulse"])
def test_without_counterweight_the_radius_stays_todays(radius, target):
    answer = lo.solve(scene_of(600).set("mechanism.r4e", radius), target)
    assert answer.status == "optimal"
    assert answer.design["m4e"] == 0.0
    assert answer.design["r4e"] == pytest.approx(float(radius.split()[0]) / 1000, abs=1e-15)


@pytest.mark.parametrize("least", ["1 g", "100 g", "2 kg"])
@pytest.mark.parametrize("target", ["balance", "pulse"])
def test_a_counterweight_that_must_be_there_but_only_harms_is_least_and_at_the_shaft(least, target):
    scene = scene_of(600).set("bounds.m4e.min", least)
    answer = lo.solve(scene, target)
    assert answer.status == "optimal"
    assert answer.design["r4e"] == pytest.approx(0.0, abs=1e-9)
    assert answer.design["m4e"] == pytest.approx(scene.bounds["m4e"].min, rel=1e-9)


def test_settling_changes_no_figure_of_the_target():
    for M0 in (600, 745, 800, 900):
        answer = lo.solve(scene_of(M0))
        raw = lo.evaluate(scene_of(M0), answer.design).figures
        for name in ("M3_fdc", "peak_torque"):
            assert answer.figures[name] == pytest.approx(raw[name], rel=1e-12, abs=1e-9)
        found = next(iter(answer.optima))[0]
        assert answer.figures["peak_torque"] == pytest.approx(found["peak_torque"], rel=1e-9)


def test_today_s_own_values_are_kept_where_nothing_asks_for_others():
    """A retrofit of a machine that balances already changes nothing."""
    scene = scene_of(800)
    balanced = lo.solve(scene, "retrofit").design
    again = scene.update({f"mechanism.{n}": f"{balanced[n]!r} {'kg' if n == 'm4e' else 'm'}" for n in DESIGN})
    answer = lo.solve(again, "retrofit")
    assert answer.status == "optimal"
    assert answer.figures["change"] == pytest.approx(0.0, abs=1e-16)
    assert answer.design == pytest.approx(balanced, rel=1e-8)


# Toys ------------------------------------------------------------------------------------------------------------


def slid(rows, goal, limits=(), y=0.5):
    """Return y after the silent level that wants it at goal; f is the objective."""
    program = toy.program("xy", rows, limits=limits, moves=(slide(goal),))
    x, said = settle(program, {"x": 1.0, "y": y})
    assert x["x"] == 1.0
    return x["y"], said


FLAT = {"f": lambda v: v["x"] ** 2}


def test_a_flat_direction_is_followed_to_the_wish():
    assert slid(FLAT, 3.0) == (3.0, ("slide: tidier",))


def test_a_direction_that_costs_anything_is_not_followed():
    for steep in (1.0, 1e-9):
        costly = {"f": lambda v, steep=steep: v["x"] ** 2 + steep * v["y"]}
        assert slid(costly, 3.0) == (0.5, ())


def test_a_direction_flat_at_both_ends_only_is_not_followed():
    bump = {"f": lambda v: v["x"] ** 2 + (v["y"] - 0.5) * (v["y"] - 3.0)}
    assert slid(bump, 3.0) == (0.5, ())


def test_a_limit_in_the_way_is_met_and_not_crossed():
    y, said = slid(FLAT, 3.0, limits=(("y", 1, 2.0),))
    assert y == pytest.approx(2.0, abs=1e-11)
    assert y <= 2.0 + 1e-11
    assert said == ("slide: tidier",)


def test_a_limit_already_met_stops_the_move_at_once():
    assert slid(FLAT, 3.0, limits=(("y", 1, 0.5),))[0] == pytest.approx(0.5, abs=1e-11)


def test_nothing_is_said_to_be_settled_where_nothing_moved():
    assert slid(FLAT, 0.5) == (0.5, ())
    program = toy.program("xy", FLAT)
    assert settle(program, {"x": 1.0, "y": 0.5}) == ({"x": 1.0, "y": 0.5}, ())
