"""The silent levels: least added mass, then least change from today, and only along what costs nothing."""

import dataclasses

import numpy as np
import pytest
from support import toy

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model.program import AxisMove, Preference, ScaleMove
from loomopt.model.session import Session, current, working
from loomopt.solving.search.tie_break import (
    TESTED_MOVES,
    apply_moves,
    apply_moves_in_batch,
    flat_directions,
    measure_moves,
)
from reference.beatup import DESIGN, LENGTHS, Machine


def slide(goal, low=-100.0, high=100.0):
    """Return the move of y alone that wants it at goal."""
    return AxisMove("slide", ("y",), (Preference("today", "tidier"),), {"y": goal}, {"y": (low, high)})


def scene_of(M0):
    return lo.load("beatup").set("operation.M0", f"{M0} N*m")


def change(scene, design):
    bounds, today = scene.bounds, scene.mechanism
    return sum(((design[n] - today[n]) / (bounds[n].max - bounds[n].min)) ** 2 for n in LENGTHS)


@pytest.mark.few(1)
@pytest.mark.parametrize("M0", [800, 900])
def test_of_all_common_factors_the_lengths_take_the_one_nearest_today(M0):
    scene = scene_of(M0)
    answer = lo.solve(scene, starts=1)
    machine, best = Machine(scene), None
    for factor in np.linspace(0.985, 1.015, 30_001):
        scaled = {**answer.design, **{name: factor * answer.design[name] for name in LENGTHS}}
        inside = all(scene.bounds[n].min - 1e-12 <= scaled[n] <= scene.bounds[n].max + 1e-12 for n in LENGTHS)
        if inside and (best is None or change(scene, scaled) < change(scene, best)):
            best = scaled
    assert change(scene, answer.design) <= change(scene, best) * (1 + 1e-9)
    assert machine.peaks(best, 10_000)["peak_torque"] == pytest.approx(answer.figures["peak_torque"], rel=1e-6)
    assert any("scale" in text for text in answer.certificate.tie_breaks)
    assert not answer.certificate.unique


@pytest.mark.parametrize("M0", [700, 745, 780])
def test_a_counterweight_is_as_light_as_its_largest_radius_allows(M0):
    answer = lo.solve(scene_of(M0).set("targets.balance.indifference", "0"), starts=1)
    assert 0 < answer.design["m4e"] < 12.4
    assert answer.design["r4e"] == 0.08
    assert any("added mass" in text for text in answer.certificate.tie_breaks)


@pytest.mark.parametrize("radius", ["0 mm", "50 mm"])
@pytest.mark.parametrize("target", ["balance", "pulse"])
def test_without_counterweight_the_radius_stays_todays(radius, target):
    answer = lo.solve(scene_of(600).set("mechanism.r4e", radius), target, starts=1)
    assert answer.status == "optimal"
    assert answer.design["m4e"] == 0.0
    assert answer.design["r4e"] == pytest.approx(float(radius.split()[0]) / 1000, abs=1e-15)


@pytest.mark.parametrize("least", ["1 g", "100 g", "2 kg"])
@pytest.mark.parametrize("target", ["balance", "pulse"])
def test_a_counterweight_that_must_be_there_but_only_harms_is_least_and_at_the_shaft(least, target):
    scene = scene_of(600).set("bounds.m4e.min", least)
    answer = lo.solve(scene, target, starts=1)
    assert answer.status == "optimal"
    assert answer.design["r4e"] == pytest.approx(0.0, abs=1e-9)
    assert answer.design["m4e"] == pytest.approx(scene.bounds["m4e"].min, rel=1e-9)


def test_settling_changes_no_figure_of_the_target():
    for M0 in (600, 745, 800, 900):
        answer = lo.solve(scene_of(M0), starts=1)
        raw = lo.evaluate(scene_of(M0), answer.design).figures
        for name in ("M3_fdc", "peak_torque"):
            assert answer.figures[name] == pytest.approx(raw[name], rel=1e-12, abs=1e-9)
        result = next(iter(answer.optima))[0]
        assert answer.figures["peak_torque"] == pytest.approx(result["peak_torque"], rel=1e-9)


def test_today_s_own_values_are_kept_where_nothing_asks_for_others():
    """A retrofit of a machine that balances already changes nothing."""
    scene = scene_of(800)
    balanced = lo.solve(scene, "retrofit", starts=1).design
    again = scene.update({f"mechanism.{n}": f"{balanced[n]!r} {'kg' if n == 'm4e' else 'm'}" for n in DESIGN})
    answer = lo.solve(again, "retrofit", starts=1)
    assert answer.status == "optimal"
    assert answer.figures["change"] == pytest.approx(0.0, abs=1e-16)
    assert answer.design == pytest.approx(balanced, rel=1e-8)


# Toys ------------------------------------------------------------------------------------------------------------


def slid(rows, goal, limits=(), y=0.5):
    """Return y after the silent level that wants it at goal; f is the objective."""
    program = toy.program("xy", rows, limits=limits, moves=(slide(goal),))
    x, message = apply_moves(program, {"x": 1.0, "y": y})
    assert x["x"] == 1.0
    return x["y"], message


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
    y, message = slid(FLAT, 3.0, limits=(("y", 1, 2.0),))
    assert y == pytest.approx(2.0, abs=1e-11)
    assert y <= 2.0 + 1e-11
    assert message == ("slide: tidier",)


def test_a_limit_already_met_stops_the_move_at_once():
    assert slid(FLAT, 3.0, limits=(("y", 1, 0.5),))[0] == pytest.approx(0.5, abs=1e-11)


@pytest.mark.parametrize("power", [1, 2, 3])
def test_a_met_limit_that_hardly_rises_is_not_stepped_into(power):
    """What it gives way for rounding would be a step of 1e-6 and more, away from the bounds that stop a design."""
    slow = FLAT | {"h": lambda v: 1e-6 * (v["y"] - 0.5) ** power}
    assert slid(slow, 3.0, limits=(("h", 1, 0.0),)) == (0.5, ())


def test_a_met_limit_that_falls_first_stops_where_it_is_met_again():
    hollow = FLAT | {"h": lambda v: (v["y"] - 0.5) * (v["y"] - 2.0)}
    y, message = slid(hollow, 3.0, limits=(("h", 1, 0.0),))
    assert (y, message) == (pytest.approx(2.0, abs=1e-11), ("slide: tidier",))


def test_nothing_is_said_to_be_settled_where_nothing_moved():
    assert slid(FLAT, 0.5) == (0.5, ())
    program = toy.program("xy", FLAT)
    assert apply_moves(program, {"x": 1.0, "y": 0.5}) == ({"x": 1.0, "y": 0.5}, ())


# Goals of a move --------------------------------------------------------------------------------------------------


def a_move(kind=AxisMove, toward="today", along=("y",), today=None, bounds=None, **wish):
    today, bounds = today or dict.fromkeys(along, 1.0), bounds or dict.fromkeys(along, (0.5, 4.0))
    return kind("slide", along, (Preference(toward, "tidier", **wish),), today, bounds)


@pytest.mark.parametrize(
    ("toward", "today", "expected"),
    [("least", 1.0, 0.5), ("most", 1.0, 4.0), ("today", 1.0, 1.0), ("today", 0.1, 0.5), ("today", 9.0, 4.0)],
)
def test_an_axis_goes_to_its_ends_or_to_today_within_its_bounds(toward, today, expected):
    move = a_move(toward=toward, today={"y": today})
    assert move.goal(move.wishes[0], {"y": 2.0}) == {"y": expected}


def test_an_axis_without_room_stays():
    move = a_move(along=("x", "y"), bounds={"x": (2.0, 2.0), "y": (0.0, 3.0)})
    assert move.goal(move.wishes[0], {"x": 2.0, "y": 2.0}) == {"y": 1.0}


LENGTHY = {"x": (1.0, 9.0), "y": (1.0, 5.0)}


@pytest.mark.parametrize(("toward", "factor"), [("least", 0.5), ("most", 1.25)])
def test_a_scale_goes_as_far_as_every_bound_allows(toward, factor):
    move = a_move(ScaleMove, toward, ("x", "y"), bounds=LENGTHY)
    expected = {"x": 2 * factor, "y": 4 * factor}
    assert move.goal(move.wishes[0], {"x": 2.0, "y": 4.0}) == pytest.approx(expected)


def test_a_scale_nearest_to_today_weighs_each_length_by_the_width_of_its_bound():
    move = a_move(ScaleMove, "today", ("x", "y"), {"x": 3.0, "y": 4.0}, LENGTHY)
    x, widths = {"x": 2.0, "y": 4.0}, {"x": 8.0, "y": 4.0}
    factors = np.linspace(0.5, 1.25, 100_001)
    far = sum(((factors * x[n] - move.today[n]) / widths[n]) ** 2 for n in x)
    best = factors[np.argmin(far)]
    goal = move.goal(move.wishes[0], x)
    assert goal == pytest.approx({name: best * value for name, value in x.items()}, rel=1e-5)
    away = a_move(ScaleMove, "today", ("x", "y"), {"x": 30.0, "y": 40.0}, LENGTHY)
    assert away.goal(away.wishes[0], x) == pytest.approx({"x": 2.5, "y": 5.0})


def test_a_scale_without_room_or_size_stays():
    fixed = a_move(ScaleMove, "today", ("x", "y"), bounds={"x": (2.0, 2.0), "y": (1.0, 5.0)})
    assert fixed.goal(fixed.wishes[0], {"x": 2.0, "y": 4.0}) == {}
    none = a_move(ScaleMove, "today", ("x", "y"), bounds=LENGTHY)
    assert none.goal(none.wishes[0], {"x": 0.0, "y": 0.0}) == {}


def test_a_negative_coordinate_scales_with_the_lengths():
    move = a_move(ScaleMove, "most", ("x", "y"), bounds={"x": (-3.0, 3.0), "y": (1.0, 5.0)})
    assert move.goal(move.wishes[0], {"x": -2.0, "y": 2.0}) == pytest.approx({"x": -3.0, "y": 3.0})


def test_the_first_wish_that_holds_is_followed():
    wishes = (
        Preference("most", "heavy", when="x", above=1.0),
        Preference("least", "light", when="x", above=0.5),
        Preference("today", ""),
    )
    move = AxisMove("slide", ("y",), wishes, {"y": 1.0}, {"y": (0.0, 2.0)})
    results = [move.wished({"x": x, "y": 1.0}).toward for x in (1.5, 1.0, 0.5)]
    assert results == ["most", "least", "today"]
    assert AxisMove("slide", ("y",), wishes[:2], {}, {}).wished({"x": 0.0}) is None


def test_a_peak_is_compared_all_round_not_by_its_height():
    """The peak of x cos φ + y sin 2 φ / 9 stays 1 or nearly; the wave does not."""
    waves = {"w": lambda m, v, phi: m.cos(phi) * v["x"] + v["y"] * (1 - m.cos(phi) ** 2) ** 4 / 99}
    program = toy.program("xy", {}, waves, objectives=("peak w",), moves=(slide(0.9),))
    assert apply_moves(program, {"x": 1.0, "y": 0.5})[0]["y"] == 0.5


@pytest.mark.parametrize(("size", "report"), [(1.0, True), (1e3, False), (1e-3, True)])
def test_a_move_is_told_that_is_no_rounding_in_the_variables_own_size(size, report):
    program = toy.program("xy", FLAT, moves=(slide(0.5 + 1e-7),), sizes={"y": size})
    assert bool(apply_moves(program, {"x": 1.0, "y": 0.5})[1]) == report


# To the last number -----------------------------------------------------------------------------------------------


def test_a_wish_that_can_be_met_is_met_to_the_last_bit():
    assert 0.51 + 1.0 * (2.56 - 0.51) != 2.56, "a sum would miss it by rounding"
    assert slid(FLAT, 2.56, y=0.51)[0] == 2.56


@pytest.mark.parametrize(("change", "same"), [(1e-10, True), (1.1e-10, False), (-1e-10, True), (-1.1e-10, False)])
def test_a_limit_that_is_touched_may_change_by_next_to_nothing(change, same):
    rows = FLAT | {"h": lambda v: change * (v["y"] == 9.0)}
    program = toy.program("xy", rows, limits=(("h", 1, 0.0),), moves=(slide(1.0, 0.5, 9.0),))
    assert bool(flat_directions(program, {"x": 1.0, "y": 0.5})) == same


@pytest.mark.parametrize(("short", "same"), [(1e-7, False), (1.1e-7, True)])
def test_a_limit_counts_as_touched_within_a_ten_millionth(short, same):
    rows = FLAT | {"h": lambda v: (v["y"] == 9.0) * 1e-3 - short}
    program = toy.program("xy", rows, limits=(("h", 1, 0.0),), moves=(slide(1.0, 0.5, 9.0),))
    assert bool(flat_directions(program, {"x": 1.0, "y": 0.5})) == same


def test_a_limit_gives_way_by_rounding_only():
    y, _ = slid(FLAT, 3.0, limits=(("y", 1, 2.0),))
    assert y - 2.0 == pytest.approx(1e-12, rel=1e-2)


def test_a_limit_that_is_touched_and_stays_where_it_is_does_not_change():
    program = toy.program("xy", FLAT, limits=(("x", 1, 1.0),), moves=(slide(1.0, 0.5, 9.0),))
    assert flat_directions(program, {"x": 1.0 - 5e-8, "y": 0.5}) == [{"y": 1.0}]


@pytest.mark.parametrize(("end", "flat"), [(0.5, False), (0.5004, False), (0.5006, True), (0.6, True)])
def test_a_way_must_be_flat_a_thousandth_beyond_the_design_and_no_farther(end, flat):
    rows = {"f": lambda v: v["x"] ** 2 + np.maximum(0.0, v["y"] - end)}
    assert slid(rows, 0.25)[0] == (0.25 if flat else 0.5)


def test_what_is_no_number_on_the_way_has_changed():
    """An objective after one that stays the same, and a limit that is touched, as roots of what becomes negative."""
    there, move = {"x": 1.0, "y": 1.0}, (slide(1.0, 0.5, 9.0),)
    root = {"g": lambda v: 0.0 * np.sqrt(np.maximum(v["y"], 2.0 - v["y"]) * (2.0 - v["y"]))}
    both = toy.program("xy", FLAT | root, objectives=("f", "g"), moves=move)
    limit = toy.program("xy", FLAT | root, limits=(("g", 1, 0.0),), moves=move)
    with np.errstate(invalid="ignore"):
        assert flat_directions(toy.program("xy", FLAT, moves=move), there) == [{"y": 1.0}]
        assert flat_directions(both, there) == flat_directions(limit, there) == []


def test_a_bound_of_what_moves_is_no_limit_that_changes_and_any_other_is():
    there, move = {"x": 1.0, "y": 9.0}, (slide(1.0, 0.5, 9.0),)
    assert flat_directions(toy.program("xy", FLAT, bounds={"y": (0.5, 9.0)}, moves=move), there) == [{"y": 1.0}]
    assert flat_directions(toy.program("xy", FLAT, limits=(("y", 1, 9.0),), moves=move), there) == []


def test_a_way_is_followed_to_its_wish_and_not_to_where_limits_hold_again_beyond_it():
    rows = FLAT | {"h": lambda v: 1.0 * ((v["y"] > 2.0) & (v["y"] < 50.0))}
    assert slid(rows, 3.0, limits=(("h", 1, 0.5),))[0] == pytest.approx(2.0, abs=1e-11)


def test_a_direction_ends_at_its_bounds_or_at_the_factors_they_allow():
    axis, scale = a_move(), a_move(ScaleMove, along=("x", "y"), bounds=LENGTHY)
    assert list(axis.ends({"y": 1.0}, {"y": 2.0})) == [{"y": 0.5}, {"y": 4.0}]
    assert list(scale.ends({"x": 2.0, "y": 4.0}, {"x": 2.0, "y": 4.0})) == [
        {"x": 1.0, "y": 2.0},
        {"x": 2.5, "y": 5.0},
    ]
    assert list(scale.directions({"x": 2.0, "y": 4.0})) == [{"x": 2.0, "y": 4.0}]
    assert list(scale.directions({"x": 0.0, "y": 0.0})) == []
    endless = a_move(along=("x", "y"), bounds={"x": (0.0, np.inf), "y": (0.0, 1.0)})
    assert list(endless.directions({"x": 2.0, "y": 0.5})) == [{"y": 1.0}]


def test_designs_moved_in_a_batch_are_those_moved_alone():
    """Of one kind, of another kind, and one whose linkage does not assemble at the goal."""
    job = registry.find("beatup")
    scenes = [scene_of(M0) for M0 in (600, 620, 800)] + [scene_of(600).set("bounds.m4e.max", "0 kg")]
    programs = [job.program(scene, "balance") for scene in scenes]
    designs = [(program, program.completed(dict(program.starts[0]))) for program in programs]
    with working(Session()):
        alone = [apply_moves(*design) for design in designs]
        flat = [flat_directions(*design) for design in designs]
    with working(Session()):
        assert apply_moves_in_batch(designs) == alone
        measure_moves(designs)
        tested = current().count(TESTED_MOVES)
        assert tested > len(designs)
        assert [flat_directions(*design) for design in designs] == flat
        assert current().count(TESTED_MOVES) == tested, "all moves were tested before"
    assert any(x != dict(design) for (x, _), (_, design) in zip(alone, designs, strict=True))


def test_a_design_without_values_stays_and_spoils_no_other():
    program = toy.program("xy", {"f": lambda v: v["x"] ** 2 / v["z"]}, moves=(slide(3.0),))
    broken = dataclasses.replace(program, parameters={**program.parameters, "z": 0.0})
    x = {"x": 0.0, "y": 1.0}
    good = dataclasses.replace(program, parameters={**program.parameters, "z": 1.0})
    (moved, _), (stayed, rules) = apply_moves_in_batch([(good, x), (broken, x)])
    assert moved["y"] == 3.0
    assert (stayed, rules) == (x, ())
