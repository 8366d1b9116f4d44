"""What a state is given and gives: a coordinate of its own, and the loads that move with it, in the steady state."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from loomopt.maths.systems import Maths, Number
from loomopt.schema import Values


class Oscillator(Protocol):
    """What a state is made of, as `motion/harmonic.py` has it: what a load with corners makes of it is read here."""

    @property
    def turn(self) -> Number:
        """Time of one turn, s."""

    def steady(self, frequency: Number, /) -> tuple[Number, Number]:
        """Return A and B of its answer A cos Ωt + B sin Ωt to the force cos Ωt; frequency: Ω, rad/s."""

    def repeated(self, position: Number, rate: Number, /) -> tuple[Number, Number]:
        """Return z and z˙ just after a kick of both, once a turn for ever."""

    def ringing(self, after: tuple[Number, Number], elapsed: Number, /) -> tuple[Number, Number]:
        """Return z and z˙ of the free vibration that begins with `after`; elapsed: time since then, s."""


class Carried(NamedTuple):
    """What moves with a state's coordinate.

    inertia: of it all, kg·m² or kg; weigh(angles, weights): sums Σ weights[k][i] F(angles[i]) at crank angles, rad, of
    the terms F without corners.
    """

    inertia: Number
    weigh: Callable[[Sequence[Number], Sequence[Sequence[Number]]], list[Number]]


class UnsteadyError(ArithmeticError):
    """There is no steady state to trust: the problem, and the remedy, in words."""

    def __init__(self, problem: str, remedy: str) -> None:
        super().__init__(problem)
        self.problem, self.remedy = problem, remedy


class Moved(NamedTuple):
    """What is read of a state at one instant; force(): Q, N or N·m; coordinate(): z, the reply of corners included."""

    pose: Number
    coordinate: Callable[[], Number]
    force: Callable[[], Number]


class Written(NamedTuple):
    """Symbols in which a state writes its equation of motion: z, z', z'' with respect to φ, and what it answers."""

    coordinate: tuple[Number, Number, Number]
    omega: Number
    inertia: Number
    force: Number


class Replied(Protocol):
    """formula(maths, pose, given, own, reply): of derived values; reply: z and z˙ in answer to loads with corners."""

    def __call__(
        self, maths: Maths, pose: Number, given: Values, own: Values, reply: tuple[Number, Number], /
    ) -> Number:
        """Return the value, SI."""
