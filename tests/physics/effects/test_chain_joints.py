"""Mechanisms with formulas of their own, as chains of parts: what their effects declare is what the chain says."""

import pytest

from loomopt.physics.effects.beatup import joint_forces as beatup
from loomopt.physics.effects.rapier import joint_forces as rapier
from loomopt.physics.mechanisms.chain_forces import body_pair, names, pin_forces

CHAINS = {
    "beatup": (beatup, beatup.crank_rocker()),
    "rapier": (rapier, rapier.drive(False)),
    "rapier with a pitch radius": (rapier, rapier.drive(True)),
}


@pytest.mark.parametrize(("effect", "linked"), CHAINS.values(), ids=CHAINS)
def test_forces_are_between_the_bodies_that_the_effect_names(effect, linked):
    assert {f"force_{name}": body_pair(linked, place) for place, name in names(linked).items()} == effect.SIDES
    assert {*pin_forces(linked).values()} == effect.PINS.keys()
    assert {*effect.SIDES} <= {*effect.EFFECT.vectors}
