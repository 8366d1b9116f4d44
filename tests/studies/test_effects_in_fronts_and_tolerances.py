"""Fronts and tolerances with every effect on: rows and slopes agree with single solves and evaluations."""

import math

import numpy as np
import pytest
from support.effect_choices import ALL, CASES, choices, machine

import loomopt as lo
from loomopt.physics.effects.kinds import Speed
from loomopt.physics.effects.pins import LOSS
from loomopt.physics.effects.shedding.joint_forces import PUSHES
from loomopt.studies.effects.study import known_effects
from loomopt.studies.tolerance import study
from loomopt.studies.tolerance.plan import plan_tolerance

FRONTS = {
    "beatup": ("peak_torque", "m4e", "bounds.m4e.max", "kg"),
    "rapier": ("peak_acceleration", "l4", "bounds.l4.max", "m"),
    "shedding": ("K1", "X0", "bounds.X0.max", "m"),
    "linkage": ("peak_torque", "mass", "bounds.mass.max", "kg"),
}
"""Figure that the default target minimises, the one it is traded against, and the limit of a solve on the latter."""
ANOTHER_BASIN = pytest.mark.xfail(
    strict=True, reason="at 5.69 kg the row is 1.3e-5 above another basin, which the move of the lighter row misses"
)
SOLVABLE = [
    pytest.param(job, name, marks=ANOTHER_BASIN if (job, name) == ("linkage", ALL) else (), id=f"{job}-{name}")
    for job, name in (case.values for case in CASES)
    if not any(isinstance(e, Speed) and e.name in choices(job)[name] for e in known_effects(machine(job)))
]
"""Scenes with effects that a solve covers."""
LENGTHS = {"beatup": "l2", "rapier": "l5", "shedding": "K1", "linkage": "l2"}
"""Number with a tolerance."""
COUNTS = {"landings", "period"}
"""Figures that are whole numbers."""
SOLVED, EVALUATED, SLOPE, SIDED, STEP = 1e-6, 1e-9, 1e-3, 1e-2, 1e-4
"""Relative differences of a row from a solve and from an evaluation, of a slope from a central difference and from a
one-sided one, and the step of differences."""


def scene_with(job, name):
    return machine(job).with_effect(*choices(job)[name])


def is_near(value, reference, share):
    return value == reference or abs(value - reference) <= share * max(1.0, abs(reference))


@pytest.mark.few(0, slow=3)
@pytest.mark.parametrize(("job", "name"), SOLVABLE)
def test_rows_of_a_front_are_single_solves(job, name):
    scene, (figure, against, limit, unit) = scene_with(job, name), FRONTS[job]
    front = lo.pareto(scene, (figure, against), points=3)
    assert front.rows
    for row in front.rows:
        limit_value = {**row.design, **row.figures, **row.place}.get(against)
        answer = lo.solve(scene if limit_value is None else scene.set(limit, f"{limit_value * (1 + 1e-12)!r} {unit}"))
        if not row.certified:
            assert answer.status != "optimal" or not all(answer.reached.values()), row.reason
            continue
        assert answer.status == "optimal"
        values, again = {**row.design, **row.figures}, lo.evaluate(scene, row.design).figures
        assert all(is_near(again[k], v, EVALUATED) for k, v in row.figures.items() if v is not None and again[k])
        assert is_near(values[figure], {**answer.design, **answer.figures}[figure], SOLVED)


@pytest.mark.few(2, slow=4)
@pytest.mark.parametrize(("job", "name"), CASES)
def test_slopes_of_a_tolerance_are_differences_of_evaluations(job, name):
    scene, number = scene_with(job, name), LENGTHS[job]
    design = lo.evaluate(scene).design
    plan = plan_tolerance(scene.update({"tolerances": {number: "0.1 %"}}), dict(design), None, 16, 0)
    step = STEP * design[number]
    high, low = (lo.evaluate(scene, {**design, number: design[number] + side * step}).figures for side in (1, -1))
    now, compared = lo.evaluate(scene, design).figures, 0
    for figure, slopes in study.slopes(plan).items():
        values = high.get(figure), low.get(figure), now.get(figure)
        if any(value is None or not math.isfinite(value) for value in values) or figure in COUNTS:
            continue
        above, below = (values[0] - values[2]) / step, (values[2] - values[1]) / step
        size = max(abs(above), abs(below), abs(values[2]) / design[number])
        if slopes.corner:
            assert abs(abs(slopes.steeper[number]) - max(abs(above), abs(below))) <= SIDED * size, figure
        else:
            assert abs(slopes.by_number[number] - (above + below) / 2) <= SLOPE * size, figure
        compared += 1
    assert compared > 3


def test_forces_without_contact_are_left_out_of_many_machines_too():
    """Today's spring loses contact, and a force is highest there that the cam cannot give."""
    scene = scene_with("shedding", "joint_forces")
    design = lo.evaluate(scene).design
    plan = plan_tolerance(scene.update({"tolerances": {"K1": "0.1 %"}}), dict(design), None, 16, 0)
    shares = (0.99, 1.0, 1.01)
    read = plan.read({"K1": np.array([share * design["K1"] for share in shares])})
    for place, share in enumerate(shares):
        figures = lo.evaluate(scene, {**design, "K1": share * design["K1"]}).figures
        for name in (*PUSHES, LOSS):
            if figures[name] is not None:
                assert read[name][place] == pytest.approx(figures[name], rel=1e-9), name
