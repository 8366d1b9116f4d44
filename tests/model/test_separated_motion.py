"""What an output does on its own: its loads tried one by one, their sum as a body, and what is refused."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model import separation
from loomopt.model.separation import Linear, UnfollowedError, body, forms, sizes
from loomopt.physics.effects.shedding import separation as shedding

RPM = math.pi / 30
SCENE = lo.load("shedding").with_effect("separation", "damping", "dry_friction").set("operation.speed", "300 rpm")
FRAME: Any = SCENE.tables["mechanism"]


def sampler(scene=SCENE, design=None):
    return registry.of(scene).sampler(scene, design or {})


def effect_value(scene, effect, key):
    return getattr(scene.effects[effect], key)


def test_the_sizes_are_those_of_the_cycloidal_law():
    """Stroke h, speed 2 h ω/β, acceleration 2 π h ω²/β² of the shorter stroke [any textbook of cams]."""
    result = sizes(sampler())
    stroke, beta, omega = FRAME.travel, min(SCENE.mechanism["rise"], SCENE.mechanism["return"]), 300 * RPM
    assert result.stroke == pytest.approx(stroke, rel=1e-12)
    assert result.speed == pytest.approx(2 * stroke * omega / beta, rel=1e-4)
    assert result.acceleration == pytest.approx(2 * math.pi * stroke * omega**2 / beta**2, rel=1e-4)


def test_each_load_has_the_form_of_its_law_in_both_zones():
    result = forms(sampler(), shedding.EFFECT)
    k, x0, h = FRAME.K1, FRAME.X0, FRAME.travel
    tension: Any = SCENE.effects["warp_tension"]
    expected = {
        "return_spring": [Linear(0, 0, k, k * x0, 0)] * 2,
        "weight": [Linear(0, 0, 0, -effect_value(SCENE, "weight", "G"), 0)] * 2,
        "inertia": [Linear(effect_value(SCENE, "inertia", "M"), 0, 0, 0, 0)] * 2,
        "damping": [Linear(0, effect_value(SCENE, "damping", "C"), 0, 0, 0)] * 2,
        "dry_friction": [Linear(0, 0, 0, 0, effect_value(SCENE, "dry_friction", "F"))] * 2,
        "warp_tension": [  # −T1 (1 − 2x/h) in the upper half, T2 (2x/h − 1) in the lower one
            Linear(0, 0, 2 * tension.T1 / h, -tension.T1, 0),
            Linear(0, 0, 2 * tension.T2 / h, -tension.T2, 0),
        ],
    }
    assert set(result) == set(expected)
    for name, zones in expected.items():
        for item, other in zip(result[name], zones, strict=True):
            scale = max(map(abs, other))
            assert list(item) == pytest.approx(list(other), rel=1e-9, abs=1e-9 * scale), name


def test_the_body_is_the_sum_of_its_loads_and_goes_on_at_its_corner():
    read = sampler()
    result = body(read, shedding.EFFECT, forms(read, shedding.EFFECT))
    assert result.mass == pytest.approx(effect_value(SCENE, "inertia", "M"), rel=1e-12)
    assert result.damping == pytest.approx(effect_value(SCENE, "damping", "C"), rel=1e-12)
    assert result.friction == pytest.approx(effect_value(SCENE, "dry_friction", "F"), rel=1e-12)
    assert list(result.corners) == pytest.approx([FRAME.travel / 2], rel=1e-12)
    assert result.rest(0, result.corners[0]) == pytest.approx(result.rest(1, result.corners[0]), rel=1e-12)


def test_on_its_cam_the_forms_give_the_force_of_contact():
    """The model's own sum over the whole turn, from the output's motion and the linear forms alone."""
    read = sampler()
    known, at = forms(read, shedding.EFFECT), lo.simulate(SCENE.without_effect("separation"))
    x, v, a = (at[name].to_numpy() for name in ("X [m]", "X_t [m/s]", "X_tt [m/s^2]"))
    moving = np.abs(v) > 1e-6 * np.abs(v).max()
    zone = (x > FRAME.travel / 2).astype(int)
    totals = [
        sum(form[k].at(x[i], v[i], a[i], np.sign(v[i])) for form in known.values())
        for i, k in enumerate(zone)
        if moving[i]
    ]
    assert np.abs(totals - at["N [N]"].to_numpy()[moving]).max() < 1e-8 * at["N [N]"].abs().max()


def turned(term):
    """Return the packaged frame with one of its loads made another: term(pose, own)."""
    read = sampler(lo.load("shedding").with_effect("separation"))

    def force(at):
        return term(at.pose, at.table)

    loads = tuple(dataclasses.replace(e, force=force) if e.name == "inertia" else e for e in read.model.loads)
    return read, next(load for load in loads if load.name == "inertia")


@pytest.mark.parametrize(
    ("term", "why"),
    [
        (lambda pose, values: values["M"] * pose.acceleration**2, "not linear"),
        (lambda pose, values: values["M"] * pose.acceleration + pose.q * pose.velocity, "not linear"),
        (lambda pose, values: values["M"] * pose.acceleration * pose.q1, "reads the mechanism's q1"),
    ],
)
def test_what_is_not_linear_in_the_outputs_own_motion_is_refused_by_name(term, why):
    read, load = turned(term)
    with pytest.raises(UnfollowedError, match=why) as caught:
        separation._form(read, shedding.EFFECT, load, 0.0)
    assert "separation and inertia cannot be on together" in str(caught.value)


def test_an_output_without_mass_does_not_fly():
    read = sampler()
    known = forms(read, shedding.EFFECT)
    none = {name: tuple(form._replace(mass=0.0) for form in zones) for name, zones in known.items()}
    with pytest.raises(UnfollowedError, match="no mass above 0"):
        body(read, shedding.EFFECT, none)


def test_a_stiff_spring_holds_the_frame_and_its_curves_are_those_of_the_cam():
    """With 100 times the spring nothing parts, and the columns are those of a scene without the effect."""
    stiff = SCENE.set("mechanism.K1", f"{100 * FRAME.K1!r} N/m")
    job = registry.of(stiff)
    result = job.parted(stiff, job.sampler(stiff, {}))
    assert not result.course.parted
    assert set(result.figures.values()) == {None}
    with_it, without = lo.simulate(stiff), lo.simulate(stiff.without_effect("separation"))
    assert np.all(with_it["gap [m]"] == 0.0)
    for angle in (0.5, 2.0, 4.0):
        first, other = (np.interp(angle, table["phi [rad]"], table["N [N]"]) for table in (with_it, without))
        assert first == pytest.approx(other, rel=1e-4)
