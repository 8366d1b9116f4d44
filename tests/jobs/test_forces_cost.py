"""What joint_forces costs: nothing where it is off, figures alone where it is on, at most half as much time again."""

import gc
import time

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model.sampling import Sampler

SCENES = {"beatup": (), "rapier": ("head_inertia",), "shedding": (), "knuckle-press": ()}
"""Packaged scene → effects put on."""
MOST = 1.5
"""Times the processor's time of the same certified answer without the effect."""


def with_and_without(name):
    scene = lo.load(name)
    scene = scene.with_effect(*SCENES[name]) if SCENES[name] else scene
    return scene, scene.with_effect("joint_forces")


@pytest.mark.parametrize("name", SCENES)
def test_it_adds_quantities_and_changes_no_digit_of_another(name):
    off, on = with_and_without(name)
    job = registry.of(off)
    without, neighbour = (job.sampler(scene, job.today(scene)) for scene in (off, on))
    values = {*neighbour.model._quantities} - {*without.model._quantities}
    assert not [name for name in without.model._quantities if name.startswith(("force_", "roller_", "direction of"))]
    assert values
    for quantity in without.model.quantities:
        first, other = (Sampler(variable.model, variable.values).peak(quantity) for variable in (without, neighbour))
        assert first == other, quantity
    programs = [job.task(scene, scene.schema.default_target).program() for scene in (off, on)]
    assert [variable.name for variable in programs[0].variables] == [
        variable.name for variable in programs[1].variables
    ]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["beatup", "shedding", "knuckle-press"])
def test_a_certified_answer_costs_at_most_half_as_much_again(name):
    off, on = with_and_without(name)
    times = []
    for scene in (off, on):
        lo.solve(scene, starts=1)  # built once
        runs = []
        for _ in range(3):
            gc.collect()
            begun = time.process_time()
            answer = lo.solve(scene, starts=1)
            runs.append(time.process_time() - begun)
        assert answer.certificate.passed
        times.append((min(runs), answer.figures))
    (plain, figures), (loaded, others) = times
    print(f"{name}: {plain:.3f} s, with joint_forces {loaded:.3f} s, {loaded / plain:.2f} times")
    assert loaded <= MOST * plain
    assert {figure: others[figure] for figure in figures if figures[figure] is not None} == {
        figure: value for figure, value in figures.items() if value is not None
    }
