"""The certificate against wrong answers of the real jobs, each a millionth from an optimum."""

import functools

import pytest
from support import slow

import loomopt as lo
from loomopt.jobs import registry
from loomopt.scenes import designs
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.nlp.point import sampler_at

ACCURACY = 1e-8
MILLIONTH = 1e-6
OPTIMA: dict[str, tuple[str, str, dict[str, object]]] = {
    "beatup 600": ("beatup", "balance", {"operation.M0": "600 N*m"}),
    "beatup 745": ("beatup", "balance", {}),
    "beatup 900": ("beatup", "balance", {"operation.M0": "900 N*m"}),
    "beatup pulse": ("beatup", "pulse", {}),
    "beatup torque": ("beatup", "torque", {}),
    "rapier stroke-dwell": ("rapier", "stroke-dwell", {}),
    "rapier dwell": ("rapier", "dwell", {}),
    "shedding stiffness": ("shedding", "stiffness", {}),
    "shedding speed": ("shedding", "speed", {}),
    "shedding force": ("shedding", "force", {}),
    "shedding law": ("shedding", "law", {"targets.law.intervals": 8}),
}
optima = pytest.mark.parametrize("name", OPTIMA)


@functools.cache
def optimum(name):
    """Return the program of a case and its optimum, SI."""
    job, target, changes = OPTIMA[name]
    scene = lo.load(job).update(changes)
    answer, program = lo.solve(scene, target, starts=1), registry.find(job).program(scene, target)
    assert answer.status == "optimal", answer.message
    return program, registry.find(job).values(program, designs.flat(answer.design))


def objectives(program, x):
    """Return a design's objectives, in order, in units of their scale."""
    sampler = sampler_at(program, x)
    assert sampler is not None
    results = []
    for o in program.objectives:
        value = sampler.peak(o.row) if o.quantities else sampler.figures[o.row]
        results.append((abs(value) if o.is_magnitude else value) / o.scale)
    return results


def nudged(program, x, name, share):
    """Return x with one variable off by a share of itself, or of its scale where it is 0."""
    size = next(v.scale for v in program.variables if v.name == name)
    return x | {name: x[name] + share * (abs(x[name]) or size)}


@pytest.mark.few(6)
@optima
def test_the_optimum_itself_passes(name):
    program, x = optimum(name)
    assert certify(program, x, ACCURACY).passed


@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("name", "share"),
    slow.after(
        len(OPTIMA),
        [(name, sign * MILLIONTH) for sign in (1, -1) for name in OPTIMA]
        + [(name, sign * 1e-4) for name in OPTIMA if "rapier" not in name for sign in (1, -1)],
    ),
)
def test_one_variable_off_is_refused_or_no_better(name, share):
    """What passes is as good, level by level, to rounding: the counterweight's radius, for which its mass makes up."""
    program, x = optimum(name)
    best, passed = objectives(program, x), []
    for variable in program.variables:
        moved = nudged(program, x, variable.name, share)
        certificate = certify(program, moved, ACCURACY)
        assert certificate.passed or certificate.reasons
        if certificate.passed:
            passed.append(variable.name)
            assert objectives(program, moved) == pytest.approx(best, rel=1e-12, abs=1e-12)
    assert set(passed) <= {"r4e"}


@pytest.mark.few(8)
@optima
@pytest.mark.parametrize("size", [1e-5, 1e-3])
def test_an_optimum_stretched_in_all_variables_is_refused(name, size):
    """By turns up and down, so that no common scale of the lengths is hit."""
    program, x = optimum(name)
    for sign in (1, -1):
        moved = x
        for k, variable in enumerate(program.variables):
            moved = nudged(program, moved, variable.name, sign * size * (-1) ** k * (1 + k / 7))
        certificate = certify(program, moved, ACCURACY)
        assert not certificate.passed
        assert certificate.reasons


@pytest.mark.parametrize("name", ["shedding stiffness", "shedding law"])
def test_a_spring_a_millionth_too_soft_lets_the_roller_off(name):
    program, x = optimum(name)
    soft = certify(program, nudged(program, x, "K1", -MILLIONTH), ACCURACY)
    assert not soft.passed
    assert any("limit N_min is exceeded" in reason for reason in soft.reasons), soft.reasons
    stiff = certify(program, nudged(program, x, "K1", MILLIONTH), ACCURACY)
    assert not stiff.passed
    assert any("K1 can still fall" in reason for reason in stiff.reasons), stiff.reasons


def test_a_machine_a_millionth_too_fast_lets_the_roller_off():
    program, x = optimum("shedding speed")
    fast = certify(program, nudged(program, x, "speed", MILLIONTH), ACCURACY)
    assert any("limit N_min is exceeded" in reason for reason in fast.reasons), fast.reasons
    slow = certify(program, nudged(program, x, "speed", -MILLIONTH), ACCURACY)
    assert any("speed can still fall" in reason for reason in slow.reasons), slow.reasons
