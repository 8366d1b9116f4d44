"""Exchange: what holds at a few angles ends up holding at all of them; levels, starts, relaxations, failures."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from waves import model, objective, program

from loomopt.jobs import registry
from loomopt.model.kinematics import Arcs
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import TURN, split
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.nlp import exchange, ipopt
from loomopt.solving.nlp.point import Elastic, Known, Settings, sampler_at

BEATUP = registry.load("beatup")


def balance(scene=BEATUP):
    return registry.of(scene).program(scene, "balance")


def solved(task, **changes):
    return exchange.solve(task, task.starts[0], replace(Settings(), **changes))


def highest(task, point, name):
    """Return the largest |quantity| of a design on a dense grid."""
    pieces = np.zeros(100_001, dtype=np.intp)
    return np.abs(Sampler(task.model, point.x).at(name, pieces, np.linspace(0, 1, 100_001))).max()


@pytest.mark.parametrize(
    ("excesses", "creeps"),
    [
        ((1e-8,) * 4, False),
        ((1e-8, 6e-9, 9e-9, 6e-9, 7e-9), True),
        ((1e-8, 6e-9, 9e-9, 4e-9, 7e-9), False),
        ((1e-5, 6e-9, 9e-9, 6e-9, 7e-9), False),
        ((1e-8, 6e-7, 9e-9, 6e-9, 7e-9), False),
        ((1e-8, 1e-8, 6e-9, 9e-9, 6e-9, 7e-9), True),
    ],
)
def test_an_exchange_creeps_where_four_rounds_do_not_halve_what_little_is_exceeded(excesses, creeps):
    assert exchange._stalled(excesses) == creeps


def test_the_least_peak_is_half_the_range():
    """cos φ + cos 2φ / 2 runs from −3/4 to 3/2: the best shift is −3/8, the peak 9/8."""
    task = program(objectives=(objective("wave", "peak"),))
    point = solved(task)
    assert point.usable
    assert point.x["x"] == pytest.approx(-0.375, abs=1e-10)
    assert highest(task, point, "wave") == pytest.approx(1.125, abs=1e-9)
    assert point.violation <= 1e-10


def test_a_whole_cycle_limit_holds_between_its_nodes():
    """The nearest point to (3, 2) of the unit circle's disc: no node of the first round is where it touches."""
    task = program(limits=(("circle", 1, 1.0),))
    point = solved(task)
    assert point.usable
    value = Sampler(task.model, point.x).figures["bowl"]
    assert value == pytest.approx((13**0.5 - 1) ** 2, abs=1e-8)
    assert [point.x["x"], point.x["y"]] == pytest.approx([3 / 13**0.5, 2 / 13**0.5], abs=1e-4), "root of the violation"
    assert highest(task, point, "circle") <= 1 + 1e-9


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9, 1e-11])
def test_violation_is_two_decades_below_the_accuracy(accuracy):
    task = program(limits=(("circle", 1, 1.0),))
    point = solved(task, accuracy=accuracy)
    assert point.usable
    assert point.violation <= max(accuracy / 100, 1e-11), "values are sums of rounded terms: no closer than that"
    assert highest(task, point, "circle") <= 1 + accuracy + 1e-11


def test_rounds_that_run_out_leave_a_violation_that_is_told():
    """A peak as high wherever it stands slips between all nodes so far: what is exceeded is said, nothing certified.

    The round that came nearest counts, not the last.
    """
    task = program(limits=(("sharp", 1, 0.7),))
    point = solved(task)
    assert point.violation == pytest.approx(highest(task, point, "sharp") - 0.7, abs=1e-8)
    assert 1e-7 < point.violation < 1e-4
    certificate = certify(task, point.x, 1e-8)
    assert not certificate.passed
    assert any("limit sharp is exceeded" in reason for reason in certificate.reasons)


def test_an_earlier_level_is_kept_when_its_weight_is_large_enough():
    """|x − ...| first, then the bowl: its slope along x + y is 5 at the line, so a weight above 5 is exact."""
    levels = (objective("sum", "magnitude"), objective("bowl"))
    exact, weak = (solved(program(objectives=levels), penalty=weight) for weight in (10.0, 1.0))
    assert exact.x == pytest.approx({"x": 0.5, "y": -0.5}, abs=1e-8)
    assert weak.x["x"] + weak.x["y"] > 1.0, "a weight below the multiplier buys the bowl with the first level"


def test_start_on_the_answer_and_start_far_away_agree():
    task = program(limits=(("circle", 1, 1.0),))
    near, far = (
        exchange.solve(task, {"x": x, "y": y}, Settings()) for x, y in ((3 / 13**0.5, 2 / 13**0.5), (-9.0, 9.0))
    )
    assert near.x == pytest.approx(far.x, abs=1e-4)


def test_a_program_without_admissible_design_is_not_reached():
    point = solved(program(limits=(("x", -1, 2.0), ("x", 1, 1.0))))
    assert not point.usable


@pytest.mark.parametrize(
    ("limits", "needed"),
    [
        ((("x", -1, 2.0), ("x", 1, 1.0)), 1.0),
        ((("sum", -1, 4.0), ("circle", 1, 2.0)), 4.0 / 2**0.5 - 2.0),
        ((("x", 0, 12.0),), 2.0),
        ((("x", 0, 1.0), ("sum", 0, 3.0), ("y", 1, 1.5)), 0.5),
    ],
    ids=str,
)
def test_elastic_solves_give_the_least_sum_of_excesses(limits, needed):
    task = program(limits=limits)
    point = exchange.solve(task, task.starts[0], Settings(), elastic=Elastic())
    assert point.usable
    assert sum(abs(need) for need in point.relaxation.values()) == pytest.approx(needed, abs=1e-6)


def test_a_start_that_does_not_assemble_is_told():
    task = balance()
    folded = {**task.starts[0], "l1": 0.3}
    point = exchange.solve(task, folded, Settings())
    assert (point.status, point.usable) == ("Not_Assembled", False)


def test_starts_are_the_jobs_own_then_random_ones_that_assemble():
    task = balance()
    drawn = exchange.starts(task, 40, seed=7)
    assert len(drawn) == 40
    assert drawn[0] == dict(task.starts[0])
    assert drawn == exchange.starts(task, 40, seed=7)
    assert drawn[1:] != exchange.starts(task, 40, seed=8)[1:]
    assert drawn[:10] == exchange.starts(task, 10, seed=7)
    for start in drawn:
        assert sampler_at(task, start) is not None
        for variable in task.variables:
            low, high = variable.range
            assert low <= start[variable.name] <= high


@pytest.mark.parametrize("M0", [600, 745, 800, 900])
def test_a_loom_s_peak_holds_between_all_nodes(M0):
    task = balance(BEATUP.set("operation.M0", f"{M0} N*m"))
    point = exchange.solve(task, task.starts[0], Settings())
    assert point.usable
    sampler = sampler_at(task, point.x)
    pieces, u = sampler.grid(100_000)
    dense = np.abs(sampler.at("peak_torque", pieces, u)).max()
    assert dense == pytest.approx(sampler.peak("peak_torque"), rel=1e-8)
    assert dense <= sampler.peak("peak_torque") * (1 + 1e-12)
    assert sum(map(len, point.nodes)) <= 24, "a few nodes do, not a grid"


def test_a_warm_start_from_the_answer_stays_there():
    task = balance()
    cold = exchange.solve(task, task.starts[0], Settings())
    warm = exchange.solve(task, cold.x, Settings(), warm=cold)
    assert warm.usable
    assert warm.iterations < cold.iterations
    for variable in task.variables:
        assert warm.x[variable.name] == pytest.approx(cold.x[variable.name], abs=1e-9 * variable.scale)


def test_a_warm_start_goes_where_a_cold_one_goes_even_from_afar():
    near, far = (balance(BEATUP.set("operation.M0", f"{M0} N*m")) for M0 in (900, 620))
    from_afar = exchange.solve(near, near.starts[0], Settings())
    warm, cold = (exchange.solve(far, far.starts[0], Settings(), warm=point) for point in (from_afar, None))
    assert warm.usable
    for name in ("l1", "l2", "l3", "l4", "s"):
        assert warm.x[name] == pytest.approx(cold.x[name], abs=1e-8), name
    assert math.isfinite(warm.violation)


def gives_up(monkeypatch, moved=0.0):
    """Let IPOPT give up where it would have succeeded, x moved by so much."""

    def given_up(*arguments):
        answer = ipopt.run(*arguments)
        x = {name: value + moved for name, value in answer.x.items()}
        return answer._replace(status="Search_Direction_Becomes_Too_Small", x=x)

    monkeypatch.setattr(exchange, "run", given_up)


@pytest.mark.parametrize(
    ("limits", "moved", "stands"),
    [
        ((("sum", 1, 4.0),), 0.0, True),
        ((("sum", 1, 4.0),), 2e-8, True),
        ((("sum", 1, 4.0),), 1e-6, False),
        ((("sum", 0, 4.0),), -1e-6, False),
        ((("sum", 0, 4.0),), -2e-8, True),
        ((("sum", 0, 4.0),), 0.0, True),
        ((("sum", 1, 4.0),), -1e-6, True),
        ((("circle", 1, 1.0),), 0.0, False),
        ((("circle", 1, 9.0),), 0.0, True),
    ],
)
def test_where_the_solver_gives_up_the_rows_decide(limits, moved, stands, monkeypatch):
    """An extreme between the nodes of the only round counts too."""
    gives_up(monkeypatch, moved)
    monkeypatch.setattr(exchange, "EXCHANGE_ROUNDS", 1)
    point = solved(program(limits=limits))
    assert point.status == "Search_Direction_Becomes_Too_Small"
    assert point.usable is stands


def test_equalities_that_leave_nothing_to_solve_for_are_met_by_a_start_that_stands_on_them():
    task = program([("x", 0, 0.5), ("y", 0, 0.25), ("sum", 0, 0.75)])
    start = {"x": 0.5, "y": 0.25}
    point = exchange.solve(task, start, Settings())
    assert (point.status, point.usable, point.x) == ("Not_Enough_Degrees_Of_Freedom", True, start)
    assert exchange.solve(task, {}, Settings(), warm=point).x == start
    assert not exchange.solve(task, {"x": 0.5, "y": 0.3}, Settings()).usable


def test_rounds_that_run_out_leave_a_point_with_its_violation(monkeypatch):
    monkeypatch.setattr(exchange, "EXCHANGE_ROUNDS", 1)
    task = program(limits=(("circle", 1, 1.0),))
    point = solved(task, polish=False)
    assert point.usable
    assert point.violation == pytest.approx(highest(task, point, "circle") - 1.0, rel=1e-6)
    assert point.violation > 1e-3


def test_an_elastic_solve_whose_rounds_run_out_is_not_reached(monkeypatch):
    task = program(limits=(("sum", -1, 4.0), ("circle", 1, 2.0)))
    monkeypatch.setattr(exchange, "ELASTIC_ROUNDS", 2)
    assert not exchange.solve(task, task.starts[0], Settings(), elastic=Elastic()).usable


def test_what_needs_no_relaxation_is_told_as_none():
    task = program(limits=(("x", -1, 2.0), ("x", 1, 1.0), ("y", 1, 5.0)))
    point = exchange.solve(task, task.starts[0], Settings(), elastic=Elastic())
    assert set(point.relaxation) <= {0, 1}
    assert all(need > 1e-9 for need in point.relaxation.values())


def test_equal_nodes_of_a_turn_are_all_that_is_seen():
    task = program(limits=(("circle", 1, 1.0),))
    point = solved(task, uniform=5, polish=False)
    assert point.usable
    assert point.violation == 0.0
    assert [len(nodes) for nodes in point.nodes] == [10], "both signs"
    angles = sorted({2 * math.pi * node.u for node in point.nodes[0]})
    assert angles == pytest.approx([2 * math.pi * k / 5 for k in range(5)], abs=1e-15)
    assert {node.sign for node in point.nodes[0]} == {1.0, -1.0}
    assert 1e-3 < highest(task, point, "circle") - 1.0 < 1 / math.cos(math.pi / 10) - 1
    assert point.iterations < 60, "one round"
    signed = program(limits=(("circle", 1, 1.0),), physics=model(signed=("circle",)))
    assert [len(nodes) for nodes in solved(signed, uniform=5, polish=False).nodes] == [5]


def test_equal_nodes_keep_to_the_pieces_their_limit_speaks_of():
    half = Arcs("half", lambda maths, given: (1.0, 2.5), lambda angle, corners: float(1.0 <= angle % TURN < 2.5))
    task = program(limits=(("circle", 1, 1.0),), physics=model(arcs=(half,)))
    limited = replace(task, limits=(replace(task.limits[0], where=("half", 1.0)),))
    nodes = solved(limited, uniform=36, polish=False).nodes[0]
    sampler = sampler_at(limited, limited.starts[0])
    angles = {round(sampler.angle(node) % TURN, 12) for node in nodes}
    assert angles == {round(TURN * k / 36, 12) for k in range(36) if 1.0 <= TURN * k / 36 < 2.5}


def test_a_node_keeps_its_crank_angle_when_corners_change_their_order():
    def cycle(first, second):
        return split((first, second), ("a",), lambda angle: (0.0,))

    before, after = cycle(1.0, 2.0), SimpleNamespace(cycle=cycle(2.1, 2.0))
    node = Extreme(1, 0.25, -3.0, signed=True)
    angle = float(before.angles(np.array([1]), np.array([0.25]))[0])
    moved = exchange._node_in_cycle(node, before, cast(Sampler, after))
    here = float(after.cycle.angles(np.array([moved.piece]), np.array([moved.u]))[0])
    assert math.remainder(here - angle, TURN) == pytest.approx(0.0, abs=1e-14)
    assert (moved.value, moved.signed) == (-3.0, True)


def test_no_more_random_starts_are_drawn_than_are_worth_it(monkeypatch):
    task = program()
    drawn = []
    monkeypatch.setattr(exchange, "sampler_at", lambda program, x: drawn.append(x))
    assert exchange.starts(task, 3) == []
    assert len(drawn) == 1 + 200 * 3


def test_iterations_are_those_of_all_rounds(monkeypatch):
    texts: list[int] = []

    def counted(*arguments):
        answer = ipopt.run(*arguments)
        texts.append(answer.iterations)
        return answer

    monkeypatch.setattr(exchange, "run", counted)
    task = program(limits=(("circle", 1, 1.0),))
    point = solved(task, polish=False)
    assert len(texts) > 2
    assert point.iterations == sum(texts)


def test_an_elastic_solve_may_end_in_its_first_round_whatever_is_known():
    """What is known to bind waits for the second round: where there is none, what the first one stood on is told."""
    task = program(limits=(("circle", 1, 1.0),))
    known = Known(tuple(solved(task).binding))
    assert any(known.nodes)
    point = exchange.solve(task, {"x": 0.1, "y": 0.1}, Settings(uniform=36), elastic=Elastic(), known=known)
    assert point.usable
    assert len(point.binding) == len(known.nodes)
    assert set(point.nodes[0]).isdisjoint(known.nodes[0])
