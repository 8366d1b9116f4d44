"""Forces between cam and lever, in their bearings, and of the moving masses on the frame: figures only.

Cam shaft O, y to the lever's pivot (0, a), the cam turns anticlockwise. The lever carries the couple N λ, λ = travel/
arm_swing; the cam pushes its roller along the outward normal n with F_n = N λ/(l cos α), aside along the lever with
F_n sin α; torque on the cam F_n (p × n) = N X'. The rod to the frame acts at `lever.arm` from the pivot. The cam cannot
pull: where N is negative there is no contact and no force.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from loomopt.base.records import lazy
from loomopt.maths.systems import Number
from loomopt.physics.effects import pins
from loomopt.physics.effects.kinds import Check, Inputs, Loading
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.schema import Figure

if TYPE_CHECKING:
    from loomopt.physics.mechanisms.cam_follower import Contact

SWUNG = ("mechanism.arm_swing",)
FOLLOWED = ("mechanism.arm", "mechanism.centre_distance", "mechanism.base_radius", "mechanism.roller_radius", *SWUNG)
LEVER = ("mechanism.lever.arm", "mechanism.lever.direction")


PUSHES = ("roller_force", "roller_side", "cam_shaft_force", "lever_couple", "lever_pivot_force")
"""Forces that are absent without contact."""

PINS = {"shaft": "cam shaft's bearings", "roller": "pin of the roller, which rolls", "lever": "pivot of the lever"}


@dataclass(frozen=True)
class CamForces:
    """Forces at one instant, N; each when it is first read."""

    at: Inputs[Any]
    loading: Loading

    @lazy
    def _contact(self) -> "Contact":
        from loomopt.physics.mechanisms.cam_follower import Follower

        names = [key.removeprefix("mechanism.") for key in FOLLOWED]
        contact: Contact = self.at.pose.contact(Follower(**{name: self.at.values[name] for name in names}))
        return contact

    @lazy
    def lever_couple(self) -> Number:
        """N λ, N·m."""
        return self.loading.force * self.at.values["travel"] / self.at.values["arm_swing"]

    @lazy
    def _across(self) -> Number:
        """Component of the roller's force that turns the lever."""
        return self.lever_couple / self.at.values["arm"]

    @lazy
    def roller_force(self) -> Number:
        """Of the cam on the roller, along the normal."""
        along, _ = self._contact.sides
        return self._across * self._contact.speed / along

    @lazy
    def push(self) -> Vector:
        """The force of the cam on the roller, and of the frame on the cam's shaft."""
        normal = self._contact.normal(0)
        return Vector(-self.roller_force * normal.x, -self.roller_force * normal.y)

    @property
    def cam_shaft_force(self) -> Number:
        """In the cam shaft's bearings."""
        return self.roller_force

    @lazy
    def roller_side(self) -> Number:
        """Component of the roller's force along the lever, from its pivot to the roller."""
        along, across = self._contact.sides
        return -self._across * across / along

    @lazy
    def lever_pivot_force(self) -> Vector:
        """Force of the frame on the lever: the balance of roller and rod."""
        normal, angle = self._contact.normal(0), self.at.values["lever.direction"]
        rod = self.lever_couple / self.at.values["lever.arm"]
        return Vector(
            self.roller_force * normal.x - rod * self.at.maths.cos(angle),
            self.roller_force * normal.y - rod * self.at.maths.sin(angle),
        )

    @lazy
    def shaking_force(self) -> Vector:
        """Of frame and spring on the loom, N; y upward, against X."""
        force = self.loading.inertia * self.at.pose.acceleration
        return Vector(0 * force, force)

    def heading(self, part: str) -> Vector:
        """Unit direction of the cam, x where it begins to rise, or of the lever, to its roller."""
        cos, sin = self.at.maths.cos, self.at.maths.sin
        if part == "cam":
            return Vector(cos(self.at.pose.phi), sin(self.at.pose.phi))
        return Vector(-sin(self._contact.angle), -cos(self._contact.angle))

    @lazy
    def friction_work(self) -> Mapping[str, Number]:
        """Friction work per newton in each pin, m per rad of the cam; the roller rolls and does not slip."""
        turned = {
            "shaft": ("cam_shaft_force", 1),
            "roller": ("roller_force", self._contact.rolling),
            "lever": ("lever_pivot_force", self._contact.phi_1),
        }
        return pins.works(self.at, turned)


EFFECT = Check(
    name="joint_forces",
    summary="forces of the roller, in its lever and the cam shaft, and of the moving masses",
    table=pins.parameters(PINS),
    rank=95,
    joints=CamForces,
    vectors=("lever_pivot_force", "shaking_force"),
    scalars=PUSHES[:-1],
    sides={
        "roller_force": ("cam", "lever"),
        "cam_shaft_force": ("frame", "cam"),
        "lever_pivot_force": ("frame", "lever"),
    },
    directed={"roller_force": "push", "cam_shaft_force": "push"},
    signed=("roller_force", "cam_shaft_force", "lever_couple"),
    pushes=(*PUSHES, pins.LOSS),
    worked={pins.LOSS: "friction_work"},
    wanted={
        pins.LOSS: ("operation.speed", *FOLLOWED, *LEVER, *pins.read("joint_forces", PINS)),
        "roller_force": FOLLOWED,
        "roller_side": FOLLOWED,
        "cam_shaft_force": FOLLOWED,
        "lever_couple": SWUNG,
        "lever_pivot_force": (*FOLLOWED, *LEVER),
        "shaking_force": ("effects.inertia.M",),
    },
    figures=(
        Figure("roller_force", "force", "peak force of the cam on the roller", sides=("max",)),
        Figure("roller_side", "force", "peak force of the cam along the lever", sides=("max",)),
        Figure("cam_shaft_force", "force", "peak force in the cam shaft's bearings", sides=("max",)),
        Figure("lever_couple", "torque", "peak torque that the lever carries", sides=("max",)),
        Figure("lever_pivot_force", "force", "peak force in the lever's pivot", sides=("max",)),
        Figure("shaking_force", "force", "peak inertia force of frame and spring", sides=("max",)),
        pins.FIGURE,
    ),
    examples=({},),
)
