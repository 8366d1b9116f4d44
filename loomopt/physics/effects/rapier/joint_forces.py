"""Forces in the joints of the rapier drive and in its gear mesh: figures only; links are taken for massless.

F_J is the force of the part nearer the drive on the next one: frame → cranks (A0, C0) → links (A, C) → D, B1; sley →
driving link (B2); frame → sley (B0); in the axes of [Hong17]. Wheel and pinion sit on the sley, so that the tape puts
the couple −Q k on the driving link and +Q k on the sley, k = i1 i2 D_wheel/2. The second crank's gear meshes with the
main shaft's, of twice its radius. Left out: what parts the wheels (its pressure angle is not printed), the sector's own
tooth force at B2, and what beats up, whose forces add.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from loomopt.base.records import lazy
from loomopt.base.units import ShowValue
from loomopt.maths.systems import Number
from loomopt.physics.effects import pins
from loomopt.physics.effects.kinds import Check, Inputs, Loading, Motion
from loomopt.physics.mechanisms.dyad import Vector, cross
from loomopt.physics.mechanisms.joint_forces import (
    PairForces,
    Wrench,
    crank_torque,
    minus,
    plus,
    tooth_force,
    two_links,
    unit,
)
from loomopt.physics.schema import Figure

if TYPE_CHECKING:
    from loomopt.physics.mechanisms.rapier_drive import RapierPose

JOINTS = {
    "A0": "peak force in the main shaft's bearings",
    "A": "peak force in the main crank's pin",
    "B0": "peak force in the rocking shaft's bearings",
    "B1": "peak force in the joint of rod and sley",
    "B2": "peak force in the joint of sley and driving link",
    "C0": "peak force in the second shaft's bearings",
    "C": "peak force in the second crank's pin",
    "D": "peak force in the joint of link 5 and driving link",
}


SIDES = {
    "force_A0": ("frame", "crank"),
    "force_A": ("crank", "rod"),
    "force_B0": ("frame", "sley"),
    "force_B1": ("rod", "sley"),
    "force_B2": ("sley", "driving link"),
    "force_C0": ("frame", "second crank"),
    "force_C": ("second crank", "link 5"),
    "force_D": ("link 5", "driving link"),
}
PINS = {joint: text.removeprefix("peak force in the ") for joint, text in JOINTS.items()}


@dataclass(frozen=True)
class RapierForces:
    """Forces in the joints, N, at one instant; each when it is first read."""

    at: Inputs[Any]
    loading: Loading

    @property
    def _drive(self) -> "RapierPose":
        pose: RapierPose = self.at.pose.joints
        return pose

    @lazy
    def couple(self) -> Number:
        """Of the tape, N·m, on the sley; its opposite on the driving link."""
        return self.loading.force * self._drive.dimensions.travel

    @lazy
    def five_bar(self) -> PairForces:
        """Link 5 (C→D) and driving link (B2→D)."""
        return two_links(self._drive.dyad, None, Wrench(Vector(0, 0), -self.couple))

    @lazy
    def sley(self) -> Wrench:
        """Loads on the sley, about B0."""
        push = minus(self.force_B2)
        return Wrench(push, self.couple + cross(self._drive.carrier, push))

    @lazy
    def four_bar(self) -> PairForces:
        """Rod (A→B1) and sley (B0→B1)."""
        return two_links(self._drive.sley_dyad, None, self.sley)

    @lazy
    def _centres(self) -> tuple[Vector, Number]:
        """Unit vector C0→A0, and the pitch radius of the second crank's gear, m."""
        drive, shaft = self._drive, self._drive.main_shaft
        centres = Vector(shaft.x - drive.dimensions.C0x, shaft.y - drive.dimensions.C0y)
        length = self.at.maths.sqrt(centres.x**2 + centres.y**2)
        return unit(centres, length), self.at.values.get("gears.pitch_radius", length / 3)

    @lazy
    def gear_force(self) -> Number:
        """At the pitch circles, on the second crank's gear, to the left of C0→A0."""
        return crank_torque(self._drive.second_crank, self.force_C) / self._centres[1]

    @lazy
    def _mesh(self) -> Vector:
        return tooth_force(self.gear_force, 1, self._centres[0])

    @lazy
    def force_A0(self) -> Vector:
        """Of the frame on the main crank with its gear."""
        return plus(self.force_A, self._mesh)

    @property
    def force_A(self) -> Vector:
        """Of the main crank on the rod."""
        return self.four_bar.outer1

    @property
    def force_B0(self) -> Vector:
        """Of the frame on the sley."""
        return self.four_bar.outer2

    @property
    def force_B1(self) -> Vector:
        """Of the rod on the sley."""
        return self.four_bar.inner

    @property
    def force_B2(self) -> Vector:
        """Of the sley on the driving link."""
        return self.five_bar.outer2

    @lazy
    def force_C0(self) -> Vector:
        """Of the frame on the second crank with its gear."""
        return plus(self.force_C, minus(self._mesh))

    @property
    def force_C(self) -> Vector:
        """Of the second crank on link 5."""
        return self.five_bar.outer1

    @property
    def force_D(self) -> Vector:
        """Of link 5 on the driving link."""
        return self.five_bar.inner

    def heading(self, part: str) -> Vector:
        """Unit direction of a part."""
        drive = self._drive
        d, rod, link = drive.dimensions, drive.sley_dyad, drive.dyad
        vectors = {"crank": (drive.main_crank, d.l1), "rod": (rod.link1, d.l2), "sley": (rod.link2, d.l3)}
        vectors |= {"second crank": (drive.second_crank, d.l4), "link 5": (link.link1, d.l5)}
        return unit(*{**vectors, "driving link": (link.link2, d.l6)}[part])

    @lazy
    def friction_work(self) -> Mapping[str, Number]:
        """Friction torque per newton in the joints, m per rad of the main crank."""
        drive = self._drive
        sense, sley, (link, driving) = drive.stand.sense, drive.phi3_1, drive.rates
        rod, second = sense * drive.four_bar.rod_1, -2 * sense
        turned = {"A0": sense, "A": rod - sense, "B0": sley, "B1": sley - rod, "B2": driving - sley}
        turned |= {"C0": second, "C": link - second, "D": driving - link}
        return pins.works(self.at, {joint: (f"force_{joint}", turn) for joint, turn in turned.items()})


def remark(at: Inputs[object], shown: ShowValue) -> str:
    """Remark that the forces contain nothing of the head."""
    if "head_inertia.mass" in at.values or "tape_friction.force" in at.values:
        return ""
    return "the joint forces do not contain the head: add the effect head_inertia or tape_friction"


EFFECT: Check[Motion] = Check(
    name="joint_forces",
    summary="forces in the joints and in the gear mesh",
    table=pins.parameters(PINS),
    rank=40,
    joints=RapierForces,
    between=("sley",),
    vectors=tuple(f"force_{joint}" for joint in JOINTS),
    scalars=("gear_force",),
    sides=SIDES,
    worked={pins.LOSS: "friction_work"},
    wanted={pins.LOSS: ("operation.speed", *pins.read("joint_forces", PINS))},
    figures=(
        *(Figure(f"force_{joint}", "force", text, sides=("max",)) for joint, text in JOINTS.items()),
        Figure("gear_force", "force", "peak force at the pitch circles of the gears", sides=("max",)),
        pins.FIGURE,
    ),
    remark=remark,
    examples=({},),
)
