"""Rows at corners: where they stand in a cycle, which extremes they hold, and which prices are theirs."""

import numpy as np
import pytest
from steps import COUNT, program

from loomopt.jobs import registry
from loomopt.model.sampling import Extreme
from loomopt.physics.cycle import TURN
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.point import Settings, sampler_at
from loomopt.solving.nlp.rows import CycleStations, RowFamily, station_places, stations, structure


@pytest.fixture(scope="module")
def stood():
    """Return where the toy's stations stand, and the design's sampler."""
    task = program()
    sampler = sampler_at(task, task.starts[0])
    return CycleStations(stations(task.model, sampler.given, list(task.starts[0])), sampler.cycle), sampler


def test_each_stands_where_its_step_begins(stood):
    at, sampler = stood
    angles = sampler.cycle.angles(at.pieces, at.u)
    assert np.mod(angles, TURN) == pytest.approx(np.arange(COUNT) * TURN / COUNT, abs=1e-14)
    assert sampler.cycle.switch(at.pieces)["step"].tolist() == list(range(COUNT))
    assert at.switches(("raised", "nobody's")).tolist() == [[float(1 <= k <= 6), 0.0] for k in range(COUNT)]


def test_a_law_falls_on_its_return_and_its_pieces_end_there():
    """A knot of the return begins the piece below it: its own piece, above, is the one before."""
    scene = registry.load("shedding").set("targets.law.intervals", 12)
    task = registry.of(scene).program(scene, "law")
    sampler = sampler_at(task, task.starts[0])
    at = CycleStations(stations(task.model, sampler.given, [v.name for v in task.variables]), sampler.cycle)
    rise, back, near = (sampler.given.values[name] for name in ("rise", "return", "begin.near"))
    knots = np.arange(1, 12) / 12
    assert sampler.cycle.angles(at.pieces, at.u) == pytest.approx([*(rise * knots), *(near - back * knots)], rel=1e-14)
    assert sampler.cycle.switch(at.pieces)["law"].tolist() == 2 * list(range(1, 12))
    assert sampler.cycle.switch(at.pieces)["segment"].tolist() == [0.0] * 11 + [2.0] * 11
    assert at.u.tolist() == [0.0] * 11 + [1.0] * 11
    lifts = sampler.at("lift", at.pieces, at.u)
    assert lifts == pytest.approx(sampler.at("lift", (at.pieces - 1 + 2 * (at.u == 1.0)).astype(int), 1.0 - at.u))


def test_extremes_at_corners_are_held_from_either_side_and_others_are_not(stood):
    at, sampler = stood
    for k in (0, 5, 11):
        piece = int(at.pieces[k])
        assert at.station(Extreme(piece, 0.0, 1.0)) == k
        assert at.station(Extreme((piece - 1) % sampler.cycle.pieces, 1.0, 1.0)) == k
        assert at.station(Extreme(piece, 1e-9, 1.0)) is None
    raised = next(k for k in range(sampler.cycle.pieces) if sampler.cycle.starts[k] == pytest.approx(0.1))
    assert at.station(Extreme(raised, 0.0, 1.0)) is None, "a corner that is no station"


def test_where_a_load_jumps_at_a_corner_the_other_side_is_another_row(stood):
    at, sampler = stood
    before = int(at.pieces[3]) - 1
    assert at.station(Extreme(before, 1.0, 1.0)) == 3
    switched = sampler.cycle.switches.copy()
    switched[before, sampler.cycle.names.index("raised")] = 0.0
    other = type(sampler.cycle)(sampler.cycle.starts, sampler.cycle.names, switched, sampler.cycle.order)
    assert CycleStations(stations_of(sampler), other).station(Extreme(before, 1.0, 1.0)) is None


def stations_of(sampler):
    return stations(sampler.model, sampler.given, [f"x{k}" for k in range(COUNT)])


def test_signs_are_those_of_the_values_where_magnitudes_count(stood):
    at, sampler = stood
    assert at.signs(sampler, "wave").tolist() == [1.0] * COUNT, "signed"
    task = program()
    low = sampler_at(task, dict.fromkeys(task.starts[0], -0.5))
    values = CycleStations(stations_of(low), low.cycle)
    assert values.signs(low, "swing").tolist() == [-1.0] * COUNT
    assert CycleStations((), low.cycle).signs(low, "swing").tolist() == []


def test_families_of_part_of_the_turn_have_rows_there_only():
    switches = [{"segment": 0.0, "law": 1.0}, {"segment": 2.0, "law": 1.0}]
    assert station_places(switches, RowFamily("lift")) == [0, 1]
    assert station_places(switches, RowFamily("lift", where=("segment", 2.0))) == [1]
    assert station_places(switches, RowFamily("lift", where=("segment", 1.0))) == []
    assert station_places(switches, RowFamily("lift", where=("raised", 1.0))) == [], (
        "whether it holds there is not known"
    )


@pytest.mark.parametrize("where", [None, ("step", 2.0)])
def test_every_station_that_a_family_is_asked_for_has_a_row(where):
    task = program(limits=(("wave", 1, 1.0), ("swing", 1, 2.0)), where=where)
    built = structure(task, sampler_at(task, task.starts[0]), 2)
    count = COUNT if where is None else 1
    assert [len(places) for places in built.station_rows] == [count, count]
    assert built.rows.stations == (count, count)


def test_nodes_are_for_what_no_station_holds():
    task = program()
    calls = Calls(task, Settings())
    sampler = calls.sampler(task.starts[0])
    (peaks,), (loose,) = (
        result(sampler) for result in (calls.peaks, lambda s: calls.nodeless_extremes(s, calls.peaks(s)))
    )
    corners = [e for e in peaks if e.u in (0.0, 1.0)]
    assert len(corners) > 5
    assert {e for e in peaks if e not in loose} <= set(corners)
    assert all(
        0.0 < e.u < 1.0 or sampler.angle(e) == pytest.approx(3.3) or sampler.angle(e) == pytest.approx(0.1)
        for e in loose
    )
    point = exchange.solve(task, task.starts[0], Settings())
    assert point.violation <= 1e-10
    violation = calls.violation(calls.peaks(calls.sampler(point.x)), np.zeros(0))
    assert violation <= 1e-10, "at corners too"
