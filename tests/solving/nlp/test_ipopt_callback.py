"""Iterations of IPOPT as they are reported."""

import itertools

import pytest
from waves import objective, program

from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.ipopt import IterationCallback
from loomopt.solving.nlp.point import Settings


def test_every_iteration_is_reported_in_order():
    seen: list[int] = []
    task = program([("circle", 1, 1.0)])
    point = exchange.solve(task, task.starts[0], Settings(callback=IterationCallback(seen.append)))
    assert seen[0] == 0
    assert all(after in (before + 1, 0) for before, after in itertools.pairwise(seen)), "0: a larger NLP"
    assert len(seen) >= point.iterations > 0


def test_one_callback_serves_nlps_of_one_size():
    made = IterationCallback(lambda count: None)
    assert made.for_size(2, 3, 4) is made.for_size(2, 3, 4)
    assert made.for_size(2, 3, 4) is not made.for_size(2, 4, 4)


def test_an_interrupt_in_a_report_ends_the_solve():
    def stop(count):
        raise KeyboardInterrupt

    task = program((), (objective("circle", "peak", ("shifted",)),))
    with pytest.raises(KeyboardInterrupt):
        exchange.solve(task, task.starts[0], Settings(callback=IterationCallback(stop)))
