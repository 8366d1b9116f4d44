"""Why a rapier drive cannot turn: which dyad does not close, and over which crank angles."""

import math
from collections.abc import Mapping

import numpy as np

from loomopt import maths
from loomopt.mechanisms import crank_rocker
from loomopt.mechanisms.dyad import dot
from loomopt.mechanisms.rapier_drive import Dimensions, Pose, Sley

SAMPLES = 3600


def fault(dimensions: Dimensions) -> str:
    """Say why a drive (m, rad) does not turn all round, and at which crank angles from FDC; "" when it does."""
    d = dimensions
    if min(d.l1, d.l2, d.l3, d.l71, d.l3p, d.l4, d.l5, d.l6, d.i1, d.i2, d.wheel) <= 0:
        return "every length and ratio must be greater than 0"
    four_bar = crank_rocker.fault(d.l1, d.l2, d.l3, d.l71)
    if four_bar:
        return f"the sley four-bar is no crank-rocker: {four_bar.replace('l4', 'l71')}"
    phi1 = np.linspace(0.0, 2 * math.pi, SAMPLES + 1)
    pose = Pose(maths.numpy(), d, Sley(maths.FLOAT, d).stand, phi1)
    span = np.sqrt(dot(pose.base, pose.base))
    for text, open_at in (
        ("C and B2 are farther apart than l5 + l6", span >= d.l5 + d.l6),
        ("C and B2 are closer than l5 and l6 differ", span <= abs(d.l5 - d.l6)),
    ):
        if open_at.all():
            return f"the five-bar closes at no crank angle: {text}"
        if open_at.any():
            return f"the five-bar locks: {text} {_stretches(np.degrees(phi1), open_at)}"
    return ""


def _stretches(degrees: "np.ndarray", open_at: "np.ndarray") -> str:
    """Return the stretches of crank angle where something holds, as words."""
    edges = np.diff(open_at.astype(int))
    begins, ends = [float(degrees[k + 1]) for k in np.flatnonzero(edges > 0)], []
    ends = [float(degrees[k]) for k in np.flatnonzero(edges < 0)]
    if open_at[0]:
        ends = [*ends[1:], ends[0] + 360.0]
        begins = begins or [0.0]
    return " and ".join(f"from {a:.1f} to {b:.1f} deg" for a, b in zip(begins, ends, strict=False))


def named(design: Mapping[str, float]) -> str:
    """Return `fault` of numbers by name, SI; "" where some of them are not named."""
    names = Dimensions.__dataclass_fields__
    if not all(name in design for name in names):
        return ""
    return fault(Dimensions(**{name: design[name] for name in names}))
