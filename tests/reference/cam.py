"""The cam once more, from rotated vectors and any law of u: what the product's drawing is compared with."""

import numpy as np
from scipy.interpolate import PPoly

TURN90 = np.array([[0.0, -1.0], [1.0, 0.0]])


def spline(knots):
    """Return the law whose s'' runs straight between evenly spaced knots, integrated twice by SciPy."""
    steps = np.linspace(0, 1, len(knots))
    bend = PPoly(np.array([np.diff(knots) / np.diff(steps), knots[:-1]]), steps)
    rate, law = bend.antiderivative(), bend.antiderivative(2)
    return lambda u: (law(u), rate(u), bend(u))


def lift(law, segments, theta):
    """Return X/travel and its two derivatives with respect to the cam angle; segments: four angles, rad."""
    rise, far, back, _ = segments
    up, down = theta / rise, (rise + far + back - theta) / back
    rising = np.array(law(np.clip(up, 0, 1))) / np.array([[1.0], [rise], [rise**2]])
    falling = np.array(law(np.clip(down, 0, 1))) / np.array([[1.0], [-back], [back**2]])
    still = np.array([theta < rise + far + back / 2, np.zeros_like(theta), np.zeros_like(theta)])
    return np.where(theta <= rise, rising, np.where((down >= 0) & (down <= 1), falling, still))


def cross(first, other):
    return first[0] * other[1] - first[1] * other[0]


def contact(follower, lifted, theta):
    """Return roller centre and profile, (n, 2) m, pressure angle, rad, and the centre curve's curvature, 1/m.

    The arm hangs from a pivot above the shaft; its roller, m(φ) in the machine, is turned back by the cam's angle.
    """
    a, arm, r0, radius, swing = (
        follower[k] for k in ("centre_distance", "arm", "base_radius", "roller_radius", "arm_swing")
    )
    phi, phi_1, phi_2 = swing * lifted
    angle = phi + np.arccos((a**2 + arm**2 - r0**2) / (2 * a * arm))
    m = np.array([-arm * np.sin(angle), a - arm * np.cos(angle)])
    m_1 = np.array([-arm * np.cos(angle), arm * np.sin(angle)])
    m_2 = np.array([arm * np.sin(angle), arm * np.cos(angle)])
    rate = m_1 * phi_1 - TURN90 @ m
    second = m_2 * phi_1**2 + m_1 * phi_2 - 2 * (TURN90 @ m_1) * phi_1 - m
    back = np.array([[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]])
    centre, tangent, bent = (np.einsum("ijn,jn->in", back, vector) for vector in (m, rate, second))
    speed = np.hypot(*tangent)
    inward = -(TURN90 @ tangent) / speed
    path = np.einsum("ijn,jn->in", back, m_1 / arm)
    pressure = np.arctan2(-cross(path, inward), -np.sum(path * inward, axis=0))
    return centre.T, (centre + radius * inward).T, pressure, -cross(tangent, bent) / speed**3


def distance(points, polyline):
    """Return each point's distance to a closed polyline, (n, 2) both."""
    start, end = polyline, np.roll(polyline, -1, axis=0)
    chord = end - start
    squared = np.maximum(np.sum(chord**2, axis=1), 1e-300)
    result = np.empty(len(points))
    for k, point in enumerate(points):
        share = np.clip(np.sum((point - start) * chord, axis=1) / squared, 0, 1)
        result[k] = np.min(np.hypot(*(point - start - share[:, None] * chord).T))
    return result
