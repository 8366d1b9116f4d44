"""Optima of the packaged linkages: found by another solver and another formulation, and the same however described."""

import functools
import math

import numpy as np
import pytest
import scipy.optimize
from support.linkage_scenes import changed, four_bar

import loomopt as lo
from loomopt.jobs import registry

SIX = lo.load("sixbar-sley")
PLAIN = {
    "windows": None,
    "mechanism": {"end": None},
    "bounds": {"end": None},
    "limits": {"travel": None},
    "targets": {"dwell": None},
}
"""The six-bar without its rest."""


def six(**changes):
    return registry.scene(changed(changed(SIX.document, PLAIN), changes))


@functools.cache
def solved(target="", **changes):
    return lo.solve(six(**{name: dict(change) for name, change in changes.items()}), target or None)


@pytest.mark.slow
def test_the_sley_is_balanced_without_its_rest():
    solution = solved()
    assert solution.status == "optimal"
    assert solution.figures["peak_torque"] == pytest.approx(156.9927548, rel=1e-9)
    assert abs(solution.figures["moment.front"]) <= 1e-7


@pytest.mark.slow
@pytest.mark.parametrize(
    ("target", "figure", "value"),
    [("torque", "peak_torque", 85.95624778), ("smooth", "peak_acceleration", 0.3712768937)],
)
def test_what_else_is_sought_of_it(target, figure, value):
    solution = solved(target)
    assert solution.status == "optimal"
    assert solution.figures[figure] == pytest.approx(value, rel=1e-9)


@pytest.mark.slow
def test_joints_keep_out_of_a_box():
    answer = lo.solve(six(limits={"x_max": {"E": {"max": "265 mm"}}, "y_min": {"F": {"min": "270 mm"}}}))
    assert answer.figures["peak_torque"] == pytest.approx(157.244860, abs=1e-6)
    assert answer.figures["x_max.E"] == pytest.approx(0.265, abs=1e-9)
    assert answer.figures["y_min.F"] >= 0.27 - 1e-9


@pytest.mark.slow
def test_the_least_torque_with_a_rest_and_the_longest_rest():
    answer = lo.solve(SIX)
    assert answer.figures["peak_torque"] == pytest.approx(168.0868528, rel=1e-9)
    assert answer.figures["travel.rest"] == pytest.approx(math.radians(0.25), rel=1e-9)
    longest = lo.solve(SIX, "dwell")
    assert math.degrees(longest.design["end"]) == pytest.approx(256.8786297, abs=1e-7)
    freed = lo.solve(SIX.free(["end"]), "dwell")
    assert freed.design["end"] == pytest.approx(longest.design["end"], abs=1e-10)


@pytest.mark.slow
def test_a_press_needs_the_least_torque():
    answer = lo.solve(lo.load("knuckle-press"))
    assert answer.status == "optimal"
    assert answer.figures["peak_torque"] == pytest.approx(6721.970155, rel=1e-9)


def test_a_point_follows_its_path_as_least_squares_have_it():
    scene = lo.load("path-18")
    answer = lo.solve(scene)
    square = 18 * answer.figures["path_rms"] ** 2
    assert square == pytest.approx(0.009028884631, rel=1e-9)
    names = list(scene.mechanism)
    path = np.loadtxt(scene.paths.folder / "path-18.csv", delimiter=",", skiprows=1)

    def missed(x):
        """Return the distances by plain complex numbers: circles that meet, by the law of cosines."""
        v = dict(zip(names, x, strict=True))
        A, D = v["Ax"] + 1j * v["Ay"], v["Dx"] + 1j * v["Dy"]
        B = A + v["l2"] * np.exp(1j * (np.radians(path[:, 0]) + v["start"]))
        d = abs(D - B)
        turned = np.arccos((v["l3"] ** 2 + d**2 - v["l4"] ** 2) / (2 * v["l3"] * d))
        P = B + (v["along"] + 1j * v["across"]) * (D - B) / d * np.exp(1j * turned)
        away = P - (path[:, 1] + 1j * path[:, 2])
        return np.concatenate([away.real, away.imag])

    start = [answer.design[name] * 1.003 for name in names]
    other = scipy.optimize.least_squares(missed, start, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert 2 * other.cost == pytest.approx(square, rel=1e-9)


# The same optimum however the linkage is described.

TURNED = math.radians(25)


def turned(x, y):
    """Return a point of the frame turned."""
    c, s = math.cos(TURNED), math.sin(TURNED)
    return c * x - s * y, s * x + c * y


def least(scene, target="torque"):
    answer = lo.solve(scene, target)
    assert answer.status == "optimal"
    return answer.figures["peak_torque"]


@functools.cache
def reference():
    return least(four_bar())


@pytest.mark.slow
def test_parts_may_stand_in_any_order():
    parts = dict(reversed(four_bar().document["parts"].items()))
    scene = registry.scene({**four_bar().document, "parts": parts})
    assert list(scene.document["parts"]) == list(parts)
    assert least(scene) == pytest.approx(reference(), rel=1e-12)


@pytest.mark.slow
def test_a_mirrored_linkage_turns_the_other_way():
    parts = {"crank": {"ratio": -1}, "beat": {"side": "right"}}
    assert least(four_bar(parts=parts, output={"sense": "counter-clockwise"})) == pytest.approx(reference(), rel=1e-12)


@pytest.mark.slow
def test_a_turned_linkage_has_the_same_optimum():
    fixed = {"bounds": {"l4": None}, "mechanism": {"l4": None}}
    plain = four_bar(**fixed, parts={"D": {"x": "167 mm"}})
    x, y = turned(167, 0)
    moved = {
        "A": {"x": "3 mm", "y": "-7 mm"},
        "crank": {"start": "25 deg"},
        "D": {"x": f"{x + 3!r} mm", "y": f"{y - 7!r} mm"},
    }
    assert least(four_bar(**fixed, parts=moved, output={"zero": "180 deg"})) == pytest.approx(least(plain), rel=1e-11)


def in_other_units(document, length, torque, inertia, force=(1.0, "kN")):
    """Return tables with lengths times a factor in another unit: number and unit of the four kinds."""

    def text(value):
        if isinstance(value, dict):
            return {key: text(item) for key, item in value.items()}
        if not isinstance(value, str):
            return value
        for unit, (factor, other) in {" mm": length, " N*m": torque, " kg*m^2": inertia, " kN": force}.items():
            if value.endswith(unit):
                return f"{float(value.removesuffix(unit)) * factor!r} {other}"
        return value

    return {key: item if key in ("parts", "problem") else text(item) for key, item in document.items()}


@pytest.mark.slow
def test_inches_change_nothing():
    document = in_other_units(four_bar().document, (1 / 25.4, "in"), (1.0, "N*m"), (1.0, "kg*m^2"))
    assert least(registry.scene(document)) == pytest.approx(reference(), rel=1e-12)


def test_a_thousandth_of_the_size_has_the_same_optimum():
    """With loads that go with it: the counterweight's m r² by 1e-6, so all else that is a torque."""
    document = in_other_units(four_bar().document, (1e-3, "mm"), (1e-6, "N*m"), (1e-6, "kg*m^2"))
    assert least(registry.scene(document)) == pytest.approx(1e-6 * reference(), rel=1e-10)


# The same of longer chains: a six-bar, a press with a slider, a shaper with a slot.

FIXED: dict[str, dict] = {
    "bounds": {"Gx": None, "Gy": None},
    "mechanism": {"Gx": None, "Gy": None},
    "parts": {"G": {"x": "379.5 mm", "y": "348.4 mm"}},
}
STOOD: dict[str, dict] = {
    "bounds": {"Ax": None, "Ay": None},
    "mechanism": {"Ax": None, "Ay": None},
    "parts": {"A": {"x": "-458 mm", "y": "-180 mm"}},
}
WEIGHTLESS: dict[str, dict] = {"effects": {"gravity": None}}


def long_chain(name, **changes):
    """Return a packaged scene, the six-bar without its rest, with tables merged into its own."""
    document = lo.load(name).document
    return registry.scene(changed(changed(document, PLAIN) if name == "sixbar-sley" else document, changes))


@functools.cache
def chain_reference(name, without=""):
    changes = {"": {}, "weight": WEIGHTLESS, "G": FIXED, "A": STOOD}
    return once(long_chain(name, **changes[without]))


def once(scene):
    # One start of the press ends in another basin, which one rounding chooses: it is searched.
    answer = lo.solve(scene, "torque", starts=None if "knuckle" in scene.name else 1)
    assert answer.status == "optimal"
    return answer.figures["peak_torque"]


def turned_pivot(x, y):
    u, v = turned(x, y)
    return {"x": f"{u!r} mm", "y": f"{v!r} mm"}


MIRRORED: dict[str, dict[str, dict]] = {
    "sixbar-sley": {
        "parts": {
            "crank": {"ratio": -1},
            "drive": {"side": "right"},
            "E": {"angle": "-epsilon"},
            "G": {"y": "-Gy"},
            "beat": {"side": "right"},
        },
        "output": {"sense": "clockwise"},
        "effects": {"gravity": {"down": "60 deg"}},
    },
    "knuckle-press": {
        "parts": {
            "A": {"x": "-Ax"},
            "shaft": {"ratio": -1, "start": "180 deg"},
            "knuckle": {"side": "left"},
        },
    },
    "shaper": {"parts": {"A": {"y": "-d"}, "G": {"y": "-h"}, "crank": {"ratio": -1}}},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", MIRRORED)
def test_a_longer_chain_may_have_its_parts_in_any_order_and_be_mirrored(name):
    document = long_chain(name).document
    scene = registry.scene({**document, "parts": dict(reversed(document["parts"].items()))})
    assert once(scene) == pytest.approx(chain_reference(name), rel=1e-9)
    assert once(long_chain(name, **MIRRORED[name])) == pytest.approx(chain_reference(name), rel=1e-9)


@pytest.mark.slow
def test_a_turned_six_bar_and_a_turned_press_have_the_same_optimum():
    moved = {
        "crank": {"start": "25 deg"},
        "D": {"x": None} | turned_pivot(166.8, 0),
        "G": turned_pivot(379.5, 348.4),
    }
    scene = changed(long_chain("sixbar-sley", **FIXED).document, {
        "parts": moved, "mechanism": {"l4": None}, "effects": {"gravity": {"down": "-35 deg"}},
    })  # fmt: skip
    assert once(registry.scene(scene)) == pytest.approx(chain_reference("sixbar-sley", "G"), rel=1e-9)
    moved = {
        "A": turned_pivot(-458, -180),
        "shaft": {"start": "25 deg"},
        "ram": {"direction": "-65 deg"},
    }
    scene = changed(long_chain("knuckle-press", **STOOD).document, {
        "parts": moved, "effects": {"gravity": {"down": "-65 deg"}},
    })  # fmt: skip
    assert once(registry.scene(scene)) == pytest.approx(chain_reference("knuckle-press", "A"), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sixbar-sley", "knuckle-press"])
def test_a_longer_chain_in_inches_or_a_thousandth_of_the_size(name):
    inches = in_other_units(long_chain(name).document, (1 / 25.4, "in"), (1.0, "N*m"), (1.0, "kg*m^2"))
    assert once(registry.scene(inches)) == pytest.approx(chain_reference(name), rel=1e-9)
    light = long_chain(name, **WEIGHTLESS).document
    small = in_other_units(light, (1e-3, "mm"), (1e-6, "N*m"), (1e-6, "kg*m^2"), (1e-3, "kN"))
    assert once(registry.scene(small)) == pytest.approx(1e-6 * chain_reference(name, "weight"), rel=1e-9)
