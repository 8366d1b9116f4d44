"""Derivatives with respect to the crank angle by automatic differentiation."""

import numpy as np
import pytest

from loomopt.solving.nlp import expressions


def test_second_derivatives_of_a_formula_with_and_without_switches():
    angles = np.linspace(0.1, 6.0, 7)
    plain = expressions.second_derivative(lambda maths, phi, switch: maths.sin(2 * phi), 0)
    assert plain(angles, np.zeros((0, 7))) == pytest.approx(-4 * np.sin(2 * angles), rel=1e-13)
    switched = expressions.second_derivative(
        lambda maths, phi, switch: switch[0] * maths.cos(phi) + switch[1] * phi**2, 2
    )
    switches = np.array([np.arange(7.0), np.arange(7.0)[::-1]])
    expected = -switches[0] * np.cos(angles) + 2 * switches[1]
    assert switched(angles, switches) == pytest.approx(expected, rel=1e-13)
