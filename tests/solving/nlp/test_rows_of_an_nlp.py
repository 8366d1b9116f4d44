"""Where variables and rows of an NLP stand: what is written to each is read from it, and from nothing else."""

from dataclasses import replace

import numpy as np
import pytest
import steps
import waves
from support.worst import WorstPeak

from loomopt.model.objectives import Magnitude, Worst
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.point import Elastic, Settings
from loomopt.solving.nlp.rows import Multipliers, RowMap, binding, row_map

LEVELS = (
    Magnitude("x", "x", 4.0),
    Worst("apart", "y", 1.0, ("sum",)),
    WorstPeak("circle", "circle", 2.0, ("shifted",)),
)
PLAIN = waves.program([("sum", 0, 1.0), ("wave", 1, 3.0), ("apart", 1, 2.0), ("circle", 1, 9.0)], LEVELS)
STATIONS = steps.program(limits=(("wave", 1, 1.5), ("h3", 1, 1.2), ("swing", 1, 2.0)), where=("step", 2.0))
PROGRAMS = {"plain": PLAIN, "stations": STATIONS, "in chains": steps.program(0.05), "bare": waves.program()}
TASKS = [pytest.param(task, elastic, id=f"{n} {elastic}") for n, task in PROGRAMS.items() for elastic in (False, True)]


def blocks(rows, g):
    """Return all rows of a vector by what they are of."""
    return [
        rows.limit_rows(g),
        *(rows.piece_rows(g, k) for k in range(len(rows.pieces))),
        *(rows.station_rows(g, k) for k in range(len(rows.stations))),
        rows.node_rows(g),
        rows.definitions(g),
    ]


@pytest.mark.parametrize("lifted", [0, 5])
@pytest.mark.parametrize(("task", "elastic"), TASKS)
def test_what_is_written_to_a_block_is_read_from_it_alone(task, elastic, lifted):
    rows = replace(row_map(task, 3, elastic), lifted=lifted)
    g = np.full(rows.size, np.nan)
    for k, block in enumerate(blocks(rows, g)):
        block[...] = k
    assert not np.isnan(g).any(), "every row is in a block"
    assert np.all(np.diff(g) >= 0), "one block after the other"
    for k, block in enumerate(blocks(rows, g)):
        assert np.all(block == k)
    assert len(rows.definitions(g)) == lifted
    assert len(rows.original_rows(g)) == rows.size - lifted
    x = np.arange(rows.variables + rows.extras + lifted)
    assert rows.join(*rows.split(x)).tolist() == rows.original_variables(x).tolist()
    assert [*rows.original_variables(x), *rows.lifted_variables(x)] == x.tolist()
    assert rows.split(x)[0].tolist() == list(range(len(task.variables)))


@pytest.mark.parametrize(("task", "elastic"), TASKS)
def test_a_built_nlp_has_the_rows_that_are_foretold(task, elastic):
    calls = Calls(task, Settings(), Elastic() if elastic else None)
    sampler = calls.sampler(task.starts[0])
    peaks = calls.peaks(sampler)
    nodes = [of[:1] for of in calls.nodeless_extremes(sampler, peaks)]
    nlp = calls.nlp(sampler, nodes, warm=False)
    arguments = calls.arguments(nlp, sampler, task.starts[0], calls.first_extra(nlp, sampler), nodes)
    values = np.asarray(nlp.jacobian(arguments["x0"], arguments["p"])[0]).ravel()
    assert nlp.rows == row_map(task, nlp.rows.slots, elastic)
    assert nlp.rows.size == len(values) == len(arguments["ubg"])
    assert nlp.rows.variables + nlp.rows.extras == len(arguments["x0"])
    assert row_map(task, 0, elastic).with_size(len(values)).size == len(values)
    limits = [task.limits[k] for k in nlp.rows.limits]
    _, extra = nlp.rows.split(arguments["x0"])
    ways = nlp.structure.excess_places
    given = [extra[list(ways.get(k, ()))] for k in nlp.rows.limits]
    expected = [
        limit.excess(sampler) - (way[0] - way[1:].sum() if len(way) else 0.0)
        for limit, way in zip(limits, given, strict=True)
    ]
    assert nlp.rows.limit_rows(values) == pytest.approx(np.array(expected), abs=1e-12)
    used = nlp.rows.used_slots(list(map(len, nodes)))
    assert not nlp.rows.node_rows(values)[~used].any(), "unused slots weigh nothing"


def test_pieces_are_of_each_row_and_each_sign():
    """|x|, then the worse of y and x + y, then two peaks, which have no pieces."""
    assert row_map(PLAIN, 6).pieces == (2, 2, 0)
    assert row_map(PLAIN, 6).limits == (0, 2)
    assert row_map(PLAIN, 6).stations == (0, 0, 0, 0)
    assert row_map(PLAIN, 6, elastic=True).pieces == ()


def priced(rows):
    """Return multipliers that are all different."""
    x, g = (np.arange(1.0, 1 + size) for size in (rows.variables + rows.extras, rows.size))
    return Multipliers(rows, -x, g)


@pytest.mark.parametrize(("task", "elastic"), TASKS)
@pytest.mark.parametrize("slots", [2, 3, 6])
def test_multipliers_keep_their_rows_where_slots_come_and_go(task, elastic, slots):
    before, rows = priced(row_map(task, 3, elastic)), row_map(task, slots, elastic)
    after = before.for_slots(rows)
    assert after.rows is rows
    assert after.limits == before.limits
    assert list(before.limits) == list(rows.limits)
    for k in range(len(rows.pieces)):
        assert np.array_equal(after.pieces(k), before.pieces(k))
    assert list(map(list, after.stations)) == list(map(list, before.stations))
    common = min(3, slots)
    assert np.array_equal(after.nodes[:, :common], before.nodes[:, :common])
    assert not after.nodes[:, common:].any()
    assert after.lam_x is before.lam_x
    assert after.variables.tolist() == [-1.0 - k for k in range(len(task.variables))]


def test_the_first_nodes_of_each_family_bind_and_of_other_rows_those_with_a_multiplier():
    rows = row_map(PLAIN, 2)
    lam_g = np.zeros(rows.size)
    rows.limit_rows(lam_g)[:] = 0.0, 2e-6
    rows.node_rows(lam_g)[0] = 1.0
    result = Multipliers(rows, np.array([2e-6, -2e-6, *[0.0] * rows.extras]), lam_g).binding(
        row_map(PLAIN, 3), [0, 1, 2, 3]
    )
    grown = row_map(PLAIN, 3)
    assert grown.limit_rows(result.rows).tolist() == [False, True]
    assert grown.node_rows(result.rows).tolist() == grown.used_slots([0, 1, 2, 3]).tolist()
    assert grown.used_slots([0, 1, 2, 3]).sum(axis=1).tolist() == [0, 1, 2, 3]
    assert (result.at_upper[0], result.at_lower[1], result.at_upper.sum(), result.at_lower.sum()) == (True, True, 1, 1)


def test_multipliers_say_what_binds():
    bound = binding(np.array([2e-6, -2e-6, 1e-7, 0.0]), np.array([2e-6, -2e-6, 5e-7]))
    assert list(bound.at_upper) == [True, False, False, False]
    assert list(bound.at_lower) == [False, True, False, False]
    assert list(bound.rows) == [True, True, False]
    none = binding(np.array([1e-6, -1e-6]), np.array([1e-6, 1.1e-6]))
    assert list(none.rows) == [False, True], "only a multiplier above the threshold binds"
    assert not none.at_upper.any()
    assert not none.at_lower.any()


def test_without_multipliers_there_are_none():
    assert not Multipliers()
    assert Multipliers().limits == {}
    assert Multipliers().nodes.shape == (0, 0)
    assert priced(RowMap(variables=1))
