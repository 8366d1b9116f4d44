"""What of a counterweight's bounds is of use."""

import pytest

from loomopt.jobs.beatup.program import AMPLE, LONG, counterweight_holding, counterweight_room

TODAY = {"m4e": 0.0, "r4e": 0.0, "l4": 0.167}
BUILT = {"m4e": (0.0, 12.4), "r4e": (0.0, 0.08)}


def test_the_reed_that_holds_the_resistance_is_in_proportion_to_todays():
    assert counterweight_holding(0.62, -135.0, 600.0) == pytest.approx(0.62 * 600 / 735, rel=1e-15)
    assert counterweight_holding(0.62, 600.0, 600.0) == 0.0, "a reed that does not turn holds nothing"


def test_bounds_that_can_be_built_stay_as_they_are():
    assert counterweight_room(TODAY, BUILT, 0.62) == BUILT
    assert counterweight_room(TODAY, {**BUILT, "m4e": (0.0, 1e8)}, 0.0) == {**BUILT, "m4e": (0.0, 1e8)}, (
        "nothing to compare with"
    )


@pytest.mark.parametrize("bounds", [{"r4e": (0.0, 100.0)}, {"m4e": (0.0, 1e8)}, {"m4e": (0.0, 1e8), "r4e": (0.0, 1e3)}])
def test_of_generous_bounds_what_is_of_use_is_left(bounds):
    result = counterweight_room(TODAY, {**BUILT, **bounds}, 0.62)
    assert result["m4e"][1] * result["r4e"][1] ** 2 <= AMPLE * 0.62 * (1 + 1e-12)
    assert result["r4e"][1] <= LONG * 0.167
    assert all(0.0 < result[name][1] <= {**BUILT, **bounds}[name][1] for name in result)


def test_todays_own_counterweight_and_least_bounds_are_always_within():
    heavy = {"m4e": 500.0, "r4e": 2.0, "l4": 0.167}
    result = counterweight_room(heavy, {"m4e": (3.0, 1e8), "r4e": (0.1, 100.0)}, 0.62)
    assert result["m4e"] == (3.0, 500.0)
    assert result["r4e"] == (0.1, 2.0)
