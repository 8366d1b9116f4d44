"""Whole-cycle limits that hold on part of the turn, and nodes of a cycle whose corners change their order."""

import math

import numpy as np
import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Node

RAPIER = registry.load("rapier")
JOB = registry.of(RAPIER)


@pytest.fixture(scope="module")
def drive():
    built = JOB.program(RAPIER, "stroke-dwell")
    return built, Sampler(built.model, {**built.parameters, **built.completed(RAPIER.mechanism)})


def test_the_dwell_rows_see_their_own_arc_only(drive):
    built, sampled = drive
    for limit in (limit for limit in built.cycle_limits.values() if limit.where):
        phi = np.radians(np.linspace(0, 30, 20_001)) * limit.where[1]
        pose = built.model.instant(systems.numpy(), sampled.given, Node(phi, {})).pose
        assert sampled.peak(limit.row, limit.where) == pytest.approx(np.abs(pose.q).max() / 0.006, rel=1e-9)
    assert sampled.peak("dwell_travel") > 100


def test_a_minimum_over_the_cycle_is_a_bound_on_what_it_leaves_of_the_complement(drive):
    built, _ = drive
    limit = next(limit for limit in built.limits if limit.name == "mu_min")
    assert limit.bound == pytest.approx(math.radians(60), rel=1e-15)


@pytest.mark.slow
def test_prices_of_the_dwell_follow_the_arcs_ends_as_well():
    scene = RAPIER
    best = lo.solve(scene)
    worth = {price.limit: price.worth["peak_acceleration"] for price in best.binding}
    step = 0.05
    for name in ("dwell_after", "dwell_before"):
        ends = [
            lo.solve(scene.set(f"operation.{name}", f"{30 + sign * step} deg"), warm_start=best) for sign in (-1, 1)
        ]
        peaks = [end.figures["peak_acceleration"] for end in ends]
        assert (peaks[1] - peaks[0]) / math.radians(2 * step) == pytest.approx(worth[name], rel=1e-3)


def test_the_load_that_no_limit_reads_is_not_in_the_program():
    scene = RAPIER.with_effect("tape_friction")
    assert JOB.program(scene, "stroke-dwell").model.loads == ()
    limited = scene.set("limits.peak_torque.max", "9 N*m")
    assert [load.name for load in JOB.program(limited, "stroke-dwell").model.loads] == ["tape_friction"]


def test_corners_without_a_formula_move_with_the_design():
    scene = RAPIER.with_effect("tape_friction")
    for design in ({}, {"l4": 0.013}, {"C0y": 0.24}):
        sampled = JOB.sampler(scene, design)
        assert len(sampled.hints) in (2, 4)
        for angle in sampled.given.values["turns"]:
            pose = sampled.model.instant(systems.FLOAT, sampled.given, Node(angle, {})).pose
            assert abs(pose.q1) < 1e-14
