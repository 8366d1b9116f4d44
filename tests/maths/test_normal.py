"""The normal distribution over arrays, beside the standard library's."""

from statistics import NormalDist

import numpy as np
import pytest

from loomopt.maths import normal

SHARES = [1e-300, 1e-12, 1e-5, 0.01, 0.0749, 0.0751, 0.3, 0.5, 0.7, 0.9249, 0.9251, 0.999, 1 - 1e-9]


def test_the_quantile_is_that_of_one_value():
    result = normal.quantile(np.array(SHARES))
    assert result == pytest.approx([NormalDist().inv_cdf(share) for share in SHARES], rel=1e-15, abs=1e-300)


def test_what_lies_below_the_quantile_is_the_share():
    shares = np.array(SHARES[1:])
    assert normal.shares_below(normal.quantile(shares)) == pytest.approx(shares, rel=1e-12)
    assert normal.below(0.0) == 0.5
