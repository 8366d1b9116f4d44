"""The balance: mechanism + effects → the force the output needs and the torque the crank needs.

    Q = Σ output terms                 force or torque the mechanism must supply at its output q
    crank torque = Q q' + Σ drive terms        power balance; positive = the motor drives

Only loads that stand in the scene are in the sums. Each term is written in its effect's own file.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from loomopt.maths import Maths, Number
from loomopt.schema import Load, Values


class Motion:
    """What every pose knows: q, q1, q2 (output and its derivatives with respect to φ) give q˙ and q¨."""

    q: Number
    q1: Number
    q2: Number
    omega: Number
    omega_dot: Number

    @property
    def velocity(self) -> Number:
        """q˙ = q' ω."""
        return self.q1 * self.omega

    @property
    def acceleration(self) -> Number:
        """q¨ = q'' ω² + q' ω̇; the second term only where the speed changes."""
        steady = self.q2 * self.omega**2
        return steady if self.omega_dot is None else steady + self.q1 * self.omega_dot


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
    joints: Any = None
    omega_dot: Number = None


@dataclass(frozen=True)
class Given:
    """All numbers of a scene in one number system: `values` by name, `own` values of each effect."""

    values: Values
    own: Mapping[str, Values]


def terms(
    maths: Maths, loads: Sequence[Load], pose: Motion, given: Given, switches: Sequence[Number]
) -> Iterator[tuple[Load, Number]]:
    """Yield each load with its term; switches[i] says which of its formulas holds (see `Load.switch`)."""
    for load, switch in zip(loads, switches, strict=True):
        yield load, _term(maths, load, pose, given, switch)


def _term(maths: Maths, load: Load, pose: Motion, given: Given, switch: Number) -> Number:
    return load.force(maths, pose, given.values, given.own[load.name], switch)


def total(numbers: Sequence[Number]) -> Number:
    """Return the sum without a leading zero term; 0 for none."""
    if not numbers:
        return 0
    result = numbers[0]
    for number in numbers[1:]:
        result = result + number
    return result


def output_force(maths: Maths, loads: Sequence[Load], pose: Motion, given: Given, switches: Sequence[Number]) -> Number:
    """Return Q, N or N·m: what the mechanism must supply at its output."""
    acting = [(load, switch) for load, switch in zip(loads, switches, strict=True) if load.acts == "output"]
    return total([_term(maths, load, pose, given, switch) for load, switch in acting])


def crank_torque(maths: Maths, loads: Sequence[Load], pose: Motion, given: Given, switches: Sequence[Number]) -> Number:
    """Return the torque on the crank, N·m: Q q' and the drive's own terms."""
    found = list(terms(maths, loads, pose, given, switches))
    output = [term for load, term in found if load.acts == "output"]
    drive = [term for load, term in found if load.acts == "drive"]
    return total([total(output) * pose.q1, *drive] if output else drive)
