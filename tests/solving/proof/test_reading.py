"""Rows over boxes: whatever a design of the box is worth lies inside, and what is not sure is left open."""

import numpy as np
import pytest
from machines_in_boxes import solved

from loomopt.model.sampling import Sampler
from loomopt.solving.proof.reading import LIMIT, Reader


@pytest.mark.parametrize(
    "given", [("beatup", "balance"), ("beatup", "balance", "bearing_friction"), ("beatup", "retrofit")]
)
def test_rows_hold_what_designs_in_the_box_are_worth(given):
    found = solved(*given)
    task, program = found.task, found.program
    reader = Reader(task, len(program.objectives), task.place(found.x))
    rng, count = np.random.default_rng(2), 150
    half = 0.5 * task.sizes[:, None] * 10.0 ** rng.uniform(-9, -0.5, (1, count))
    middle = task.low[:, None] + half + rng.random((len(task.low), count)) * (task.sizes[:, None] - 2 * half)
    low, high = middle - half, middle + half
    read = reader.read(low, high)
    steps = (2 * rng.random(middle.shape) - 1) * half
    seen = 0
    for k in range(count):
        try:
            sampler = Sampler(program.model, task.values(middle[:, k] + steps[:, k]))
        except (ArithmeticError, TypeError, ValueError):
            continue
        merits = [objective.merit(sampler) / objective.scale for objective in program.objectives]
        for level, merit in enumerate(merits):
            own = [row for row, of in enumerate(read.of) if of == level]
            # No piece exceeds the objective, by its values and by its slopes.
            slopes = np.minimum(
                read.slope.low[:, own, k] * steps[:, None, k], read.slope.high[:, own, k] * steps[:, None, k]
            )
            with np.errstate(invalid="ignore"):
                lines = read.middle.low[own, k] + np.where(np.isnan(slopes), -np.inf, slopes).sum(axis=0)
            assert np.all(read.value.low[own, k] <= merit * (1 + 1e-9) + 1e-12)
            assert np.all(lines <= merit * (1 + 1e-9) + 1e-12)
            seen += bool(np.isfinite(lines).any())
    assert seen > 50


def test_rows_that_depend_on_corners_are_open_where_their_order_is_not_sure():
    found = solved("beatup", "balance")
    task = found.task
    reader = Reader(task, 2, task.place(found.x))
    read = reader.read(task.low[:, None], task.high[:, None])
    of = np.array(read.of)
    assert np.all(np.isinf(read.value.low[of >= 0]))
    # Ratios of lengths, and limits of the design alone, are not.
    assert np.isfinite(read.value.low[of == LIMIT]).any()


def test_a_middle_without_a_cycle_leaves_what_speaks_of_the_design_alone():
    found = solved("beatup", "balance", "rod_inertia", "bounds.l1.max=160 mm", "bounds.l2.min=10 mm")
    task = found.task
    reader = Reader(task, 1, task.place(found.x))
    at = task.low.copy()
    at[list(task.names).index("l1")], at[list(task.names).index("l2")] = 0.155, 0.012
    read = reader.read(at[:, None], at[:, None])
    assert read.value.low[[row for row, of in enumerate(read.of) if of == LIMIT]].max() > 0.1
