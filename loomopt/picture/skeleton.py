"""A mechanism as joints and links in the positions that matter, full scale in mm: what pictures of it share."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from loomopt.picture.drawing import fixed_pivot
from loomopt.picture.shapes import Circle, Line, Point, Primitive, Trace

JOINT = 0.35
"""Radius of a joint's circle, in text heights."""


@dataclass(frozen=True)
class Skeleton:
    """Joints and links; each event of the motion is drawn on the layer of its name.

    pivots: fixed joints; joints: event → moving joints. links: pairs of joints, the frame between two pivots.
    guides: joint and radius, mm, of a circle about it, which moves with it. traces: curves that stand still.
    sizes: radius of a joint's own circle, in text heights, where it is another; 0 for none.
    """

    pivots: Mapping[str, Point]
    joints: Mapping[str, Mapping[str, Point]]
    links: tuple[tuple[str, str], ...]
    guides: tuple[tuple[str, float], ...] = ()
    traces: tuple[Trace, ...] = ()
    sizes: Mapping[str, float] = field(default_factory=dict)

    @property
    def primes(self) -> dict[str, str]:
        """The marks of moving joints' names at each event."""
        return {event: "'" * k for k, event in enumerate(self.joints)}

    def at(self, event: str) -> dict[str, Point]:
        """Return all joints at an event."""
        return {**self.pivots, **self.joints[event]}

    def strokes(self, h: float) -> list[Primitive]:
        """Return what every drawing shows; h: text height, mm."""
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
            sizes = {name: self.sizes.get(name, JOINT) for name in joints}
            found += [Circle("joints", joints[name], size * h) for name, size in sizes.items() if size]
        return found

    def csv(self) -> str:
        """Return the joints as CSV, mm; digits round-trip."""
        rows = [(name, "frame", point) for name, point in self.pivots.items()]
        for event, joints in self.joints.items():
            rows += [(f"{name}{self.primes[event]}", event, point) for name, point in joints.items()]
        lines = [f"{name},{event},{point.x!r},{point.y!r}\n" for name, event, point in rows]
        return "".join(["joint,position,x [mm],y [mm]\n", *lines])
