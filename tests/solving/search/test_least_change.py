"""Least change from today: the last level, where an optimum leaves more open than the program's own moves settle."""

import math

import numpy as np
import pytest
from support import toy
from support.rapiers import ROOM

import loomopt as lo
from loomopt.maths.systems import FLOAT
from loomopt.model.program import AxisMove, Preference
from loomopt.physics.mechanisms.cam_spline import spline
from loomopt.solving.certificate import second_order
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.nlp.point import Settings
from loomopt.solving.search import least_change, tie_break
from loomopt.solving.search.least_change import with_least_change
from loomopt.solving.search.search import Search, certify_best, objectives, solve_from

ANGLES = ("rise", "far_dwell", "return", "near_dwell")
LEAST = "least change from today"


@pytest.fixture
def unsettled(monkeypatch):
    """Return a way to solve without the last level."""

    def solve(scene, target=None):
        with monkeypatch.context() as patch:
            patch.setattr(least_change, "with_least_change", lambda search: search)
            return lo.solve(scene, target, starts=1)

    return solve


def freed(**changes):
    """Return the shedding scene with its four angles free."""
    free = {f"bounds.{name}.free": True for name in ANGLES}
    return lo.load("shedding").update(free | {key.replace("__", "."): value for key, value in changes.items()})


def uneven():
    """Return it with a rise that is too short for today's speed and the weakest spring, and a long return."""
    values = {"mechanism.rise": "100 deg", "mechanism.return": "140 deg", "operation.speed": "125 rpm"}
    return freed().update(values)


def degrees(answer):
    return [math.degrees(answer.design[name]) for name in ANGLES]


# Toys ------------------------------------------------------------------------------------------------------------


def solved(program, start, today):
    """Return the search of a toy after its least change."""
    search = Search(toy.ToyJob(program), program, Settings(), today)
    return with_least_change(certify_best(solve_from(search, start)))


def test_the_sum_of_squares_in_bound_widths_is_least():
    bounds = {"x": (1.0, 9.0), "y": (-10.0, 10.0), "z": (0.0, 5.0)}
    rows = {"f": lambda v: v["x"], "sum": lambda v: v["y"] + v["z"]}
    program = toy.program("xyz", rows, limits=(("sum", -1, 3.0),), bounds=bounds)
    best = solved(program, {"x": 4.0, "y": 4.0, "z": 2.0}, {"x": 5.0, "y": 0.0, "z": 0.0}).best
    assert best.certificate.passed
    assert best.certificate.tie_breaks == (f"y, z: {LEAST}",)
    assert best.certificate.open == ()
    assert not best.certificate.unique
    assert best.certificate.change.stationarity <= 1e-6
    assert [best.x[name] for name in "xyz"] == pytest.approx([1.0, 48 / 17, 3 / 17], abs=1e-8)


def test_a_level_that_only_curves_is_held_and_not_traded():
    rows = {"f": lambda v: 1.0 + (v["x"] + v["y"] - 1.0) ** 2}
    best = solved(toy.program("xy", rows), {"x": 4.0, "y": 1.0}, {"x": 9.0, "y": 0.0}).best
    assert best.certificate.tie_breaks == (f"x, y: {LEAST}",)
    assert (best.x["x"], best.x["y"]) == pytest.approx((5.0, -4.0), abs=1e-6)


def test_two_levels_are_held():
    rows = {"f": lambda v: v["x"], "g": lambda v: (v["y"] + v["z"] - 1.0) ** 2}
    program = toy.program("xyz", rows, bounds={"x": (2.0, 9.0)}, objectives=("f", "g"))
    best = solved(program, {"x": 4.0, "y": 3.0, "z": 1.0}, {"x": 5.0, "y": 1.0, "z": 2.0}).best
    assert best.certificate.tie_breaks == (f"y, z: {LEAST}",)
    assert [best.x[name] for name in "xyz"] == pytest.approx([2.0, 0.0, 1.0], abs=1e-8)


def test_what_has_no_value_of_today_is_named_as_open():
    program = toy.program("xyz", {"f": lambda v: v["x"] ** 2})
    bare = solved(program, {"x": 4.0, "y": 3.0, "z": 1.0}, {}).best.certificate
    assert (bare.tie_breaks, bare.open) == ((), ("y", "z"))
    half = solved(program, {"x": 4.0, "y": 3.0, "z": 1.0}, {"y": 2.0}).best
    assert half.x["y"] == pytest.approx(2.0, abs=1e-6)
    assert (half.certificate.tie_breaks, half.certificate.open) == ((f"y, z: {LEAST}",), ("z",))
    assert half.certificate.choices[-1] == "open: z"


def test_a_design_that_gets_no_certificate_stays_and_says_what_is_open(monkeypatch):
    monkeypatch.setattr(least_change, "_certify_change", lambda *_: None)
    program = toy.program("xy", {"f": lambda v: v["x"] ** 2})
    search = certify_best(
        solve_from(Search(toy.ToyJob(program), program, Settings(), {"y": 2.0}), {"x": 4.0, "y": 3.0})
    )
    best = with_least_change(search).best
    assert best.x == search.best.x
    assert (best.certificate.tie_breaks, best.certificate.open) == ((), ("y",))


@pytest.mark.parametrize(
    "moves", [(), (AxisMove("y", ("y",), (Preference("least", "tidy"),), {"y": 0.0}, {"y": (-9, 9)}),)]
)
def test_nothing_is_solved_where_nothing_is_left(moves, monkeypatch):
    monkeypatch.setattr(least_change, "solve_from", lambda *_: pytest.fail("solved again"))
    rows = {"f": lambda v: v["x"] ** 2 + (0 if moves else v["y"] ** 2)}
    program = toy.program("xy", rows, moves=moves)
    best = solved(program, {"x": 4.0, "y": 3.0}, {"x": 1.0, "y": 2.0}).best
    assert best.certificate.passed
    assert best.certificate.change is None


def test_a_design_that_has_changed_least_already_stays_to_the_last_bit_and_is_not_certified_again(monkeypatch):
    certified = []

    def counted(*request):
        certified.append(request)
        return certify(*request)

    monkeypatch.setattr(least_change, "certify", counted)
    program = toy.program("xy", {"f": lambda v: v["x"]}, bounds={"x": (1.0, 9.0)})
    first = solved(program, {"x": 4.0, "y": 3.0}, {"y": 2.0}).best
    assert len(certified) == 1
    again = solved(program, first.x, {"y": first.x["y"]}).best
    assert len(certified) == 1
    assert again.x["y"] == first.x["y"]
    assert again.certificate.passed
    assert again.certificate.tie_breaks == (f"y: {LEAST}",)
    assert again.certificate.change.stationarity <= 1e-6


def test_levels_that_are_shown_at_a_design_are_not_followed_there_again(monkeypatch):
    followed = []

    def counted(lagrangian, *others):
        followed.append(lagrangian.level)
        return higher(lagrangian, *others)

    higher = second_order._higher
    program = toy.program("xy", {"f": lambda v: v["x"]}, bounds={"x": (1.0, 9.0)})
    first = solved(program, {"x": 4.0, "y": 3.0}, {"y": 2.0}).best
    monkeypatch.setattr(second_order, "_higher", counted)
    stays = solved(program, first.x, {"y": first.x["y"]}).best
    assert (followed, stays.certificate.passed) == ([0, 1], True), "once at the level, once at the change"
    followed.clear()
    moves = solved(program, {"x": 4.0, "y": 3.0}, {"y": 2.0}).best
    assert followed.count(0) > 1, "another design"
    assert moves.x == first.x


def test_a_level_that_is_shown_says_as_much_as_one_that_is_followed():
    program = toy.program("xy", {"f": lambda v: v["x"] ** 2 + v["y"] ** 4, "g": lambda v: v["y"] ** 2}, objectives="fg")
    x = {"x": 0.0, "y": 0.0}
    assert certify(program, x, 1e-8, 1) == certify(program, x, 1e-8)
    falls = toy.program("xy", {"f": lambda v: v["x"] ** 2 - v["y"] ** 4, "g": lambda v: v["y"] ** 2}, objectives="fg")
    assert not certify(falls, x, 1e-8).passed


def test_designs_that_change_share_one_model():
    program = toy.program("xy", {"f": lambda v: v["x"] ** 2})
    tasks = [least_change.change_program(program, {"x": 0.0, "y": y}, (), {"x": 0.0, "y": 2.0}) for y in (1.0, 3.0)]
    assert tasks[0].model is tasks[1].model
    assert tasks[0].parameters == tasks[1].parameters
    other = least_change.change_program(program, {"x": 0.0, "y": 1.0}, ("x",), {"x": 0.0, "y": 2.0})
    assert other.model is not tasks[0].model


def test_only_moves_along_the_level_are_looked_at(monkeypatch):
    requests: list[set[str]] = []

    def counted(directions):
        requests.extend(set(direction.way) for direction in directions)
        return [0.0] * len(directions)

    monkeypatch.setattr(tie_break, "_changes_along", counted)
    axes = [AxisMove(n, (n,), (Preference("today", "tidy"),), {n: 0.0}, {n: (-9.0, 9.0)}) for n in "xyz"]
    program = toy.program("xyz", {"f": lambda v: v["x"] ** 2 + (v["y"] - v["z"]) ** 2}, moves=tuple(axes))
    certificate = certify(program, {"x": 0.0, "y": 1.0, "z": 1.0}, 1e-8)
    ways = least_change.open_directions(program, {"x": 0.0, "y": 1.0, "z": 1.0}, certificate, ())
    assert len(ways) == 1, "y and z together are no move"
    assert requests == []
    flat = toy.program("xyz", {"f": lambda v: v["x"] ** 2}, moves=tuple(axes))
    certificate = certify(flat, {"x": 0.0, "y": 1.0, "z": 1.0}, 1e-8)
    assert len(least_change.open_directions(flat, {"x": 0.0, "y": 1.0, "z": 1.0}, certificate, ("y",))) == 0
    assert requests == [{"z"}], "y stays whatever it changes"


# Machines --------------------------------------------------------------------------------------------------------


def test_angles_that_need_not_change_do_not():
    answer = lo.solve(freed(operation__speed="60 rpm"), starts=1)
    assert answer.status == "optimal"
    assert degrees(answer) == pytest.approx([120.0, 60.0, 120.0, 60.0], abs=1e-9)
    assert answer.certificate.tie_breaks == (f"rise, far_dwell, return: {LEAST}",)
    assert answer.as_dict()["certificate"]["levels"][-1]["objective"] == "change from today"


def test_only_the_angle_that_must_change_changes():
    answer = lo.solve(freed(operation__speed="60 rpm", bounds__rise__min="125 deg"), starts=1)
    assert degrees(answer) == pytest.approx([125.0, 60.0, 120.0, 55.0], abs=1e-9)


def test_no_angles_nearer_to_todays_hold_as_weak_a_spring(unsettled):
    """From rise 100° and return 140°, at a speed at which the spring needs a longer rise."""
    scene = uneven()
    answer = lo.solve(scene, starts=1)
    widths = {name: scene.bounds[name].max - scene.bounds[name].min for name in ANGLES[:3]}

    def far(design):
        return sum(((design[name] - scene.mechanism[name]) / width) ** 2 for name, width in widths.items())

    assert answer.figures["K1"] == pytest.approx(unsettled(scene).figures["K1"], rel=1e-9)
    assert far(answer.design) < far(unsettled(scene).design) - 0.01
    rng = np.random.default_rng(1)
    nearer = 0
    for _ in range(60):
        step = rng.normal(scale=0.02, size=3)
        trial = {**answer.design, **{n: answer.design[n] + d for n, d in zip(ANGLES[:3], step, strict=True)}}
        trial["near_dwell"] = 2 * math.pi - sum(trial[name] for name in ANGLES[:3])
        if far(trial) < far(answer.design):
            nearer += 1
            assert not lo.evaluate(scene, trial).admissible
    assert nearer > 10


@pytest.mark.slow
def test_a_law_that_need_not_change_is_todays_sampled_but_for_its_end():
    scene = lo.load("shedding").set("operation.speed", "100 rpm")
    answer = lo.solve(scene, "law", starts=1)
    values = np.array(answer.design["law"])
    todays = 2 * math.pi * np.sin(2 * math.pi * np.arange(17) / 16)
    assert answer.certificate.tie_breaks == (f"law: {LEAST}",)
    assert answer.figures["K1"] == pytest.approx(6176.1875, rel=1e-12)
    assert values == pytest.approx(todays, abs=0.1)
    # The spline through today's values ends at rest but not at 1: of all that end there this one is nearest, and
    # heights are linear in the values.
    heights = np.array([[float(end) for end in spline(FLOAT, tuple(row)).end] for row in np.eye(17)])
    inner = np.abs(todays) < 2 * math.pi - 1e-9
    inner[[0, -1]] = False
    missed = np.array([1.0, 0.0]) - values[~inner] @ heights[~inner]
    gap = missed - todays[inner] @ heights[inner]
    nearest = todays[inner] + np.linalg.pinv(heights[inner].T) @ gap
    assert values[inner] == pytest.approx(nearest, abs=1e-8)


def test_a_rapier_turns_back_toward_today_as_far_as_its_bounds_allow(unsettled):
    scene = lo.load("rapier").update(ROOM)
    answer, before = lo.solve(scene, starts=1), unsettled(scene)
    assert answer.certificate.tie_breaks == (f"alpha, C0x, C0y, phi40: {LEAST}",)
    assert answer.figures["peak_acceleration"] == pytest.approx(before.figures["peak_acceleration"], rel=1e-9)
    names = ("alpha", "C0x", "C0y", "phi40")

    def turned(angle):
        C0 = complex(answer.design["C0x"], answer.design["C0y"]) * np.exp(1j * angle)
        values = {"C0x": C0.real, "C0y": C0.imag, "alpha": answer.design["alpha"] + angle}
        return values | {"phi40": answer.design["phi40"] + angle}

    def far(values):
        return sum(((values[n] - scene.mechanism[n]) / (scene.bounds[n].max - scene.bounds[n].min)) ** 2 for n in names)

    def inside(values):
        return all(scene.bounds[n].min - 1e-9 <= values[n] <= scene.bounds[n].max + 1e-9 for n in names)

    reached = [far(turned(angle)) for angle in np.linspace(-0.08, 0.08, 1601) if inside(turned(angle))]
    assert far(answer.design) <= min(reached) + 1e-7
    assert far(answer.design) < max(reached) - 1e-3


@pytest.mark.parametrize(
    ("scene", "target"),
    [
        (freed(operation__speed="60 rpm"), "stiffness"),
        (uneven(), "stiffness"),
        (freed(operation__speed="100 rpm", targets__law__intervals=8), "law"),
        pytest.param(freed(operation__speed="100 rpm"), "law", marks=pytest.mark.slow),
        (lo.load("rapier").update(ROOM), "stroke-dwell"),
    ],
)
def test_no_earlier_objective_changes(scene, target, monkeypatch):
    seen = []

    def unchanged(search):
        after = with_least_change(search)
        seen.append([objectives(search.program, item.best.x) for item in (search, after)])
        return after

    monkeypatch.setattr(least_change, "with_least_change", unchanged)
    answer = lo.solve(scene, target, starts=1)
    assert answer.status == "optimal"
    assert answer.certificate.tie_breaks
    before, after = seen[0]
    assert after == pytest.approx(before, abs=1e-9)


@pytest.mark.parametrize(("name", "target"), [("beatup", "balance"), ("beatup-light", "balance"), ("beatup", "pulse")])
def test_a_counterweight_and_a_common_scale_are_settled_by_their_own_rules(name, target, monkeypatch):
    monkeypatch.setattr(least_change, "solve_from", lambda *_: pytest.fail("solved again"))
    answer = lo.solve(lo.load(name), target, starts=1)
    assert not answer.certificate.unique
    assert answer.certificate.open == ()


def test_what_is_left_open_is_said(monkeypatch):
    monkeypatch.setattr(least_change, "_solve_least_change", lambda *_: None)
    answer = lo.solve(freed(operation__speed="60 rpm"), starts=1)
    assert answer.status == "optimal"
    assert "Other values are equally good for: rise, far_dwell, return." in answer.message
    assert answer.as_dict()["certificate"]["settled"] == ["open: rise, far_dwell, return"]
