"""The balance: mechanism + effects → the force the output needs and the torque the crank needs.

    Q = Σ output terms                 force or torque the mechanism must supply at its output q
    crank torque = Q q' + Σ drive terms        power balance; positive = the motor drives

Only loads of the scene are in the sums. Each term is written in its effect's own file.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from loomopt.base.records import Frozen, lazy
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Applied, Effect, Inputs, LinkMass, Load, Motion, State
from loomopt.physics.schema import Values

if TYPE_CHECKING:
    from loomopt.physics.mechanisms.dyad import Vector

Acting = Load[Any] | State
NO_SWITCH: Values = Frozen()


@dataclass(frozen=True)
class Pose(Motion):
    """Instant of the cycle, any shape.

    phi: crank angle, rad; omega: crank speed, rad/s (None where no load needs it); q, q1, q2: output and its
    derivatives with respect to φ; joints: the mechanism's own pose; omega_dot: rad/s², None at constant speed.
    """

    phi: Number
    omega: Number
    q: Number
    q1: Number
    q2: Number
    joints: object = None
    omega_dot: Number = None


class Given(NamedTuple):
    """All numbers of a scene in one number system: `values` by name, `tables` values of each effect.

    known: names of the scene's numbers, from which all else follows. linkage: the mechanism's own record of what its
    poses read at once, such as lengths and dead centres.
    """

    values: Values
    tables: Mapping[str, Values]
    known: frozenset[str] = frozenset()
    linkage: object = None

    def inputs(
        self, maths: Maths, effect: Effect, pose: Motion | None = None, switch: Values = NO_SWITCH
    ) -> Inputs[Any]:
        """Inputs of an effect's formulas; switch: by a load's name, which of its formulas holds."""
        return Inputs(maths, self.values, self.tables[effect.name], pose, switch.get(effect.name, 0))


def terms(
    maths: Maths, loads: Sequence[Acting], pose: Motion, given: Given, switch: Values, gone: Collection[str] = ()
) -> Iterator[tuple[Acting, Number]]:
    """Yield each load with its term, except those in `gone`; switch: name of a load → number of its valid formula.

    See `Load.switch`.
    """
    for load in loads:
        if load.name in gone:
            continue
        at = given.inputs(maths, load, pose, switch)
        if isinstance(load, State):
            yield load, load.force(at, reply_to_corners(maths, load, loads, pose, given, switch))
        elif load.force_under_loads:
            others = [acting for acting in loads if acting is not load]
            yield load, load.force_under_loads(at, Loaded(maths, others, pose, given, switch))
        else:
            yield load, load.force(at)


def reply_to_corners(
    maths: Maths, state: State, loads: Sequence[Acting], pose: Motion, given: Given, switch: Values
) -> tuple[Number, Number]:
    """z and z˙ in answer to the loads with corners that a state carries."""
    answers = []
    for load in loads:
        if isinstance(load, Load) and load.name in state.carries and load.response:
            oscillator = state.oscillator(given.inputs(maths, state))
            answers.append(load.response(given.inputs(maths, load, pose, switch), oscillator))
    return total([position for position, _ in answers]), total([rate for _, rate in answers])


def total(numbers: Sequence[Number]) -> Number:
    """Sum without a leading zero term; 0 for none."""
    if not numbers:
        return 0
    result = numbers[0]
    for number in numbers[1:]:
        result = result + number
    return result


def carried(loads: Sequence[Acting]) -> frozenset[str]:
    """Names of the loads that move with a separate coordinate, whose force replaces theirs."""
    return frozenset(name for load in loads if isinstance(load, State) for name in load.carries)


def output_force(maths: Maths, loads: Sequence[Acting], pose: Motion, given: Given, switch: Values) -> Number:
    """Q, N or N·m: force or moment that the mechanism supplies at its output."""
    gone = carried(loads) | {load.name for load in loads if load.acts != "output"}
    return total([term for _, term in terms(maths, loads, pose, given, switch, gone)])


def crank_torque(maths: Maths, loads: Sequence[Acting], pose: Motion, given: Given, switch: Values) -> Number:
    """Torque on the crank, N·m: Q q' and the drive's own terms."""
    pairs = list(terms(maths, loads, pose, given, switch, carried(loads)))
    output = [term for load, term in pairs if load.acts == "output"]
    drive = [term for load, term in pairs if load.acts == "drive"]
    drive += [rest for load in loads if (rest := rest_in_drive(maths, loads, load, pose, given)) is not None]
    drive += [term for load in loads if (term := inside(maths, load, pose, given)) is not None]
    return total([total(output) * pose.q1, *drive] if output else drive)


def on_output(maths: Maths, load: Acting, term: Number, pose: Motion, given: Given) -> Number:
    """Part of a load's term that acts on the parts on the output, N or N·m there: all of an output term."""
    share = load.output_share if isinstance(load, Load) else None
    return share(given.inputs(maths, load, pose)) if share else term


def rest_in_drive(maths: Maths, loads: Sequence[Acting], load: Acting, pose: Motion, given: Given) -> Number | None:
    """Part of a drive term, N·m, that a state leaves in the drive when it carries the rest; None for any other load."""
    if not isinstance(load, Load) or load.output_share is None or load.name not in carried(loads):
        return None
    at = given.inputs(maths, load, pose)
    return load.force(at) - load.output_share(at) * pose.q1


def inside(maths: Maths, load: Acting, pose: Motion, given: Given) -> Number | None:
    """Crank torque that a load of the output takes inside the drive besides, N·m; None for nothing."""
    formula = load.inside if isinstance(load, Load) else None
    return formula(given.inputs(maths, load, pose)) if formula else None


@dataclass(frozen=True)
class Loaded:
    """Loads on a mechanism at one instant, for its joint forces; computed when first read."""

    maths: Maths
    loads: Sequence[Acting]
    pose: Motion
    given: Given
    switch: Values

    @lazy
    def terms(self) -> Sequence[tuple[Acting, Number]]:
        """Loads with their terms, as if all moved with the output."""
        return list(terms(self.maths, self.loads, self.pose, self.given, self.switch))

    @lazy
    def force(self) -> Number:
        """Q, N or N·m."""
        gone = carried(self.loads)
        return total([term for load, term in self.terms if load.acts == "output" and load.name not in gone])

    @lazy
    def carried(self) -> Motion:
        """Motion of the parts that move with the output, or that of the state that carries them."""
        state = next((load for load in self.loads if isinstance(load, State) and load.moved), None)
        if state is None or state.moved is None:
            return self.pose
        at = self.given.inputs(self.maths, state, self.pose)
        reply = reply_to_corners(self.maths, state, self.loads, self.pose, self.given, self.switch)
        coordinate = state.coordinate(at, reply)
        moving = [(load, term) for load, term in self.terms if load.name in state.carries and isinstance(load, Load)]
        inertia = total([load.moved(self.given.inputs(self.maths, load)) for load, _ in moving if load.moved])
        pushed = total(
            [on_output(self.maths, load, term, self.pose, self.given) for load, term in moving if not load.moved]
        )
        acceleration = (self.force - pushed) / inertia
        motion: Motion = state.moved(at, coordinate, self.force, acceleration)
        return motion

    @lazy
    def masses(self) -> Sequence[tuple[LinkMass, Motion]]:
        """Masses of the loads with their motions."""
        return masses(self.maths, self.loads, self.given, (self.pose, self.carried))

    @property
    def inertia(self) -> Number:
        """Inertia of all that the loads move, kg·m² or kg."""
        return total([mass.second for mass, _ in self.masses])

    @lazy
    def pushes(self) -> "Sequence[Vector]":
        """Forces on the output's link itself, N."""
        return pushes(self.maths, self.terms, self.given, (self.pose, self.carried))

    @lazy
    def applied(self) -> Sequence[Applied]:
        """Forces on links and joints by name."""
        forces, gone = list[Applied](), carried(self.loads)
        for load in (load for load in self.loads if isinstance(load, Load) and load.applied):
            assert load.applied is not None
            pose = self.pose.with_carried(self.carried) if load.name in gone else self.pose
            forces += load.applied(self.given.inputs(self.maths, load, pose, self.switch))
        return forces


def masses(
    maths: Maths, loads: Sequence[Acting], given: Given, motions: tuple[Motion, Motion]
) -> list[tuple[LinkMass, Motion]]:
    """Masses that loads move, inertia alone where a load has no mass; motions: the output's, and of carried parts."""
    pairs = []
    gone = carried(loads)
    for load in (load for load in loads if isinstance(load, Load)):
        at, motion = given.inputs(maths, load), motions[load.name in gone]
        if load.mass:
            pairs.append((load.mass(at), motion))
        elif load.moved:
            pairs.append((LinkMass("", 0, 0, 0, load.moved(at)), motion))
    return pairs


def pushes(
    maths: Maths, terms: Sequence[tuple[Acting, Number]], given: Given, motions: tuple[Motion, Motion]
) -> "list[Vector]":
    """Forces of the terms of loads, N; motions: those of the output and of the carried parts."""
    vectors = []
    gone = carried([load for load, _ in terms])
    for load, term in terms:
        if isinstance(load, Load) and load.push:
            push = load.push(given.inputs(maths, load, motions[load.name in gone]), term)
            vectors += [] if push is None else [push]
    return vectors
