"""Torsion of the shaft between the output's link and the driven parts."""

from loomopt.physics.effects.shaft_torsion import EFFECT

__all__ = ["EFFECT", "SLIDING"]

SLIDING = None
"""What slides has no shaft."""
