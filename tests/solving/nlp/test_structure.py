"""What an NLP is made of beside its numbers, and those numbers as parameters."""

import math

import numpy as np
import pytest
from beatup_nlps import program_of, put
from support.toy import Still
from waves import objective, program

from loomopt.maths import systems
from loomopt.model.model import CycleQuantity, DesignRow, Integral, JobModel
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import TURN, split
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.point import Settings
from loomopt.solving.nlp.rows import NodeParameters, means, structure


def test_a_node_on_a_corner_keeps_its_side():
    """Both sides of the pulse's begin are one crank angle with and without resistance."""
    nlp, _, sampler, *_ = put(program_of())
    node, cycle = nlp.structure.node, sampler.cycle
    pulse = int(np.flatnonzero(cycle.on(("resistance", 1.0)))[0])
    before = (pulse - 1) % cycle.pieces
    first, other = node.write(cycle, before, 1.0), node.write(cycle, pulse, 0.0)
    corners = np.mod([float(angle) for angle in sampler.model.corners(systems.FLOAT, sampler.given)], TURN)
    angles = [node.read(row, corners).phi % TURN for row in (first, other)]
    assert angles[0] == pytest.approx(angles[1], abs=1e-14)
    assert [node.read(row, corners).switch["resistance"] for row in (first, other)] == [0.0, 1.0]


def turned(angle, corners):
    begin, end = corners
    return float((angle - begin) % TURN < (end - begin) % TURN)


def read_width(node, row, corners):
    """Return the width, rad, of a node's share of a mean."""
    return row[0] + np.dot(row[node.width], corners)


@pytest.mark.parametrize("corners", [(0.4, 5.9), (5.9, 0.4)], ids=str)
@pytest.mark.parametrize("piece", [0, 1])
@pytest.mark.parametrize("u", [0.0, 0.25, 1.0])
def test_a_node_is_read_as_it_was_written(corners, piece, u):
    cycle = split(corners, ("half",), lambda angle: (turned(angle, corners),))
    node = NodeParameters(2, ("half", "datum"))
    row = node.write(cycle, piece, u, 0.3)
    assert len(row) == node.size == 8
    read = node.read(row, corners)
    here = float(cycle.angles(np.array([piece]), np.array([u]))[0])
    assert read.phi == pytest.approx(here, rel=1e-14)
    assert read.switch == {"half": cycle.switch(piece)["half"], "datum": 0.0}
    assert read_width(node, row, corners) == pytest.approx(0.3 * np.diff(cycle.starts)[piece], rel=1e-14)
    assert read_width(node, node.write(cycle, piece, u), corners) == 0.0
    moved = tuple(corner + 0.1 for corner in corners)
    assert node.read(row, moved).phi == pytest.approx(here + 0.1, rel=1e-14)
    wider = (corners[0], corners[1] + 0.1)
    width = np.diff(cycle.starts)[piece] + (0.1 if piece == 0 else -0.1)
    assert read_width(node, row, wider) == pytest.approx(0.3 * width, rel=1e-14)


def test_a_fixed_node_has_its_datum_and_no_corner_moves_it():
    node, cycle = NodeParameters(2, ("half", "datum")), split((0.4, 5.9), ("half",), lambda angle: (angle,))
    mean = Integral("miss", "rms", "square", angles=(1.25, 6.0), data=(7.0, 8.0))
    for row, piece, angle, datum in zip(node.write_fixed(cycle, mean), (0, 1), mean.angles, mean.data, strict=True):
        assert len(row) == node.size
        read = node.read(row, (9.0, 9.0))
        assert (read_width(node, row, (9.0, 9.0)), read.phi) == (1.0, angle)
        assert read.switch == {"half": cycle.switch(piece)["half"], "datum": datum}


def of_datum(at):
    return (at.values["x"] * at.maths.cos(at.node.phi) - at.node.switch["datum"]) ** 2


TABLE = Integral("miss", "rms", "square", angles=(0.0, 1.0, 2.0), data=(1.0, 0.5, -0.5))
WHOLE = Integral("mean", "root", "square of wave")


def averaged():
    """Return a model with two means: at three angles with data, and over the whole cycle."""
    quantities = {
        "square": CycleQuantity(of_datum, figure=False),
        "square of wave": CycleQuantity(lambda at: (at.values["x"] + at.maths.cos(at.node.phi)) ** 2, figure=False),
    }
    rows = {"x": DesignRow(lambda at: at.values["x"])}
    return JobModel(Still("averaged"), own_quantities=quantities, own_rows=rows, integrals=(TABLE, WHOLE))


@pytest.mark.parametrize("name", ["miss", "rms", "mean", "root"])
def test_means_are_rows_that_objectives_read(name):
    task = program((), (objective(name),), physics=averaged())
    calls = Calls(task, Settings())
    x = {"x": 0.3, "y": 0.0}
    sampler = calls.sampler(x)
    nlp = calls.nlp(sampler, [], warm=False)
    arguments = calls.arguments(nlp, sampler, x, np.zeros(0), [])
    value = float(nlp.gradient(arguments["x0"], arguments["p"])[0])
    square = np.mean([(0.3 * math.cos(a) - d) ** 2 for a, d in zip(TABLE.angles, TABLE.data, strict=True)])
    expected = {"miss": square, "rms": math.sqrt(square), "mean": 0.09 + 0.5, "root": math.sqrt(0.59)}[name]
    assert value == pytest.approx(expected, rel=1e-14)
    assert sampler.single(name) == pytest.approx(expected, rel=1e-14)
    assert Sampler(task.model, x).read(systems.FLOAT).single(name) == pytest.approx(expected, rel=1e-13)


def test_only_means_that_something_reads_are_taken():
    plain, other = (program((), (objective(name),), physics=averaged()) for name in ("x", "root"))
    limited = program([("rms", 1, 2.0)], (objective("x"),), physics=averaged())
    assert [mean.name for mean in means(plain, False)] == []
    assert [mean.name for mean in means(other, False)] == ["mean"]
    assert [mean.name for mean in means(limited, True)] == ["miss"]
    assert [mean.name for mean in means(other, True)] == [], "an elastic program has no objectives"
    assert structure(limited, Sampler(limited.model, {"x": 1.0, "y": 0.0}), 6).points == (("miss", 3),)
    assert structure(other, Sampler(other.model, {"x": 1.0, "y": 0.0}), 6).points == (("mean", 32),)


def test_every_number_has_its_place():
    built = structure(task := program_of(), Sampler(task.model, {**task.parameters, **task.starts[0]}), 6)
    nlp, arguments, sampler, nodes, _ = put(task)
    p, layout = arguments["p"], built.layout
    assert layout.size == len(p) == nlp.structure.layout.size
    assert layout.read(p, "values") == list(task.parameters.values())
    assert layout.read(p, "variable scale") == [v.scale for v in task.variables]
    assert layout.read(p, "limit scale") == [limit.scale for limit in task.limits]
    assert layout.read(p, "limit") == [limit.bound for limit in task.limits]
    assert layout.read(p, "objective weight") == Calls(task, Settings()).weights
    assert layout.read(p, "objective scale") == [level.scale for level in task.objectives]
    (event,) = task.model.events_read
    assert layout.read(p, f"still {event}") == list(sampler.stills[event].values())
    rows = layout.rows(p, "family 0")
    assert [row[0] for row in rows] == [1.0] * len(nodes[0]) + [0.0] * (6 - len(nodes[0]))
    assert [row[1] for row in rows[: len(nodes[0])]] == [node.sign for node in nodes[0]]


def test_structures_tell_what_differs():
    task, sampler = program((), (objective("circle", "peak"),)), Sampler(program().model, {"x": 1.0, "y": 0.5})
    first = structure(task, sampler, 6)
    assert structure(task, sampler, 6).key == first.key
    assert len({first.key, structure(task, sampler, 12).key, structure(task, sampler, 6, elastic=True).key}) == 3


def test_what_may_give_way_has_an_excess_and_a_row_of_its_own():
    task = program([("sum", 1, 1.0), ("sum", -1, 0.0), ("wave", 1, 3.0)], (objective("circle", "peak"),))
    sampler = Sampler(task.model, {"x": 1.0, "y": 0.5})
    plain, elastic = structure(task, sampler, 6), structure(task, sampler, 6, elastic=True)
    assert (plain.rows.extras, elastic.rows.extras) == (1, 3)
    assert (plain.excess_places, elastic.excess_places) == ({}, {0: (0,), 1: (1,), 2: (2,)})
    assert plain.rows.limits == elastic.rows.limits == (0, 1)
