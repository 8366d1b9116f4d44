"""The mechanism with its effects at one instant, and the formulas that are read there: quantities, rows, integrals."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from loomopt.maths.systems import Maths, Number
from loomopt.physics import balance
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node, Where
from loomopt.physics.schema import Values

if TYPE_CHECKING:
    from loomopt.program.model import JobModel


class Instant:
    """The mechanism with its effects at one node, in one number system; what no formula reads is not computed.

    event: where it stands at an event of the motion, whose pose is exact.
    """

    def __init__(self, model: "JobModel", maths: Maths, given: Given, node: Node, event: str = "") -> None:
        self.model, self.maths, self.given, self.node, self.event = model, maths, given, node, event
        self._pose: Number = None

    @property
    def values(self) -> Values:
        """The scene's numbers and what follows from them, by name."""
        return self.given.values

    @property
    def pose(self) -> Number:
        """The mechanism's pose."""
        # Not functools.cached_property: its lock costs as much as a node's own arithmetic.
        if self._pose is None:
            kinematics = self.model.kinematics
            if self.event:
                self._pose = kinematics.still(self.maths, self.given, self.event, self.node.switch)
            else:
                self._pose = kinematics.pose(self.maths, self.given, self.node)
        return self._pose

    @property
    def force(self) -> Number:
        """Q, N or N·m: what the mechanism must supply at its output."""
        return balance.output_force(self.maths, self.model.loads, self.pose, self.given, self.node.switch)

    @property
    def crank_torque(self) -> Number:
        """The torque on the crank, N·m."""
        return balance.crank_torque(self.maths, self.model.loads, self.pose, self.given, self.node.switch)

    def terms(self) -> dict[str, Number]:
        """Return each load's term by its name, N or N·m."""
        found = balance.terms(self.maths, self.model.loads, self.pose, self.given, self.node.switch)
        return {load.name: term for load, term in found}

    def switched(self, **switch: Number) -> "Instant":
        """Return the same node with other switches."""
        node = Node(self.node.phi, {**self.node.switch, **switch})
        return Instant(self.model, self.maths, self.given, node, self.event)

    def at_speed(self, speed: Number) -> "Instant":
        """Return the same node with the crank at another speed, rad/s; its pose must be a dataclass with `omega`."""
        found = Instant(self.model, self.maths, self.given, self.node, self.event)
        found._pose = replace(self.pose, omega=speed)
        return found


Formula = Callable[[Instant], Number]


class Quantity(NamedTuple):
    """A whole-cycle quantity; figure: whether its largest |value| is one.

    signed: the largest value counts, not the largest |value|; bounded: its formula runs on series of balls, so that a
    bound between points is proven with every answer; loaded: it reads the sum of the loads, so that it is known only
    where all of them are.
    """

    formula: Formula
    figure: bool = True
    signed: bool = False
    bounded: bool = False
    loaded: bool = False


class Row(NamedTuple):
    """A value of the design alone, or of the position at an event; needs: scene numbers without which there is none."""

    formula: Formula
    needs: tuple[str, ...] = ()
    event: str = ""


class Integral(NamedTuple):
    """A mean of `quantity` over the crank angle; root: its square root.

    Over the pieces `where`; or, with `angles` (rad), over these alone, each with one number of `data` as the switch
    "datum". parts: of each piece, where one rule does not resolve what rings on it.
    """

    name: str
    root: str
    quantity: str
    where: Where | None = None
    angles: tuple[float, ...] = ()
    data: tuple[float, ...] = ()
    parts: int = 1
