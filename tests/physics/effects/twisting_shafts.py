"""Beat-up machines on a shaft that twists, and what is read of them."""

import functools
import math

import numpy as np

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.model import model
from loomopt.physics.mechanisms import crank_rocker

PLAIN = lo.load("beatup")
OMEGA, J4, M0 = 20 * math.pi, 0.62, 745.0
LENGTHS = crank_rocker.Lengths(0.031, 0.065, 0.155, 0.167)
CENTRES = crank_rocker.dead_centres(FLOAT, LENGTHS)
HALF = math.radians(29.8) / 2
RIGID, SLOPE = -734.9847767302, -3150469.92
"""M3 at front dead centre on a rigid shaft without resistance, and J² ω⁴ ψ''''(β): what a shaft adds, times k."""


def one_percent(k):
    return 0.02 * math.sqrt(k * J4)


def shaft(k, c, resisted=True):
    """Return the packaged scene on a shaft of k, N·m/rad, and c, N·m·s/rad."""
    scene = PLAIN if resisted else PLAIN.without_effect("resistance")
    return scene.set("effects.shaft_torsion", {"stiffness": f"{k!r} N*m/rad", "damping": f"{c!r} N*m*s/rad"})


@functools.cache
def sampler(k, c, resisted=True):
    scene = shaft(k, c, resisted)
    return registry.of(scene).sampler(scene, {})


def twist(result, phi):
    """Return z, rad, at crank angles, rad."""
    return read(result, phi).coordinate()


def read(result, phi):
    pieces, u = result.cycle.located(np.asarray(phi))
    at = result.model.instant(systems.numpy(), result.given, result.node(pieces, u))
    (state,) = result.model.states
    return model.read_at(state, at)
