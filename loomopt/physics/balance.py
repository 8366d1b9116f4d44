"""The balance: mechanism + effects → the force the output needs and the torque the crank needs.

    Q = Σ output terms                 force or torque the mechanism must supply at its output q
    crank torque = Q q' + Σ drive terms        power balance; positive = the motor drives

Only loads that stand in the scene are in the sums. Each term is written in its effect's own file.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from loomopt.base.records import lazy
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Applied, LinkMass, Load, Motion, State
from loomopt.physics.schema import Values

if TYPE_CHECKING:
    from loomopt.physics.mechanisms.dyad import Vector

Acting = Load[Any] | State


@dataclass(frozen=True)
class Pose(Motion):
    """One instant of the cycle, any shape.

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
    """All numbers of a scene in one number system: `values` by name, `own` values of each effect.

    known: names of the scene's numbers, from which all else follows. linkage: the mechanism's own record of what its
    poses read at once, such as lengths and dead centres.
    """

    values: Values
    own: Mapping[str, Values]
    known: frozenset[str] = frozenset()
    linkage: object = None


def terms(
    maths: Maths, loads: Sequence[Acting], pose: Motion, given: Given, switch: Values, gone: Collection[str] = ()
) -> Iterator[tuple[Acting, Number]]:
    """Yield each load with its term, but those `gone`; switch: by a load's name, which of its formulas holds.

    See `Load.switch`.
    """
    for load in loads:
        if load.name in gone:
            continue
        own = given.own[load.name]
        if isinstance(load, State):
            yield load, load.force(maths, pose, given.values, own, replied(maths, load, loads, pose, given, switch))
        elif load.upon:
            others = [each for each in loads if each is not load]
            loaded = Loaded(maths, others, pose, given, switch)
            yield load, load.upon(maths, pose, given.values, own, switch.get(load.name, 0), loaded)
        else:
            yield load, load.force(maths, pose, given.values, own, switch.get(load.name, 0))


def replied(
    maths: Maths, state: State, loads: Sequence[Acting], pose: Motion, given: Given, switch: Values
) -> tuple[Number, Number]:
    """Return z and z˙ in answer to the loads with corners that a state carries."""
    found = []
    for load in loads:
        if isinstance(load, Load) and load.name in state.carries and load.response:
            oscillator = state.oscillator(maths, given.values, given.own[state.name])
            own = given.own[load.name]
            found.append(load.response(maths, oscillator, pose, given.values, own, switch.get(load.name, 0)))
    return total([position for position, _ in found]), total([rate for _, rate in found])


def total(numbers: Sequence[Number]) -> Number:
    """Return the sum without a leading zero term; 0 for none."""
    if not numbers:
        return 0
    result = numbers[0]
    for number in numbers[1:]:
        result = result + number
    return result


def carried(loads: Sequence[Acting]) -> frozenset[str]:
    """Return the names of the loads that move with a coordinate of their own: its force stands for them."""
    return frozenset(name for load in loads if isinstance(load, State) for name in load.carries)


def output_force(maths: Maths, loads: Sequence[Acting], pose: Motion, given: Given, switch: Values) -> Number:
    """Return Q, N or N·m: what the mechanism must supply at its output."""
    gone = carried(loads) | {load.name for load in loads if load.acts != "output"}
    return total([term for _, term in terms(maths, loads, pose, given, switch, gone)])


def crank_torque(maths: Maths, loads: Sequence[Acting], pose: Motion, given: Given, switch: Values) -> Number:
    """Return the torque on the crank, N·m: Q q' and the drive's own terms."""
    found = list(terms(maths, loads, pose, given, switch, carried(loads)))
    output = [term for load, term in found if load.acts == "output"]
    drive = [term for load, term in found if load.acts == "drive"]
    drive += [term for load in loads if (term := inside(maths, load, pose, given)) is not None]
    return total([total(output) * pose.q1, *drive] if output else drive)


def inside(maths: Maths, load: Acting, pose: Motion, given: Given) -> Number | None:
    """Crank torque that a load of the output takes inside the drive besides, N·m; None for nothing."""
    formula = load.inside if isinstance(load, Load) else None
    return formula(maths, pose, given.values, given.own[load.name]) if formula else None


@dataclass(frozen=True)
class Loaded:
    """What acts on a mechanism at one instant, for whoever reads the forces in its joints; each when first read."""

    maths: Maths
    loads: Sequence[Acting]
    pose: Motion
    given: Given
    switch: Values

    @lazy
    def terms(self) -> Sequence[tuple[Acting, Number]]:
        """Each load with its term, as if all moved with the output."""
        return list(terms(self.maths, self.loads, self.pose, self.given, self.switch))

    @lazy
    def force(self) -> Number:
        """Q, N or N·m."""
        gone = carried(self.loads)
        return total([term for load, term in self.terms if load.acts == "output" and load.name not in gone])

    @lazy
    def carried(self) -> Motion:
        """The motion of what moves with the output; where a state carries that, its own."""
        state = next((load for load in self.loads if isinstance(load, State) and load.moved), None)
        if state is None or state.moved is None:
            return self.pose
        values, own = self.given.values, self.given.own
        reply = replied(self.maths, state, self.loads, self.pose, self.given, self.switch)
        coordinate = state.coordinate(self.maths, self.pose, values, own[state.name], reply)
        moving = [(load, term) for load, term in self.terms if load.name in state.carries and isinstance(load, Load)]
        inertia = total([load.moved(values, own[load.name]) for load, _ in moving if load.moved])
        pushed = total([term for load, term in moving if not load.moved])
        acceleration = (self.force - pushed) / inertia
        found: Motion = state.moved(self.pose, own[state.name], coordinate, self.force, acceleration)
        return found

    @lazy
    def masses(self) -> Sequence[tuple[LinkMass, Motion]]:
        """What the loads move, each with its motion."""
        return masses(self.maths, self.loads, self.given, (self.pose, self.carried))

    @lazy
    def pushes(self) -> "Sequence[Vector]":
        """Forces on the output's link itself, N."""
        return pushes(self.maths, self.terms, self.given, (self.pose, self.carried))

    @lazy
    def applied(self) -> Sequence[Applied]:
        """Forces on links and joints by name."""
        found: list[Applied] = []
        for load in (load for load in self.loads if isinstance(load, Load) and load.applied):
            own, switch = self.given.own[load.name], self.switch.get(load.name, 0)
            assert load.applied is not None
            found += load.applied(self.maths, self.pose, self.given.values, own, switch)
        return found


def masses(
    maths: Maths, loads: Sequence[Acting], given: Given, motions: tuple[Motion, Motion]
) -> list[tuple[LinkMass, Motion]]:
    """Return what loads move, inertia alone where one tells no mass; motions: the output's, and of what is carried."""
    found = []
    gone, values = carried(loads), given.values
    for load in (load for load in loads if isinstance(load, Load)):
        own, motion = given.own[load.name], motions[load.name in gone]
        if load.mass:
            found.append((load.mass(maths, values, own), motion))
        elif load.moved:
            found.append((LinkMass("", 0, 0, 0, load.moved(values, own)), motion))
    return found


def pushes(
    maths: Maths, terms: Sequence[tuple[Acting, Number]], given: Given, motions: tuple[Motion, Motion]
) -> "list[Vector]":
    """Return the forces that loads tell of their terms, N; motions: the output's, and of what is carried."""
    found = []
    gone = carried([load for load, _ in terms])
    for load, term in terms:
        if isinstance(load, Load) and load.push:
            push = load.push(maths, motions[load.name in gone], given.values, given.own[load.name], term)
            found += [] if push is None else [push]
    return found
