"""Numbers that are only rounding beside the largest of their unit are shown as 0, and no others."""

import math

import pytest

from loomopt.interface.rounding import Rounding
from loomopt.physics.tolerances import SHOWN_AS_ZERO


def test_numbers_are_compared_with_the_largest_of_their_own_unit():
    rounding = Rounding([("N", -100.0), ("N", None), ("mm", 1e-9)])
    assert rounding.shown("N", 100 * SHOWN_AS_ZERO) == rounding.shown("N", -99 * SHOWN_AS_ZERO) == 0.0
    assert rounding.shown("N", -101 * SHOWN_AS_ZERO) == pytest.approx(-101 * SHOWN_AS_ZERO)
    assert rounding.shown("mm", 1e-9) == 1e-9
    assert rounding.shown("kg", 1e-20) == 1e-20, "nothing else has its unit"


def test_no_number_stays_none_and_an_undefined_one_undefined():
    rounding = Rounding([("N", 1.0), ("N", math.nan)])
    assert rounding.shown("N", None) is None
    assert math.isnan(rounding.shown("N", math.nan))
