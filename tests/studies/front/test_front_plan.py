"""The plan of a front on rows made by hand: gaps, jumps, kinks, what is dominated, what is missed."""

import itertools
import math
from dataclasses import replace

import pytest

from loomopt.studies.front import plan
from loomopt.studies.front.plan import NARROW, FrontScale
from loomopt.studies.run.rows import Row, Side

SCALE = FrontScale(("a", "b"), (1, 1), (0.0, 0.0), (1.0, 1.0))


def row(point, b, a, slope=-1.0, active=("l1 min",), request=None, certified=True, again=None, parent=None, **more):
    """Return a row at (b, a); request: how much of b it might have had; more: what else it says of itself."""
    warm: dict[str, object] = {"axes": {"a": a, "b": b}, "active": [[label, "", 1] for label in active]}
    warm |= {"again": again, "fine": False, "near": None, **more}
    status = "optimal" if certified else "failed"
    place = {} if point < 2 else {"b": b if request is None else request}
    return Row(point, place, parent, status, None, {}, {}, {plan.sloped(("a", "b")): slope}, {}, certified, 0.0, warm)


ENDS = [row(0, 1.0, 0.0, 0.0), row(1, 0.0, 1.0)]


def planned(rows, points=40):
    return [item.b for item in plan.following(rows, SCALE, points)]


def computed(answer, points=40):
    """Return the rows of a front whose answer to so much of b is known: (b, a, slope, active)."""

    def answered(point, request, **more):
        b, a, slope, active = answer(request)
        return row(point, b, a, slope if point else 0.0, active, request=request, **more)

    rows = [answered(0, 1.0), answered(1, 0.0)]
    while batch := plan.following(rows, SCALE, points):
        for item in batch:
            more = {"again": item.again, "fine": item.fine, "parent": item.near[0], "steps": item.steps}
            rows.append(answered(len(rows), item.b, **more))
    return rows


def findings(rows):
    return plan.changes_and_gaps(plan.spots(rows, SCALE)[0], SCALE)


def test_the_first_round_is_spread_evenly_over_one_gap():
    result = planned(ENDS)
    assert len(result) == plan.BATCH
    assert result == sorted(result)
    assert max(b - a for a, b in itertools.pairwise([0.0, *result, 1.0])) <= 0.25


def test_the_widest_gap_in_either_axis_is_halved_first():
    rows = [*ENDS, row(2, 0.1, 0.1), row(3, 0.5, 0.05)]
    assert planned(rows, points=5) == [pytest.approx(0.05)]
    rows = [*ENDS, row(2, 0.1, 0.9), row(3, 0.2, 0.1)]
    assert planned(rows, points=6) == [pytest.approx(0.15), pytest.approx(0.6)]


def test_what_another_dominates_is_solved_again_from_it_once():
    rows = [*ENDS, row(2, 0.5, 0.4), row(3, 0.6, 0.45)]
    first = plan.following(rows, SCALE, 40)[0]
    assert (first.again, first.near, first.b) == (3, (2,), 0.6)
    rows.append(row(4, 0.6, 0.3, again=3, parent=2))
    assert all(item.again is None for item in plan.following(rows, SCALE, 40))
    assert [spot.point for spot in plan.spots(rows, SCALE)[0]] == [1, 2, 4, 0]


def test_a_row_that_was_lost_with_its_process_is_a_failed_row_and_not_asked_for_again():
    rows = [*ENDS, row(2, 0.5, 0.4), row(3, 0.6, 0.45)]
    rows.append(Row(4, {"b": 0.6}, 2, "failed", "the process that solved it died"))
    result = plan.following(rows, SCALE, 40)
    assert all(item.again is None for item in result)
    assert 0.6 not in [item.b for item in result]
    rest = plan.following([*ENDS, Row(2, {"b": 0.5}, 0, "failed", "it died")], SCALE, 3)
    assert [(item.again, item.near) for item in rest] == [(1, (0,)), (0, (1,))]


def test_a_point_that_was_missed_is_not_asked_for_again():
    rows = [*ENDS, row(2, 0.5, 0.5, certified=False)]
    assert 0.5 not in planned(rows)
    assert planned(rows, points=4) == [0.25]


def test_a_row_without_a_certificate_is_solved_once_more_from_nearer_neighbours():
    active = [("l1 min",), ("l2 max",)]
    rows = [row(0, 1.0, 0.0, 0.0, active[1]), row(1, 0.0, 1.0, active=active[0])]
    rows += [row(2, 0.5, 0.5, certified=False, near=[0, 1])]
    while batch := plan.following(rows, SCALE, 6):
        retries = [item for item in batch if item.again == 2]
        for item in batch:
            more = {"again": item.again, "fine": item.fine, "parent": item.near[0], "steps": item.steps}
            touched, near = active[item.b > 0.4], list(item.near)
            certified = not item.steps
            position = {"b": item.b, "a": 1 - item.b, "request": item.b}
            rows.append(row(len(rows), **position, active=touched, certified=certified, near=near, **more))
        if retries:
            break
    (retry,) = retries
    left, right = (plan.value(rows[point], "b") for point in retry.near)
    assert left < retry.b == 0.5 < right
    assert right - left < 0.5
    assert all(item.again != 2 for item in plan.following(rows, SCALE, 6))
    assert retry.near[0] in [spot.point for spot in plan.spots(rows, SCALE)[0]]


def test_both_neighbours_lend_their_designs_where_they_touch_others():
    rows = [*ENDS, row(2, 0.5, 0.5, active=("l2 max",)), row(3, 0.25, 0.75)]
    near = {item.b: item.near for item in plan.following(rows, SCALE, 8)}
    assert near[0.375] == (2, 3)
    assert near[0.75] == (0, 2)


def test_either_side_of_a_change_is_solved_from_the_other_before_it_is_narrowed_down():
    first = row(0, 1.0, 0.0, 0.0, active=("l2 max",))
    rows = [
        first,
        ENDS[1],
        row(2, 0.3, 0.7),
        row(3, 0.6, 0.4, active=("l2 max",)),
        row(4, 0.8, 0.2, active=("l2 max",)),
    ]
    result = plan.following(rows, SCALE, 5)
    pairs = [(1, 2), (2, 1), (2, 3), (3, 2), (3, 4), (4, 3), (4, 0), (0, 4)]
    assert [(item.again, *item.near) for item in result] == pairs
    assert all(item.steps == 1 and not item.fine for item in result)
    rows += [row(5 + k, 0.5, 0.0, certified=False, again=again, parent=by) for k, (again, by) in enumerate(pairs)]
    (middle,) = plan.following(rows, SCALE, 5)
    assert middle.fine
    assert middle.b == pytest.approx(0.45)


def test_a_kink_is_found_where_it_is():
    def answer(b):
        return (b, 1 - 2 * b, -2.0, ("l1 min",)) if b < 0.3 else (b, 0.4 * (1 - b) / 0.7, -0.4 / 0.7, ("l2 max",))

    (change,), gaps = findings(computed(answer))
    assert change.kind == "kink"
    assert change.limits == (Side("l1", "min"), Side("l2", "max"))
    assert change.at == pytest.approx(0.3, abs=1e-9)
    assert gaps == []


def test_a_change_without_a_corner_is_an_active_set():
    def answer(b):
        slope = -1.5 if b < 0.3 else -1.5 + 1.5 * (b - 0.3)
        past = max(b - 0.3, 0.0)
        return b, 1 - 1.5 * b + 0.75 * past**2, slope, ("l1 min",) if b < 0.3 else ()

    (change,), _ = findings(computed(answer))
    assert change.kind == "active set"
    assert change.limits == (Side("l1", "min"),)
    assert change.at == pytest.approx(0.3, abs=NARROW)


def test_a_stretch_where_nothing_is_better_is_a_gap_with_a_jump_at_its_end():
    def answer(b):
        if b < 0.2:
            return b, 1 - b, -1.0, ("l1 min",)
        # Up to 0.6 more of b is of no use.
        return (0.2, 0.8, 0.0, ("l1 min",)) if b < 0.6 else (b, 0.5 * (1 - b) / 0.4, -1.25, ("l2 max",))

    rows = computed(answer)
    changes, gaps = findings(rows)
    jump = next(change for change in changes if change.kind == "jump")
    assert jump.at == pytest.approx(0.6, abs=2 * NARROW)
    assert gaps == [(pytest.approx(0.2), pytest.approx(0.6, abs=2 * NARROW))]


def test_a_sheer_fall_is_a_jump():
    def answer(b):
        return (b, 1 - 0.1 * b, -0.1, ("l1 min",)) if b < 0.4 else (b, 0.2 * (1 - b), -0.2, ("l1 min",))

    (change,), _ = findings(computed(answer))
    assert change.kind == "jump"
    assert change.at == pytest.approx(0.4, abs=2 * NARROW)


def test_a_plan_ends():
    def answer(b):
        return b, 1 - b, -1.0, (f"l{math.floor(1000 * b)} min",)

    rows = computed(answer, points=10)
    requests = [item for item in rows if item.warm["again"] is None]
    assert len(requests) <= plan.MOST_MORE * 10 + plan.BATCH
    # The others are trials: each row from either neighbour, in one step and in short ones.
    assert len(rows) <= 6 * len(requests)


def two_basins(b, basin):
    """Return what a basin comes to with so much of b: the second one is better from 0.55 on."""
    return (b, 1.1 * (1 - b), -1.1) if basin == "l1 min" else (b, 2 * (0.8 - b) + 0.005, -2.0)


def moved(points=6):
    """Return the rows of a front whose points first all stand in the first basin, but for the end of least a.

    A row that is tried from another one comes to the other's basin.
    """
    rows = [row(0, 0.8, 0.005, -2.0, active=("l2 max",)), row(1, 0.0, 1.1, -1.1)]
    while batch := plan.following(rows, SCALE, points):
        for item in batch:
            basin = rows[item.near[0]].warm["active"][0][0] if item.steps else "l1 min"
            b, a, slope = two_basins(item.b, basin)
            stands = item.steps and a > plan.value(rows[item.again], "a") - plan.ALIKE
            more = {"apart": list(item.near)} if stands and a > plan.value(rows[item.again], "a") + plan.ALIKE else {}
            record = {"again": item.again, "fine": item.fine, "parent": item.near[0], "steps": item.steps, **more}
            rows.append(row(len(rows), b, a, slope, (basin,), request=item.b, certified=not stands, **record))
    return rows


def test_a_row_that_a_neighbours_design_beats_is_bettered_and_the_next_one_after_it():
    front, _ = plan.spots(moved(), SCALE)
    for spot in front:
        best = min(two_basins(spot.b, basin)[1] for basin in ("l1 min", "l2 max"))
        assert spot.a == pytest.approx(best, abs=1e-12), spot.b
    assert sum(spot.active[0].side.limit == "l2" for spot in front) >= 3


def test_a_basin_that_changes_is_a_jump_though_both_figures_pass_on_without_one():
    rows = moved()
    front, _ = plan.spots(rows, SCALE)
    changes, gaps = plan.changes_and_gaps(front, SCALE, plan.basins_apart(rows))
    (jump,) = [change for change in changes if change.kind == "jump"]
    assert jump.at == pytest.approx(0.505 / 0.9, abs=1e-9)
    assert jump.limits == (Side("l1", "min"), Side("l2", "max"))
    assert gaps == []


def test_a_row_that_comes_out_again_but_for_rounding_keeps_its_place():
    rows = [*ENDS, row(2, 0.5, 0.4), row(3, 0.5 - 1e-12, 0.4 - 1e-12, again=2, parent=0)]
    assert [spot.point for spot in plan.spots(rows, SCALE)[0]] == [1, 2, 0]
    rows = [*ENDS, row(2, 0.5, 0.4), row(3, 0.5 + 1e-12, 0.3, again=2, parent=0)]
    assert [spot.point for spot in plan.spots(rows, SCALE)[0]] == [1, 3, 0]


def test_ends_that_are_one_have_no_width():
    rows = {0: row(0, 0.3, 0.5), 1: row(1, 0.3 + 1e-9, 0.5)}
    assert plan.scaled(rows, ("a", "b"), (1, 1), (1.0, 1.0)).width == (0.0, 0.0)


def test_an_end_that_another_row_dominates_is_sought_again_from_it():
    rows = [row(0, 1.0, 0.0, 0.0), row(1, 0.0, 1.0), row(2, 0.5, -0.2, request=0.6, parent=1)]
    again = next(item for item in plan.following(rows, SCALE, 3) if item.again == 0)
    assert (again.near, again.end) == ((2,), 0)
    better = row(3, 0.7, -0.3, 0.0, again=0, parent=2)
    better = replace(better, place={})
    scale = plan.scaled({item.point: item for item in (*rows, better)}, ("a", "b"), (1, 1), (1.0, 1.0))
    assert scale.origin == (-0.3, 0.0)
    assert scale.width == pytest.approx((1.3, 0.7))


def test_a_jump_that_rows_did_not_suffice_to_narrow_down_is_one_with_its_gap():
    front = [row(1, 0.0, 1.0, -0.01), row(2, 0.999, 0.9, -0.01), row(0, 1.0, 0.0, 0.0, active=("l2 max",))]
    (change,), (gap,) = findings(front)
    assert change.kind == "jump"
    assert gap == (0.999, 1.0)
