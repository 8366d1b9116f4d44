"""Turning points of a whole-cycle quantity, to the last bit."""

from loomopt.program.sampling import Sampler

STEPS, FARTHEST, LAST = 6, 1e-3, 1e-15
"""Newton's steps from a sampled extreme, which is right to 1e-8; rad beyond which a step leads elsewhere, and that end
them."""


def settled(sampler: Sampler, derivatives: tuple[str, str], angle: float) -> float:
    """Return the crank angle, rad, of a turning point after Newton's method from nearby.

    derivatives: quantities that are the first and the second derivative in the crank angle.
    """
    for _ in range(STEPS):
        slope, bend = sampler.at_angle(derivatives, angle)
        step = slope / bend if bend else 0.0
        if abs(step) > FARTHEST:
            return angle
        angle -= step
        if abs(step) < LAST:
            break
    return angle
