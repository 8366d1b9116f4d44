"""Between the NLP's variables and the drive a person reads: designs, figures, sentences."""

import math

import numpy as np
import pytest

from loomopt.jobs import registry

SCENE = registry.load("rapier")
JOB = registry.of(SCENE)
TODAY = JOB.today(SCENE)
VARIABLES = ("l4", "l5", "l6", "l3p", "alpha", "C0x", "C0y", "phi40")


def test_a_design_is_the_drives_own_numbers_and_what_is_freed():
    program = JOB.program(SCENE, "stroke-dwell")
    x = program.completed({name: TODAY[name] for name in VARIABLES})
    assert JOB.design(program, x) == {name: TODAY[name] for name in VARIABLES}
    free = JOB.program(SCENE.free("sley"), "stroke-dwell")
    x = free.completed({name: SCENE.mechanism[name] for name in (*VARIABLES, "l1", "l2", "l3", "l71")})
    assert {"l1", "l2", "l3", "l71"} <= set(JOB.design(free, x))
    assert not {"phi_stroke", "stroke", "s_dwell"} & set(JOB.design(free, x))


def test_a_design_becomes_variables_with_what_follows_from_it():
    program = JOB.program(SCENE, "dwell")
    result, figures = JOB.values(program, TODAY), JOB.figures(SCENE, TODAY)
    assert result["phi_stroke"] == pytest.approx(figures["phi_stroke"], abs=1e-12)
    assert result["dwell"] == pytest.approx(figures["dwell"], abs=1e-12)
    assert JOB.design(program, result) == {name: TODAY[name] for name in VARIABLES}


def test_figures_are_the_extremes_of_the_curves():
    scene = SCENE.with_effect("head_inertia")
    result, table = JOB.figures(scene, TODAY), JOB.curves(scene, TODAY, steps=36_000)
    for name, column in (
        ("peak_acceleration", "S_2 [m/rad^2]"),
        ("peak_jerk", "S_3 [m/rad^3]"),
        ("tape_force", "Q [N]"),
    ):
        assert result[name] == pytest.approx(float(np.abs(table[column]).max()), rel=1e-6), name
    assert result["stroke"] == pytest.approx(float(table["S [m]"].max()), rel=1e-9)
    assert result["mu_min"] == pytest.approx(float(np.abs(table["mu [rad]"]).min()), rel=1e-4)
    assert result["swing"] == pytest.approx(float(np.ptp(table["phi3 [rad]"])), rel=1e-8)
    assert result["dwell"] == min(result["dwell_after"], result["dwell_before"])
    jerk = table["S_3 [m/rad^3]"][np.unique(table["phi [rad]"], return_index=True)[1]]
    assert result["rms_jerk"] == pytest.approx(math.sqrt(np.mean(jerk**2)), rel=1e-4)


def test_figures_without_their_numbers_are_undefined():
    document = {table: dict(values) for table, values in SCENE.document.items()}
    document["operation"], document["targets"] = {}, {}
    figures = JOB.figures(registry.scene(document), TODAY)
    assert {name for name, value in figures.items() if value is None} == {
        *("dwell_after", "dwell_before", "dwell", "tape_force", "peak_torque", "peak_power", "match_rms"),
        *("head_overrun", "gear_force", "friction_loss"),
        *(f"force_{joint}" for joint in ("A0", "A", "B0", "B1", "B2", "C0", "C", "D")),
    }


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("stroke-dwell", "With stroke 850 mm and 36 deg of dwell, the least peak head acceleration is 0.5 m/rad^2."),
        ("dwell", "With stroke 850 mm, the largest dwell on both sides is 36 deg."),
        ("smooth", "With stroke 850 mm and 36 deg of dwell, the least rms head jerk is 0.7 m/rad^3."),
        ("match", "The head travel comes within 1.25 mm rms of the table."),
    ],
)
def test_what_an_optimum_is_worth_in_one_sentence(target, message):
    figures = {
        "stroke": 0.85,
        "dwell": math.radians(36),
        "peak_acceleration": 0.5,
        "rms_jerk": 0.7,
        "match_rms": 0.00125,
    }
    assert JOB.say(SCENE, target, figures) == message
