"""The least curvature over a cone of directions, sought by projected gradients."""

import numpy as np

from loomopt.cycle import Floats
from loomopt.solving.nnls import nnls
from loomopt.tolerances import CONE_OPEN, CONE_STEPS, CONE_TIP

TINY = 1e-300
"""Keeps the step of a matrix of zeros a number."""


def least_on_cone(hessian: Floats, slopes: Floats) -> float:
    """Return the least d'Hd over unit directions d with slopes d ≤ 0 that was found; infinite without any.

    hessian: (n, n), symmetric; slopes: (m, n). Projected gradients from the eigenvectors: a heuristic, for the
    problem is NP-hard [Murty and Kabadi, Mathematical Programming 39 (1987), 117-129]. What it returns is reached by
    a direction of the cone; that there is nothing less is not proven.
    """
    values, vectors = np.linalg.eigh(hessian)
    if not len(slopes):
        return float(values[0])
    seeds = [sign * vector for vector in vectors.T for sign in (1.0, -1.0)]
    pace, least = 1.0 / max(float(np.abs(hessian).sum(axis=0).max()), TINY), np.inf
    for seed in seeds:
        direction = onto_cone(seed, slopes)
        for _ in range(CONE_STEPS):
            if direction is None:
                break
            bend = float(direction @ hessian @ direction)
            least = min(least, bend)
            direction = onto_cone(direction - pace * (hessian @ direction - bend * direction), slopes)
    return float(least)


def onto_cone(direction: Floats, slopes: Floats) -> Floats | None:
    """Return the unit direction of the nearest point of the cone slopes d ≤ 0; None where that is its tip."""
    kept = direction - slopes.T @ nnls(slopes.T, direction)
    length = float(np.linalg.norm(kept))
    if length <= CONE_TIP * max(1.0, float(np.linalg.norm(direction))) or np.any(slopes @ kept > CONE_OPEN * length):
        return None
    return np.asarray(kept / length)
