"""Stretches of the cycle over which a quantity is as good as zero, as sampled."""

import numpy as np

from loomopt.physics.cycle import TURN
from loomopt.program.sampling import Sampler

SAMPLES = 3600
"""Of one turn: ends of stretches are right to a tenth of a degree."""


def near_zero(sampler: Sampler, name: str, most: float, least: float) -> list[tuple[float, float]]:
    """Return the stretches (begin, end), rad, over which |quantity| is at most `most`, SI, where it is known.

    least: the narrowest that counts, rad; one across the turn's end ends beyond it.
    """
    pieces, u = sampler.grid(SAMPLES)
    angles = sampler.cycle.angles(pieces, u)
    inside = np.flatnonzero((np.abs(sampler.at(name, pieces, u)) <= most) & sampler.on(name)[pieces])
    if not inside.size:
        return []
    runs = np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1)
    found = [(float(angles[run[0]]), float(angles[run[-1]])) for run in runs]
    if len(found) > 1 and inside[0] == 0 and inside[-1] == len(u) - 1:
        found = [*found[1:-1], (found[-1][0], found[0][1] + TURN)]
    return [(begin, end) for begin, end in found if end - begin >= least]
