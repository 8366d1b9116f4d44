"""Derivatives of a formula with respect to the crank angle by CasADi's automatic differentiation."""

from collections.abc import Callable, Sequence

import numpy as np

from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.physics.cycle import Floats


def second(
    formula: Callable[[Maths, Number, Sequence[Number]], Number], switches: int
) -> Callable[[Floats, Floats], Floats]:
    """Return the second derivative of formula(maths, phi, switches) with respect to phi.

    What is returned takes angles (n,), rad, and their switches (switches, n), and gives (n,).
    """
    import casadi as ca

    phi, data = ca.SX.sym("phi"), ca.SX.sym("switch", switches)
    slope = ca.gradient(formula(systems.casadi(), phi, ca.vertsplit(data) if switches else []), phi)
    found = ca.Function("second", [phi, data], [ca.gradient(slope, phi)])

    def at(angles: Floats, places: Floats) -> Floats:
        return np.asarray(found(angles[None, :], places.reshape(switches, len(angles))), dtype=np.float64).ravel()

    return at
