"""The effects a scene may call for, one file each; an effect absent from a scene is absent from its equations."""

from loomopt.effects import (
    bearing_friction,
    centrifugal,
    counterweight_inertia,
    gravity,
    head_inertia,
    reed_inertia,
    resistance,
    rocker_inertia,
    rod_inertia,
    tape_friction,
)
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
