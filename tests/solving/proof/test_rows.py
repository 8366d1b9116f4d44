"""Means over the cycle in boxes: they hold what quadrature gives for designs of the box, with slopes that do too."""

import numpy as np
import pytest
from machines_in_boxes import solved

from loomopt.maths import systems
from loomopt.maths.intervals import Interval, interval
from loomopt.model.sampling import Sampler
from loomopt.solving.proof.reading import Reader, layouts
from loomopt.solving.proof.task import BoxRows, OpenError, _summed, strips


def test_means_hold_the_quadrature_of_designs_in_the_box():
    solution = solved("beatup", "pulse")
    task, (objective,) = solution.task, solution.program.objectives
    at = task.place(solution.x)
    reader = Reader(task, 1, at)
    rng, count = np.random.default_rng(6), 25
    half = task.sizes[:, None] * 10.0 ** rng.uniform(-9, -1.3, (1, count))
    middle = at[:, None] * (1 + 0.01 * rng.random((1, count)))
    read = reader.read(middle - half, middle + half)
    steps = (2 * rng.random(middle.shape) - 1) * half
    for k in range(count):
        sampler = Sampler(solution.program.model, task.values(middle[:, k] + steps[:, k]))
        true = objective.merit(sampler) / objective.scale
        assert read.value.low[-1, k] <= true <= read.value.high[-1, k]
        slopes = read.slope.low[:, -1, k] * steps[:, k], read.slope.high[:, -1, k] * steps[:, k]
        least, most = (float(item(*slopes).sum()) for item in (np.minimum, np.maximum))
        assert read.middle.low[-1, k] + least <= true * (1 + 1e-12)
        assert read.middle.high[-1, k] + most >= true * (1 - 1e-12)


def test_a_mean_of_one_design_is_close_to_its_quadrature():
    solution = solved("beatup", "pulse")
    at = solution.task.place(solution.x)
    reader = Reader(solution.task, 1, at)
    read = reader.read(at[:, None], at[:, None])
    objective = solution.program.objectives[0]
    true = objective.merit(Sampler(solution.program.model, solution.task.values(at))) / objective.scale
    assert read.value.high[-1, 0] - read.value.low[-1, 0] < 2e-3 * true
    assert read.value.low[-1, 0] <= true <= read.value.high[-1, 0]


def test_pieces_of_several_widths_are_weighed():
    """The mean square over the whole turn, pulse and rest, against quadrature."""
    solution = solved("beatup", "pulse")
    task, model = solution.task, solution.program.model
    (integral,) = model.integrals
    whole = integral._replace(where=None)
    at = task.place(solution.x)
    ((layout, _),) = layouts(task, at[:, None], {})
    assert layout is not None
    system = systems.boxes()
    given = model.given(system, task.points(at[:, None]))
    corners = model.corners(system, given)
    mean = BoxRows(model, system, given, layout.stills, layout.cycle, corners).mean(whole)
    true = layout.sampler.mean(whole)
    assert float(mean.low.ravel()[0]) <= true <= float(mean.high.ravel()[0])
    assert float((mean.high - mean.low).ravel()[0]) < 0.5 * true


def test_a_mean_without_a_cycle_is_refused():
    solution = solved("beatup", "pulse")
    model, system = solution.program.model, systems.boxes()
    rows = BoxRows(model, system, model.given(system, solution.task.points(solution.task.low[:, None])), {})
    with pytest.raises(OpenError, match="a cycle that is not known"):
        rows.mean(model.integrals[0])


def test_sums_hold_the_true_sum():
    values = np.linspace(0.1, 1.0, 16)[:, None] * np.array([[1.0, 1e10]])
    result = _summed(interval(values), 16)
    assert np.all(result.low < values.sum(axis=0))
    assert np.all(result.high > values.sum(axis=0))
    first = _summed(Interval(np.array([[0.5]]), np.array([[0.6]])), 16)
    assert first.low <= 8.0 <= 9.6 <= first.high


def test_small_boxes_get_more_strips():
    assert [strips(np.full((3, 4), width)) for width in (1.0, 0.05, 0.0)] == [8, 16, 32]
