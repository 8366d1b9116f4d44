"""Rows over boxes: whatever a design of the box is worth lies inside, and what is not sure is left open."""

import numpy as np
import pytest
from machines_in_boxes import solved

from loomopt.model.sampling import Sampler
from loomopt.solving.proof import reading
from loomopt.solving.proof.reading import LIMIT, LateError, Reader


@pytest.mark.parametrize(
    "given", [("beatup", "balance"), ("beatup", "balance", "bearing_friction"), ("beatup", "retrofit")]
)
def test_rows_hold_what_designs_in_the_box_are_worth(given):
    solution = solved(*given)
    task, program = solution.task, solution.program
    reader = Reader(task, len(program.objectives), task.place(solution.x))
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
            values = [row for row, of in enumerate(read.of) if of == level]
            # No piece exceeds the objective, by its values and by its slopes.
            slopes = np.minimum(
                read.slope.low[:, values, k] * steps[:, None, k], read.slope.high[:, values, k] * steps[:, None, k]
            )
            with np.errstate(invalid="ignore"):
                lines = read.middle.low[values, k] + np.where(np.isnan(slopes), -np.inf, slopes).sum(axis=0)
            assert np.all(read.value.low[values, k] <= merit * (1 + 1e-9) + 1e-12)
            assert np.all(lines <= merit * (1 + 1e-9) + 1e-12)
            seen += bool(np.isfinite(lines).any())
    assert seen > 50


def test_rows_that_depend_on_corners_are_open_where_their_order_is_not_sure():
    solution = solved("beatup", "balance")
    task = solution.task
    reader = Reader(task, 2, task.place(solution.x))
    read = reader.read(task.low[:, None], task.high[:, None])
    of = np.array(read.of)
    assert np.all(np.isinf(read.value.low[of >= 0]))
    # Ratios of lengths, and limits of the design alone, are not.
    assert np.isfinite(read.value.low[of == LIMIT]).any()


def test_boxes_read_in_parts_are_the_same_bits_and_the_clock_is_looked_at_between_parts(monkeypatch):
    """A mean over the cycle takes as many strips as all boxes of the read ask for, whatever part they stand in."""
    solution = solved("beatup", "pulse")
    task = solution.task
    reader = Reader(task, 1, task.place(solution.x))
    half = 0.5 * task.sizes[:, None] * np.linspace(1e-4, 0.2, 20)
    middle = np.clip(task.place(solution.x)[:, None], task.low[:, None] + half, task.high[:, None] - half)
    whole = reader.read(middle - half, middle + half)
    monkeypatch.setattr(reading, "AT_ONCE", 7)
    parts = reader.read(middle - half, middle + half)
    for item, other in zip(whole[:3], parts[:3], strict=True):
        assert item.low.tobytes() == other.low.tobytes()
        assert item.high.tobytes() == other.high.tobytes()
    clock = iter([2.0, 3.0])
    monkeypatch.setattr("loomopt.solving.proof.reading.time.perf_counter", lambda: next(clock))
    with pytest.raises(LateError):
        reader.read(middle - half, middle + half, until=2.5)
    assert next(clock, None) is None


def test_a_middle_without_a_cycle_leaves_what_speaks_of_the_design_alone():
    solution = solved("beatup", "balance", "rod_inertia", "bounds.l1.max=160 mm", "bounds.l2.min=10 mm")
    task = solution.task
    reader = Reader(task, 1, task.place(solution.x))
    at = task.low.copy()
    at[list(task.names).index("l1")], at[list(task.names).index("l2")] = 0.155, 0.012
    read = reader.read(at[:, None], at[:, None])
    assert read.value.low[[row for row, of in enumerate(read.of) if of == LIMIT]].max() > 0.1
