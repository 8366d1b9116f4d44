"""The speed up to which a quantity keeps its bound, where loads are quadratic in the speed at every crank angle."""

import math
from collections.abc import Mapping

import numpy as np

from loomopt.cycle import Floats
from loomopt.program.model import JobModel
from loomopt.program.sampling import Sampler

AT_REST = 1e-12
"""Share of the largest value by which one at rest may miss its bound: rounding."""
NEWTON, CONVERGED = 30, 1e-15


def speed_reached(model: JobModel, values: Mapping[str, float], name: str, most: float) -> float:
    """Return the speed, rad/s, up to which a signed quantity stays at most `most`, SI; infinite where it always does.

    It is quadratic in the speed at every crank angle: the first root is sampled, then followed by Newton's method
    with the refined largest value. 0 where the bound is broken at rest.
    """
    unit = float(values["speed"])
    still = Sampler(model, {**values, "speed": 0.0})
    pieces, u = still.grid()

    def room_at(speed: float) -> Floats:
        return -still.moved({"speed": speed}).at(name, pieces, u)

    rest, ahead, back = room_at(0.0), room_at(unit), room_at(-unit)
    rounding = AT_REST * float(np.abs(np.concatenate([rest, ahead])).max())
    spare = rest + most
    if spare.min() < -rounding:
        return 0.0
    square, linear = (ahead + back) / 2 - rest, (ahead - back) / 2
    shares = _first_roots(square, linear, np.maximum(spare, 0.0), rounding)
    share = float(shares.min())
    return math.inf if math.isinf(share) else _settled(still, name, most, unit * share)


def _first_roots(square: Floats, linear: Floats, spare: Floats, rounding: float) -> Floats:
    """Return the least positive x with square x² + linear x + spare = 0 at each angle, infinite without one."""
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = linear**2 - 4 * square * spare
        root = 2 * spare / (-linear + np.sqrt(np.maximum(inside, 0.0)))
    falls = (inside >= 0.0) & (root > 0.0) & ((np.abs(square) > rounding) | (np.abs(linear) > rounding))
    return np.where(falls, root, np.inf)


def _settled(still: Sampler, name: str, most: float, speed: float) -> float:
    """Return the speed, rad/s, where the refined largest value is `most`, from one nearby; still: at rest."""
    for _ in range(NEWTON):
        top = still.moved({"speed": speed}).extremes(name)[0]
        node = np.array([top.piece]), np.array([top.u])
        ends = [float(still.moved({"speed": w}).at(name, *node)[0]) for w in (0.0, 2 * speed)]
        slope = (ends[1] - ends[0]) / (2 * speed)
        if not slope > 0.0:
            break
        step = (most - top.value) / slope
        speed += step
        if abs(step) <= CONVERGED * speed:
            break
    return speed
