"""What loads do to an output that has parted from its mechanism: their own formulas, tried and taken only if linear.

A load that goes by the crank angle, by the mechanism's position or by anything but the output's position, speed,
acceleration and direction of motion cannot be followed, and is refused by name.
"""

import itertools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from loomopt.maths import systems
from loomopt.maths.systems import FLOAT, Number
from loomopt.physics.balance import Acting
from loomopt.physics.cycle import Node
from loomopt.physics.effects.kinds import Event, Load, State
from loomopt.physics.motion.free import Body, Zone
from loomopt.program.sampling import Sampler

LINEAR = 1e-12
"""Share of a load's largest term by which it may miss the sum of its parts: rounding."""
SAMPLES = 3600
"""Of one turn, by which the output's own stroke, speed and acceleration are known: a tenth of a degree misses less than
1e-4 of a peak of any law."""
PROBES = ((0.7, 0.0, 0.0, 0.0), (-0.4, 0.9, 0.0, 0.5), (0.3, -0.8, 0.6, -1.0), (1.6, 0.5, -0.9, 1.0))
"""Position, speed, acceleration (in the output's own sizes) and direction at which a load's linear form is tried."""


class UnfollowedError(ValueError):
    """What keeps a design from being followed: in words, "{force}" for one in N; effect: to name; what helps."""

    def __init__(self, effect: str, problem: str, remedy: str, force: float = 0.0) -> None:
        super().__init__(problem)
        self.effect, self.problem, self.remedy, self.force = effect, problem, remedy, force


class Linear(NamedTuple):
    """A load of the output on its own: mass ẍ + damping ẋ + stiffness x + steady + friction sgn ẋ, SI."""

    mass: float
    damping: float
    stiffness: float
    steady: float
    friction: float

    def at(self, x: Number, v: Number, a: Number, direction: Number) -> Number:
        """Return the term, SI."""
        return self.mass * a + self.damping * v + self.stiffness * x + self.steady + self.friction * direction


Forms = dict[str, tuple[Linear, ...]]
"""Name of a load of the output → its linear form in each zone of the output's position."""


class Sizes(NamedTuple):
    """Of the output held on its mechanism: stroke, m, largest speed, m/s, and acceleration, m/s²."""

    stroke: float
    speed: float
    acceleration: float


def sizes(sampler: Sampler) -> Sizes:
    """Return the sizes of the output's motion."""
    pieces, u = sampler.grid(SAMPLES)
    pose = sampler.model.instant(systems.numpy(), sampler.given, sampler.node(pieces, u)).pose
    rates = (float(np.abs(values).max()) for values in (pose.velocity, pose.acceleration))
    return Sizes(*(size or 1.0 for size in (float(np.ptp(pose.q)), *rates)))


def forms(sampler: Sampler, event: Event) -> Forms:
    """Return the linear forms of the output's loads. Raises UnfollowedError."""
    ends = [-math.inf, *_corners(sampler, event), math.inf]
    found = {}
    for load in (load for load in sampler.model.loads if load.acts == "output"):
        spans = itertools.pairwise(ends)
        found[load.name] = tuple(_form(sampler, event, load, _switch(sampler, event, load, *span)) for span in spans)
    return found


def body(sampler: Sampler, event: Event, known: Forms) -> Body:
    """Return the output on its own; known: the linear forms of its loads. Raises UnfollowedError."""
    zones = [tuple(each) for each in zip(*known.values(), strict=True)]
    mass, damping, _, _, friction = (math.fsum(values) for values in zip(*zones[0], strict=True))
    held = tuple(Zone(math.fsum(f.stiffness for f in each), math.fsum(f.steady for f in each)) for each in zones)
    least = {"mass": mass - math.ulp(0.0), "damping": damping, "friction": friction}
    least["stiffness"] = min(zone.stiffness for zone in held)
    for name, value in least.items():
        if value < 0.0:
            remedy = f"Take {event.name} off (--without {event.name})"
            raise UnfollowedError(event.name, f"without its mechanism the output has no {name} above 0", remedy)
    return Body(mass, damping, friction, tuple(_corners(sampler, event)), held)


def _corners(sampler: Sampler, event: Event) -> list[float]:
    """Return the positions of the output where loads change their formula, ascending."""
    loads = [load for load in sampler.model.loads if isinstance(load, Load) and _cornered(sampler, load)]
    called = {name for load in loads for name in load.reads}
    return sorted({place for name, place in event.places(sampler.given.values).items() if name in called})


def _cornered(sampler: Sampler, load: Load[Any]) -> tuple[float, ...]:
    """Return the crank angles, rad, where a load changes its formula; none for most."""
    given = sampler.given
    return tuple(load.corners(FLOAT, given.values, given.own[load.name])) if load.corners else ()


def _refused(event: Event, load: Acting, why: str) -> UnfollowedError:
    problem = (
        f"effects {event.name} and {load.name} cannot be on together: in flight {load.name} is not known, for {why}"
    )
    return UnfollowedError(event.name, problem, f"Take one of them off (--without {load.name})")


def _switch(sampler: Sampler, event: Event, load: Acting, low: float, high: float) -> float:
    """Return which of its formulas a load has while the output is between two positions."""
    if isinstance(load, State):
        raise _refused(event, load, "it moves on its own")
    if load.known_in(sampler.model.words_of(load.name)):
        raise _refused(event, load, "it is known in part of the turn only")
    own = _cornered(sampler, load)
    if not own:
        return 0.0
    places = event.places(sampler.given.values)
    angles = {angle for name in load.reads if name in places for angle in sampler.given.values[name]}
    found = {switch for place, switch in _switches(sampler, load) if low <= place <= high}
    if set(own) != angles or len(found) != 1:
        raise _refused(event, load, "it goes by the crank angle")
    return found.pop()


def _switches(sampler: Sampler, load: Acting) -> Iterator[tuple[float, float]]:
    """Yield the output's position in the middle of each piece, and a load's switch there."""
    for piece, (begin, end) in enumerate(itertools.pairwise(sampler.cycle.starts)):
        switch = sampler.cycle.switch(piece)
        pose = sampler.model.instant(FLOAT, sampler.given, Node(float(begin + end) / 2, switch)).pose
        yield float(pose.q), float(switch[load.name])


def _form(sampler: Sampler, event: Event, load: Acting, switch: float) -> Linear:
    """Return a load's linear form, tried at a few states. Raises UnfollowedError for one that has none."""
    values, own = sampler.given.values, sampler.given.own[load.name]
    extent, speed, push = sizes(sampler)

    def term(x: float, v: float, a: float, direction: float) -> float:
        try:
            pose = event.free(values, x * extent, v * speed, a * push, direction)
            return float(load.force(FLOAT, pose, values, own, switch))  # type: ignore[arg-type]  # states are refused
        except AttributeError as error:
            raise _refused(event, load, f"it reads the mechanism's {error.name}") from None

    steady = term(0.0, 0.0, 0.0, 0.0)
    mass, damping = term(0.0, 0.0, 1.0, 0.0) - steady, term(0.0, 1.0, 0.0, 0.0) - steady
    stiffness, friction = term(1.0, 0.0, 0.0, 0.0) - steady, term(0.0, 0.0, 0.0, 1.0) - steady
    parts = Linear(mass, damping, stiffness, steady, friction)
    size = sum(map(abs, parts))
    if not all(abs(term(*probe) - parts.at(*probe)) <= LINEAR * size for probe in PROBES):
        raise _refused(event, load, "it is not linear in the output's motion")
    return Linear(mass / push, damping / speed, stiffness / extent, steady, friction)
