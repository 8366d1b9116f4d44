"""A design whose output may part from its mechanism: its course by motion/flight.py, and the curves of one period."""

import bisect
import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from loomopt.base.refusals import refusal
from loomopt.base.units import SI_UNIT
from loomopt.maths.systems import FLOAT
from loomopt.maths.turning_points import crossing
from loomopt.physics.cycle import TURN, Floats, Node
from loomopt.physics.effects.kinds import Event
from loomopt.physics.motion.flight import Cam, Course, Stretch
from loomopt.physics.motion.free import Moving
from loomopt.physics.tolerances import ACCURACY, SAME_ANGLE
from loomopt.program.curves import ANGLE, POWER, Columns, Rows, columns_at, load_name, rows, split
from loomopt.program.free_loads import SAMPLES, Forms, UnfollowedError, body, forms, sizes
from loomopt.program.sampling import Sampler
from loomopt.scene.scene import Scene

BEYOND = 1.01
"""Share of the largest sampled acceleration that no acceleration exceeds."""
HELD, GAP = "{}_cam", "gap"
"""Columns of what the output rests on, and of how far it is from that."""


@dataclass(frozen=True)
class Parted:
    """A design, followed. loads: of the output, each with its linear form in every zone of its position."""

    sampler: Sampler
    event: Event
    course: Course
    loads: Forms

    @property
    def figures(self) -> dict[str, float | None]:
        """The event's figures, SI; None where contact is never lost."""
        if not self.course.parted:
            return {figure.name: None for figure in self.event.figures}
        return dict(self.event.read(self.course))

    def curves(self, columns: Columns, steps: int, also: Sequence[float]) -> dict[str, Floats]:
        """Return the curves of one period, SI; of the last turn that was simulated where there is none.

        Of the output in flight they are its own; what it rests on, and the gap between them, are columns too.
        """
        whole, parts = rows(self.sampler, columns, steps, also), []
        for k, turn in enumerate(self.course.periodic):
            for stretch in turn.stretches:
                part = self._stretch(columns, whole, stretch)
                parts.append(part | {ANGLE: part[ANGLE] + k * TURN})
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def _stretch(self, columns: Columns, whole: Rows, stretch: Stretch) -> dict[str, Floats]:
        """Return the curves from one end of a stretch to the other; whole: the rows of a turn."""
        output = next(iter(columns.motion))
        name, unit = split(output)
        found = columns_at(self.sampler, columns, self._rows(whole, stretch))
        face = found[output]
        flown = found | (self._flown(found, columns, stretch) if stretch.piece else {})
        gap = np.maximum(flown[output] - face, 0.0)
        beside = {f"{HELD.format(name)} [{unit}]": face, f"{GAP} [{unit}]": gap}
        first = {ANGLE: flown[ANGLE], output: flown[output], **beside}
        return first | {column: values for column, values in flown.items() if column not in first}

    def _rows(self, whole: Rows, stretch: Stretch) -> Rows:
        """Return the rows of a turn that lie in a stretch, its ends from the inside among them."""
        cycle = self.sampler.cycle
        inside = (whole[2] > stretch.begin + SAME_ANGLE) & (whole[2] < stretch.end - SAME_ANGLE)
        first, u = cycle.place(stretch.begin)
        last = cycle.piece_before(stretch.end)
        begins, ends = cycle.starts[last : last + 2]
        reached = min((stretch.end - begins) / (ends - begins), 1.0)
        return (
            np.concatenate([[first], whole[0][inside], [last]]),
            np.concatenate([[u], whole[1][inside], [reached]]),
            np.concatenate([[stretch.begin], whole[2][inside], [stretch.end]]),
        )

    def _flown(self, found: dict[str, Floats], columns: Columns, stretch: Stretch) -> dict[str, Floats]:
        """Return the columns that are the output's own in flight; nothing acts between it and the mechanism."""
        piece, omega, body = stretch.piece, self.course.cam.omega, self.course.body
        assert piece
        motions = [self.course.free(stretch, float(angle)) for angle in found[ANGLE]]
        x, v, a = (np.array(values) for values in zip(*motions, strict=True))
        jerk = np.array([0.0 if piece.stuck else piece.jerk(each) for each in motions])
        name, orders = split(next(iter(columns.motion)))[0], (x, v, a, jerk)
        own = {f"{name}_{k}" if k else name: values / omega**k for k, values in enumerate(orders)}
        own |= {f"{name}_{'t' * k}": values for k, values in enumerate(orders) if k}
        shown = {column: own[split(column)[0]] for column in found if split(column)[0] in own}
        direction = -body.rest(piece.zone, piece.x) / body.friction if piece.stuck else piece.sign
        drive = np.zeros(len(x))
        for load in self.sampler.model.loads:
            if load.acts == "output":
                term = self.loads[load.name][piece.zone].at(x, v, a, direction)
                shown[f"{load_name(load)} [{columns.unit}]"] = np.broadcast_to(term, x.shape)
            else:
                drive = drive + found[f"{load_name(load)} [{SI_UNIT['torque']}]"]
        none = np.zeros(len(x))
        torque = columns.torque[0] if columns.torque else ""
        ends = {columns.force[0] if columns.force else "": none, torque: drive, POWER: drive * omega}
        # What checks read holds of an output that rests on its mechanism.
        unknown = {f"{check} [{unit}]": np.full(len(x), np.nan) for check, unit in columns.checks.items()}
        return shown | {column: values for column, values in (ends | unknown).items() if column in found}


def followed(scene: Scene, sampler: Sampler) -> Parted | None:
    """Return a design, followed, where an effect of its scene may part its output from the mechanism.

    Raises BadInput where it cannot be followed.
    """
    try:
        return _followed(sampler)
    except UnfollowedError as error:
        problem = error.problem.format(force=scene.show(error.force, "force"))
        raise refusal(problem, scene.origin, f"effects.{error.effect}", remedy=error.remedy) from None


@functools.lru_cache(maxsize=8)
def _followed(sampler: Sampler) -> Parted | None:
    events = [effect for effect in sampler.model.effects if isinstance(effect, Event)]
    if len(events) > 1:
        problem = f"effects {events[0].name} and {events[1].name} both part the output from its mechanism"
        raise UnfollowedError(events[1].name, problem, f"Take one of them off (--without {events[1].name})")
    if not events:
        return None
    event, known = events[0], forms(sampler, events[0])
    try:
        free, cam = body(sampler, event, known), _cam(sampler, event)
        return Parted(sampler, event, event.follow(free, cam, sampler.given.own[event.name]), known)
    except ArithmeticError as error:
        remedy = f"Lower the restitution, or take {event.name} off (--without {event.name})"
        raise UnfollowedError(event.name, f"the flight does not end: {error}", remedy) from None


def _cam(sampler: Sampler, event: Event) -> Cam:
    """Return the mechanism that pushes the output. Raises UnfollowedError where they do not touch at crank angle 0."""
    cycle, kinematics, given = sampler.cycle, sampler.model.kinematics, sampler.given
    starts = [float(start) for start in cycle.starts]
    switches = [cycle.switch(piece) for piece in range(cycle.pieces)]

    def motion(angle: float) -> Moving:
        piece = min(max(bisect.bisect_right(starts, angle) - 1, 0), len(switches) - 1)
        pose = kinematics.pose(FLOAT, given, Node(angle, switches[piece]))
        return Moving(float(pose.q), float(pose.velocity), float(pose.acceleration))

    stroke, fastest, hardest = sizes(sampler)
    return Cam(float(given.values["speed"]), motion, fastest, BEYOND * hardest, stroke, _pulls(sampler, event))


def _pulls(sampler: Sampler, event: Event) -> tuple[tuple[float, float], ...]:
    """Return the stretches of the turn, rad, where the force of contact would be below 0, by more than a solve leaves.

    Raises UnfollowedError where that is so at crank angle 0.
    """
    pieces, u = sampler.grid(SAMPLES)
    least = sampler.extremes(event.least)
    pieces, u = np.append(pieces, [each.piece for each in least]), np.append(u, [each.u for each in least])
    order = np.lexsort((u, pieces))
    pieces, u = pieces[order], u[order]
    force, angles = sampler.at(event.force, pieces, u), sampler.cycle.angles(pieces, u)
    slack, start = ACCURACY * float(np.abs(force).max()), float(min(force[0], force[-1]))
    if start <= -slack:
        problem = f"{event.name} begins in contact at cam angle 0, where the force of contact would be {{force}}"
        remedy = f"Tighten what holds the output there, or take {event.name} off (--without {event.name})"
        raise UnfollowedError(event.name, problem, remedy, start)

    def crossed(k: int) -> float:
        """Return the crank angle, rad, where the force crosses 0 between a node and the next."""
        piece, sign = pieces[k : k + 1], -1.0 if force[k] >= 0.0 else 1.0
        if pieces[k] != pieces[k + 1]:
            return float(angles[k + 1])
        at = crossing(lambda x: sign * float(sampler.at(event.force, piece, np.array([x]))[0]), u[k], u[k + 1])
        return float(sampler.cycle.angles(piece, np.array([at]))[0])

    changes = np.flatnonzero((force[:-1] < 0.0) != (force[1:] < 0.0))
    changes = changes[1:] if force[0] < 0.0 else changes
    spans = [(int(changes[k]), int(changes[k + 1]) if k + 1 < len(changes) else -1) for k in range(0, len(changes), 2)]
    return tuple(
        (crossed(begin), crossed(end) if end >= 0 else TURN)
        for begin, end in spans
        if force[begin + 1 : end + 1 if end >= 0 else None].min() < -slack
    )
