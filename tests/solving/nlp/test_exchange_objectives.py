"""Objectives over several rows, the worst of which counts; what is known in closed form comes out."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from waves import WAVES, model, objective, program

from loomopt.maths import systems
from loomopt.model.sampling import Sampler
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Settings

ROOT = 2**0.5


def solved(task, **options):
    return exchange.solve(task, task.starts[0], Settings(), **options)


def merit(task, x):
    """Return the first objective at variables, peaks by plain NumPy on a dense grid."""
    level, sampler = task.objectives[0], Sampler(task.model, x)
    phi = np.linspace(0, 2 * math.pi, 100_001)

    def worth(row):
        if level.quantities:
            values = WAVES[row](systems.numpy(), x, phi)
            return float(np.max(values if row in task.model.signed else np.abs(values)))
        return abs(sampler.single(row)) if level.is_magnitude else sampler.single(row)

    return max(map(worth, level.rows))


KNOWN = {
    "worst of two values": ((), objective("bowl", "value", ("other bowl",)), (1.0, 1.0), 5.0),
    "worst of two magnitudes": (
        [("bowl", 1, 1.0)],
        objective("sum", "magnitude", ("apart",)),
        (3 - 1 / ROOT, 2 - 1 / ROOT),
        5 - ROOT,
    ),
    "worst of two peaks": ((), objective("circle", "peak", ("shifted",)), (1.5, 0.5), 10**0.5 / 2),
    "worst of three peaks": (
        [("y", -1, 2.0)],
        objective("circle", "peak", ("shifted", "wave")),
        (7.75 / 9, 2.0),
        7.75 / 9 + 1.5,
    ),
}


@pytest.mark.parametrize("name", KNOWN)
def test_the_least_is_the_one_known_in_closed_form(name):
    limits, level, place, value = KNOWN[name]
    task = program(limits, (level,))
    point = solved(task)
    assert point.usable
    assert merit(task, point.x) == pytest.approx(value, rel=1e-8)
    assert level.merit(Sampler(task.model, point.x)) == pytest.approx(value, rel=1e-8)
    assert [point.x["x"], point.x["y"]] == pytest.approx(place, abs=1e-4)


@pytest.mark.few(2)
@pytest.mark.parametrize("name", KNOWN)
def test_no_neighbour_is_better(name):
    limits, level, _, value = KNOWN[name]
    task = program(limits, (level,))
    point = solved(task)
    for angle, step in itertools.product(np.linspace(0, 2 * math.pi, 24), (1e-3, 1e-1)):
        moved = {"x": point.x["x"] + step * math.cos(angle), "y": point.x["y"] + step * math.sin(angle)}
        sampler = Sampler(task.model, moved)
        if all(limit.excess(sampler) <= 1e-9 for limit in task.limits):
            assert merit(task, moved) >= value - 1e-9


def test_a_signed_peak_may_be_negative_and_the_worst_of_two_counts():
    """Largest values x + 3/2 and |(x, y)|: with both at most 10 the first alone would go to −10."""
    task = program([("x", -1, -5.0)], (objective("wave", "peak"),), physics=model(signed=WAVES))
    assert merit(task, solved(task).x) == pytest.approx(-3.5, abs=1e-9)
    both = program([("x", -1, -5.0)], (objective("wave", "peak", ("circle",)),), physics=model(signed=WAVES))
    point = solved(both)
    assert merit(both, point.x) == pytest.approx(0.75, abs=1e-8), "x + 3/2 = −x"
    assert point.x == pytest.approx({"x": -0.75, "y": 0.0}, abs=1e-4)


def test_a_later_level_has_what_the_earlier_one_leaves():
    """First the larger of |x + y| and |x − y|, at its least 0; then the bowl has no room."""
    levels = (objective("sum", "magnitude", ("apart",)), objective("bowl"))
    assert solved(program((), levels)).x == pytest.approx({"x": 0.0, "y": 0.0}, abs=1e-8)
    levels = (objective("wave", "peak", ("wave",)), objective("bowl"))
    assert solved(program((), levels)).x == pytest.approx({"x": -0.375, "y": 2.0}, abs=1e-8)


def test_a_neighbour_s_answer_leads_where_a_cold_start_does():
    level = objective("circle", "peak", ("shifted",))
    near = solved(program([("y", -1, 2.0)], (level,)))
    moved = program([("y", -1, 2.1)], (level,))
    warm, cold = solved(moved, warm=near), solved(moved)
    assert warm.usable
    assert warm.iterations == 0
    assert merit(moved, warm.x) == pytest.approx(merit(moved, cold.x), rel=1e-9)


def test_the_rows_of_an_objective_are_part_of_the_structure():
    second_program = program((), (objective("circle", "peak", ("shifted",)),))
    other = replace(second_program, objectives=(objective("circle", "peak", ("wave",)),))
    fewer = replace(second_program, objectives=(objective("circle", "peak"),))
    assert len({second_program.structure, other.structure, fewer.structure}) == 3
