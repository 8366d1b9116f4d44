"""The least relaxation, on limits whose clash is plain to see."""

import math

import numpy as np
import pytest
from support import toy

from loomopt.physics.tolerances import NEEDED
from loomopt.solving.answer.solution import UnitFormatter
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.search import elastic
from loomopt.solving.search.elastic import clash, least
from loomopt.solving.search.search import Search

ROWS = {"f": lambda v: v["x"] ** 2 + v["y"] ** 2, "p": lambda v: v["x"] + v["y"], "q": lambda v: v["x"] - v["y"]}


def clash_of(limits, sizes=None, waves=None):
    program = toy.program("xy", ROWS, waves, limits=limits, sizes=sizes)
    formatter = UnitFormatter(toy.scene_of(toy.ToyJob(program)))
    return clash(Search(None, program, Settings(), nearest=least(program, [program.starts[0]], Settings())), formatter)


def relaxations_of(answer):
    return {
        (relaxation.limit, relaxation.side, relaxation.alone): relaxation.needed for relaxation in answer.relaxations
    }


def test_either_of_two_limits_that_clash_would_do_alone():
    answer = clash_of((("x", -1, 2.0), ("x", 1, 1.0), ("y", 1, 5.0)))
    assert tuple(answer.limits) == ("x >= 2", "x <= 1")
    assert relaxations_of(answer)["x", "min", True] == pytest.approx(1.0, rel=1e-7)
    assert relaxations_of(answer)["x", "max", True] == pytest.approx(2.0, rel=1e-7)
    assert ("y", "max", True) not in relaxations_of(answer)


def test_the_least_sum_is_in_natural_sizes():
    """p ≥ 4 against x ≤ 1 and y ≤ 1: what is large by nature gives way first."""
    answer = clash_of((("p", -1, 4.0), ("x", 1, 1.0), ("y", 1, 1.0)), sizes={"p": 10.0})
    assert relaxations_of(answer)["p", "min", True] == pytest.approx(2.0, rel=1e-7)
    assert answer.relaxations[0].limit == "p"
    small = clash_of((("p", -1, 4.0), ("x", 1, 1.0), ("y", 1, 1.0)), sizes={"x": 10.0})
    assert small.relaxations[0].limit == "x"
    assert small.relaxations[0].needed == pytest.approx(3.0, rel=1e-7)


def test_limits_that_must_give_way_together_are_not_alone():
    clashing = (("x", -1, 2.0), ("x", 1, 1.0), ("y", -1, 2.0), ("y", 1, 1.0))
    answer = clash_of(clashing)
    assert {relaxation.alone for relaxation in answer.relaxations} == {False}
    assert sum(abs(relaxation.needed - relaxation.value) for relaxation in answer.relaxations) == pytest.approx(
        2.0, rel=1e-7
    )
    assert {relaxation.limit for relaxation in answer.relaxations} == {"x", "y"}


def test_an_equality_gives_way_to_the_side_that_helps():
    answer = clash_of((("x", 0, 3.0), ("x", 1, 1.0)))
    sides = {(relaxation.side, relaxation.value): relaxation.needed for relaxation in answer.relaxations}
    assert sides["min", 3.0] == pytest.approx(1.0, rel=1e-7)
    assert sides["max", 1.0] == pytest.approx(3.0, rel=1e-7)


def test_what_a_whole_cycle_limit_needs():
    waves = {"w": lambda m, v, phi: v["x"] + m.cos(phi)}
    answer = clash_of((("w", 1, 0.25),), waves=waves)
    assert tuple(answer.limits) == ("w <= 0.25",)
    assert relaxations_of(answer) == {("w", "max", True): pytest.approx(1.0, rel=1e-7)}


def test_where_a_design_needs_nothing_the_search_for_the_least_relaxation_ends(monkeypatch):
    program = toy.program("xy", ROWS, limits=(("x", -1, 1.0),))
    nearest = least(program, [program.starts[0]] * 3, Settings())
    assert nearest.relaxation == {}
    assert nearest.x["x"] >= 1.0 - 1e-9
    calls = []
    original = exchange.solve

    def solve(*arguments, **more):
        calls.append(arguments)
        return original(*arguments, **more)

    monkeypatch.setattr(exchange, "solve", solve)
    least(program, [program.starts[0]] * 3, Settings())
    assert len(calls) == 1


# Starts -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("sums", "most", "best"),
    [
        ((2.0, 1.5, 1.0), (math.inf, 2.0 - NEEDED, 1.5 - NEEDED), 1.0),
        ((2.0, None, 1.0), (math.inf, 2.0 - NEEDED, 2.0 - NEEDED), 1.0),
        ((None, 2.0, None), (math.inf, math.inf, 2.0 - NEEDED), 2.0),
        ((None, None), (math.inf, math.inf), None),
    ],
)
def test_each_start_need_only_be_followed_below_the_best_so_far(monkeypatch, sums, most, best):
    calls: list[float] = []

    def solve(program, start, settings, elastic, known):
        total = sums[len(calls)]
        calls.append(known.cutoff)
        reached = total is not None
        return Point(
            {}, "", reached, relaxation={0: 1.0} if reached else {}, extra=np.array([total] if reached else [])
        )

    monkeypatch.setattr(exchange, "solve", solve)
    program = toy.program("xy", ROWS, limits=(("x", -1, 2.0),))
    answer = least(program, [{}] * len(sums), Settings())
    assert tuple(calls) == most
    assert (answer.extra[0] if answer else None) == best


def test_another_basin_of_the_least_relaxation_is_found_from_another_start():
    """x² ≥ 4 needs less where x may go below −1 than where it may go above 0.5."""
    rows = {**ROWS, "s": lambda v: v["x"] ** 2}
    program = toy.program("xy", rows, limits=(("s", -1, 4.0), ("x", 1, 0.5), ("x", -1, -1.0)))
    right, left = ({"x": x, "y": 0.0} for x in (3.0, -3.0))
    assert sum(least(program, [right], Settings()).extra) == pytest.approx(1.5, abs=1e-7)
    assert sum(least(program, [right, left], Settings()).extra) == pytest.approx(1.0, abs=1e-7)


def test_a_limit_alone_is_found_though_all_at_once_another_gives_way():
    """Least together: p gives way by 1. Alone: x to 3, or y to 3."""
    limits = (("p", -1, 4.0), ("x", 1, 1.5), ("y", 1, 1.5))
    answer = clash_of(limits)
    assert relaxations_of(answer)["p", "min", True] == pytest.approx(3.0, rel=1e-7)
    assert relaxations_of(answer)["x", "max", True] == pytest.approx(2.5, rel=1e-7)
    assert relaxations_of(answer)["y", "max", True] == pytest.approx(2.5, rel=1e-7)


def test_a_limit_that_does_not_suffice_is_not_told():
    """The circle keeps x at 1 or below, whatever y may be."""
    answer = clash_of((("f", 1, 1.0), ("x", -1, 2.0), ("y", 1, 5.0)))
    assert {key[0] for key in relaxations_of(answer)} == {"f", "x"}


def test_both_rows_of_a_limit_need_what_the_worse_one_does():
    program = toy.program("xy", ROWS, limits=(("x", -1, 2.0), ("x", -1, 3.0), ("x", 1, 0.0), ("y", 1, 1.0)))
    needed = {0: 0.5, 1: -1.5, 2: 2.0, 3: 0.9e-9}
    assert elastic._worst_rows(program, needed) == {1: -1.5, 2: 2.0}
