"""Warp tension by levels in a motion of segments: T1 with the shed up, T2 with it down, by where the frame is."""

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput

TENSION = {"T1": "124 N", "T2": "83 N"}
DWELL, DOWN, UP = {"angle": "50 deg"}, {"angle": "130 deg", "to": "70 mm"}, {"angle": "130 deg", "to": "0 mm"}


def scene(segments, tension, **mechanism):
    return lo.scene(
        {
            "problem": {"name": "four", "job": "shedding", "title": "four segments"},
            "operation": {"speed": "300 rpm", "N_min": "60 N"},
            "mechanism": {"law": "cycloidal", "K1": "8 N/mm", "X0": "60 mm", **mechanism, **segments},
            "effects": {"weight": {"G": "300 N"}, "warp_tension": tension, "inertia": {"M": "30.6 kg"}},
            "bounds": {"K1": {"min": "0 N/mm", "max": "100 N/mm"}, "X0": {"min": "0 mm", "max": "90 mm"}},
        }
    )


def test_four_segments_have_the_optimum_of_rise_dwell_return_dwell():
    segments = {"segments": [DOWN, DWELL, UP, DWELL]}
    plain = {"travel": "70 mm", "rise": "130 deg", "far_dwell": "50 deg", "return": "130 deg", "near_dwell": "50 deg"}
    result, other = lo.solve(scene(segments, TENSION)), lo.solve(scene({}, TENSION, **plain))
    assert (result.status, other.status) == ("optimal", "optimal")
    assert result.figures["contact_max"] == pytest.approx(other.figures["contact_max"], rel=1e-9)
    for name in ("K1", "X0"):
        assert result.design[name] == pytest.approx(other.design[name], rel=1e-8)


@pytest.mark.parametrize(
    "order", [[DWELL, DOWN, DWELL, UP], [UP, DWELL, DOWN, DWELL], [{**DOWN, "law": "modified_sine"}, DWELL, UP, DWELL]]
)
def test_levels_follow_from_where_the_frame_is(order):
    frame = lo.simulate(scene({"segments": order}, TENSION))
    X, pull = frame["X [m]"].to_numpy(), -frame["warp_tension [N]"].to_numpy()
    share = X / 0.07
    expected = np.where(share < 0.5, 124 * (1 - 2 * share), -83 * (2 * share - 1))
    assert pull == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("segments", "tension", "report"),
    [
        ([DOWN, DWELL, UP, DWELL], {**TENSION, "shape": "step"}, "shape must be linear"),
        (
            [
                {"angle": "90 deg", "to": "70 mm"},
                {"angle": "90 deg", "to": "30 mm"},
                {"angle": "180 deg", "to": "0 mm"},
            ],
            TENSION,
            "one move from the lowest",
        ),
    ],
)
def test_what_levels_do_not_tell_is_refused(segments, tension, report):
    with pytest.raises(BadInput, match=report):
        scene({"segments": segments}, tension)
