"""The row made of an answer's multipliers: stationary at the answer, and never stricter than what it is made of."""

import numpy as np
import pytest
from machines_in_boxes import solved

from loomopt.solving.proof.reading import LIMIT, Reader
from loomopt.solving.proof.tree import multipliers, with_cut


@pytest.mark.parametrize(("name", "level"), [("beatup-light", 0), ("beatup-light", 1), ("beatup", 1)])
def test_the_lagrangian_is_flat_at_the_answer_in_all_directions_that_bounds_leave(name, level):
    solution = solved(name, "balance")
    task = solution.task
    at = task.place(solution.x)
    reader = Reader(task, level + 1, at)
    weights = multipliers(reader, at, level)
    of = np.array(reader.of)
    assert np.all(weights >= 0)
    assert weights[of == level].sum() == pytest.approx(1.0, rel=1e-6)
    read, _ = with_cut(reader.read(at[:, None], at[:, None]), weights, np.zeros(len(of)))
    slope = (read.slope.low[:, -1, 0] + read.slope.high[:, -1, 0]) / 2 * task.sizes
    inside = (at - task.low > 1e-7 * task.sizes) & (task.high - at > 1e-7 * task.sizes)
    assert np.abs(slope[inside]).max(initial=0.0) < 1e-5
    # Where a bound holds it, the row falls toward the bound only.
    low, high = at - task.low <= 1e-7 * task.sizes, task.high - at <= 1e-7 * task.sizes
    assert np.all(slope[low] > -1e-5)
    assert np.all(slope[high] < 1e-5)


def test_a_sum_of_rows_has_the_sum_of_their_bounds():
    solution = solved("beatup-light", "balance")
    task = solution.task
    at = task.place(solution.x)
    reader = Reader(task, 1, at)
    read = reader.read(at[:, None] - 1e-4, at[:, None] + 1e-4)
    weights = np.zeros(len(reader.of))
    weights[[1, 4]] = 0.5, 2.0
    bounds = np.arange(len(weights), dtype=float)
    more, ends = with_cut(read, weights, bounds)
    assert more.of == (*read.of, LIMIT)
    assert ends[-1] == pytest.approx(0.5 * 1 + 2.0 * 4)
    assert more.value.low[-1, 0] <= 0.5 * read.value.low[1, 0] + 2 * read.value.low[4, 0]
    assert with_cut(read, np.zeros(len(weights)), bounds)[0] is read
