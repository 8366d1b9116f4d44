"""Heald frames that leave their cam, and what is read of them."""

import math

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.physics.effects.shedding import separation
from reference.flight import Frame

RPM = math.pi / 30
ON = lo.load("shedding").with_effect("separation")
JOB = registry.of(ON)
SLOW = ON.set("operation.speed", "200 rpm")
SOFT = ON.set("mechanism.K1", f"{0.99 * 102602.60942536!r} N/m")
RUBBED = ON.with_effect("damping", "dry_friction")
NINETY = ON.without_effect("warp_tension").update(
    {f"mechanism.{name}": "90 deg" for name in ("rise", "far_dwell", "return", "near_dwell")}
    | {"mechanism.travel": "25 mm", "mechanism.X0": "20 mm", "mechanism.K1": "2000 N/m"}
    | {"effects.inertia.M": "2 kg", "effects.weight.G": "-19.62 N", "operation.speed": "50 rad/s"}
)
CASES = {
    "600 rpm": (
        *(ON, Frame(8029.14, 600 * RPM)),
        *(60.74441435101576, 673.8162536419274, -4.01240016315543, 0.222655772147891),
    ),
    "200 rpm": (
        *(SLOW, Frame(8029.14, 200 * RPM)),
        *(67.92751992316671, 169.0086902775047, -0.779129073974828, 0.0120862999388265),
    ),
    "1 % soft": (
        *(SOFT, Frame(0.99 * 102602.60942536, 600 * RPM)),
        *(85.53624055245309, 96.91121606497789, -0.0158642530816492, 5.29449204093515e-6),
    ),
    "90 deg": (
        *(NINETY, Frame(2000, 50.0, 2.0, 0.02, 0.025, -19.62, 0.0, 0.0, segments=(90,) * 4)),
        *(49.06405154719958, 179.2830015853239, -1.18894028027568, 0.0116558941868837),
    ),
}
"""Scene, its numbers, lift-off and landing, deg, relative speed, m/s, and gap, m."""
every = pytest.mark.parametrize("case", CASES)


def followed(scene, design=None):
    """Return the course of a design."""
    return JOB.parted(scene, JOB.sampler(scene, design or {})).course


def figures(scene):
    second_figures = lo.evaluate(scene).figures
    return {figure.name: second_figures[figure.name] for figure in separation.EFFECT.figures}
