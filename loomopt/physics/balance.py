"""The balance: mechanism + effects → the force the output needs and the torque the crank needs.

    Q = Σ output terms                 force or torque the mechanism must supply at its output q
    crank torque = Q q' + Σ drive terms        power balance; positive = the motor drives

Only loads that stand in the scene are in the sums. Each term is written in its effect's own file.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Load, Motion, State
from loomopt.physics.schema import Values

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
    return total([total(output) * pose.q1, *drive] if output else drive)
