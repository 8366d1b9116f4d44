"""NLPs are built once for each structure, and kept while there is room."""

import casadi as ca
import numpy as np
import pytest
from beatup_nlps import DESIGN, program_of, put

from loomopt.model.session import current
from loomopt.solving.nlp import transcribe as built
from loomopt.solving.nlp.point import sampler_at
from loomopt.solving.nlp.transcribe import Buffered, transcribe


@pytest.mark.slow
def test_numbers_are_parameters_and_only_structure_is_built():
    first, _, sampler, *_ = put(program_of())
    for changes in (
        {"operation.M0": "600 N*m"},
        {"operation.speed": "300 rpm", "limits.swing.max": "25 deg"},
        {"bounds.l1.min": "20 mm", "effects.inertia.J4": "0.9 kg*m^2", "effects.resistance.pulse": "20 deg"},
    ):
        again, fresh = transcribe(program_of(changes=changes.items()), sampler, 6)
        assert again is first
        assert not fresh


@pytest.mark.parametrize(
    ("effects", "target", "changes"),
    [
        (("gravity",), "balance", ()),
        ((), "torque", ()),
        ((), "balance", (("limits.peak_torque.max", "90 N*m"),)),
        ((), "balance", (("limits.swing.max", "22.9 deg"),)),
    ],
    ids=str,
)
def test_another_structure_is_another_program(effects, target, changes):
    assert put(program_of(effects, target, changes))[0] is not put(program_of())[0]


@pytest.mark.slow
def test_no_more_programs_are_kept_than_there_is_room_for():
    for slots in range(6, 6 + built.CACHE_SIZE + 3):
        program = program_of((), "torque")
        transcribe(program, sampler_at(program, DESIGN), slots)
    assert current().count(built.NLPS) == built.CACHE_SIZE


def test_a_buffered_function_is_the_function():
    """Sparse results are dense arrays of their shape; the next call leaves what the last one returned as it is."""
    x, p = ca.SX.sym("x", 3), ca.SX.sym("p", 2)
    g = ca.vertcat(x[0] * p[0], x[2] ** 2)
    for outputs in ([g, ca.jacobian(g, x)], [ca.triu(ca.hessian(g[1] * p[1], x)[0])], [ca.SX(2, 3)]):
        function = ca.Function("f", [x, p], outputs)
        buffered, remaining = Buffered(function), []
        for seed in range(3):
            rng = np.random.default_rng(seed)
            given = rng.normal(size=3), rng.normal(size=2)
            wanted = function(*given) if len(outputs) > 1 else [function(*given)]
            remaining += [(np.array(want.full()), item) for want, item in zip(wanted, buffered(*given), strict=True)]
        assert all(want.shape == item.shape and np.array_equal(want, item) for want, item in remaining)
