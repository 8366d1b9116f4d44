"""Rapier drive of [Hong17] in plain NumPy, as an engineer writes it by hand: joints as points, nothing general.

Knows nothing of loomopt. SI units and rad. A design is l4, l5, l6, l3p, alpha, C0x, C0y, phi40; its numbers broadcast
against crank angles, so one call serves one design (floats) or many (columns), and complex steps give slopes.

Origin B0 (rocking shaft). Sley four-bar A0 A B1 B0, crank angle φ1 counter-clockwise from front dead centre; second
crank C0C at φ40 − 2 φ1; D where link 5 about C and link 6 about B2 meet; B2 on the sley at φ3 + α. S is the travel of
the rapier head, its derivatives are by φ1 (m/rad, m/rad²).

[Hong17] Hong L. et al., Design of beating-up and weft insertion mechanism for carbon fiber composite loom, 2017,
doi 10.19333/j.mfkj.2017050120304
"""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

L1, L2, L3, L71 = 0.076385, 0.275705, 0.684, 0.773
PHI30 = np.radians(80.48)
"""The sley four-bar, and the sley's direction at front dead centre."""
TRAVEL = 300 / 18 * 1.0 * 0.240 / 2
"""m of travel per rad between link 6 and the sley: i1 i2 D_wheel / 2."""
TODAY = np.array([0.012, 0.4950647, 0.185, 0.180, np.radians(30), 0.4610345, 0.2342173, np.radians(166.67588)])
"""The paper's layout: its drawing, in closed form."""
NAMES = ("l4", "l5", "l6", "l3p", "alpha", "C0x", "C0y", "phi40")
LOWER = np.array([0.005, 0.3, 0.12, 0.12, 0.0, 0.4010345, 0.1742173, np.radians(146.67588)])
UPPER = np.array([0.04, 0.7, 0.26, 0.26, np.radians(60), 0.5210345, 0.2942173, np.radians(186.67588)])
WIDTH = UPPER - LOWER
MARGIN = 1.001
DENSE = 7200
"""Crank angles on which the referee looks for extremes before it refines them."""


@dataclass(frozen=True)
class Needs:
    """Stroke, m; the dwells' band, m, and arcs after and before front dead centre, rad; least transmission angle."""

    stroke: float = 0.850
    band: float = 0.006
    after: float = np.radians(30)
    before: float = np.radians(30)
    transmission: float = np.radians(30)


NEEDS = Needs()
"""Those of the packaged scene."""


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1]


def minus(a, b):
    return a[0] - b[0], a[1] - b[1]


def angle(x, y):
    """Return atan2(y, x), with its slope when x or y carry a complex step."""
    size = np.arctan2(y.real, x.real)
    if not np.iscomplexobj(x + y):
        return size
    return size + 1j * (x.real * y.imag - y.real * x.imag) / (x.real**2 + y.real**2)


def spoke(length, angle, rate, rate_1=0.0):
    """Return a spoke's end and its two derivatives, for an angle with its own two derivatives."""
    x, y = length * np.cos(angle), length * np.sin(angle)
    return (x, y), (-rate * y, rate * x), (-rate_1 * y - rate * rate * x, rate_1 * x - rate * rate * y)


def meeting(p, q, rp, rq):
    """Return the joint at rp from P and rq from Q, counter-clockwise of Q seen from P, and its two derivatives.

    p and q hold position, velocity and acceleration. Where the circles miss, they are taken as barely meeting:
    a solver must be able to look there, and `margins` are negative.
    """
    along = minus(q[0], p[0])
    square = dot(along, along)
    area = ((rp + rq) ** 2 - square) * (square - (rp - rq) ** 2)
    area = np.sqrt(np.where(area.real > 1e-12, area, 1e-12))
    u, v = (1 + (rp * rp - rq * rq) / square) / 2, area / (2 * square)
    a = u * along[0] - v * along[1], u * along[1] + v * along[0]
    joint = p[0][0] + a[0], p[0][1] + a[1]
    b, determinant = minus(joint, q[0]), cross(a, minus(joint, q[0]))

    def moving(da, db):
        """Solve a·v = da, b·v = db."""
        return (da * b[1] - db * a[1]) / determinant, (db * a[0] - da * b[0]) / determinant

    first = moving(dot(a, p[1]), dot(b, q[1]))
    sway, swing = minus(first, p[1]), minus(first, q[1])
    return joint, first, moving(dot(a, p[2]) - dot(sway, sway), dot(b, q[2]) - dot(swing, swing))


def turning(r, r_1, r_2, square):
    """Return the first two derivatives of a vector's direction, its length fixed."""
    return cross(r, r_1) / square, cross(r, r_2) / square


def sley(phi):
    """Return φ3, φ3', φ3'' at crank angles: the same for every design."""
    gamma = np.arccos((L3**2 + L71**2 - (L1 + L2) ** 2) / (2 * L3 * L71))
    A0 = L71 * np.cos(PHI30 - gamma), L71 * np.sin(PHI30 - gamma)
    front = np.arctan2(L3 * np.sin(PHI30) - A0[1], L3 * np.cos(PHI30) - A0[0])
    A = spoke(L1, front + phi, 1.0)
    A = ((A[0][0] + A0[0], A[0][1] + A0[1]), *A[1:])
    still = (0.0, 0.0)
    B1, B1_1, B1_2 = meeting((still, still, still), A, L3, L2)
    return angle(*B1), *turning(B1, B1_1, B1_2, L3**2)


def motion(design, phi, rocking=None):
    """Return the direction of link 6 against the sley as a vector, S', S'', transmission angle's cosine, |B2C|²."""
    l4, l5, l6, l3p, alpha, C0x, C0y, phi40 = design
    phi3, phi3_1, phi3_2 = sley(phi) if rocking is None else rocking
    C = spoke(l4, phi40 - 2 * phi, -2.0)
    C = ((C[0][0] + C0x, C[0][1] + C0y), *C[1:])
    B2 = spoke(l3p, phi3 + alpha, phi3_1, phi3_2)
    D, D_1, D_2 = meeting(B2, C, l6, l5)
    r = minus(D, B2[0])
    rates = turning(r, minus(D_1, B2[1]), minus(D_2, B2[2]), l6 * l6)
    along = np.cos(phi3), np.sin(phi3)
    reach = minus(C[0], B2[0])
    square = dot(reach, reach)
    return SimpleNamespace(
        pointing=(dot(along, r), cross(along, r)),
        S_1=TRAVEL * (rates[0] - phi3_1),
        S_2=TRAVEL * (rates[1] - phi3_2),
        cos_mu=(l5 * l5 + l6 * l6 - square) / (2 * l5 * l6),
        square=square,
    )


FRONT = sley(np.zeros(1))


def curves(design, phi, rocking=None):
    """Return S, S', S'', cos of the transmission angle at D and |B2C|² at crank angles."""
    at, front = motion(design, phi, rocking), motion(design, 0.0, FRONT)
    S = TRAVEL * angle(dot(front.pointing, at.pointing), cross(front.pointing, at.pointing))
    return S, at.S_1, at.S_2, at.cos_mu, at.square


def extremes(design, which, low=0.0, high=2 * np.pi):
    """Return angles and values of all local extremes of one of the curves, dense and then by parabolas."""
    phi, step = np.linspace(low, high, DENSE, retstep=True)
    value = curves(design, phi)[which]
    rise = np.diff(value)
    at = phi[1:-1][(rise[:-1] > 0) != (rise[1:] > 0)]
    for _ in range(3):
        left, mid, right = curves(design, (at[:, None] + step * np.array([-1, 0, 1])).ravel())[which].reshape(-1, 3).T
        at = at + step * np.clip((left - right) / (2 * (left - 2 * mid + right)), -1, 1)
    return at, curves(design, at)[which]


def stroke(design):
    """Return the largest S and its crank angle."""
    at, S = extremes(design, 0)
    return S.max(), at[S.argmax()]


def dwell(design, side, band=NEEDS.band):
    """Return the arc after (side 1) or before (side −1) front dead centre on which |S| <= band; ends by bisection."""
    phi = side * np.linspace(0.0, 2 * np.pi, DENSE)
    out = int(np.argmax(np.abs(curves(design, phi)[0]) > band))
    low, high = phi[out - 1], phi[out]
    for _ in range(50):
        mid = (low + high) / 2
        low, high = (low, mid) if abs(curves(design, np.array([mid]))[0][0]) > band else (mid, high)
    return abs(low)


def peak(design):
    """Return the largest |S''|."""
    return np.abs(extremes(design, 2)[1]).max()


def transmission(design):
    """Return the least angle at D between links 5 and 6, from either side."""
    return np.arccos(np.abs(extremes(design, 3)[1]).max())


def margins(design):
    """Return by how much the triangle C D B2 closes at both ends, 1 at the limit of assembly."""
    reach = np.sqrt(extremes(design, 4)[1])
    l5, l6 = design[1:3]
    return (l5 + l6) / reach.max(), reach.min() / abs(l5 - l6)


def violation(design, needs=NEEDS, lower=LOWER, upper=UPPER):
    """Return by how much the worst limit is exceeded, each relative to itself; the transmission angle in rad."""
    ends = curves(design, np.array([-needs.before, needs.after]))[0]
    excess = [
        (np.maximum(lower - design, design - upper) / WIDTH).max(),
        abs(stroke(design)[0] / needs.stroke - 1),
        np.abs(np.append(extremes(design, 0, -needs.before, needs.after)[1], ends)).max() / needs.band - 1,
        needs.transmission - transmission(design),
        MARGIN / min(margins(design)) - 1,
    ]
    return max(0.0, *excess) if np.all(np.isfinite(excess)) else np.inf
