"""Whole-cycle limits that hold on part of the turn, and nodes of a cycle whose corners change their order."""

import math

import numpy as np
import pytest

import loomopt as lo
from loomopt import maths
from loomopt.cycle import TURN, split
from loomopt.jobs.rapier.design import sampler
from loomopt.jobs.rapier.program import program
from loomopt.program.sampling import Sampler
from loomopt.schema import Arcs


def straddling(angle, corners):
    return float(corners[0] <= angle % TURN < corners[1])


@pytest.fixture(scope="module")
def drive():
    scene = lo.load("rapier")
    built = program(scene, "stroke-dwell")
    return built, Sampler(built.model, {**built.parameters, **built.completed(scene.mechanism)})


def test_a_node_is_found_again_by_its_crank_angle():
    cycle = split((Arcs("arc", straddling),), ((0.7, 2.0, 5.5),))
    for angle in (-0.3, 0.0, 0.7, 1.2, 1.999, 3.0, 5.6, 6.9):
        piece, u = cycle.located(angle)
        assert 0.0 <= u <= 1.0
        found = float(cycle.angles(np.array([piece]), np.array([u]))[0])
        assert (found - angle + 1e-12) % TURN == pytest.approx(1e-12, abs=1e-13)


def test_the_dwell_rows_see_their_own_arc_only(drive):
    built, sampled = drive
    for limit in (limit for limit in built.limits if limit.where):
        phi = np.radians(np.linspace(0, 30, 20_001)) * limit.where[1]
        pose = built.model.pose(maths.numpy(), sampled.given, phi)
        assert sampled.peak(limit.row, limit.where) == pytest.approx(np.abs(pose.q).max() / 0.006, rel=1e-9)
    assert sampled.peak("dwell_travel") > 100


def test_a_minimum_over_the_cycle_is_a_bound_on_what_it_leaves_of_the_complement(drive):
    built, _ = drive
    limit = next(limit for limit in built.limits if limit.name == "mu_min")
    assert limit.bound == pytest.approx(math.radians(60), rel=1e-15)


def test_prices_of_the_dwell_follow_the_arcs_ends_as_well():
    scene = lo.load("rapier")
    best = lo.solve(scene)
    worth = {price.limit: price.worth["peak_acceleration"] for price in best.binding}
    step = 0.05
    for name in ("dwell_after", "dwell_before"):
        ends = [lo.solve(scene.set(f"operation.{name}", f"{30 + sign * step} deg"), near=best) for sign in (-1, 1)]
        peaks = [end.figures["peak_acceleration"] for end in ends]
        assert (peaks[1] - peaks[0]) / math.radians(2 * step) == pytest.approx(worth[name], rel=1e-3)


def test_the_load_that_no_limit_reads_is_not_in_the_program():
    scene = lo.load("rapier").with_effect("tape_friction")
    assert program(scene, "stroke-dwell").model.loads == ()
    limited = scene.set("limits.peak_torque.max", "9 N*m")
    assert [load.name for load in program(limited, "stroke-dwell").model.loads] == ["tape_friction"]


def test_corners_without_a_formula_move_with_the_design():
    scene = lo.load("rapier").with_effect("tape_friction")
    for design in ({}, {"l4": 0.013}, {"C0y": 0.24}):
        sampled = sampler(scene, {**scene.mechanism, **design})
        assert len(sampled.hints) in (2, 4)
        for angle in sampled.given.values["turns"]:
            pose = sampled.model.pose(maths.FLOAT, sampled.given, angle)
            assert abs(pose.q1) < 1e-14
