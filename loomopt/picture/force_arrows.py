"""Forces in the joints as arrows on a drawing: at events of the motion, and where each one peaks."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from loomopt.base.records import Frozen
from loomopt.maths.systems import FLOAT
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import TURN
from loomopt.picture.drawing import JOINT, Label, arrow
from loomopt.picture.shapes import Circle, Line, Point, Primitive

if TYPE_CHECKING:
    from loomopt.picture.motion import MechanismMotion

LAYER, PREFIX = "forces", "force_"
"""The layer of the arrows, and what names of forces in joints begin with."""
LONGEST, HEAD = 14.0, 1.2
"""Length of the largest force's arrow, and of its head, in text heights."""
LEAST = 0.1
"""Share of the largest force below which an arrow would be no longer than its head: its number alone is told."""


NOWHERE: Mapping[str, str] = Frozen()


class ForceArrow(NamedTuple):
    """The force in one joint at one crank angle, rad; x, y: N; event: of the motion, "" for where it peaks.

    at: the joint that it acts in, where that is called otherwise.
    """

    joint: str
    angle: float
    x: float
    y: float
    event: str
    at: str = ""

    @property
    def place(self) -> str:
        """The joint that it acts in."""
        return self.at or self.joint

    @property
    def size(self) -> float:
        """Its size, N."""
        return math.hypot(self.x, self.y)


def told(sampler: Sampler, events: Sequence[str], places: Mapping[str, str] = NOWHERE) -> list[ForceArrow]:
    """Return the forces in all joints that a design tells by components: just before each event, and at their peaks.

    places: the joints of forces that are not called after them.
    """
    names = [name for name in sampler.model.told if name.startswith(PREFIX) and f"{name}_x" in sampler.model.told]
    cycle, found = sampler.cycle, []
    for event in events if names else ():
        angle = float(sampler.model.event(FLOAT, sampler.given, event))
        piece = cycle.piece_before(angle)
        width = cycle.starts[piece + 1] - cycle.starts[piece]
        u = ((angle - cycle.starts[piece]) % TURN) / width
        found += [_read(sampler, name, piece, u or 1.0, event, places) for name in names]
    for name in names:
        top = sampler.extremes(name)[0]
        found.append(_read(sampler, name, top.piece, top.u, "", places))
    return found


def _read(sampler: Sampler, name: str, piece: int, u: float, event: str, places: Mapping[str, str]) -> ForceArrow:
    node = np.array([piece]), np.array([u])
    x, y = (float(values[0]) for values in sampler.together([f"{name}_x", f"{name}_y"], *node).values())
    joint, angle = name.removeprefix(PREFIX), float(sampler.cycle.angles(*node)[0]) % TURN
    return ForceArrow(joint, angle, x, y, event, places.get(joint, ""))


def legend(event: str) -> tuple[tuple[str, str], ...]:
    """Return what the legend says of the arrows."""
    when = f"just before {event} and " if event else ""
    return ((LAYER, f"F  forces in the joints, {when}at their peaks"),)


def drawn(
    forces: Sequence[ForceArrow], motion: "MechanismMotion", sizes: Mapping[ForceArrow, str], height: float
) -> tuple[list[Primitive], list[Label]]:
    """Return arrows, as long as forces are large, and their labels; a joint at a peak stands as an open circle.

    motion: joints at the forces' angles, one after another; sizes: each one with its unit; height: of texts, m.
    """
    strokes: list[Primitive] = []
    labels: list[Label] = []
    most = max((force.size for force in forces), default=0.0)
    for k, force in enumerate(forces):
        fixed = motion.pivots.get(force.place)
        if fixed is None and force.place not in motion.joints:
            continue
        at = fixed or Point(*map(float, motion.joints[force.place][k]))
        side = math.atan2(force.y, force.x)
        tip = at
        if force.size > LEAST * most:
            tip = at.towards(side, LONGEST * height * force.size / most)
            strokes += [Line(LAYER, (at, tip)), arrow(LAYER, tip, side, HEAD * height)]
        if not force.event and fixed is None:
            strokes.append(Circle(LAYER, at, JOINT * height))
        when = "" if force.event else f" at {math.degrees(force.angle):.2f}°"
        labels.append(Label(LAYER, tip, side, f"F{force.joint} = {sizes[force]}{when}", (at.part(tip),)))
    return strokes, labels
