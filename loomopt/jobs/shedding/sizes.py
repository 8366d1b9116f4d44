"""Natural sizes of a heald frame and its spring: what the NLP is scaled by, and where it starts."""

import numpy as np

from loomopt import maths
from loomopt.cycle import Floats
from loomopt.jobs.shedding.model import RETURN_SPRING
from loomopt.program.sampling import Sampler

LEAST_STRETCH = 1e-3
"""Share of the largest elongation below which a spring is as good as slack."""
MEGA = 1e6


class Sizes:
    """force, N: the largest sum of the loads' magnitudes, the spring apart; stiffness, N/m: what keeps contact.

    sampler: the frame today; stretch: the largest elongation its spring may have, m; most: its largest stiffness.
    """

    def __init__(self, sampler: Sampler, stretch: float, most: float) -> None:
        self.sampler = sampler
        given = sampler.given
        pieces, u = sampler.grid()
        at = sampler.model.instant(maths.numpy(), given, sampler.node(pieces, u))
        acting = {name: term for name, term in at.terms().items() if name != RETURN_SPRING.name}
        parts = [np.broadcast_to(np.asarray(term, dtype=float), u.shape) for term in acting.values()]
        self.travelled: Floats = np.asarray(at.pose.q, dtype=float)
        self.others: Floats = np.sum(parts, axis=0) if parts else np.zeros(u.shape)
        least = float(given.values.get("N_min", 0.0))
        self.force = float(np.sum(np.abs(parts), axis=0).max() if parts else 0.0) + least or 1.0
        self.stretch = stretch
        preload = stretch - float(given.values["travel"])
        self.needed = self.stiffness_for(least, preload) or (self.force / stretch if stretch > 0.0 else 1.0)
        self.stiffness = min(self.needed, most) or self.needed

    def stiffness_for(self, least: float, preload: float) -> float:
        """Return the stiffness, N/m, that keeps the cam force above `least`, N, at a preload, m, as sampled."""
        elongated = np.maximum(self.travelled + preload, min(LEAST_STRETCH * self.stretch, preload) or LEAST_STRETCH)
        return float(max(0.0, np.max((least - self.others) / elongated)))

    def figure(self, name: str, quantity: str, value: float) -> float:
        """Return the size of a figure over the cycle."""
        if name.startswith("contact"):
            return self.force
        return abs(value) or abs(self.sampler.peak(quantity)) or 1.0

    def margin(self, kind: str) -> float:
        """Return what a check's margins of a kind are measured by; 0 where nothing of the frame says."""
        return {"stiffness": self.stiffness, "pressure": 100 * MEGA, "force": self.force}.get(kind, 0.0)
