"""The certificate and what is not an optimum: optima moved in random directions, and the optima of tighter tasks.

What is moved at random mostly breaks a limit; the optimum of a tighter task breaks none, and is refused because it can
still be better.
"""

import functools
import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from machines import powers

import loomopt as lo
from loomopt.jobs import registry
from loomopt.scenes import designs
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.nlp.point import sampler_at

ACCURACY = 1e-8
OPTIMA = {
    "beatup balance": ("beatup", "balance", {}),
    "beatup 600 balance": ("beatup", "balance", {"operation.M0": "600 N*m"}),
    "beatup torque": ("beatup", "torque", {}),
    "beatup pulse": ("beatup", "pulse", {}),
    "rapier stroke-dwell": ("rapier", "stroke-dwell", {}),
    "rapier dwell": ("rapier", "dwell", {}),
    "shedding stiffness": ("shedding", "stiffness", {}),
    "shedding force": ("shedding", "force", {}),
    "shedding speed": ("shedding", "speed", {}),
}


def solved(job, target, changes):
    """Return the program of a task and its optimum, SI."""
    scene = lo.load(job).update(changes)
    answer, program = lo.solve(scene, target, starts=1), registry.of(scene).program(scene, target)
    assert answer.status == "optimal", answer.message
    return program, registry.of(scene).values(program, designs.flat(answer.design))


optimum = functools.cache(lambda name: solved(*OPTIMA[name]))


def objectives(program, x):
    """Return a design's objectives, in order, in units of their scale."""
    sampler = sampler_at(program, x)
    assert sampler is not None
    values = [sampler.peak(o.row) if o.quantities else sampler.figures[o.row] for o in program.objectives]
    return [(abs(v) if o.is_magnitude else v) / o.scale for v, o in zip(values, program.objectives, strict=True)]


@pytest.mark.parametrize("name", OPTIMA)
@pytest.mark.few(2)
def test_an_optimum_moved_in_any_direction_is_refused(name):
    """By 1e-6 to 1e-2 of the variables' sizes; variables without room stay."""
    program, x = optimum(name)
    assert certify(program, x, ACCURACY).passed
    moving = [v for v in program.variables if v.lower < v.upper]
    directions = st.lists(st.floats(-1, 1), min_size=len(moving), max_size=len(moving))

    @settings(max_examples=8 if name.startswith("rapier") else 16)
    @given(directions, powers(-6, -2))
    def refused(direction, size):
        length = math.hypot(*direction)
        assume(length > 0.1)
        moved = x | {v.name: x[v.name] + size * v.scale * d / length for v, d in zip(moving, direction, strict=True)}
        try:
            certificate = certify(program, moved, ACCURACY)
        except ValueError:
            return
        if certificate.passed:
            assert objectives(program, moved) == pytest.approx(objectives(program, x), rel=1e-9, abs=1e-9)
        else:
            assert certificate.reasons

    refused()


TIGHTER: dict[str, dict[str, tuple[float, float, str]]] = {
    "beatup torque": {"limits.mu_min.min": (56.5, 57.5, "deg"), "bounds.l1.min": (30, 31, "mm")},
    "beatup pulse": {"limits.swing.min": (22.9, 23.3, "deg"), "bounds.l4.max": (167, 165, "mm")},
    "rapier stroke-dwell": {"operation.dwell_after": (30, 32, "deg"), "bounds.l3p.max": (260, 250, "mm")},
    "shedding stiffness": {"bounds.X0.max": (80, 60, "mm"), "operation.N_min": (0, 50, "N")},
    "shedding speed": {"bounds.X0.max": (80, 60, "mm"), "operation.N_min": (0, 50, "N")},
}


@pytest.mark.parametrize("name", TIGHTER)
@pytest.mark.few(2)
def test_the_optimum_of_a_tighter_task_is_no_optimum_of_this_one(name):
    """It keeps every limit; only that it can still be better is wrong with it."""
    program, x = optimum(name)
    (job, target, changes), best = OPTIMA[name], objectives(*optimum(name))

    @settings(max_examples=3 if job == "rapier" else 8)
    @given(st.fixed_dictionaries({key: st.integers(0, 100) for key in TIGHTER[name]}))
    def refused(drawn):
        assume(any(drawn.values()))
        limits = {key: (TIGHTER[name][key], percent / 100) for key, percent in drawn.items()}
        tight = {key: f"{a + share * (b - a)!r} {unit}" for key, ((a, b, unit), share) in limits.items()}
        _, other = solved(job, target, changes | tight)
        certificate, result = certify(program, {v: other[v] for v in x}, ACCURACY), objectives(program, other)
        assert certificate.feasibility <= 1e-9
        if result[0] > best[0] + 1e-6:
            assert not certificate.passed
            assert any("can still fall" in reason for reason in certificate.reasons), certificate.reasons
        else:
            assert result[0] >= best[0] - 1e-8

    refused()
