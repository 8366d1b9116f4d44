"""Numbers of any system compared bit by bit."""

import flint
import numpy as np

from loomopt.maths import systems
from loomopt.maths.jets import Jet


def bits(value):
    """Return a number of any system as something that is equal where every bit is."""
    if isinstance(value, Jet):
        return bits(value.v), bits(value.g), None if value.h is None else bits(value.h)
    if isinstance(value, flint.arb):
        return str(value.mid().man_exp()), str(value.rad().man_exp())
    if isinstance(value, flint.arb_series):
        return [bits(value[k]) for k in range(systems.ORDER)]
    if isinstance(value, np.ndarray | float | int):
        return np.asarray(value, dtype=np.float64).tobytes()
    return value._mpf_
