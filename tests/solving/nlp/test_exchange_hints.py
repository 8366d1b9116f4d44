"""Events that no formula gives: the exchange ends where those that its rows read stand right, and nowhere before."""

import math

import pytest
from support.kepler import MODEL
from waves import objective, program

from loomopt.model.sampling import Sampler
from loomopt.solving.nlp import exchange, ipopt
from loomopt.solving.nlp.point import Elastic, Known, Settings

BEST = 2 + math.sin(2) / 2
"""x where e is 2: 2 + sin 2 / 2."""


def task(row="bowl", limits=(), start=(1.0, 0.4)):
    return program(limits, (objective(row),), start, physics=MODEL)


def solved(built, **more):
    return exchange.solve(built, built.starts[0], Settings(), **more)


@pytest.fixture
def runs(monkeypatch):
    results = []

    def counted(calls, nlp, sampler, *more):
        results.append(sampler.hints["hint"])
        return ipopt.run(calls, nlp, sampler, *more)

    monkeypatch.setattr(exchange, "run", counted)
    return results


@pytest.mark.parametrize("start", [0.1, 1.0, 6.0])
def test_a_solve_ends_where_its_events_stand_right(start, runs):
    point = solved(task(start=(start, 0.4)))
    assert point.usable
    assert point.x["x"] == pytest.approx(BEST, abs=1e-7)
    assert Sampler(MODEL, point.x).figures["bowl"] <= 1e-14
    assert len(runs) > 1
    assert runs[-1] == pytest.approx(2.0, abs=1e-3), "solved last from where the event is"


def test_a_limit_on_an_event_is_met_where_it_is(runs):
    point = solved(task("other", (("event", 1, 1.0),)))
    assert point.usable
    assert Sampler(MODEL, point.x).figures["event"] == pytest.approx(1.0, abs=1e-9)
    assert len(runs) > 1


def test_a_least_relaxation_is_one_of_events_that_stand_right():
    built = task("other", (("event", 1, 1.0), ("x", -1, BEST)))
    point = solved(built, elastic=Elastic())
    assert point.usable
    # e moves slower than x up to e = pi/2, and faster beyond.
    needed = (math.pi / 2 - 1) + BEST - (math.pi / 2 + 0.5)
    assert sum(point.relaxation.values()) == pytest.approx(needed, abs=1e-6)


def test_no_start_is_dropped_as_beaten_while_its_events_stand_elsewhere():
    known = Known(cutoff=1e-9)
    assert solved(task(), known=known).usable
    beaten = solved(task(), known=Known(cutoff=-1.0))
    assert (beaten.status, beaten.usable) == ("Beaten", False)


@pytest.mark.parametrize("limits", [(), (("x", 1, 2.0),)])
def test_an_event_that_no_row_reads_takes_no_round_more(limits, runs):
    point = solved(task("other", limits))
    assert point.usable
    assert len(runs) == 1
