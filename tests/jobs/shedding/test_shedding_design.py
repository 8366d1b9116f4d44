"""Between the NLP's variables and the spring, cam and law a person reads: designs, figures, sentences."""

import math

import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.physics.mechanisms.cam_spline import cycloid_like

SCENE = registry.load("shedding")
JOB = registry.of(SCENE)
TODAY = JOB.today(SCENE)
K1, X0 = 8029.14, 0.08


def variables(program, **values):
    return {v.name: values.get(v.name, program.starts[0].get(v.name, v.lower)) for v in program.variables}


def test_a_design_is_the_spring_and_what_is_freed():
    program = JOB.program(SCENE, "stiffness")
    assert JOB.design(program, variables(program, K1=1e5, X0=0.07)) == {"K1": 1e5, "X0": 0.07}
    free = JOB.program(SCENE.free("rise"), "stiffness")
    angles = {"rise": 2.0, "far_dwell": 1.2, "return": 1.9}
    design = JOB.design(free, variables(free, K1=1e5, **angles))
    assert {name: design[name] for name in angles} == angles
    assert design["near_dwell"] == pytest.approx(2 * math.pi - 5.1, rel=1e-15)


def test_a_number_that_is_kept_is_in_the_design_only_where_it_gave_way():
    program = JOB.program(SCENE, "stiffness")
    assert "travel" not in JOB.design(program, variables(program))
    assert JOB.design(program, variables(program, travel=0.06))["travel"] == 0.06


@pytest.mark.parametrize("symmetric", [False, True])
def test_a_free_law_is_in_the_design_with_all_its_knots(symmetric):
    program = JOB.program(SCENE.update({"targets.law.intervals": 8, "targets.law.symmetric": symmetric}), "law")
    design = JOB.design(program, variables(program))
    assert [design[f"law_{k}"] for k in range(9)] == pytest.approx(cycloid_like(8), rel=1e-12)
    assert JOB.figures(SCENE, design)["law_acceleration"] == pytest.approx(max(cycloid_like(8)), rel=1e-12)


def test_figures_are_the_extremes_of_the_curves():
    """On a fine table the extremes are met from inside, by no more than its steps let pass."""
    result, table = JOB.figures(SCENE, TODAY), JOB.curves(SCENE, TODAY, steps=36_000)
    force, angle = table["N [N]"], table["phi [rad]"]
    size = float(np.abs(force).max())
    assert 0 <= force.min() - result["contact_min"] <= 1e-6 * size
    assert 0 <= result["contact_max"] - force.max() <= 1e-6 * size
    assert result["contact_angle"] == pytest.approx(float(angle[force.argmin()]), abs=2e-4)
    assert result["pressure_angle_max"] == pytest.approx(float(np.abs(table["pressure_angle [rad]"]).max()), rel=1e-6)
    assert result["curvature_min"] == pytest.approx(float(table["curvature [1/m]"].min()), rel=1e-6)
    assert result["curvature_max"] == pytest.approx(float(table["curvature [1/m]"].max()), rel=1e-6)
    assert result["law_acceleration"] == pytest.approx(2 * math.pi, rel=1e-14)
    assert (result["K1"], result["X0"], result["travel"]) == (K1, X0, 0.0656)
    assert result["spring_stretch"] == pytest.approx(X0 + 0.0656, rel=1e-15)
    assert result["spring_force_max"] == pytest.approx(K1 * (X0 + 0.0656), rel=1e-15)


def test_where_the_least_force_is_met_twice_the_first_angle_counts():
    """Without weight, warp and inertia the spring alone presses: least all along the upper dwell."""
    bare = SCENE.without_effect("weight").without_effect("warp_tension").without_effect("inertia")
    figures = JOB.figures(bare, TODAY)
    assert figures["contact_min"] == pytest.approx(K1 * X0, rel=1e-14)
    assert figures["contact_angle"] == pytest.approx(0.0, abs=1e-12)
    assert figures["contact_speed"] is None


def test_with_the_pull_known_in_the_dwells_only_the_force_has_extremes_in_the_dwells_only():
    levels = SCENE.set("effects.warp_tension.shape", "levels")
    for quantity in ("lift", "cam_force"):
        assert len(JOB.sampler(SCENE, TODAY).extremes(quantity)) > 2
        sampler = JOB.sampler(levels, TODAY)
        segments = [sampler.cycle.switch(e.piece)["segment"] for e in sampler.extremes(quantity)]
        assert sorted(segments) == [1.0, 3.0]
    assert "contact_max" not in JOB.studied(levels).peaks
    assert JOB.figures(levels, TODAY)["contact_speed"] is None
    assert JOB.figures(levels, TODAY)["contact_min"] > JOB.figures(SCENE, TODAY)["contact_min"]


@pytest.mark.parametrize(
    ("target", "message"),
    [
        (
            "stiffness",
            "The least return spring that keeps the roller on the cam all round has 102602.609 N/m. Today's ",
        ),
        ("law", "With the cam law chosen too, the least return spring"),
        ("force", "The least peak cam force is 15000 N, with a return spring of 102602.609 N/m. Today's spring"),
        ("speed", "Today's spring keeps the roller on the cam all round up to 145 rpm."),
    ],
)
def test_what_an_optimum_is_worth_in_words(target, message):
    figures = {"K1": 102602.609425357, "contact_max": 15000.0, "speed": 145 * math.pi / 30}
    assert JOB.say(SCENE, target, figures).startswith(message)
    assert ("would lift off: the cam force would be -" in JOB.say(SCENE, target, figures)) == (target != "speed")
    levels = SCENE.set("effects.warp_tension.shape", "levels")
    if target != "force":
        assert "in both dwells" in JOB.say(levels, target, figures)


def test_todays_spring_holds_or_is_too_soft():
    figures = {"K1": 1e5, "contact_max": 15000.0, "speed": 1.0}
    assert "holds: the cam force is never less than" in JOB.say(
        SCENE.set("mechanism.K1", "200 kN/m"), "stiffness", figures
    )
    soft = SCENE.update({"mechanism.K1": "110 kN/m", "operation.N_min": "5 kN"})
    assert "is too soft: the cam force would be" in JOB.say(soft, "stiffness", figures)
