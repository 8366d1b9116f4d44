"""A mechanism as joints and links in the positions that matter, full scale in m: what pictures of it share."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from loomopt.base.units import factor
from loomopt.picture.shapes import Circle, Line, Point, Primitive, Trace
from loomopt.picture.symbols import fixed_pivot, mass
from loomopt.picture.units import METRIC, Units

JOINT = 0.35
"""Radius of a joint's circle, in text heights."""


class Mass(NamedTuple):
    """A centre of mass: mass, kg; radius: its distance from the joint it turns about, m."""

    mass: float
    radius: float


@dataclass(frozen=True)
class Skeleton:
    """Joints and links; each event of the motion is drawn on the layer of its name.

    pivots: fixed joints; joints: event → moving joints. links: pairs of joints, the frame between two pivots.
    guides: joint and radius, m, of a circle about it, which moves with it. traces: curves that stand still.
    sizes: radius of a joint's own circle, in text heights, where it is another; 0 for none.
    masses: which of the joints are centres of mass.
    """

    pivots: Mapping[str, Point]
    joints: Mapping[str, Mapping[str, Point]]
    links: tuple[tuple[str, str], ...]
    guides: tuple[tuple[str, float], ...] = ()
    traces: tuple[Trace, ...] = ()
    sizes: Mapping[str, float] = field(default_factory=dict)
    masses: Mapping[str, Mass] = field(default_factory=dict)

    @property
    def primes(self) -> dict[str, str]:
        """The marks of moving joints' names at each event."""
        return {event: "'" * k for k, event in enumerate(self.joints)}

    def at(self, event: str) -> dict[str, Point]:
        """Return all joints at an event."""
        return {**self.pivots, **self.joints[event]}

    def strokes(self, h: float) -> list[Primitive]:
        """Return what every drawing shows; h: text height, m."""
        frame = [link for link in self.links if set(link) <= set(self.pivots)]
        found: list[Primitive] = [Line("paths", (self.pivots[one], self.pivots[other])) for one, other in frame]
        for pivot in self.pivots.values():
            found += fixed_pivot(pivot, h)
        found += [Circle("paths", self.pivots[name], radius) for name, radius in self.guides if name in self.pivots]
        found += self.traces
        for event, joints in self.joints.items():
            at = self.at(event)
            found += [Line(event, (at[one], at[other])) for one, other in self.links if (one, other) not in frame]
            found += [Circle(event, joints[name], radius) for name, radius in self.guides if name in joints]
            sizes = {name: self.sizes.get(name, JOINT) for name in joints if name not in self.masses}
            found += [Circle("joints", joints[name], size * h) for name, size in sizes.items() if size]
            found += [part for name in joints if name in self.masses for part in mass(joints[name], h)]
        return found

    def csv(self, units: Units = METRIC) -> str:
        """Return the joints as CSV; of centres of mass, where there are any, mass and radius too. Digits round-trip."""
        length, mass = units.length, units.mass
        heading = f"joint,position,x [{length}],y [{length}]"
        lines = [f"{heading},mass [{mass}],radius [{length}]" if self.masses else heading]
        placed = [("frame", "", self.pivots), *((e, self.primes[e], joints) for e, joints in self.joints.items())]
        for event, prime, joints in placed:
            for name, point in joints.items():
                numbers = [axis / factor(length) for axis in point]
                if name in self.masses:
                    own = self.masses[name]
                    numbers += [own.mass / factor(mass), own.radius / factor(length)]
                blank = "" if name in self.masses or not self.masses else ",,"
                lines.append(f"{name}{prime},{event},{','.join(map(repr, numbers))}{blank}")
        return "".join(f"{line}\n" for line in lines)
