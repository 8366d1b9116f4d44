"""Sampling a mechanism whose every value is known: extremes and means of a Scotch yoke against closed forms."""

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from made_up import CLOTH, INERTIA, NUMBERS, SPRING, Yoke

from loomopt.model.model import CycleQuantity, Integral, JobModel
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import TURN

MODEL = JobModel(
    Yoke(),
    (INERTIA, SPRING),
    own_quantities={
        "force": CycleQuantity(lambda at: at.force),
        "torque": CycleQuantity(lambda at: at.crank_torque),
        "pushed": CycleQuantity(lambda at: at.force, signed=True),
        "square": CycleQuantity(lambda at: at.force**2),
    },
    integrals=(Integral("mean", "", "force"), Integral("mean_square", "rms", "square")),
)
WITH_CLOTH = replace(
    MODEL,
    effects=(*MODEL.effects, CLOTH),
    integrals=(Integral("pressing", "", "force", where=("cloth", 1.0)), Integral("whole", "", "force")),
)
MACHINES = {
    "spring and mass": {},
    "slow": {"speed": 1.0},
    "fast": {"speed": 600.0},
    "hardly any spring": {"spring.k": 1e-6},
    "inertia and spring nearly cancel": {"speed": 60.0, "inertia.m": 3000.0 / 60.0**2 * (1 + 1e-7), "spring.p": 0.05},
}
every = pytest.mark.parametrize("changes", MACHINES.values(), ids=list(MACHINES))


def parts(changes):
    """Return a and b of the force a + b cos φ, and r, in 40 digits."""
    v = {name: mpmath.mpf(value) for name, value in {**NUMBERS, **changes}.items()}
    r, k = v["r"], v["spring.k"]
    return k * (r - v["spring.p"]), v["inertia.m"] * r * v["speed"] ** 2 - k * r, r


@every
def test_the_peak_of_a_force_is_at_a_dead_centre(changes):
    a, b, _ = parts(changes)
    sampler = Sampler(MODEL, {**NUMBERS, **changes})
    size = float(abs(a) + abs(NUMBERS["r"] * (NUMBERS | changes)["spring.k"]) + abs(b))
    assert sampler.peak("force") == pytest.approx(float(max(abs(a + b), abs(a - b))), abs=1e-14 * size)
    assert sampler.peak("pushed") == pytest.approx(float(max(a + b, a - b)), abs=1e-14 * size)


@every
def test_every_extreme_of_the_torque_stands_where_its_slope_is_zero(changes):
    """(a + b cos φ) r sin φ is extreme where b cos 2φ + a cos φ = 0."""
    with mpmath.workdps(40):
        a, b, r = parts(changes)
        root = mpmath.sqrt(a * a + 8 * b * b)
        cosines = [c for c in ((-a + root) / (4 * b), (-a - root) / (4 * b)) if abs(c) < 1] if b else [mpmath.mpf(0)]
        angles = [sign * mpmath.acos(c) for c in cosines for sign in (1, -1)]
        exact = {float(phi % (2 * mpmath.pi)): float((a + b * mpmath.cos(phi)) * r * mpmath.sin(phi)) for phi in angles}
    sampler = Sampler(MODEL, {**NUMBERS, **changes})
    largest = max(map(abs, exact.values()))
    results = {
        sampler.angle(extreme): extreme.value
        for extreme in sampler.extremes("torque")
        if abs(extreme.value) > 1e-9 * largest
    }
    assert sorted(results) == pytest.approx(sorted(exact), abs=1e-6)
    assert [results[phi] for phi in sorted(results)] == pytest.approx([exact[phi] for phi in sorted(exact)], rel=1e-12)
    assert sampler.peak("torque") == pytest.approx(largest, rel=1e-12)


@every
def test_means_over_the_turn_are_those_of_harmonics(changes):
    a, b, _ = map(float, parts(changes))
    figures = Sampler(MODEL, {**NUMBERS, **changes}).figures
    size = abs(a) + abs(b) + NUMBERS["r"] * (NUMBERS | changes)["spring.k"]
    assert figures["mean"] == pytest.approx(a, abs=1e-13 * size)
    assert figures["mean_square"] == pytest.approx(
        a * a + b * b / 2, abs=1e-13 * size * (abs(a) + abs(b) + 1e-13 * size)
    )
    assert figures["rms"] == math.sqrt(figures["mean_square"])


@pytest.mark.parametrize("width", [1e-3, 0.9, 3.0])
def test_a_mean_over_pieces_is_the_integral_over_just_these(width):
    """The cloth adds F (met − cos φ)/(1 + met), met = −cos width, from π − width to π."""
    a, b, _ = map(float, parts({}))
    sampler = Sampler(WITH_CLOTH, {**NUMBERS, "cloth.width": width})
    contact, F = -math.cos(width), NUMBERS["cloth.F"]
    exact = mpmath.quad(
        lambda phi: a + b * mpmath.cos(phi) + F * (contact - mpmath.cos(phi)) / (1 + contact),
        [math.pi - width, math.pi],
    )
    assert sampler.figures["pressing"] == pytest.approx(float(exact) / width, rel=1e-9 if width < 0.01 else 1e-12)
    whole = a + F * (contact * width + math.sin(width)) / (1 + contact) / TURN
    assert sampler.figures["whole"] == pytest.approx(whole, rel=1e-9), "pieces count by their widths"


@pytest.mark.parametrize("samples", [90, 360, 5000])
def test_a_grid_holds_whole_turn_and_corners_however_many_samples(samples):
    sampler = Sampler(WITH_CLOTH, NUMBERS)
    pieces, u = sampler.grid(samples)
    angles = sampler.cycle.angles(pieces, u)
    assert np.all(np.diff(angles) >= 0)
    assert angles[-1] - angles[0] == pytest.approx(TURN, rel=1e-15)
    for corner in (math.pi - NUMBERS["cloth.width"], math.pi):
        assert np.abs(np.remainder(angles - corner + 1, TURN) - 1).min() < 1e-12
    assert np.diff(angles).max() <= TURN / samples * (1 + 1e-12)


def test_the_force_of_the_cloth_is_known_on_both_sides_of_where_it_lets_go():
    sampler = Sampler(WITH_CLOTH, NUMBERS)
    a, b, _ = map(float, parts({}))
    last = sampler.cycle.on(("cloth", 1.0)).argmax()
    before = sampler.at("force", np.array([last]), np.array([1.0]))[0]
    after = sampler.at("force", np.array([(last + 1) % sampler.cycle.pieces]), np.array([0.0]))[0]
    assert (before, after) == pytest.approx((a - b + NUMBERS["cloth.F"], a - b), rel=1e-12)
    assert sampler.peak("pushed") >= before > after
