"""Speed of the crank over the turn, of any output."""

from loomopt.physics.effects.speed_fluctuation import EFFECT

__all__ = ["EFFECT", "SLIDING"]

SLIDING = EFFECT
