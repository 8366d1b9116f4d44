"""A program reduced for boxes: every admissible design has a point in the whole box."""

import numpy as np
import pytest
from machines_in_boxes import designs, solved

from loomopt.solving.proof.task import OpenError, reduced


@pytest.mark.few(1)
@pytest.mark.parametrize("effects", [(), ("rod_inertia",), pytest.param(("gravity",), marks=pytest.mark.slow)])
def test_every_design_has_a_point_in_the_box_and_the_same_figures_there(effects):
    solution = solved("beatup", "balance", *effects)
    task = solution.task
    for x, sampler in designs(solution.program, 40):
        at = task.place(x)
        free = task.scale.taken_out(x) if task.scale else x
        assert at == pytest.approx([free[name] for name in task.names], rel=1e-14)
        assert set(task.values(at)) == set(sampler.values)
        assert set(task.design(at)) == {v.name for v in solution.program.variables}


def test_what_only_loosens_limits_is_no_variable_and_implied_ends_are_found():
    task = solved("beatup", "balance").task
    assert task.names == ("l1", "l2", "l3", "s")
    assert task.monotone_slack == {"r4e": 0.08}
    assert (float(task.fixed["r4e"].low), float(task.fixed["r4e"].high)) == (0.0, 0.08)
    most = 12.4 * 0.08**2
    assert task.low[3] <= 0.0
    assert most <= task.high[3] <= most * (1 + 1e-14)


def test_a_least_mass_is_kept_by_what_only_loosens_limits():
    solution = solved("beatup", "balance", "bounds.m4e.min=5 kg", "bounds.r4e.min=40 mm")
    task = solution.task
    assert task.low[3] == pytest.approx(5 * 0.04**2, rel=1e-12)
    assert task.low[3] <= 5 * 0.04**2


def test_a_variable_without_an_end_is_refused():
    solution = solved("shedding", "speed")
    with pytest.raises(OpenError, match="speed is not bounded"):
        reduced(solution.program, (), None, {})
    task = reduced(solution.program, (), None, {"speed": 100.0})
    assert task.high[task.names.index("speed")] == 100.0
    assert np.all(np.isfinite(task.sizes))
