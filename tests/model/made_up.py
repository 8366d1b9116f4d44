"""A mechanism that nobody builds, right at sight: a Scotch yoke with a mass, a spring and a cloth."""

from collections.abc import Collection
from dataclasses import dataclass

from support.toy import Still

from loomopt.maths.systems import Maths, Number
from loomopt.physics import balance
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.schema import Table, Values

FRONT, REAR = "front", "rear"


@dataclass(frozen=True)
class Yoke(Still):
    """q = r (1 − cos φ); front at φ = π, rear at 0."""

    structure: str = "yoke"

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> Values:
        return {"stroke": 2 * given.values["r"]}

    def pose(self, maths: Maths, given: Given, node: Node) -> balance.Pose:
        r, phi = given.values["r"], node.phi
        return balance.Pose(
            phi, given.values["speed"], r * (1 - maths.cos(phi)), r * maths.sin(phi), r * maths.cos(phi)
        )

    def still(self, maths: Maths, given: Given, event: str, switch: Values) -> balance.Pose:
        r = given.values["r"]
        q, q2 = {FRONT: (2 * r, -r), REAR: (0 * r, r)}[event]
        return balance.Pose(self.events(maths, given)[event], given.values["speed"], q, 0, q2)

    def events(self, maths: Maths, given: Given) -> Values:
        return {FRONT: maths.pi, REAR: 0 * maths.pi}


class MassTable(Table):
    m: float


class SpringTable(Table):
    k: float
    p: float


class ClothTable(Table):
    F: float
    width: float


def inertia(at: Inputs[balance.Pose]) -> Number:
    return at.table["m"] * at.pose.acceleration


def spring(at: Inputs[balance.Pose]) -> Number:
    return at.table["k"] * (at.pose.q - at.table["p"])


def cloth(at: Inputs[balance.Pose]) -> Number:
    """Return F, faded in from where the cloth is met to the front, where it is let go."""
    contact = -at.maths.cos(at.table["width"])
    return at.switch * at.table["F"] * (-at.maths.cos(at.pose.phi) + contact) / (1 + contact)


def pressed(at: Inputs[object]) -> tuple[Number, ...]:
    """Return where the cloth is met and left, rad: it leaves at the front."""
    return (at.maths.pi - at.table["width"], at.maths.pi)


def presses(angle: float, corners: tuple[float, ...]) -> float:
    begin, end = corners
    return 1.0 if (angle - begin) % 6.283185307179586 < end - begin else 0.0


INERTIA = Load(name="inertia", summary="", table=MassTable, acts="output", force=inertia)
SPRING = Load(name="spring", summary="", table=SpringTable, acts="output", force=spring)
CLOTH = Load(name="cloth", summary="", table=ClothTable, acts="output", force=cloth, corners=pressed, switch=presses)
NUMBERS = {
    "r": 0.05,
    "speed": 60.0,
    "inertia.m": 2.0,
    "spring.k": 3000.0,
    "spring.p": 0.04,
    "cloth.F": 1500.0,
    "cloth.width": 0.9,
}
