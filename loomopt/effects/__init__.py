"""The effects a scene may call for, one file each; an effect absent from a scene is absent from its equations."""

from loomopt.effects.beatup import (
    bearing_friction,
    centrifugal,
    counterweight_inertia,
    gravity,
    resistance,
    rocker_inertia,
    rod_inertia,
)
from loomopt.effects.beatup import inertia as reed_inertia
from loomopt.effects.rapier import head_inertia, tape_friction
from loomopt.effects.shedding import coil, dry_friction, warp_tension, weight
from loomopt.effects.shedding import damping as frame_damping
from loomopt.effects.shedding import inertia as frame_inertia
from loomopt.schema import Effect

BEATUP: dict[str, Effect] = {
    module.EFFECT.name: module.EFFECT
    for module in (
        reed_inertia,
        resistance,
        rocker_inertia,
        counterweight_inertia,
        rod_inertia,
        gravity,
        bearing_friction,
        centrifugal,
    )
}
"""Effects of the beat-up mechanism, in the order its balance lists them."""

RAPIER: dict[str, Effect] = {module.EFFECT.name: module.EFFECT for module in (head_inertia, tape_friction)}
"""Effects of the rapier drive."""

SHEDDING: dict[str, Effect] = {
    module.EFFECT.name: module.EFFECT
    for module in (weight, warp_tension, frame_inertia, frame_damping, dry_friction, coil)
}
"""Effects of the heald frame on its cam, the return spring apart, in the order its balance lists them."""
