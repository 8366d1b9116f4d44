"""The normal distribution over arrays: its quantile, and how much of it lies below a value."""

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MIDDLE, FAR = 0.425, 5.0
"""|p - 1/2| up to which the first fraction holds, and sqrt(-log p) up to which the second does."""
SHIFTS = 0.180625, 1.6, 5.0
CENTRAL = (
    (
        *(3.3871328727963666080, 1.3314166789178437745e2, 1.9715909503065514427e3, 1.3731693765509461125e4),
        *(4.5921953931549871457e4, 6.7265770927008700853e4, 3.3430575583588128105e4, 2.5090809287301226727e3),
    ),
    (
        *(1.0, 4.2313330701600911252e1, 6.8718700749205790830e2, 5.3941960214247511077e3),
        *(2.1213794301586595867e4, 3.9307895800092710610e4, 2.8729085735721942674e4, 5.2264952788528545610e3),
    ),
)
NEAR = (
    (
        *(1.42343711074968357734, 4.63033784615654529590, 5.76949722146069140550, 3.64784832476320460504),
        *(1.27045825245236838258, 2.41780725177450611770e-1, 2.27238449892691845833e-2, 7.74545014278341407640e-4),
    ),
    (
        *(1.0, 2.05319162663775882187, 1.67638483018380384940, 6.89767334985100004550e-1),
        *(1.48103976427480074590e-1, 1.51986665636164571966e-2, 5.47593808499534494600e-4, 1.05075007164441684324e-9),
    ),
)
TAIL = (
    (
        *(6.65790464350110377720, 5.46378491116411436990, 1.78482653991729133580, 2.96560571828504891230e-1),
        *(2.65321895265761230930e-2, 1.24266094738807843860e-3, 2.71155556874348757815e-5, 2.01033439929228813265e-7),
    ),
    (
        *(1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1, 1.48753612908506148525e-2),
        *(7.86869131145613259100e-4, 1.84631831751005468180e-5, 1.42151175831644588870e-7, 2.04426310338993978564e-15),
    ),
)
"""Numerator and denominator of each fraction, lowest power first [Wichura, Algorithm AS 241: PPND16, Applied Statistics
37 (1988)]: right to 1e-16."""


def quantile(p: Floats) -> Floats:
    """Value below which a share p of the standard normal distribution lies; p: in (0, 1)."""
    centred = p - 0.5
    apart = np.sqrt(-np.log(np.minimum(p, 1.0 - p)))
    inner = _fraction(CENTRAL, SHIFTS[0] - centred**2)
    outer = np.where(apart <= FAR, _fraction(NEAR, apart - SHIFTS[1]), _fraction(TAIL, apart - SHIFTS[2]))
    return np.asarray(np.where(np.abs(centred) <= MIDDLE, centred * inner, np.sign(centred) * outer))


def _fraction(powers: tuple[tuple[float, ...], tuple[float, ...]], x: Floats) -> Floats:
    above, below = (np.polynomial.polynomial.polyval(x, np.array(coefficients)) for coefficients in powers)
    return np.asarray(above / below)


def below(value: float) -> float:
    """Share of the standard normal distribution that lies below a value."""
    return 0.5 * math.erfc(-value / math.sqrt(2))


def shares_below(values: Floats) -> Floats:
    """Shares of the standard normal distribution that lie below values."""
    return np.array([below(float(value)) for value in values.ravel()]).reshape(values.shape)
