"""The speed up to which a quantity keeps its bound, where loads are quadratic in the speed at every crank angle."""

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from loomopt.maths.systems import numpy
from loomopt.model.model import JobModel
from loomopt.model.reading import Quantities
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.cycle import Floats, Node

SPEED_AT_REST, SPEED_STEPS, SPEED_MET = 1e-12, 30, 1e-8
"""Largest speed that keeps a bound: share of the largest value by which one at rest may miss it, for rounding; Newton's
steps at most, and the share of the speed after which there is none left to take: the next would be its square."""


def speed_reached(model: JobModel, values: Mapping[str, float], name: str, most: float, slack: float = 0.0) -> float:
    """Return the speed, rad/s, up to which a signed quantity stays at most `most`, SI; infinite where it always does.

    It is quadratic in the speed at every crank angle: the first root is sampled, then followed by Newton's method
    with the refined largest value. 0 where the bound is broken at rest. slack, SI: an excess that counts as none, at
    rest and up to the mechanism's own speed: what a solve leaves of a bound that is met exactly.
    """
    own = float(values["speed"])
    at_rest = sampled(model, {**values, "speed": 0.0})
    speed = _reached(at_rest, own, name, most, slack)
    tied = slack > 0.0 and speed < own <= _reached(at_rest, own, name, most + slack, slack)
    return own if tied else speed


def followed(
    name: str, reached: Callable[[Sampler], float], model: JobModel, values: Mapping[str, float]
) -> dict[str, float]:
    """Return, by name, the speed, rad/s, that follows from all else; nothing where there is no such speed."""
    speed = reached(sampled(model, values))
    return {name: speed} if math.isfinite(speed) else {}


def _reached(at_rest: Sampler, unit: float, name: str, most: float, slack: float) -> float:
    """Return the speed, rad/s, up to which a quantity stays at most `most`; unit: a speed to read it at, rad/s."""
    nodes = at_rest.node(*at_rest.grid())
    rest, ahead, back = -_at_speeds(at_rest, name, nodes, (0.0, unit, -unit))
    rounding = SPEED_AT_REST * float(np.abs([rest, ahead]).max())
    spare = rest + most
    if spare.min() < -max(rounding, slack):
        return 0.0
    square, linear = (ahead + back) / 2 - rest, (ahead - back) / 2
    shares = _first_roots(square, linear, np.maximum(spare, 0.0), rounding)
    share = float(shares.min())
    return math.inf if math.isinf(share) else _settled(at_rest, name, most, unit * share)


def _at_speeds(at_rest: Sampler, name: str, nodes: Node, speeds: Sequence[float]) -> Floats:
    """Return (speeds, nodes): a quantity at each of several speeds, rad/s."""
    values = {**at_rest.values, **at_rest.hints, "speed": np.array(speeds)[:, None]}
    given = at_rest.model.given(numpy(), values)
    (found,) = Quantities(at_rest.model, (numpy(), numpy()), given)((name,), nodes)
    at_rest.session.positions += found.size
    return np.broadcast_to(found, (len(speeds), len(nodes.phi)))


def _first_roots(square: Floats, linear: Floats, spare: Floats, rounding: float) -> Floats:
    """Return the least positive x with square x² + linear x + spare = 0 at each angle, infinite without one."""
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = linear**2 - 4 * square * spare
        root = 2 * spare / (-linear + np.sqrt(np.maximum(inside, 0.0)))
    falls = (inside >= 0.0) & (root > 0.0) & ((np.abs(square) > rounding) | (np.abs(linear) > rounding))
    return np.where(falls, root, np.inf)


def _settled(at_rest: Sampler, name: str, most: float, speed: float) -> float:
    """Return the speed, rad/s, where the refined largest value is `most`, from one nearby."""
    for _ in range(SPEED_STEPS):
        top = sampled(at_rest.model, {**at_rest.values, "speed": speed}).extremes(name)[0]
        node = at_rest.node(np.array([top.piece]), np.array([top.u]))
        still, twice = _at_speeds(at_rest, name, node, (0.0, 2 * speed)).ravel().tolist()
        slope = (twice - still) / (2 * speed)
        if not slope > 0.0:
            break
        step = (most - top.value) / slope
        speed += step
        if abs(step) <= SPEED_MET * speed:
            break
    return speed
