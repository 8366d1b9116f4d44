"""Forces in every pin of a linkage, in its guides and gears, and of all moving masses on the frame: figures only.

Solved from the output back to the crank. A force is that on the part that is named with it, or, of a pin between two
links of one group, on the second; the frame feels the opposite. Output terms act on the output's link, or on what
slides; what only turns with the output, or slides with it, shakes the frame with its inertia. About the crank shaft.
"""

import functools
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from loomopt.base.records import lazy
from loomopt.maths.systems import Number
from loomopt.physics.effects import pins
from loomopt.physics.effects.chain_joints import ChainForces
from loomopt.physics.effects.kinds import Applied, Check, Inputs, Loading
from loomopt.physics.effects.linkage import LinkagePose
from loomopt.physics.schema import Figure, Table

if TYPE_CHECKING:
    from loomopt.physics.mechanisms.chain import Chain, ChainPose
    from loomopt.physics.mechanisms.chain_forces import Walk
    from loomopt.physics.mechanisms.dyad import Vector
    from loomopt.physics.mechanisms.joint_forces import Wrench


SENTENCE = (
    "every group from the last part back to the crank: of a dyad R = (N2 r1 + N1 r2)/(r1 x r2), N the moment of all "
    "that acts on a link about its outer joint, masses included; of a slider and of a slot what keeps each link still"
)


class Parameters(Table):
    """No values of its own."""


class LinkageForces(ChainForces):
    """Forces at one instant, by the names of their figures; each when it is first read."""

    def __init__(self, linked: "Chain | None", at: Inputs[Any], loading: Loading) -> None:
        assert linked is not None
        self.at, self.loading, self.pose, self._linked = at, loading, at.pose, linked

    @property
    def linked(self) -> "Chain":
        """Parts of the linkage."""
        return self._linked

    def output(self, size: Number, inertial: bool = False) -> list[Applied]:
        """Loads that a force or torque at the output is; size: as the output counts it."""
        from loomopt.physics.mechanisms.chain import slider_of
        from loomopt.physics.mechanisms.chain_forces import Walk
        from loomopt.physics.mechanisms.dyad import Vector
        from loomopt.physics.mechanisms.moving import scaled

        out, walk = self.pose.output, Walk(self.linked, self.pose.joints)
        size = size if out.sign > 0 else -size
        size = size if self.pose.factor is None else size * self.pose.factor
        if out.measure == "angle":
            against = [Applied(out.against, None, None, -size, inertial)] if out.against else []
            return [Applied(out.name, None, None, size, inertial), *against]
        if out.measure != "slide":
            direction = Vector(1, 0) if out.measure == "x" else Vector(0, 1)
            return [Applied(out.name, scaled(size, direction), None, None, inertial)]
        part = next(candidate for candidate in self.linked.parts if candidate.name == out.name)
        if part.kind == "slider":
            on, under, place = slider_of(part.name), part.word("guide") or "frame", walk.at(part.word("pin"))
            push = scaled(size, walk.sliding(part))
        else:
            on, under, place = part.word("through"), part.word("link"), walk.at(part.word("through"))
            push = scaled(size, self.pose.joints.links[under].unit())
        return [Applied(on, push, place, None, inertial), Applied(under, scaled(-1, push), place)]

    @lazy
    def inertial(self) -> list[Applied]:
        """Loads by the parts that move with the output."""
        if not self.loading.masses:
            return []
        moved = [mass.second * motion.acceleration for mass, motion in self.loading.masses]
        return self.output(-sum(moved[1:], moved[0]), True)

    @property
    def placed(self) -> "ChainPose":
        """The linkage at the instant."""
        pose: ChainPose = self.pose.joints
        return pose

    def loaded(self) -> "Walk":
        """The chain with all its loads."""
        from loomopt.physics.mechanisms import chain_forces

        loads = [*self.loading.applied, *self.output(-self.loading.force)]
        return chain_forces.loaded(self.linked, self.placed, loads)

    @lazy
    def _shaken(self) -> "Wrench":
        from loomopt.physics.mechanisms import chain_forces

        shaft = next(part.word("at") for part in self.linked.parts if part.kind in ("crank", "cam"))
        place = self.pose.joints.joints[shaft].place
        return chain_forces.shaken([*self.loading.applied, *self.inertial], self.pose.joints, place)

    @property
    def shaking_force(self) -> "Vector":
        """Of all moving masses on the frame, N."""
        return self._shaken.force

    @property
    def shaking_moment(self) -> Number:
        """Of all moving masses on the frame, about the crank shaft, N·m."""
        return self._shaken.moment


@functools.lru_cache(maxsize=64)
def fitted(linked: "Chain") -> Check[LinkagePose]:
    """Check of a linkage, with a figure for every force that it has."""
    from loomopt.physics.mechanisms import chain_forces

    vectors, teeth = {}, {f"teeth_{gear}": gear for gear in chain_forces.meshing_gears(linked)}
    parts, places = {part.name: part for part in linked.parts}, chain_forces.names(linked)
    for (joint, part), name in places.items():
        where = f"in joint {joint}" if joint != part else f"in the guide of {part}"
        shared = f", of {part}" if joint != name and parts[part].kind != "pivot" else ""
        vectors[f"force_{name}"] = f"peak force {where}{shared}"
    shaking = {"shaking_force": "peak inertia force of all moving masses on the frame"}
    forces = [Figure(name, "force", text, sides=("max",)) for name, text in (vectors | shaking).items()]
    forces += [
        Figure(name, "force", f"peak force of the teeth of {gear}", sides=("max",)) for name, gear in teeth.items()
    ]
    rubbed = {name: f"joint {joint}" for (joint, _), name in chain_forces.pin_forces(linked).items()}
    moment = "peak moment of all moving masses about the crank shaft"
    return replace(
        EFFECT,
        table=pins.parameters(rubbed),
        sides={f"force_{name}": chain_forces.body_pair(linked, place) for place, name in places.items()},
        worked={pins.LOSS: "friction_work"},
        wanted={pins.LOSS: ("operation.speed", *pins.read("joint_forces", rubbed))},
        joints=functools.partial(LinkageForces, linked),
        vectors=(*vectors, *shaking),
        scalars=(*teeth, "shaking_moment"),
        figures=(*forces, Figure("shaking_moment", "torque", moment, sides=("max",)), pins.FIGURE),
        fitted=None,
    )


EFFECT: Check[LinkagePose] = Check(
    name="joint_forces",
    summary="forces in the joints, and of all moving masses on the frame",
    table=Parameters,
    rank=90,
    joints=functools.partial(LinkageForces, None),
    fitted=fitted,
    sentence=SENTENCE,
    examples=({},),
    of_masses="forces in the joints and on the frame",
)
