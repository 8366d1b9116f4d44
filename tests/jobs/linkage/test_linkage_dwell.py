"""Windows between events: how long the output stays near its rear, by travels from a minimum; events of other links."""

import functools
import math

import numpy as np
import pytest
from support.linkage_scenes import changed, four_bar

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.linkage.model import linkage_of
from loomopt.maths.systems import FLOAT

BAND = math.radians(1)
EVENTS = {"settle": {"travel": "1 deg", "before": "rear"}, "leave": {"travel": "1 deg", "after": "rear"}}
STILL = {"events": EVENTS, "windows": {"still": {"after": "settle", "until": "leave", "level": "rear"}}}
SIX = lo.load("sixbar-sley")


def resting(scene, **changes):
    return lo.scene(changed(changed(scene.document, STILL), changes))


@functools.cache
def four():
    rest = {"least": ["moment.front"], "most": ["length.still"]}
    return resting(four_bar(), targets={"rest": rest})


def within(scene, design, count=40001):
    """Crank angle over which the output is within the band of its least, rad, by samples."""
    sampler = registry.find("linkage").sampler(scene, design)
    phi = np.linspace(0.0, 2 * math.pi, count)[:-1]
    q = np.asarray(sampler.at("q", *sampler.cycle.located(phi)))
    return 2 * math.pi * np.mean(q <= np.min(q) + BAND)


@pytest.mark.parametrize("scene", [four(), resting(SIX)], ids=["four-bar", "six-bar"])
def test_a_window_ends_where_the_output_leaves_the_band(scene):
    figures = lo.evaluate(scene).figures
    assert figures["length.still"] == pytest.approx(within(scene, {}), abs=4e-4)
    assert figures["travel.still"] == pytest.approx(BAND, rel=1e-9)
    turned = figures["angle.leave"] - figures["angle.settle"]
    assert figures["length.still"] == pytest.approx(turned % (2 * math.pi), abs=1e-12)


def test_the_longest_rest_of_a_balanced_four_bar():
    answer = lo.solve(four(), "rest")
    assert answer.status == "optimal"
    assert answer.figures["moment.front"] == pytest.approx(0.0, abs=1e-6)
    assert answer.figures["length.still"] == pytest.approx(within(four(), answer.design), abs=4e-4)
    assert math.degrees(answer.figures["length.still"]) > 66
    assert lo.solve(four(), "balance").figures["length.still"] < answer.figures["length.still"]


def test_an_event_may_be_an_extreme_of_another_link():
    scene = resting(SIX, events={"turn": {"extreme": "max", "near": "215 deg", "of": "rocker"}})
    angle = lo.evaluate(scene).figures["angle.turn"]
    sampler = registry.find("linkage").sampler(scene, {})
    for step in (-1e-4, 1e-4):
        place, neighbour = (
            linkage_of(sampler.model).at(FLOAT, sampler.given, phi).joints.vector("rocker")
            for phi in (angle, angle + step)
        )
        turned = math.atan2(
            place.x * neighbour.y - place.y * neighbour.x, place.x * neighbour.x + place.y * neighbour.y
        )
        assert -1e-7 < turned < 0.0


@pytest.mark.parametrize(
    ("changes", "key", "problem"),
    [
        ({"windows": {"still": {"begins": "10 deg"}}}, "windows.still", "the event until"),
        ({"windows": {"still": {"until": None}}}, "windows.still", "the event until"),
        ({"windows": {"still": {"until": "nowhere"}}}, "windows.still.until", "nowhere"),
        ({"events": {"turn": {"extreme": "max", "of": "rocker"}}}, "events.turn.of", "near which it is"),
        ({"events": {"turn": {"extreme": "max", "near": "9 deg", "of": "wheel"}}}, "events.turn.of", "wheel"),
        ({"events": {"turn": {"extreme": "max", "near": "350 deg", "of": "rocker"}}}, "events.turn.near", "rocker has"),
        ({"events": {"late": {"travel": "1 deg", "after": "leave"}}}, "events.late.after", "an extreme of the output"),
    ],
)
def test_windows_and_events_that_mean_nothing_are_refused_in_one_line(changes, key, problem):
    with pytest.raises(lo.BadInput) as caught:
        resting(SIX, **changes)
    assert key in str(caught.value)
    assert problem in str(caught.value)
    assert "\n" not in str(caught.value)


def plain_six(speed):
    """The six-bar with the loads of the four-bar alone, and no limits but swing and transmission angles."""
    effects = dict.fromkeys(("mass", "gravity"))
    changes = {
        "operation": {"speed": speed},
        "mechanism": {"end": None},
        "bounds": {"end": None},
        "limits": {"peak_torque": None, "travel": None},
        "effects": effects,
        "available": None,
        "windows": {"rest": None},
        "targets": dict.fromkeys(("pulse", "retrofit", "torque", "rms", "smooth", "dwell")),
    }
    return resting(SIX, **changes)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("drive", "speed", "rest", "peak", "left"),
    [
        ("four", "600 rpm", 59.4805, 88.6894, 0.0),
        ("four", "400 rpm", 67.0180, 54.3709, 357.665),
        ("six", "400 rpm", 140.214, 131.551, 0.0),
        ("six", "600 rpm", 68.9256, 141.886, -88.3744),
    ],
)
def test_the_table_of_drives(drive, speed, rest, peak, left):
    scene = lo.scene(changed(four().document, {"operation": {"speed": speed}})) if drive == "four" else plain_six(speed)
    answer = lo.solve(scene, "balance")
    assert answer.status == "optimal"
    assert math.degrees(answer.figures["length.still"]) == pytest.approx(rest, abs=1e-3)
    assert answer.figures["peak_torque"] == pytest.approx(peak, rel=1e-5)
    assert answer.figures["moment.front"] == pytest.approx(left, rel=1e-5, abs=1e-5)
