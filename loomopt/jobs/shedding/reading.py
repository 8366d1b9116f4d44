"""What a designer reads off the cam force: the speed up to which the roller stays on the cam."""

import math
from collections.abc import Mapping

import numpy as np

from loomopt.cycle import Floats
from loomopt.jobs.shedding.model import Shedding
from loomopt.program.sampling import Sampler

AT_REST = 1e-12
"""Share of the largest cam force by which contact at rest may miss its limit: rounding."""
NEWTON, CONVERGED = 30, 1e-15


def contact_speed(model: Shedding, values: Mapping[str, float], least: float) -> float:
    """Return the cam speed, rad/s, up to which the cam force stays above `least`, N; infinite where it always does.

    The force is quadratic in the speed at every cam angle: the first root is sampled, then followed by Newton's method
    with the refined least force. 0 where contact is lost at rest.
    """
    unit = float(values["speed"])
    still = Sampler(model, {**values, "speed": 0.0})
    pieces, u = still.grid()

    def force(speed: float) -> Floats:
        return -Sampler(model, {**values, "speed": speed}).at("lift", pieces, u)

    rest, ahead, back = force(0.0), force(unit), force(-unit)
    room = AT_REST * float(np.abs(np.concatenate([rest, ahead])).max())
    spare = rest - least
    if spare.min() < -room:
        return 0.0
    square, linear = (ahead + back) / 2 - rest, (ahead - back) / 2
    shares = _first_roots(square, linear, np.maximum(spare, 0.0), room)
    share = float(shares.min())
    return math.inf if math.isinf(share) else _settled(model, values, least, unit * share)


def _first_roots(square: Floats, linear: Floats, spare: Floats, room: float) -> Floats:
    """Return the least positive x with square x² + linear x + spare = 0 at each angle, infinite without one."""
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = linear**2 - 4 * square * spare
        root = 2 * spare / (-linear + np.sqrt(np.maximum(inside, 0.0)))
    falls = (inside >= 0.0) & (root > 0.0) & ((np.abs(square) > room) | (np.abs(linear) > room))
    return np.where(falls, root, np.inf)


def _settled(model: Shedding, values: Mapping[str, float], least: float, speed: float) -> float:
    """Return the speed, rad/s, where the refined least force is `least`, from one nearby."""
    for _ in range(NEWTON):
        sampler = Sampler(model, {**values, "speed": speed})
        lowest = sampler.extremes("lift")[0]
        node = np.array([lowest.piece]), np.array([lowest.u])
        ends = [float(Sampler(model, {**values, "speed": w}).at("lift", *node)[0]) for w in (0.0, 2 * speed)]
        slope = (ends[1] - ends[0]) / (2 * speed)
        if not slope > 0.0:
            break
        step = (-least - lowest.value) / slope
        speed += step
        if abs(step) <= CONVERGED * speed:
            break
    return speed
