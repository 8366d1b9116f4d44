"""Joint forces as arrows on a drawing: at events of the motion, and at their peaks."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from loomopt.base.records import Frozen
from loomopt.maths.systems import FLOAT
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import TURN
from loomopt.picture.drawing import JOINT, Label, arrow, place
from loomopt.picture.shapes import Circle, Drawing, Floats, Line, Measure, Point, Primitive, Units

if TYPE_CHECKING:
    from loomopt.picture.motion import MechanismMotion

LAYER, PREFIX = "forces", "force_"
"""The layer of the arrows, and what names of forces in joints begin with."""
LONGEST, HEAD = 14.0, 1.2
"""Length of the largest force's arrow, and of its head, in text heights."""
LEAST = 0.1
"""Share of the largest force below which an arrow would be no longer than its head: only its number is printed."""


NOWHERE: Mapping[str, str] = Frozen()


class ForceArrow(NamedTuple):
    """Force in a joint at a crank angle, rad; x, y: N; event: event of the motion, "" for the peak.

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
        """Magnitude, N."""
        return math.hypot(self.x, self.y)


def joint_forces(sampler: Sampler, events: Sequence[str], places: Mapping[str, str] = NOWHERE) -> list[ForceArrow]:
    """Forces in all joints that have components: just before each event, and at their peaks.

    places: the joints of forces that are not called after them.
    """
    names = [
        name
        for name in sampler.model.check_figures
        if name.startswith(PREFIX) and f"{name}_x" in sampler.model.check_figures
    ]
    cycle, arrows = sampler.cycle, []
    for event in events if names else ():
        angle = float(sampler.model.event(FLOAT, sampler.given, event))
        piece = cycle.piece_before(angle)
        width = cycle.starts[piece + 1] - cycle.starts[piece]
        u = ((angle - cycle.starts[piece]) % TURN) / width
        arrows += [_read(sampler, name, piece, u or 1.0, event, places) for name in names]
    for name in names:
        top = sampler.extremes(name)[0]
        arrows.append(_read(sampler, name, top.piece, top.u, "", places))
    return arrows


def _read(sampler: Sampler, name: str, piece: int, u: float, event: str, places: Mapping[str, str]) -> ForceArrow:
    node = np.array([piece]), np.array([u])
    x, y = (float(values[0]) for values in sampler.together([f"{name}_x", f"{name}_y"], *node).values())
    joint, angle = name.removeprefix(PREFIX), float(sampler.cycle.angles(*node)[0]) % TURN
    return ForceArrow(joint, angle, x, y, event, places.get(joint, ""))


class Sheet(NamedTuple):
    """Drawing of a mechanism without placed texts: strokes, labels and lines of the legend, with their layers.

    height: of texts, m; event: that before which forces are drawn, "" for none; measures: lengths that stand in it.
    """

    title: str
    height: float
    strokes: Sequence[Primitive]
    labels: Sequence[Label]
    legend: Sequence[tuple[str, str]]
    units: Units
    event: str = ""
    measures: tuple[Measure, ...] = ()

    def drawing(
        self, forces: Mapping[ForceArrow, str] | None, motion: "Callable[[Floats], MechanismMotion]"
    ) -> Drawing:
        """Drawing with its texts placed, and with forces in its joints.

        forces: each with its size in words, None or empty without any; motion(angles): the joints at crank angles, rad.
        """
        strokes, labels, legend = [*self.strokes], [*self.labels], [*self.legend]
        if forces:
            joints = motion(np.array([force.angle for force in forces]))
            arrows, sizes = draw(tuple(forces), joints, forces, self.height)
            strokes, labels = strokes + arrows, labels + sizes
            when = f"just before {self.event} and " if self.event else ""
            legend.append((LAYER, f"F  forces in the joints, {when}at their peaks"))
        texts = place(labels, strokes, self.height)
        return Drawing(self.title, self.height, (*strokes, *texts), tuple(legend), self.units.length, self.measures)


def draw(
    forces: Sequence[ForceArrow], motion: "MechanismMotion", sizes: Mapping[ForceArrow, str], height: float
) -> tuple[list[Primitive], list[Label]]:
    """Arrows of lengths proportional to the forces, with labels; a joint at a peak is an open circle.

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
