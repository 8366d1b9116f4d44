"""What the hard cases are measured with: 120 digits, the condition of a value, angles by triangles alone.

"n ulp times condition" is |error| ≤ n · 2⁻⁵² · (|f| + Σ|x ∂f/∂x|) over all data x, derivatives by differences in 120
digits. No formula that reads float64 can promise less than n ≈ 1: its data are rounded already.
"""

from fractions import Fraction

import mpmath

EPS = 2.0**-52
MP = mpmath.MPContext()
MP.dps = 120
STEP, TIME_STEP = MP.mpf(10) ** -45, MP.mpf(10) ** -35
"""Share by which data are moved, and rad by which the crank is: 1e-45 beside a gap of 1e-17 of the frame."""


def exact(*values):
    return [MP.mpf(value) for value in values]


def worst_ulps(result, reference, data):
    """Return the largest |error| of floats, in ulps times condition, against a function of the data in many digits."""
    data = exact(*data)
    values = reference(*data)
    sizes = [abs(value) for value in values]
    for k, x in enumerate(data):
        moved = reference(*data[:k], x * (1 + STEP), *data[k + 1 :])
        sizes = [size + abs(m - value) / STEP for size, m, value in zip(sizes, moved, values, strict=True)]
    errors = zip(result, values, sizes, strict=True)
    return max(float(abs(MP.mpf(float(f)) - value) / (EPS * size)) for f, value, size in errors)


def angle(a, b, opposite):
    """Return the angle between sides a and b of a triangle by the law of cosines, rad."""
    return MP.acos((a * a + b * b - opposite * opposite) / (2 * a * b))


def motion(side):
    """Return a function of (l1, l2, l3, l4, φ) that gives ψ, ψ', ψ'' by differences of positions."""

    def psi(l1, l2, l3, l4, phi):
        x, y = l1 * MP.cos(phi) - l4, l1 * MP.sin(phi)
        turned = MP.atan2(y, x) - side * angle(l3, MP.sqrt(x * x + y * y), l2)
        return turned - 2 * MP.pi * MP.nint(turned / (2 * MP.pi))

    def rates(l1, l2, l3, l4, phi):
        before, here, after = (psi(l1, l2, l3, l4, phi + k * TIME_STEP) for k in (-1, 0, 1))
        return here, (after - before) / (2 * TIME_STEP), (after - 2 * here + before) / TIME_STEP**2

    return rates


CENTRES = ("beta", "beta_r", "theta", "swing", "psi_front", "psi_rear")


def centres(side):
    """Return a function of the lengths that gives CENTRES [Yuan24, eq 12], by arc cosines."""

    def height(l1, l2, l3, l4):
        beta, beta_r = angle(l2 + l1, l4, l3), angle(l2 - l1, l4, l3)
        front, rear = MP.pi - angle(l3, l4, l2 + l1), MP.pi - angle(l3, l4, l2 - l1)
        return side * beta, side * beta_r, side * (beta - beta_r), rear - front, side * front, side * rear

    return height


def transmission(l1, l2, l3, l4):
    """Return μ at φ = 0 and π − μ at φ = π, rad."""
    return angle(l2, l3, l4 - l1), MP.pi - angle(l2, l3, l4 + l1)


def turns(l1, l2, l3, l4):
    """Say whether four floats, taken exactly, are a crank-rocker."""
    a, b, c, d = map(Fraction, (l1, l2, l3, l4))
    return min(b + c - a - d, c + d - a - b, b + d - a - c, d - a) > 0
