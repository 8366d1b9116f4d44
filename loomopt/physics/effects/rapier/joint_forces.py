"""Forces in the joints of the rapier drive and in its gear mesh: figures only; links are taken for massless.

F_J is the force of the part nearer the drive on the next one: frame → cranks (A0, C0) → links (A, C) → D, B1; sley →
driving link (B2); frame → sley (B0); in the axes of [Hong17]. Wheel and pinion sit on the sley, so that the tape puts
the couple −Q k on the driving link and +Q k on the sley, k = i1 i2 D_wheel/2. The second crank's gear meshes with the
main shaft's, of twice its radius. Left out: what parts the wheels (its pressure angle is not printed), the sector's own
tooth force at B2, and what beats up, whose forces add.
"""

import functools
from typing import TYPE_CHECKING

from loomopt.base.records import lazy
from loomopt.base.units import ShowValue
from loomopt.maths.systems import Number
from loomopt.physics.effects import pins
from loomopt.physics.effects.chain_joints import ChainForces
from loomopt.physics.effects.kinds import Check, Inputs, Motion
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.mechanisms.joint_forces import Wrench, plus
from loomopt.physics.schema import Figure

if TYPE_CHECKING:
    from loomopt.physics.mechanisms.chain import Chain, ChainPose
    from loomopt.physics.mechanisms.chain_forces import Walk
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


@functools.cache
def drive(pitch_radius: bool) -> "Chain":
    """Drive as a chain of parts; pitch_radius: whether the scene gives that of the second crank's gear."""
    from loomopt.physics.mechanisms.chain import Chain, Part, Ref

    gear = (("at", "C0"), ("with", "crank"), ("ratio", -2), ("pin", "C"))
    radius = (("radius", Ref("gears.pitch_radius")),) if pitch_radius else ()
    four_bar = (("joins", ("A", "B0")), ("links", ("rod", "sley")), ("pin", "B1"))
    five_bar = (("joins", ("C", "B2")), ("links", ("link 5", "driving link")), ("pin", "D"))
    return Chain(
        (
            *(Part("pivot", name) for name in ("A0", "B0", "C0")),
            Part("crank", "crank", (("at", "A0"), ("pin", "A"))),
            Part("dyad", "four-bar", four_bar),
            Part("point", "B2", (("on", "sley"),)),
            Part("gear", "second crank", gear, radius),
            Part("dyad", "five-bar", five_bar),
        )
    )


class RapierForces(ChainForces):
    """Forces in the joints, N, at one instant; each when it is first read."""

    @property
    def linked(self) -> "Chain":
        """Drive as a chain of parts."""
        return drive("gears.pitch_radius" in self.at.values)

    @lazy
    def placed(self) -> "ChainPose":
        """Both cranks, both groups and the sley at the instant."""
        from loomopt.physics.mechanisms.chain_forces import PlacedLink, placed

        pose: RapierPose = self.at.pose.joints
        d, sense = pose.dimensions, pose.stand.sense
        links = {
            "crank": PlacedLink(lambda: pose.main_crank, d.l1, lambda: sense),
            "rod": PlacedLink(lambda: pose.sley_dyad.link1, d.l2, lambda: sense * pose.four_bar.rod_1),
            "sley": PlacedLink(lambda: pose.sley_dyad.link2, d.l3, lambda: pose.phi3_1),
            "second crank": PlacedLink(lambda: pose.second_crank, d.l4, lambda: -2 * sense),
            "link 5": PlacedLink(lambda: pose.dyad.link1, d.l5, lambda: pose.rates[0]),
            "driving link": PlacedLink(lambda: pose.dyad.link2, d.l6, lambda: pose.rates[1]),
        }
        centre = Vector(d.C0x, d.C0y)
        joints = {"A0": pose.main_shaft, "B0": Vector(0, 0), "B2": pose.carrier, "C0": centre}
        joints |= {"A": plus(pose.main_shaft, pose.main_crank), "C": plus(centre, pose.second_crank)}
        groups = {"four-bar": lambda: pose.sley_dyad, "five-bar": lambda: pose.dyad}
        return placed(self.at.maths, self.at.values, joints, links, groups)

    @lazy
    def sley(self) -> Wrench | None:
        """All loads on the sley, about B0; symbols in equations."""
        return self._with_tape().solve_all().acting("sley")

    def loaded(self) -> "Walk":
        """Chain with the couple of the tape."""
        walk = self._with_tape()
        walk.symbols.update({"sley": wrench} if (wrench := self.__dict__.get("sley")) else {})
        return walk

    def _with_tape(self) -> "Walk":
        """Chain with the couple of the tape on the sley, and its opposite on the driving link."""
        from loomopt.physics.mechanisms.chain_forces import Walk

        walk, couple = Walk(self.linked, self.placed), self.loading.force * self.at.pose.joints.dimensions.travel
        walk.load("driving link", Wrench(Vector(0, 0), -couple))
        walk.load("sley", Wrench(Vector(0, 0), couple))
        return walk

    @property
    def gear_force(self) -> Number:
        """At the pitch circles, on the second crank's gear, to the left of C0→A0."""
        return self.walk.teeth["second crank"]


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
    link_inertias=("sley",),
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
