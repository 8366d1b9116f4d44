"""Where formulas change over the cycle: corners of the motion's arcs, of the job's own, then of loads."""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from loomopt.maths.systems import Maths, Number
from loomopt.physics.balance import Given
from loomopt.physics.effects.kinds import Load

if TYPE_CHECKING:
    from loomopt.program.model import JobModel


class Cornered(NamedTuple):
    """A switch: the angles, rad, of its corners, what reads it between them, and those that part the cycle."""

    angles: tuple[Number, ...]
    switch: Callable[[float, tuple[float, ...]], float]
    placed: tuple[Number, ...]


def cornered(model: "JobModel", maths: Maths, given: Given) -> list[Cornered]:
    """Return each switch of a model, those of further cases after the first's."""
    found: list[Cornered] = []
    for case in (given, *given.cases):
        for arc in (*model.kinematics.arcs, *model.arcs):
            angles = arc.corners(maths, case)
            found.append(Cornered(angles, arc.switch, angles))
        for load in model.loads:
            if isinstance(load, Load) and load.corners:
                angles = load.corners(maths, case.values, case.own[load.name])
                # An event on a corner of the motion's own arcs would be that corner twice.
                events = model.kinematics.breaks.intersection(load.reads)
                there = {id(angle) for event in events for angle in case.values[event]}
                found.append(Cornered(angles, load.switch, tuple(a for a in angles if id(a) not in there)))
    return found
