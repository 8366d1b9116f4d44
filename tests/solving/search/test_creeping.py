"""An exchange that creeps along a flat direction, where two extremes share the least, ends in a certificate.

The scene is the first that benchmarks/adversarial/attack_linkage.py draws: a six-bar with a slide. Its peak velocities
forward and back are equal at the optimum and move with the design.
"""

from dataclasses import replace

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.solving.nlp.point import Settings
from loomopt.solving.search.search import Search, certify_best, solve_from

SCENE = {
    "problem": {"name": "creeps", "job": "linkage", "title": "A six-bar with a slide", "source": "drawn at random"},
    "operation": {"speed": "285.2 rpm"},
    "mechanism": {
        "l1": "215.053 mm",
        "l2": "593.56 mm",
        "l3": "719.877 mm",
        "l4": "823.713 mm",
        "e": "566.82 mm",
        "eps": "74.099 deg",
        "st": "852.042 mm",
        "Gx": "859.281 mm",
        "Gy": "400.257 mm",
    },
    "parts": {
        "A": {"kind": "pivot"},
        "D": {"kind": "pivot", "x": "l4"},
        "crank": {"kind": "crank", "at": "A", "pin": "B", "length": "l1"},
        "drive": {
            "kind": "dyad",
            "joins": ["B", "D"],
            "pin": "C",
            "side": "left",
            "links": {"rod": "l2", "rocker": "l3"},
        },
        "E": {"kind": "point", "on": "rocker", "radius": "e", "angle": "eps"},
        "G": {"kind": "pivot", "x": "Gx", "y": "Gy"},
        "ram": {
            "kind": "slider",
            "from": "E",
            "through": "G",
            "direction": "22.65 deg",
            "pin": "P",
            "side": "behind",
            "links": {"strut": "st"},
        },
    },
    "output": {"slide": "ram"},
    "events": {"front": {"extreme": "max"}, "rear": {"extreme": "min"}},
    "effects": {"inertia": {"mass": "2.0 kg"}},
    "bounds": {
        "l1": {"min": "119.624 mm", "max": "310.482 mm"},
        "l2": {"min": "330.17 mm", "max": "856.95 mm"},
        "l3": {"min": "400.435 mm", "max": "1039.319 mm"},
        "e": {"min": "315.296 mm", "max": "818.344 mm"},
        "eps": {"min": "61.387 deg", "max": "86.811 deg"},
        "st": {"min": "473.952 mm", "max": "1230.132 mm"},
        "Gx": {"min": "749.625 mm", "max": "968.937 mm"},
        "Gy": {"min": "290.601 mm", "max": "509.913 mm"},
    },
    "limits": {"swing": {"min": "190.346 mm"}, "mu": {"drive": {"min": "44.903 deg"}, "ram": {"min": "36.571 deg"}}},
    "targets": {"t": {"least": ["peak_velocity", "peak_torque"]}},
}

NEAR = {
    "l1": 0.119624,
    "l2": 0.5384278617130859,
    "l3": 0.6332717764071197,
    "l4": 0.823713,
    "e": 0.36166356027679525,
    "eps": 1.5151377769487975,
    "st": 0.8747984744010412,
    "Gx": 0.749625,
    "Gy": 0.509913,
}


@pytest.mark.slow
@pytest.mark.parametrize("levels", [1, 2])
def test_equal_peaks_that_move_along_a_flat_direction_end_in_a_certificate(levels):
    scene = lo.scene(SCENE)
    job = registry.of_target(scene, "t")
    program = job.program(scene, "t")
    program = replace(program, objectives=program.objectives[:levels])
    start = job.values(program, {**job.today(scene), **NEAR})
    search = certify_best(solve_from(Search(job, program, Settings(), job.start(program, scene)), start))
    assert search.passed, search.best.certificate.reasons
    assert search.best.x["l2"] == pytest.approx(0.5382228, abs=1e-7)
    assert search.best.x["l3"] == pytest.approx(0.6334228, abs=1e-7)


@pytest.mark.slow
def test_the_whole_search_ends_in_the_same_certificate():
    """The certificate's steps lead along the flat direction, over which peak_torque rises by 1e-4 of its size."""
    answer = lo.solve(lo.scene(SCENE), "t")
    assert answer.status == "optimal", answer.message
    assert answer.design["l2"] == pytest.approx(0.5382228, abs=1e-7)
    assert answer.design["l3"] == pytest.approx(0.6334228, abs=1e-7)
