"""The balance of [Yuan24]'s loom as an engineer writes it by hand for speed: closed forms of many designs at once.

Effects: inertia and resistance; `beatup.Machine` has the others. SI units and rad. A design is l1, l2, l3, l4 (m) and
s = m4e r4e² (kg·m²); its numbers broadcast against crank angles, so one call serves one design (floats) or many
(columns).

[Yuan24] Yuan R., Ai M., Analysis of moment balance in beating-up mechanism and its regulation strategies under
restricted space, J. Tiangong Univ. 43(4), 2024, doi 10.3969/j.issn.1671-024x.2024.04.013
"""

import numpy as np

from reference.beatup import dead_centres, extreme_transmission, front_angle

CHUNK = 8192
SPEED = 600 * 2 * np.pi / 60
PULSE = np.radians(29.8)
J4 = 0.620
LOWER = np.array([0.030, 0.060, 0.140, 0.150, 0.0])
UPPER = np.array([0.035, 0.085, 0.170, 0.167, 12.4 * 0.080**2])
TODAY = np.array([0.031, 0.065, 0.155, 0.167, 0.0])
SWING = np.radians([22.9, 23.4])
THETA, TRANSMISSION = np.radians(2.2), np.radians(56.5)
DENSE = 30_000
"""Crank angles per piece of the turn on which the referee looks for peaks before it refines them."""


def kinematics(l1, l2, l3, l4, phi):
    """Return ψ, ψ', ψ'' of the rocker: C where two circles meet, rates from the loop's linear equations."""
    ax, ay = l1 * np.cos(phi), l1 * np.sin(phi)
    bx, by = l4 - ax, -ay
    square = bx * bx + by * by
    total, difference = l2 + l3, l2 - l3
    area = np.sqrt((total * total - square) * (square - difference * difference))
    along = (total * difference / square - 1) / 2
    across = area / (2 * square)
    cx, cy = along * bx - across * by, along * by + across * bx
    rx, ry = cx + bx, cy + by
    scale = 2 / area
    rod_1 = scale * (cx * ay - cy * ax)
    psi_1 = scale * (rx * ay - ry * ax)
    psi_2 = scale * (rx * ax + ry * ay + rod_1 * rod_1 * (l2 * l2) - psi_1 * psi_1 * (rx * cx + ry * cy))
    return np.arctan2(cy, cx), psi_1, psi_2


def curves(l1, l2, l3, l4, phi, chunk=CHUNK):
    """Return ψ, ψ', ψ'' at many crank angles, a chunk at a time."""
    result = np.empty((3, len(phi)))
    for begin in range(0, len(phi), chunk):
        part = slice(begin, begin + chunk)
        result[0, part], result[1, part], result[2, part] = kinematics(l1, l2, l3, l4, phi[part])
    return result


def limits(l1, l2, l3, l4):
    """Return six rows, rad, none of which may be negative: swing, θ and transmission angle, each from both sides."""
    beta, beta_r, psi_f, psi_r = dead_centres(l1, l2, l3, l4)
    swing, theta = psi_r - psi_f, beta - beta_r
    near, far = extreme_transmission(l1, l2, l3, l4)
    rows = (swing - SWING[0], SWING[1] - swing, THETA - theta, THETA + theta, near - TRANSMISSION, far - TRANSMISSION)
    return np.array(rows)


def front_torque(l1, l2, l3, l4, s, M0):
    """Return M3 at front dead centre: M0 − J4 ω² ψ'', with ψ'' = l1 (l1+l2)/(l2 l3 sin μ)."""
    cos_mu = ((l1 + l2) ** 2 + l3**2 - l4**2) / (2 * (l1 + l2) * l3)
    return M0 - (J4 + s) * SPEED**2 * l1 * (l1 + l2) / (l2 * l3 * np.sqrt(1 - cos_mu**2))


def crank_torque(l1, l2, l3, l4, s, M0, phi):
    """Return Md = −M3 ψ' [eq 2-4, 8-9]; β ∓ δ/2 must lie within half a turn of φ."""
    _, psi_1, psi_2 = kinematics(l1, l2, l3, l4, phi)
    off = phi - front_angle(l1, l2, l3, l4)
    pulse = np.where(np.abs(off) < PULSE / 2, M0 * np.cos(np.pi / PULSE * off), 0.0)
    return ((J4 + s) * SPEED**2 * psi_2 - pulse) * psi_1


def peaks(design, M0):
    """Return the local peaks of |Md|, as (φ, |Md|), largest first: dense between the pulse's corners, then refined."""
    beta = front_angle(*design[:4])
    corners = beta + PULSE / 2 * np.array([-1, 1]), beta + np.array([PULSE / 2, 2 * np.pi - PULSE / 2])
    results = []
    for begin, end in corners:
        phi, step = np.linspace(begin, end, DENSE, retstep=True)
        size = np.abs(crank_torque(*(*design, M0, phi)))
        inner = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:])) + 1
        results += [_refined(design, M0, angle, step) for angle in phi[inner]]
        results += [(phi[k], size[k]) for k in (0, -1)]
    return sorted(results, key=lambda peak: -peak[1])


def _refined(design, M0, phi, step):
    """Return a peak that lies within a step of φ, by parabolas over ever smaller steps."""
    for _ in range(4):
        low, mid, high = np.abs(crank_torque(*(*design, M0, phi + step * np.array([-1, 0, 1]))))
        phi = phi + step * np.clip(0.5 * (low - high) / (low - 2 * mid + high), -1, 1)
        step = step / 4
    return phi, abs(crank_torque(*(*design, M0, phi)))


def violation(design):
    """Return by how much the worst limit is exceeded: lengths and s relative to their upper bounds, angles in rad."""
    outside = np.maximum(LOWER - design, design - UPPER) / UPPER
    return max(0.0, outside.max(), -limits(*design[:4]).min())
