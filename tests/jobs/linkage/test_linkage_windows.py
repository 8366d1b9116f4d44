"""Windows that measure another coordinate than the output: a straight line with a stroke, against plain NumPy."""

import math

import numpy as np
import pytest
import scipy.optimize
from support.linkage_scenes import changed, four_bar

import loomopt as lo
from loomopt.jobs import registry
from reference.planar_linkages import meeting

GUIDE = {
    "problem": {"name": "straight", "job": "linkage", "title": "straight line with a stroke"},
    "mechanism": {"l1": "40 mm", "l2": "100 mm", "l3": "100 mm", "l4": "80 mm", "p": "200 mm", "h": "160 mm"},
    "parts": {
        "A": {"kind": "pivot"},
        "D": {"kind": "pivot", "x": "l4"},
        "crank": {"kind": "crank", "at": "A", "pin": "B", "length": "l1"},
        "close": {
            "kind": "dyad", "joins": ["B", "D"], "pin": "C", "side": "left", "links": {"rod": "l2", "rocker": "l3"},
        },
        "P": {"kind": "point", "on": "rod", "radius": "p"},
    },
    "output": {"x": "P"},
    "events": {"start": {"angle": "90 deg"}, "left": {"extreme": "min"}, "right": {"extreme": "max"}},
    "windows": {"line": {"after": "start", "begins": "0 deg", "ends": "180 deg", "y": "P", "value": "h"}},
    "bounds": {
        "l1": {"min": "20 mm", "max": "50 mm"},
        "l2": {"min": "60 mm", "max": "150 mm"},
        "l3": {"min": "60 mm", "max": "150 mm"},
        "p": {"min": "100 mm", "max": "250 mm"},
        "h": {"min": "100 mm", "max": "200 mm"},
    },
    "limits": {"swing": {"min": "180 mm"}},
    "targets": {"straight": {"least": ["travel.line"]}},
}  # fmt: skip
NAMES, L4 = ("l1", "l2", "l3", "p", "h"), 0.08


def point(design, phi):
    """Coupler point at crank angles, rad, as complex numbers."""
    l1, l2, l3, p, _ = design
    B = l1 * np.exp(1j * phi)
    return B + p * (meeting(B, L4, l2, l3, 1) - B) / l2


def deviation(design):
    """Distances from the line, m, over the window."""
    return point(design, np.linspace(np.pi / 2, 3 * np.pi / 2, 2001)).imag - design[-1]


def stroke(design):
    """Largest minus least x, m, each by a parabola through the highest sample."""
    x = point(design, 2 * np.pi * np.arange(4096) / 4096).real
    ends = []
    for values in (x, -x):
        k = int(np.argmax(values))
        low, here, high = values[k - 1], values[k], values[(k + 1) % len(values)]
        ends.append(here - (high - low) ** 2 / (8 * (low - 2 * here + high)))
    return sum(ends)


TODAY = np.array([0.04, 0.1, 0.1, 0.2, 0.16])


def test_the_travel_is_that_of_the_named_coordinate():
    figures = lo.evaluate(lo.scene(GUIDE)).figures
    assert figures["travel.line"] == pytest.approx(np.max(np.abs(deviation(TODAY))), rel=1e-6)
    assert figures["swing"] == pytest.approx(stroke(TODAY), rel=1e-9)


@pytest.mark.parametrize(
    ("window", "read"),
    [
        ({"y": "P", "level": "start"}, lambda p: p.imag - p[0].imag),
        ({"x": "P", "level": "start"}, lambda p: p.real - p[0].real),
        ({"x": "C", "value": "50 mm"}, None),
        ({"angle": "rocker", "value": "20 deg"}, None),
        ({"angle": "rocker", "level": "start"}, None),
    ],
)
def test_every_coordinate_counts_from_an_event_or_a_value(window, read):
    base = changed(
        GUIDE, {"mechanism": {"h": None}, "bounds": {"h": None}, "windows": {"line": {"y": None, "value": None}}}
    )
    scene = lo.scene(changed(base, {"windows": {"line": window}}))
    phi = np.linspace(np.pi / 2, 3 * np.pi / 2, 4001)
    B = 0.04 * np.exp(1j * phi)
    C = meeting(B, L4, 0.1, 0.1, 1)
    if read is not None:
        away = read(point(TODAY, phi))
    elif "x" in window:
        away = C.real - 0.05
    else:
        turned = np.unwrap(np.angle(C - L4))
        away = turned - (math.radians(20) if "value" in window else turned[0])
    assert lo.evaluate(scene).figures["travel.line"] == pytest.approx(np.max(np.abs(away)), rel=1e-6)


@pytest.mark.slow
def test_the_straightest_line_with_a_stroke_is_that_of_slsqp():
    answer = lo.solve(lo.scene(GUIDE))
    assert (answer.status, answer.certificate.passed) == ("optimal", True)

    def excess(x):
        away = deviation(x[:5] / 10)
        return np.concatenate([x[5] / 1e3 - away, x[5] / 1e3 + away])[::10] * 1e3

    rows = [
        {"type": "ineq", "fun": excess},
        {"type": "ineq", "fun": lambda x: (stroke(x[:5] / 10) - 0.18) * 10},
    ]
    start = np.append(TODAY * 10, 1.0)
    optimum = scipy.optimize.minimize(lambda x: x[5], start, constraints=rows, method="SLSQP",
                                    options={"maxiter": 500, "ftol": 1e-13})  # fmt: skip
    assert optimum.success
    assert answer.figures["travel.line"] == pytest.approx(optimum.x[5] / 1e3, rel=1e-3)
    assert answer.figures["swing"] == pytest.approx(0.18, abs=1e-9)
    # The linkage of Hoecken: rocker and rod alike, the point twice as far.
    assert answer.design["l3"] == pytest.approx(answer.design["l2"], rel=1e-6)
    assert answer.design["p"] == pytest.approx(2 * answer.design["l2"], rel=1e-6)


WRONG = {
    "a window needs level or value": {"y": "P"},
    "has one coordinate, not x and y": {"x": "P", "y": "P", "value": "h"},
    "the window has no coordinate": {"value": "160 mm"},
    'unknown joint "Q"': {"y": "Q", "value": "h"},
}


@pytest.mark.parametrize("message", WRONG)
def test_mistakes_are_told(message):
    document = changed(GUIDE, {"windows": {"line": {"y": None, "value": None}}})
    with pytest.raises(lo.BadInput, match=message):
        lo.scene(changed(document, {"windows": {"line": WRONG[message]}}))


def test_the_output_s_own_window_is_as_before():
    window = {"rest": {"after": "rear", "begins": "-30 deg", "ends": "30 deg", "level": "rear"}}
    scene = four_bar(windows=window)
    same = four_bar(windows={"rest": {**window["rest"], "angle": "rocker"}})
    figures = [lo.evaluate(item).figures["travel.rest"] for item in (scene, same)]
    assert figures[0] == pytest.approx(figures[1], rel=1e-14)
    assert registry.of(same).model(same).has_quantity("travel.rest")
