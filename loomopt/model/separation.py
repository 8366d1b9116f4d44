"""Loads on an output that has left its mechanism: their formulas, tried and used only if they are linear.

A load may depend on the output's position, speed, acceleration and direction of motion only. A load that depends on
the crank angle or on another position of the mechanism is refused by name.
"""

import bisect
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from loomopt.base.errors import refusal
from loomopt.base.units import SI_UNIT
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT, Number
from loomopt.maths.turning_points import crossing
from loomopt.model.curves import ANGLE, POWER, Columns, Rows, columns_at, load_name, rows, split
from loomopt.model.sampling import Sampler
from loomopt.physics.balance import Acting
from loomopt.physics.cycle import TURN, Floats, Node
from loomopt.physics.effects.kinds import Event, Load, State
from loomopt.physics.motion.flight import Cam, Course, Stretch
from loomopt.physics.motion.free import Body, Moving, Zone
from loomopt.physics.tolerances import ACCURACY, SAME_ANGLE
from loomopt.scenes.scene import Scene

LINEAR = 1e-12
"""Share of a load's largest term by which it may differ from the sum of its parts: rounding."""
SAMPLES = 3600
"""Of one turn, by which the output's own stroke, speed and acceleration are known: a tenth of a degree misses less than
1e-4 of a peak of any law."""
PROBES = ((0.7, 0.0, 0.0, 0.0), (-0.4, 0.9, 0.0, 0.5), (0.3, -0.8, 0.6, -1.0), (1.6, 0.5, -0.9, 1.0))
"""Position, speed, acceleration (in the output's own sizes) and direction at which a load's linear form is tried."""


class UnfollowedError(ValueError):
    """Reason why a design cannot be simulated: text, "{force}" for a force in N; effect; remedy."""

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
        """Term, SI."""
        return self.mass * a + self.damping * v + self.stiffness * x + self.steady + self.friction * direction


Forms = dict[str, tuple[Linear, ...]]
"""Name of a load of the output → its linear form in each zone of the output's position."""


class ProbeSizes(NamedTuple):
    """Sizes of the output in contact with its mechanism: stroke, m, largest speed, m/s, and acceleration, m/s²."""

    stroke: float
    speed: float
    acceleration: float


def sizes(sampler: Sampler) -> ProbeSizes:
    """Sizes of the output's motion."""
    pieces, u = sampler.grid(SAMPLES)
    pose = sampler.model.instant(systems.numpy(), sampler.given, sampler.node(pieces, u)).pose
    rates = (float(np.abs(values).max()) for values in (pose.velocity, pose.acceleration))
    return ProbeSizes(*(size or 1.0 for size in (float(np.ptp(pose.q)), *rates)))


def forms(sampler: Sampler, event: Event) -> Forms:
    """Linear forms of the output's loads. Raises UnfollowedError."""
    ends = [-math.inf, *_corners(sampler, event), math.inf]
    by_load = {}
    for load in (load for load in sampler.model.loads if load.acts == "output"):
        spans = itertools.pairwise(ends)
        by_load[load.name] = tuple(_form(sampler, event, load, _switch(sampler, event, load, *span)) for span in spans)
    return by_load


def body(sampler: Sampler, event: Event, known: Forms) -> Body:
    """Output on its own; known: the linear forms of its loads. Raises UnfollowedError."""
    rows = [tuple(forms) for forms in zip(*known.values(), strict=True)]
    mass, damping, _, _, friction = (math.fsum(values) for values in zip(*rows[0], strict=True))
    zones = tuple(Zone(math.fsum(f.stiffness for f in forms), math.fsum(f.steady for f in forms)) for forms in rows)
    least = {"mass": mass - math.ulp(0.0), "damping": damping, "friction": friction}
    least["stiffness"] = min(zone.stiffness for zone in zones)
    for name, value in least.items():
        if value < 0.0:
            remedy = f"Take {event.name} off (--without {event.name})"
            raise UnfollowedError(event.name, f"without its mechanism the output has no {name} above 0", remedy)
    return Body(mass, damping, friction, tuple(_corners(sampler, event)), zones)


def _corners(sampler: Sampler, event: Event) -> list[float]:
    """Positions of the output where loads change their formula, ascending."""
    loads = [load for load in sampler.model.loads if isinstance(load, Load) and _cornered(sampler, load)]
    called = {name for load in loads for name in load.reads}
    return sorted({place for name, place in event.places(sampler.given.values).items() if name in called})


def _cornered(sampler: Sampler, load: Load[Any]) -> tuple[float, ...]:
    """Crank angles, rad, where a load changes its formula; none for most."""
    given = sampler.given
    return tuple(load.corners(given.inputs(FLOAT, load))) if load.corners else ()


def _refused(event: Event, load: Acting, why: str) -> UnfollowedError:
    problem = f"effects {event.name} and {load.name} cannot be on together: {load.name} is not defined in flight: {why}"
    return UnfollowedError(event.name, problem, f"Take one of them off (--without {load.name})")


def _switch(sampler: Sampler, event: Event, load: Acting, low: float, high: float) -> float:
    """Switches of a load while the output is between two positions."""
    if isinstance(load, State):
        raise _refused(event, load, "it moves on its own")
    if load.known_in(sampler.model.words_of(load.name)):
        raise _refused(event, load, "it is known in part of the turn only")
    corners = _cornered(sampler, load)
    if not corners:
        return 0.0
    places = event.places(sampler.given.values)
    angles = {angle for name in load.reads if name in places for angle in sampler.given.values[name]}
    switches = {switch for place, switch in _switches(sampler, load) if low <= place <= high}
    if set(corners) != angles or len(switches) != 1:
        raise _refused(event, load, "it depends on the crank angle")
    return switches.pop()


def _switches(sampler: Sampler, load: Acting) -> Iterator[tuple[float, float]]:
    """Yield the output's position in the middle of each piece, and a load's switch there."""
    for piece, (begin, end) in enumerate(itertools.pairwise(sampler.cycle.starts)):
        switch = sampler.cycle.switch(piece)
        pose = sampler.model.instant(FLOAT, sampler.given, Node(float(begin + end) / 2, switch)).pose
        yield float(pose.q), float(switch[load.name])


def _form(sampler: Sampler, event: Event, load: Acting, switch: float) -> Linear:
    """Load's linear form, tried at a few states. Raises UnfollowedError for one that has none."""
    assert isinstance(load, Load)
    extent, speed, push = sizes(sampler)

    def term(x: float, v: float, a: float, direction: float) -> float:
        try:
            pose = event.free(sampler.given.values, x * extent, v * speed, a * push, direction)
            at = sampler.given.inputs(FLOAT, load, pose, {load.name: switch})
            return float(load.force(at))
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


BEYOND = 1.01
"""Share of the largest sampled acceleration that no acceleration exceeds."""
CAM_COLUMN, GAP = "{}_cam", "gap"
"""Columns of the surface under the output and of its distance from the output."""


@dataclass(frozen=True)
class Parted:
    """Design whose output may leave its mechanism; loads: linear forms of its loads, by zone of its position."""

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
        """Curves of one period, SI, or of the last simulated turn if the motion is not periodic.

        Of the output in flight they are its own; what it rests on, and the gap between them, are columns too.
        """
        whole, parts = rows(self.sampler, columns, steps, also), []
        for k, turn in enumerate(self.course.periodic):
            for stretch in turn.stretches:
                part = self._stretch(columns, whole, stretch)
                parts.append(part | {ANGLE: part[ANGLE] + k * TURN})
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def _stretch(self, columns: Columns, whole: Rows, stretch: Stretch) -> dict[str, Floats]:
        """Curves from one end of a stretch to the other; whole: the rows of a turn."""
        output = next(iter(columns.motion))
        name, unit = split(output)
        curves = columns_at(self.sampler, columns, self._rows(whole, stretch))
        face = curves[output]
        flown = curves | (self._flown(curves, columns, stretch) if stretch.piece else {})
        gap = np.maximum(flown[output] - face, 0.0)
        contact_columns = {f"{CAM_COLUMN.format(name)} [{unit}]": face, f"{GAP} [{unit}]": gap}
        first = {ANGLE: flown[ANGLE], output: flown[output], **contact_columns}
        return first | {column: values for column, values in flown.items() if column not in first}

    def _rows(self, whole: Rows, stretch: Stretch) -> Rows:
        """Rows of a turn that lie in a stretch, its ends from the inside among them."""
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

    def _flown(self, curves: dict[str, Floats], columns: Columns, stretch: Stretch) -> dict[str, Floats]:
        """Columns that are the output's own in flight; nothing acts between it and the mechanism."""
        piece, omega, body = stretch.piece, self.course.cam.omega, self.course.body
        assert piece
        motions = [self.course.free(stretch, float(angle)) for angle in curves[ANGLE]]
        x, v, a = (np.array(values) for values in zip(*motions, strict=True))
        jerk = np.array([0.0 if piece.stuck else piece.jerk(motion) for motion in motions])
        name, orders = split(next(iter(columns.motion)))[0], (x, v, a, jerk)
        motion_columns = {f"{name}_{k}" if k else name: values / omega**k for k, values in enumerate(orders)}
        motion_columns |= {f"{name}_{'t' * k}": values for k, values in enumerate(orders) if k}
        shown = {column: motion_columns[split(column)[0]] for column in curves if split(column)[0] in motion_columns}
        direction = -body.rest(piece.zone, piece.x) / body.friction if piece.stuck else piece.sign
        drive = np.zeros(len(x))
        for load in self.sampler.model.loads:
            if load.acts == "output":
                term = self.loads[load.name][piece.zone].at(x, v, a, direction)
                shown[f"{load_name(load)} [{columns.unit}]"] = np.broadcast_to(term, x.shape)
            else:
                drive = drive + curves[f"{load_name(load)} [{SI_UNIT['torque']}]"]
        none = np.zeros(len(x))
        torque = columns.torque[0] if columns.torque else ""
        ends = {columns.force[0] if columns.force else "": none, torque: drive, POWER: drive * omega}
        # What checks read holds of an output that rests on its mechanism.
        unknown = {f"{check} [{unit}]": np.full(len(x), np.nan) for check, unit in columns.checks.items()}
        return shown | {column: values for column, values in (ends | unknown).items() if column in curves}


def followed(scene: Scene, sampler: Sampler) -> Parted | None:
    """Design, followed, where an effect of its scene may part its output from the mechanism.

    Raises BadInput where it cannot be followed.
    """
    try:
        return sampler.session.cached("parted", MOST_PARTED, sampler, lambda: _followed(sampler))
    except UnfollowedError as error:
        problem = error.problem.format(force=scene.show(error.force, "force"))
        raise refusal(problem, scene.origin, f"effects.{error.effect}", remedy=error.remedy) from None


MOST_PARTED = 8
"""Number of designs whose flights are cached."""


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
        return Parted(sampler, event, event.follow(free, cam, sampler.given.tables[event.name]), known)
    except ArithmeticError as error:
        remedy = f"Lower the restitution, or take {event.name} off (--without {event.name})"
        raise UnfollowedError(event.name, f"the flight does not end: {error}", remedy) from None


def _cam(sampler: Sampler, event: Event) -> Cam:
    """Mechanism that pushes the output. Raises UnfollowedError where they do not touch at crank angle 0."""
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
    """Stretches of the turn, rad, where the force of contact would be below 0, by more than a solve leaves.

    Raises UnfollowedError where that is so at crank angle 0.
    """
    pieces, u = sampler.grid(SAMPLES)
    least = sampler.extremes(event.least)
    pieces, u = np.append(pieces, [extreme.piece for extreme in least]), np.append(u, [extreme.u for extreme in least])
    order = np.lexsort((u, pieces))
    pieces, u = pieces[order], u[order]
    force, angles = sampler.at(event.force, pieces, u), sampler.cycle.angles(pieces, u)
    slack, start = ACCURACY * float(np.abs(force).max()), float(min(force[0], force[-1]))
    if start <= -slack:
        problem = f"{event.name} begins in contact at cam angle 0, where the force of contact would be {{force}}"
        remedy = f"Tighten what holds the output there, or take {event.name} off (--without {event.name})"
        raise UnfollowedError(event.name, problem, remedy, start)

    def crossed(k: int) -> float:
        """Crank angle, rad, where the force crosses 0 between a node and the next."""
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
