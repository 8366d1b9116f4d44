"""Many designs at once: what is read of each is what is read of it alone."""

import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import sampler_at
from loomopt.solving.search.multistart import Batch

TASKS = [
    ("beatup", "balance", ()),
    ("beatup", "pulse", ()),
    ("beatup", "torque", ("gravity", "bearing_friction", "rod_inertia")),
    ("rapier", "stroke-dwell", ()),
    ("rapier", "smooth", ()),
    ("rapier", "dwell", ()),
    ("shedding", "stiffness", ("dry_friction",)),
    ("shedding", "force", ()),
]
CLOSE = 0.02
"""What a look at 48 nodes of a turn may miss of a peak, of its size."""


def task(job, target, effects):
    scene = registry.load(job)
    for effect in effects:
        scene = scene.with_effect(effect) if effect not in [item.name for item in scene.active] else scene
    program = registry.of(scene).program(scene, target)
    starts = exchange.starts(program, 6, 1)
    return program, Batch(program, sampler_at(program, starts[0])), starts


def rows_of(batch, starts):
    return np.array([[start[name] for name in batch.names] for start in starts])


@pytest.mark.parametrize(("job", "target", "effects"), TASKS)
def test_objectives_and_residuals_are_those_of_each_design_alone(job, target, effects):
    program, batch, starts = task(job, target, effects)
    read = batch.values(rows_of(batch, starts))
    for k, start in enumerate(starts):
        sampler = sampler_at(program, start)
        if sampler.cycle.order != batch.like.cycle.order:
            continue
        for level, objective in enumerate(program.objectives):
            alone = objective.merit(sampler) / objective.scale
            assert read.objectives[k, level] == pytest.approx(alone, rel=CLOSE, abs=CLOSE), objective
        cycle = program.cycle_limits.values()
        for limit, residual in zip(batch.limits, read.residuals, strict=True):
            tolerance = CLOSE * max(1.0, abs(limit.excess(sampler))) if limit in cycle else 1e-9
            assert residual[k] == pytest.approx(limit.excess(sampler), abs=tolerance), limit


@pytest.mark.parametrize(("job", "target", "effects"), TASKS)
def test_jets_are_the_slopes_of_the_floats(job, target, effects):
    program, batch, starts = task(job, target, effects)
    x = rows_of(batch, starts[:3])
    free = [k for k, v in enumerate(program.variables) if v.range[0] < v.range[1]]
    sizes = np.array([program.variables[k].scale for k in free])
    directions = np.zeros((x.shape[1], len(free)))
    directions[free, np.arange(len(free))] = sizes
    jets = batch.values(x, directions)
    step = 1e-6
    for column, place in enumerate(free):
        up, down = x.copy(), x.copy()
        up[:, place] += step * sizes[column]
        down[:, place] -= step * sizes[column]
        ends = [batch.values(moved).residuals for moved in (up, down)]
        for jet, high, low in zip(jets.residuals, *ends, strict=True):
            slope = (high - low) / (2 * step)
            values = jet.g[:, column] if hasattr(jet, "g") else np.zeros(len(x))
            # At a node that another overtakes a slope is that of neither side.
            assert values == pytest.approx(slope, rel=1e-4, abs=1e-4 * max(1.0, np.abs(slope).max()))


def test_a_design_that_does_not_assemble_is_worst_and_spoils_no_other():
    _, batch, starts = task("rapier", "stroke-dwell", ())
    x = rows_of(batch, starts[:2])
    alone = batch.values(x[:1])
    x[1, batch.names.index("l5")] = 1e-3
    both = batch.values(x)
    assert np.isinf(both.violation[1])
    assert both.violation[0] == alone.violation[0]
    assert np.array_equal(both.objectives[0], alone.objectives[0])


def test_the_angle_of_the_stroke_is_put_where_the_head_is_farthest():
    _, batch, starts = task("rapier", "stroke-dwell", ())
    x = rows_of(batch, starts)
    place = batch.names.index("phi_stroke")
    right = x[:, place].copy()
    x[:, place] = 0.0
    assert batch.tops(x)[:, place] == pytest.approx(right, abs=5e-3)
    assert np.all(x[:, place] == 0.0), "what was given stays as it is"
