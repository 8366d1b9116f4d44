"""A solve from right beside an optimum ends in it: the barrier pushes such a start away from its active rows."""

import functools

import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.studies import check
from loomopt.studies.front.solver import Subproblem

LEAST = 0.46370233163691604
"""m/rad²; least peak acceleration of the packaged rapier front, the end of `results/`."""
ALIKE = 1e-9
SIZES = (1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9)
"""Relative changes of the start."""


@functools.cache
def study():
    """Return the packaged front of the rapier, built once."""
    return check.reference_trade(registry.load("rapier"))


def start():
    """Return the design at the end of least peak acceleration, as the reference table has it."""
    scene = study().scene
    table = check.read_reference(registry.results(scene) / check.front_file(study()))
    (near,) = check._front_start(study(), dict(table.iloc[0]))
    return near["point"]["x"]


@pytest.mark.few(0, slow=27)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("size", SIZES)
def test_a_start_beside_the_least_ends_in_it(size, seed):
    draw = np.random.default_rng(seed)
    x = {name: value * (1 + size * draw.uniform(-1, 1)) for name, value in start().items()}
    near = [{"point": {"task": "", "x": x}}]
    row = study().solver.solve(Subproblem(0, (None, None)), near, None)
    assert row.status == "optimal", row.reason
    assert row.figures["peak_acceleration"] <= LEAST * (1 + ALIKE)
