"""Certified answers a second, in the small size: every answer certified by jets, its steps told, memory looked at."""

import importlib
import statistics
import time

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model.sampling import Sampler
from loomopt.solving.certificate.derivatives import JetDerivatives
from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives
from loomopt.solving.certificate.kkt import active_set


@pytest.fixture(scope="module")
def answers():
    return importlib.import_module("benchmarks.measure.answers")


@pytest.mark.parametrize("name", ["beatup balance", "rapier stroke-dwell", "shedding stiffness"])
def test_warm_answers_are_certified_by_jets_and_tell_their_steps(answers, name):
    row = answers.answers(name, 3)
    assert (row["answers"], row["certified"], row["by"]) == (name, "3 of 3", "jets")
    assert row["a second"] == pytest.approx(1e3 / row["ms"]["median"])
    assert sum(row[f"{step} %"] for step in answers.STEPS) == pytest.approx(100.0)


def test_slopes_by_jets_take_a_fraction_of_those_in_40_digits():
    """A fiftieth of what those of a free cam law took; 0.2 leaves room for a busy machine. Medians of turns."""
    scene = lo.load("shedding")
    program, answer = registry.of(scene).program(scene, "law"), lo.solve(scene, "law")
    sampler = Sampler(program.model, {**program.parameters, **answer.point.x})
    rows = active_set(program, sampler).rows
    ratios = []
    for _ in range(3):
        spent = {}
        for kind in (JetDerivatives, MpmathDerivatives):
            began = time.process_time()
            kind(program, answer.point.x, sampler, rows).gradients()
            spent[kind.by] = time.process_time() - began
        ratios.append(spent["jets"] / spent["40 digits"])
    assert statistics.median(ratios) <= 0.2


def test_many_answers_leave_the_memory_as_it_is(answers):
    first, last = answers.memory(100).values()
    assert last - first < 30.0
