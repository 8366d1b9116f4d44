"""What computes meets designs that do not close: NumPy warns of none of them, whatever Python does with warnings."""

import warnings

import numpy as np
import pytest

from loomopt.maths import systems
from loomopt.model.session import working
from loomopt.physics.mechanisms import dyad
from loomopt.physics.mechanisms.dyad import Vector


def test_a_dyad_that_does_not_close_has_no_finite_rates_and_warns_of_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(RuntimeWarning):
            _rates()
        with working():
            assert not np.isfinite(_rates()).any()


def _rates():
    """Return the angular rates of two links of 1 m and 2 m that reach just as far as their pins are apart."""
    base, change = (Vector(np.array([x]), np.array([y])) for x, y in ((3.0, 0.0), (1.0, 1.0)))
    return np.array(dyad.rates(dyad.close(systems.numpy(), base, 1.0, 2.0, 1.0), change))
