"""What a certificate makes of its residuals."""

import pytest

from loomopt.physics.tolerances import ROUNDED
from loomopt.solving.certificate.records import Certificate, Level


def certificate(*levels, feasibility=0.0, violation=0.0, **more):
    return Certificate(True, (), levels, feasibility, violation, True, True, **more)


FIRST, SECOND = Level("f", 3e-9, 1e-9, 0.0), Level("g", 2e-9, 4e-9, 0.0)


def test_the_residual_is_the_largest_of_all_levels():
    assert certificate().residual == 0.0
    assert certificate(FIRST).residual == 3e-9
    assert certificate(FIRST, SECOND).residual == 4e-9


@pytest.mark.parametrize(
    ("given", "error"),
    [
        ({}, ROUNDED),
        ({"feasibility": 5e-9}, 5e-9),
        ({"violation": 6e-9}, 6e-9),
        ({"step": 7e-9}, 7e-9),
        ({"step": 1e-16}, ROUNDED),
    ],
)
def test_the_error_is_the_largest_of_what_is_amiss(given, error):
    assert certificate(**given).error == error


def test_a_price_where_nothing_touches_is_an_error_and_a_slope_is_told_by_its_step():
    assert certificate(FIRST, SECOND).error == 4e-9
    assert certificate(FIRST).error == 1e-9


def test_a_level_without_limits_has_no_price():
    assert (FIRST.price, FIRST.dearest, certificate().step, certificate().correction) == (0.0, "", 0.0, {})
