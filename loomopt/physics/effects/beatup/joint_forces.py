"""Forces in the joints of the beat-up, A to D, and the shaking force and moment on the frame: figures only.

F_J is the force of the part nearer the drive on the next one: frame → crank (A) → rod (B) → rocker (C), frame → rocker
(D); x along A→D, y towards C. Output terms are couples on the rocker, and load D by themselves only where they tell
their force. Weights are those of effect gravity. Shaking force −Σ m a_S, moment −Σ (p_S × m a_S + J α) about A.
"""

import functools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Protocol

from loomopt.base.records import lazy
from loomopt.base.units import ShowValue
from loomopt.maths.systems import Number
from loomopt.physics.effects import pins
from loomopt.physics.effects.beatup import ReedPose, gravity
from loomopt.physics.effects.chain_joints import ChainForces
from loomopt.physics.effects.kinds import Check, Inputs, LinkMass
from loomopt.physics.mechanisms import joint_forces
from loomopt.physics.mechanisms.dyad import Vector, cross
from loomopt.physics.mechanisms.joint_forces import Wrench
from loomopt.physics.schema import Figure

if TYPE_CHECKING:
    from loomopt.physics.mechanisms.chain import Chain, ChainPose
    from loomopt.physics.mechanisms.chain_forces import Walk
    from loomopt.physics.mechanisms.crank_rocker import CrankRockerPose

PLACED = ("mechanism.m4", "mechanism.r4")
"""Without which it is not known where the reed's mass is."""
SHAKING_FORCE = Figure("shaking_force", "force", "peak inertia force of all moving masses on the frame", sides=("max",))


PINS = {
    "A": "crank shaft's bearings",
    "B": "crank pin",
    "C": "joint of rod and rocker",
    "D": "rocking shaft's bearings",
}


SIDES = {
    "force_A": ("frame", "crank"),
    "force_B": ("crank", "rod"),
    "force_C": ("rod", "rocker"),
    "force_D": ("frame", "rocker"),
}


@functools.cache
def crank_rocker() -> "Chain":
    """Crank-rocker as a chain of parts."""
    from loomopt.physics.mechanisms.chain import Chain, Part

    dyad = (("joins", ("B", "D")), ("links", ("rod", "rocker")), ("pin", "C"))
    crank = Part("crank", "crank", (("at", "A"), ("pin", "B")))
    return Chain((Part("pivot", "A"), Part("pivot", "D"), crank, Part("dyad", "rod and rocker", dyad)))


class Swinging(Protocol):
    """Part of a motion that the masses on the rocking shaft read."""

    @property
    def q(self) -> Number:
        """−ψ, rad."""

    @property
    def velocity(self) -> Number:
        """q˙, rad/s."""

    @property
    def acceleration(self) -> Number:
        """q¨, rad/s²."""


class CrankRockerForces(ChainForces):
    """Forces in the joints A to D, N, and on the frame, at one instant; each when it is first read."""

    at: Inputs[ReedPose]

    @property
    def linked(self) -> "Chain":
        """Crank-rocker as a chain of parts."""
        return crank_rocker()

    @lazy
    def placed(self) -> "ChainPose":
        """Crank, rod and rocker at the instant."""
        from loomopt.physics.mechanisms.chain_forces import PlacedLink, placed

        linkage, sides = self.linkage, self.linkage.lengths
        links = {
            "crank": PlacedLink(lambda: linkage.crank, sides.l1, lambda: 1),
            "rod": PlacedLink(lambda: linkage.dyad.link1, sides.l2, lambda: linkage.rod_1),
            "rocker": PlacedLink(lambda: linkage.dyad.link2, sides.l3, lambda: -self.at.pose.q1),
        }
        joints = {"A": Vector(0, 0), "B": linkage.crank, "D": Vector(sides.l4, 0)}
        return placed(self.at.maths, self.at.values, joints, links, {"rod and rocker": lambda: linkage.dyad})

    def loaded(self) -> "Walk":
        """Chain with M3, all masses and weights."""
        from loomopt.physics.mechanisms.chain_forces import Walk

        walk = Walk(self.linked, self.placed)
        walk.load("rocker", Wrench(joint_forces.plus(self.swung.force, *self.loading.pushes), self.loading.force))
        for wrench in (self.rod, self.rod_weight):
            if wrench is not None:
                walk.load("rod", wrench)
        for force in (self.crank, self._crank_weight):
            if force is not None:
                walk.push("crank", force, walk.at("A"))
        return walk

    @property
    def linkage(self) -> "CrankRockerPose":
        """The linkage itself."""
        pose: CrankRockerPose = self.at.pose.joints  # type: ignore[assignment]  # it is one, whole or in symbols
        return pose

    @lazy
    def rod(self) -> Wrench | None:
        """Inertia and weight of the rod, about B; None for a rod without mass."""
        linkage, rods = self.linkage, [pair for pair, _ in self.loading.masses if pair.link == "rod"]
        if not rods:
            return None
        direction = joint_forces.unit(linkage.dyad.link1, linkage.lengths.l2)
        return joint_forces.together(
            joint_forces.inertia(
                body.mass,
                joint_forces.turned(direction, body.along, body.across),
                body.second,
                self._turning(linkage.rod_1, linkage.rod_2),
                self._carried(linkage.crank),
            )
            for body in rods
        )

    def _turning(self, rate: Number, second: Number) -> tuple[Number, Number]:
        """Link's angular speed, rad/s, and acceleration, rad/s², from its derivatives."""
        omega, change = self.at.pose.omega, self.at.pose.omega_dot
        steady = second * omega**2
        return rate * omega, steady if change is None else steady + rate * change

    def _carried(self, arm: Vector) -> Vector:
        """Acceleration, m/s², of a point that turns with the crank."""
        square, change = self.at.pose.omega**2, self.at.pose.omega_dot
        x, y = -square * arm.x, -square * arm.y
        return Vector(x, y) if change is None else Vector(x - change * arm.y, y + change * arm.x)

    @lazy
    def swung(self) -> Wrench:
        """Inertia load of the masses on the rocking shaft, about D."""
        return joint_forces.together(self._swinging()) or Wrench(Vector(0, 0), 0)

    def _swinging(self) -> Iterator[Wrench]:
        for mass, motion in self._on_shaft():
            turning = -motion.velocity, -motion.acceleration
            if motion is self.at.pose:
                line = joint_forces.unit(self.linkage.dyad.link2, self.linkage.lengths.l3)
            else:
                line = Vector(self.at.maths.cos(motion.q), -self.at.maths.sin(motion.q))
            first = joint_forces.turned(line, mass.along, mass.across)
            yield joint_forces.inertia(mass.mass, first, mass.second, turning)

    def _on_shaft(self) -> Iterator[tuple[LinkMass, Swinging]]:
        """Yield the masses that swing about D with their motions: first those in line with the rocker."""
        given, pairs = self.at.values, [pair for pair in self.loading.masses if pair[0].link != "rod"]
        if "m4" in given and "r4" in given and not any(mass.link == "reed" for mass, _ in pairs):
            first = given["m4"] * given["r4"] - given["m4e"] * given["r4e"]
            yield LinkMass("reed", given["m4"] + given["m4e"], first, 0, 0), self.loading.carried
        yield from pairs

    @lazy
    def rod_weight(self) -> Wrench | None:
        """The rod's weight about B; None where it has none."""
        given = self.at.values
        if "gravity.tilt" not in given or "rod_inertia.m2" not in given:
            return None
        force = gravity.weight(self.at.maths, given["rod_inertia.m2"], given["gravity.tilt"])
        share, rod = given["rod_inertia.s2"] / given["today.l2"], self.linkage.dyad.link1
        return Wrench(force, share * cross(rod, force))

    @property
    def _crank_weight(self) -> Vector | None:
        """The crank's weight, N; None where it has none."""
        if "gravity.tilt" not in self.at.values or "crank.mass" not in self.at.values:
            return None
        return gravity.weight(self.at.maths, self.at.values["crank.mass"], self.at.values["gravity.tilt"])

    @lazy
    def crank(self) -> Vector | None:
        """The force of the crank's own mass, N, at A alone; None for a balanced crank."""
        given, crank = self.at.values, self.linkage.crank
        if "crank.mass" not in given or "crank.centre" not in given:
            return None
        share = given["crank.mass"] * given["crank.centre"] / self.linkage.lengths.l1
        carried = self._carried(crank)
        return Vector(-share * carried.x, -share * carried.y)

    @lazy
    def shaking_force(self) -> Vector:
        """Of all moving masses on the frame."""
        others = [self.rod.force] if self.rod else []
        return joint_forces.plus(self.swung.force, *others, *([self.crank] if self.crank else []))

    @lazy
    def shaking_moment(self) -> Number:
        """Of all moving masses on the frame, about A, N·m."""
        about = self.swung.moment + self.linkage.lengths.l4 * self.swung.force.y
        if self.rod is None:
            return about
        return about + self.rod.moment + cross(self.linkage.crank, self.rod.force)


def remark(at: Inputs[object], shown: ShowValue) -> str:
    """Remark that the forces do not contain the cloth's couple."""
    if at.values.get("resistance.pulse") is None or at.values.get("resistance.reach") is not None:
        return ""
    return (
        "force_D contains the resistance of the cloth as a couple, because the point where the cloth pushes is not "
        "given. No other joint force needs it. Give effects.resistance.reach, its distance from the rocking shaft"
    )


EFFECT = Check(
    name="joint_forces",
    summary="forces in the joints, and of all moving masses on the frame",
    table=pins.parameters(PINS),
    rank=85,
    joints=CrankRockerForces,
    link_inertias=("rod", "rod_weight", "swung"),
    vectors=("force_A", "force_B", "force_C", "force_D", SHAKING_FORCE.name),
    scalars=("shaking_moment",),
    sides=SIDES,
    worked={pins.LOSS: "friction_work"},
    wanted={
        **dict.fromkeys(("force_D", SHAKING_FORCE.name), PLACED),
        "shaking_moment": (*PLACED, "effects.inertia.J4"),
        pins.LOSS: (*PLACED, *pins.read("joint_forces", PINS)),
    },
    reads=("m4e", "r4e"),
    needs=("operation.speed",),
    figures=(
        Figure("force_A", "force", "peak force in the crank shaft's bearings", sides=("max",)),
        Figure("force_B", "force", "peak force in the crank pin", sides=("max",)),
        Figure("force_C", "force", "peak force in the joint of rod and rocker", sides=("max",)),
        Figure("force_D", "force", "peak force in the rocking shaft's bearings", sides=("max",)),
        SHAKING_FORCE,
        Figure("shaking_moment", "torque", "peak moment of all moving masses about the crank shaft", sides=("max",)),
        pins.FIGURE,
    ),
    remark=remark,
    examples=({},),
)
