"""The cam exercise of KU Leuven: three moves with dwells between them, a load that comes and goes, two speeds.

Their grid of 1 degree finds 8.505343 and 43.329062 N/mm, with which the roller lifts off between its points. Exact
are 8.508557573 N/mm at 94.57964 deg and 43.385381532 N/mm at 282.55771 deg. The load presses the roller on the cam, as
the preload does, which the weight stands for: K1 X0 would change with K1.
"""

import math

import pytest
from numpy import linspace

import loomopt as lo

SEGMENTS = [
    {"angle": "30 deg"},
    {"angle": "90 deg", "to": "45 mm"},
    {"angle": "40 deg"},
    {"angle": "85 deg", "to": "15 mm"},
    {"angle": "20 deg"},
    {"angle": "65 deg", "to": "0 mm"},
    {"angle": "30 deg"},
]
LOAD = "angle [deg],T [N],corner\n200,0,1\n245,-260,1\n300,-260,1\n330,0,1\n"
CASES = (("120 rpm", 20, 8508.557573, 94.57964, 8505.343), ("240 rpm", 80, 43385.381532, 282.55771, 43329.062))
every = pytest.mark.parametrize(("speed", "preload", "K1", "angle", "grid"), CASES)


def scene(folder, speed, preload, **more):
    """Return the exercise as a scene."""
    path = folder / "load.csv"
    path.write_text(LOAD)
    return lo.scene(
        {
            "problem": {"name": "exercise", "job": "shedding", "title": "Cam exercise"},
            "operation": {"speed": speed},
            "mechanism": {"K1": "5 N/mm", "X0": "0 mm", "segments": SEGMENTS},
            "effects": {
                "inertia": {"M": "20 kg"},
                "weight": {"G": f"-{preload} N"},
                "warp_tension": {"table": str(path)},
            },
            "bounds": {"K1": {"min": "0 N/mm", "max": "100 N/mm"}, "X0": "0 mm"},
            **more,
        }
    )


def force(angle, K1, speed, preload):
    """Return the cam force, N, at a cam angle, deg, in plain words."""
    moves = ((30, 90, 0.0, 0.045), (160, 85, 0.045, 0.015), (265, 65, 0.015, 0.0))
    X, bend = (0.045 if 120 <= angle < 160 else 0.015 if 245 <= angle < 265 else 0.0), 0.0
    for begin, width, low, high in moves:
        if begin <= angle < begin + width:
            u, whole = (angle - begin) / width, math.radians(width)
            X = low + (high - low) * (u - math.sin(2 * math.pi * u) / (2 * math.pi))
            bend = (high - low) * 2 * math.pi * math.sin(2 * math.pi * u) / whole**2
    load = 260 * min(max((angle - 200) / 45, 0.0), 1.0, max((330 - angle) / 30, 0.0))
    return 20 * bend * (speed * math.pi / 30) ** 2 + K1 * X + preload + load


@every
def test_the_least_spring_is_the_exact_one(tmp_path, speed, preload, K1, angle, grid):
    answer = lo.solve(scene(tmp_path, speed, preload), prove=True)
    assert answer.design["K1"] == pytest.approx(K1, rel=1e-10)
    assert math.degrees(answer.figures["contact_angle"]) == pytest.approx(angle, abs=1e-5)
    assert answer.figures["travel"] == pytest.approx(0.045)
    assert answer.certificate.passed


@every
def test_the_answer_of_a_grid_of_one_degree_lifts_off(tmp_path, speed, preload, K1, angle, grid):
    assert lo.evaluate(scene(tmp_path, speed, preload), {"K1": grid, "X0": 0.0}).figures["contact_min"] < -0.05


@every
def test_the_cam_force_is_that_of_plain_formulas_all_round(tmp_path, speed, preload, K1, angle, grid):
    frame = lo.simulate(scene(tmp_path, speed, preload), {"K1": K1, "X0": 0.0})
    turns = float(speed.split()[0])
    for phi, N in zip(frame["phi [rad]"], frame["N [N]"], strict=True):
        degrees = math.degrees(phi)
        if min(abs(degrees - corner) for corner in (30, 120, 160, 245, 265, 330)) > 1e-6:
            assert pytest.approx(force(degrees, K1, turns, preload), abs=1e-9 * 2000) == N


def test_the_published_grid_is_reproduced():
    """What the exercise itself does: the least stiffness at the points of 1 degree alone."""
    for speed, preload, _, _, grid in CASES:
        turns = float(speed.split()[0])
        spring = [force(a, 1.0, turns, preload) - force(a, 0.0, turns, preload) for a in linspace(0, 359, 360)]
        needed = [-force(a, 0.0, turns, preload) / X for a, X in zip(linspace(0, 359, 360), spring, strict=True) if X]
        assert max(needed) == pytest.approx(grid, rel=1e-6)
