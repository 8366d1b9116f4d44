"""An output that should be a function of the crank angle: what it misses is least, as least squares have it."""

import math

import numpy as np
import pytest
from scipy.optimize import least_squares
from support.linkage_scenes import changed, four_bar

import loomopt as lo

PHI = np.radians(np.linspace(20.0, 140.0, 13))
LENGTHS = {"l1": 0.033, "l2": 0.074, "l3": 0.149, "l4": 0.16}
SQUARES = {
    "bounds": {"mass": None, "l4": None},
    "limits": {"swing": None, "sweep": None, "mu": {"beat": {"min": "40 deg"}}},
    "targets": {"balance": None, "torque": None, "match": {"match": "function.csv"}},
}


def rocker(l1, l2, l3, l4, phi):
    """Angle of the rocker by the law of cosines."""
    B = l1 * np.exp(1j * phi)
    d = abs(B - l4)
    return math.pi - np.arctan2(B.imag, l4 - B.real) - np.arccos((l3**2 + d**2 - l2**2) / (2 * l3 * d))


def scene_of(tmp_path, values, **changes):
    """The four-bar, whose output counts clockwise, with a table of the rocker's angles."""
    lines = [f"{math.degrees(a)!r},{math.degrees(q)!r}" for a, q in zip(PHI, -values, strict=True)]
    (tmp_path / "function.csv").write_text("\n".join(["phi [deg],q [deg]", *lines]), encoding="utf-8")
    document = changed(four_bar().document, changed(SQUARES, changes))
    document["targets"]["match"]["match"] = str(tmp_path / "function.csv")
    return lo.scene(document)


def test_a_function_that_a_four_bar_has_is_met(tmp_path):
    scene = scene_of(tmp_path, rocker(**LENGTHS, phi=PHI), mechanism={"l4": "160 mm"})
    answer = lo.solve(scene)
    assert answer.status == "optimal"
    assert answer.figures["match_rms"] == pytest.approx(0.0, abs=1e-9)
    for name, length in LENGTHS.items():
        assert answer.design[name] == pytest.approx(length, rel=1e-6)


def test_a_function_that_it_does_not_have_is_missed_least(tmp_path):
    wanted = math.radians(120) + math.radians(20) * ((PHI - PHI[0]) / (PHI[-1] - PHI[0])) ** 2
    answer = lo.solve(scene_of(tmp_path, wanted))
    assert answer.status == "optimal"
    bounds = [(0.03, 0.035), (0.06, 0.085), (0.14, 0.17)]
    low, high = np.transpose(bounds)

    def missed(lengths):
        l1, l2, l3 = lengths
        return rocker(l1, l2, l3, 0.167, PHI) - wanted

    best = min(
        (
            least_squares(missed, low + share * (high - low), bounds=(low, high), xtol=1e-14, ftol=1e-14).cost
            for share in (0.2, 0.5, 0.8)
        ),
    )
    rms = math.sqrt(2 * best / len(PHI))
    # The limit on the transmission angle does not bind here.
    assert answer.figures["mu.beat"] > math.radians(40.1)
    assert answer.figures["match_rms"] == pytest.approx(rms, rel=1e-6)


SERVO = {
    "mechanism": {"l1": "80 mm", "l2": "90 mm", "l3": "60 mm", "l4": "100 mm"},
    "parts": {
        "crank": None,
        "servo": {
            "kind": "cam",
            "at": "A",
            "pin": "B",
            "length": "l1",
            "start": "60 deg",
            "law": "polynomial_345",
            "lift": "50 deg",
            "begins": "0 deg",
            "rise": "150 deg",
            "far_dwell": "30 deg",
            "return": "150 deg",
        },
    },
    "output": {"sense": "counter-clockwise"},
    "events": {"front": {"near": None}, "rear": {"near": None}},
    "effects": {"resistance": None, "counterweight": None},
    "bounds": dict.fromkeys(("l1", "l2", "l3", "l4", "mass")),
    "limits": None,
    "targets": {"balance": None},
}


def test_an_input_that_rocks_is_a_cam_part():
    scene = lo.scene(changed(four_bar().document, SERVO))
    swing = lo.evaluate(scene).figures["swing"]
    ends = rocker(0.08, 0.09, 0.06, 0.1, np.radians([60.0, 110.0]))
    assert swing == pytest.approx(abs(ends[1] - ends[0]), rel=1e-12)


def test_a_parallelogram_is_a_gear_of_ratio_one():
    parts = {"beat": {"kind": "gear", "at": "D", "with": "crank", "ratio": 1, "pin": "C", "length": "l1"}}
    changes = {
        "mechanism": {"l2": None, "l3": None},
        "parts": {"beat": None} | {"rocker": parts["beat"]},
        "output": {"angle": None, "sense": None, "y": "C"},
        "events": {"front": {"near": None}, "rear": {"near": None}},
        "effects": {"inertia": {"J": None, "mass": "1 kg"}, "resistance": None, "counterweight": None},
        "bounds": None,
        "limits": None,
        "targets": {"balance": None},
    }
    figures = lo.evaluate(lo.scene(changed(four_bar().document, changes))).figures
    assert figures["swing"] == pytest.approx(2 * 0.031, rel=1e-12)
    assert figures["peak_velocity"] == pytest.approx(0.031, rel=1e-12)
