"""Motion of a mechanism as plain data: positions of joints at crank angles, and rigid curves that turn."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from loomopt.physics.cycle import TURN
from loomopt.picture.shapes import Floats, Point

POSES = 180
"""Positions of one turn that a moving picture is made of."""


def crank_angles() -> Floats:
    """Crank angles of a turn that a moving picture is made of, (POSES,) rad."""
    return np.asarray(TURN / POSES * np.arange(POSES), dtype=np.float64)


class Turning(NamedTuple):
    """Closed rigid curve that turns about a fixed joint, such as a cam.

    points: where it stands at turn 0, m, from the joint; turns: by how much it has turned at each crank angle, rad.
    """

    joint: str
    points: tuple[Point, ...]
    turns: Floats


@dataclass(frozen=True)
class MechanismMotion:
    """Joints and links at crank angles: who shows them looks positions up, and computes no mechanics.

    angles: crank angles, (n,) rad. joints: name → positions, (n, 2) m; fixed ones stand in `pivots`. links, springs:
    pairs of both. rings: joint and radius, m, of a circle about it. unnamed: joints that are only ends of a line.
    """

    angles: Floats
    pivots: Mapping[str, Point]
    joints: Mapping[str, Floats]
    links: tuple[tuple[str, str], ...]
    rings: tuple[tuple[str, float], ...] = ()
    turning: tuple[Turning, ...] = ()
    springs: tuple[tuple[str, str], ...] = ()
    unnamed: frozenset[str] = frozenset()
