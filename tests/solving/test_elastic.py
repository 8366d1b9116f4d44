"""The least relaxation, on limits whose clash is plain to see."""

import pytest
import toy

from loomopt.nlp import exchange
from loomopt.nlp.point import Point, Settings
from loomopt.solving import elastic
from loomopt.solving.elastic import clash
from loomopt.solving.words import Words

ROWS = {"f": lambda v: v["x"] ** 2 + v["y"] ** 2, "p": lambda v: v["x"] + v["y"], "q": lambda v: v["x"] - v["y"]}


def found(limits, sizes=None, waves=None, starts=1):
    program = toy.program("xy", ROWS, waves, limits=limits, sizes=sizes)
    words = Words(toy.scene_of(toy.ToyJob(program)))
    return clash(program, [program.starts[0]] * starts, Settings(), words)


def told(answer):
    return {(one.limit, one.side, one.alone): one.needed for one in answer.relaxations}


def test_either_of_two_limits_that_clash_would_do_alone():
    answer = found((("x", -1, 2.0), ("x", 1, 1.0), ("y", 1, 5.0)))
    assert answer.limits == ("x >= 2", "x <= 1")
    assert told(answer)["x", "min", True] == pytest.approx(1.0, rel=1e-7)
    assert told(answer)["x", "max", True] == pytest.approx(2.0, rel=1e-7)
    assert ("y", "max", True) not in told(answer)


def test_the_least_sum_is_in_natural_sizes():
    """p ≥ 4 against x ≤ 1 and y ≤ 1: what is large by nature gives way first."""
    answer = found((("p", -1, 4.0), ("x", 1, 1.0), ("y", 1, 1.0)), sizes={"p": 10.0})
    assert told(answer)["p", "min", True] == pytest.approx(2.0, rel=1e-7)
    assert answer.relaxations[0].limit == "p"
    small = found((("p", -1, 4.0), ("x", 1, 1.0), ("y", 1, 1.0)), sizes={"x": 10.0})
    assert small.relaxations[0].limit == "x"
    assert small.relaxations[0].needed == pytest.approx(3.0, rel=1e-7)


def test_limits_that_must_give_way_together_are_not_alone():
    clashing = (("x", -1, 2.0), ("x", 1, 1.0), ("y", -1, 2.0), ("y", 1, 1.0))
    answer = found(clashing)
    assert {one.alone for one in answer.relaxations} == {False}
    assert sum(abs(one.needed - one.value) for one in answer.relaxations) == pytest.approx(2.0, rel=1e-7)
    assert {one.limit for one in answer.relaxations} == {"x", "y"}


def test_an_equality_gives_way_to_the_side_that_helps():
    answer = found((("x", 0, 3.0), ("x", 1, 1.0)))
    sides = {(one.side, one.value): one.needed for one in answer.relaxations}
    assert sides["min", 3.0] == pytest.approx(1.0, rel=1e-7)
    assert sides["max", 1.0] == pytest.approx(3.0, rel=1e-7)


def test_what_a_whole_cycle_limit_needs():
    waves = {"w": lambda m, v, phi: v["x"] + m.cos(phi)}
    answer = found((("w", 1, 0.25),), waves=waves)
    assert answer.limits == ("w <= 0.25",)
    assert told(answer) == {("w", "max", True): pytest.approx(1.0, rel=1e-7)}


def test_nothing_clashes_where_a_design_needs_nothing():
    answer = found((("x", -1, 1.0),))
    assert (answer.limits, answer.relaxations) == ((), ())
    assert answer.x["x"] >= 1.0 - 1e-9


# Starts -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("sums", "tried", "least"),
    [
        ((2.0, 2.0, 2.0, 1.0), 3, 2.0),
        ((2.0, 1.0, 1.0, 1.0, 0.5), 4, 1.0),
        ((2.0, 3.0, 2.0, 3.0, 2.0, 1.0), 5, 2.0),
        ((2.0, None, 2.0, None), 4, 2.0),
        ((1.0, 1 + 5e-10, 1 - 5e-10), 3, 1 - 5e-10),
        ((1.0, 1 - 2e-9, 1 - 2e-9, 1.0), 4, 1 - 2e-9),
        ((None, None), 2, None),
    ],
)
def test_starts_are_tried_until_three_agree_on_the_least(monkeypatch, sums, tried, least):
    calls: list[dict[str, float]] = []

    def solve(program, start, settings, elastic):
        total = sums[len(calls)]
        calls.append(start)
        return Point({}, "", total is not None, relaxed={} if total is None else {0: total})

    monkeypatch.setattr(exchange, "solve", solve)
    program = toy.program("xy", ROWS, limits=(("x", -1, 2.0),))
    answer = elastic._least(program, [{}] * len(sums), Settings())
    assert len(calls) == tried
    assert (answer[1] if answer else None) == (None if least is None else {0: least})


def test_both_rows_of_a_limit_need_what_the_worse_one_does():
    program = toy.program("xy", ROWS, limits=(("x", -1, 2.0), ("x", -1, 3.0), ("x", 1, 0.0), ("y", 1, 1.0)))
    needed = {0: 0.5, 1: -1.5, 2: 2.0, 3: 0.9e-9}
    assert elastic._by_limit(program, needed) == {1: -1.5, 2: 2.0}


def test_a_limit_by_itself_is_sought_from_two_starts(monkeypatch):
    """The first call finds the least sum of two needs; each of the other limits is then tried from two starts."""
    calls = []

    def least(program, starts, settings):
        calls.append((len(starts), sum(limit.relaxable for limit in program.limits)))
        return (Point({}, "", True), {0: 1.0, 1: 1.0} if len(calls) == 1 else {2: 1.0, 3: 1.0})

    monkeypatch.setattr(elastic, "_least", least)
    monkeypatch.setattr(elastic, "_priced", lambda *_: ("both",))
    program = toy.program("xy", ROWS, limits=(("x", -1, 2.0), ("y", -1, 1.0), ("p", 1, 0.0)))
    answer = clash(program, [{}] * 5, Settings(), Words(toy.scene_of(toy.ToyJob(program))))
    assert calls == [(5, 4), (2, 1), (2, 1), (2, 1), (2, 1)]
    assert [one.limit for one in answer.relaxations] == ["x", "y"], "one that needs two of a kind is none alone"
