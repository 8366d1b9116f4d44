"""Stretch of the tape: the head's overrun, its limit, and where the quasi-static value is inaccurate."""

import math

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.text import scenes
from loomopt.jobs import registry

ON = lo.load("rapier").with_effect("tape_stretch", "head_inertia")
JOB = registry.of(ON)


def test_the_packaged_head_overruns_by_its_inertia_over_the_tapes_stiffness():
    figures = lo.evaluate(ON).figures
    assert figures["head_overrun"] == pytest.approx(0.121473913e-3, rel=1e-8)
    sampler = JOB.sampler(ON, {})
    (bend,) = sampler.at_angle(("peak_acceleration",), figures["phi_stroke"])
    assert figures["head_overrun"] == pytest.approx(-0.35 * bend * (2 * math.pi) ** 2 / 1e5, rel=1e-10)


def test_the_full_equation_of_motion_says_nearly_the_same():
    """m (x¨) + k (x − S) = 0, periodic, by harmonics: x(φ_stroke) − S = 0.1215227 mm."""
    count, w = 4096, 2 * math.pi
    sampler = JOB.sampler(ON, {})
    phi = 2 * math.pi * np.arange(count) / count
    S = np.array([sampler.at_angle(("S",), float(angle))[0] for angle in phi])
    n, bins = np.fft.rfftfreq(count, 1 / count), np.fft.rfft(S)
    stretch = bins * (0.35 * (n * w) ** 2 / (1e5 - 0.35 * (n * w) ** 2)) * (n < 60)
    angle = lo.evaluate(ON).figures["phi_stroke"]
    waves = np.where(n == 0, 1, 2) * stretch / count * np.exp(1j * n * angle)
    assert waves.real.sum() == pytest.approx(0.1215227e-3, rel=1e-6)


def test_it_can_be_limited_and_then_binds():
    free = lo.solve(ON, "dwell", starts=1)
    most = 0.98 * free.figures["head_overrun"]
    answer = lo.solve(ON.set("limits.head_overrun.max", f"{most!r} m"), "dwell", starts=1)
    assert (answer.status, answer.certificate.passed) == ("optimal", True)
    assert answer.figures["head_overrun"] == pytest.approx(most, rel=1e-8)
    assert answer.figures["dwell"] < free.figures["dwell"]
    assert "head_overrun" in {price.limit for price in answer.binding}
    assert lo.evaluate(ON, answer).figures["head_overrun"] == pytest.approx(most, rel=1e-8)


def test_it_needs_the_heads_inertia():
    with pytest.raises(BadInput, match="tape_stretch needs the effect head_inertia"):
        lo.load("rapier").with_effect("tape_stretch")


@pytest.mark.parametrize(("stiffness", "remarked"), [("6000 N/m", False), ("5000 N/m", True)])
def test_a_head_that_swings_too_slowly_is_remarked_upon(stiffness, remarked):
    """sqrt(k/m) = 20 ω at 5526.98 N/m."""
    scene = ON.set("effects.tape_stretch.stiffness", stiffness)
    assert any("a quasi-static value" in text for text in JOB.views.remarks(scene, {})) == remarked


def test_its_equation_is_written():
    report = dict(text.split("\n    ", 1) for text in scenes.equations(ON))
    assert report["tape_stretch"] == "head_overrun = -S''_stroke*head_inertia_mass*omega^2/stiffness"
