"""Samplers that are kept: one for a design, whoever asks for it, and none from one solve to the next."""

import math

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model.sampling import CACHE_SIZE, SAMPLERS, Sampler, sampled
from loomopt.model.session import Session, current, working

SCENE = lo.load("beatup")
JOB = registry.of(SCENE)
VALUES = JOB.numbers(SCENE)
MODEL = JOB.model(SCENE)


def test_the_same_design_is_sampled_once():
    current().forget(SAMPLERS)
    first = sampled(MODEL, VALUES)
    assert sampled(MODEL, dict(reversed(VALUES.items()))) is first
    assert sampled(MODEL, VALUES, 360) is not first
    assert sampled(MODEL, {**VALUES, "l1": math.nextafter(VALUES["l1"], 1.0)}) is not first
    current().forget(SAMPLERS)
    assert sampled(MODEL, VALUES) is not first


def test_a_zero_of_the_other_sign_is_another_design():
    plus, minus = (sampled(MODEL, {**VALUES, "m4e": zero}) for zero in (0.0, -0.0))
    assert plus is not minus
    assert math.copysign(1.0, minus.values["m4e"]) == -1.0


def test_what_is_kept_is_what_would_be_sampled():
    remaining, fresh = sampled(MODEL, VALUES), Sampler(MODEL, VALUES)
    assert remaining.values == VALUES
    assert remaining.figures == fresh.figures
    assert remaining.extremes("peak_torque") == fresh.extremes("peak_torque")


def test_no_more_are_kept_than_one_start_looks_at():
    current().forget(SAMPLERS)
    first = sampled(MODEL, VALUES)
    for k in range(CACHE_SIZE):
        sampled(MODEL, {**VALUES, "m4e": 1.0 + k})
    assert sampled(MODEL, VALUES) is not first


def test_positions_evaluated_do_not_depend_on_the_solve_before():
    counts = {lo.solve(SCENE).solver["evaluations"] for _ in range(3)}
    assert len(counts) == 1


def test_what_does_not_assemble_is_refused_each_time():
    for _ in range(2):
        with pytest.raises((ValueError, ZeroDivisionError)):
            sampled(MODEL, {**VALUES, "l1": 10.0})


def test_extremes_are_shared_by_names_of_the_same_numbers_and_by_no_others():
    """m4e and r4e say the same as s = m4e r4e²; another counterweight is another machine."""
    program = JOB.program(SCENE, "balance")
    x = {v.name: program.starts[0][v.name] for v in program.variables}
    mass = x["s"] / x["r4e"] ** 2
    x["s"] = mass * x["r4e"] ** 2
    known = {**program.parameters, **{name: value for name, value in x.items() if name != "s"}}
    with working(Session()):
        first = sampled(program.model, {**program.parameters, **x})
        first.search(("peak_torque",))
        same, other = (sampled(program.model, {**known, "m4e": value}) for value in (mass, 2 * mass))
        coarse = sampled(program.model, {**known, "m4e": mass}, 180)
        for sampler in (same, other, coarse):
            sampler.share()
        assert [item.knows("peak_torque") for item in (same, other, coarse)] == [True, False, False]
        shared = same.extremes("peak_torque")
    with working(Session()):
        assert Sampler(program.model, {**known, "m4e": mass}).extremes("peak_torque") == shared


def test_one_figure_is_told_without_the_others():
    sampler = Sampler(MODEL, VALUES)
    assert {name: sampler.figure(name) for name in sampler.figures} == sampler.figures
    assert sampler.figure("no such figure") is None
