"""How closely a solve looks, and designs that cannot be sampled."""

import math

import pytest
from waves import program

from loomopt.jobs import registry
from loomopt.solving.nlp.point import Settings, sampler_at


@pytest.mark.parametrize(
    ("accuracy", "samples"),
    [(1e-1, 180), (1e-3, 180), (9e-4, 360), (1e-6, 360), (9e-7, 720), (1e-8, 720), (1e-11, 720)],
)
def test_samples_follow_from_the_accuracy(accuracy, samples):
    assert Settings(accuracy).sample_count == samples
    assert Settings(accuracy, samples=96).sample_count == 96


@pytest.mark.parametrize(
    ("accuracy", "points"),
    [(1e-2, 360), (1e-6, 1639), (1e-8, 16384), (1e-9, 51811), (1e-10, 65536), (1e-11, 65536)],
)
def test_points_checked_again_grow_with_the_root_of_the_accuracy(accuracy, points):
    assert Settings(accuracy).check_count == points


@pytest.mark.parametrize(
    ("accuracy", "excess"), [(1e-1, 1e-8), (1e-6, 1e-8), (1e-7, 1e-9), (1e-8, 1e-10), (1e-10, 1e-12), (1e-11, 1e-12)]
)
def test_what_is_left_between_nodes_is_two_decades_below_the_accuracy(accuracy, excess):
    assert Settings(accuracy).excess == pytest.approx(excess, rel=1e-12)


def test_designs_without_a_finite_value_have_no_sampler():
    task = program()
    assert sampler_at(task, {"x": 1.0, "y": 2.0}).samples == 720
    assert sampler_at(task, {"x": 1.0, "y": 2.0}, 96).samples == 96
    assert sampler_at(task, {"x": math.inf, "y": 2.0}) is None
    assert sampler_at(task, {"x": math.nan, "y": 2.0}) is None


@pytest.mark.parametrize("lengths", [{"l1": 0.3}, {"l1": 0.0}, {"l4": 0.0, "l1": 0.0}])
def test_a_linkage_that_does_not_assemble_has_no_sampler(lengths):
    scene = registry.load("beatup")
    task = registry.of(scene).program(scene, "balance")
    assert sampler_at(task, {**task.starts[0], **lengths}) is None or lengths == {"l1": 0.0}


def test_what_is_not_said_is_as_usual():
    assert Settings() == Settings(1e-8, 1000.0, None, 0, 0.0, "exact", True, 0)
