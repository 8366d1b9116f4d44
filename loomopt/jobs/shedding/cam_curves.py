"""The cam of a shedding design as curves: that of the roller's centre and the real profile, as fine as one needs."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from loomopt import maths
from loomopt.cycle import Floats
from loomopt.designs import flat
from loomopt.jobs.shedding import design as shedding_design
from loomopt.jobs.shedding import fault as shedding_fault
from loomopt.jobs.shedding.model import FOLLOWER
from loomopt.mechanisms.cam_follower import Contact, Follower
from loomopt.mechanisms.dyad import Vector
from loomopt.program.sampling import Sampler
from loomopt.scene_errors import refusal
from loomopt.scenes import Scene

CLOSE = 5e-7
"""How far, m, a traced curve may lie from the true one: half of the micrometre that is promised."""
NARROW = 1e-8
"""The same as a share of the machine, where that is more: what a machine of a kilometre is traced by."""
INSIDE = np.linspace(0.0, 1.0, 9)
"""Where an interval's deviation is looked for, its ends included."""
MOST_PARTS = 32
"""Parts into which one round of tracing divides an interval at most."""

Pieces = NDArray[np.intp]


@dataclass(frozen=True)
class Stations:
    """What the workshop needs at n cam angles: theta, rad, as the sampler counts them; X, m, and the contact there."""

    theta: Floats
    X: Floats
    contact: Contact

    @property
    def pitch(self) -> Floats:
        """The roller's centre in the cam's frame, (n, 2) m."""
        return _rows(self.contact.centre(self.theta))

    @property
    def profile(self) -> Floats:
        """The cam's surface under the roller, (n, 2) m."""
        return _rows(self.contact.profile(self.theta))


@dataclass(frozen=True)
class Cam:
    """The cam of one design, ready to be read anywhere on its turn; numbers SI."""

    sampler: Sampler
    follower: Follower

    def stations(self, pieces: Pieces, u: Floats) -> Stations:
        """Return what stands at nodes (pieces, u) of the sampler's cycle."""
        cycle, physics = self.sampler.cycle, self.sampler.model
        theta, switches = cycle.angles(pieces, u), list(cycle.switches[pieces].T)
        pose = physics.pose(maths.numpy(), self.sampler.given, theta, switches)  # type: ignore[attr-defined]
        return Stations(theta, pose.q, pose.contact(self.follower))

    def at(self, theta: Floats) -> Stations:
        """Return what stands at cam angles, rad; at a corner, just behind it."""
        nodes = [self.sampler.cycle.located(float(angle)) for angle in theta]
        return self.stations(np.array([piece for piece, _ in nodes]), np.array([u for _, u in nodes]))

    @property
    def segments(self) -> dict[str, tuple[float, float]]:
        """Cam angles, rad, between which each segment lasts."""
        values = self.sampler.given.values
        far, turn, near = (float(values[f"begin.{name}"]) for name in ("far", "return", "near"))
        return {"rise": (0, far), "far dwell": (far, turn), "return": (turn, near), "near dwell": (near, 2 * math.pi)}


def _rows(points: Vector) -> Floats:
    return np.column_stack((points.x, points.y))


def missing(scene: Scene) -> tuple[str, ...]:
    """Return the keys of the follower that a scene does not give: without them there is no cam to draw."""
    return tuple(name for name in FOLLOWER if scene.mechanism.get(name) is None)


def cam(scene: Scene, design: Mapping[str, float]) -> Cam:
    """Return the cam of a design, SI (today's number for what it does not name). Raises BadInput where there is none.

    A cam that is undercut is one.
    """
    lacking = missing(scene)
    if lacking:
        keys = ", ".join(f"mechanism.{name}" for name in lacking)
        remedy = f"Give them in [mechanism]; a roller follower has {', '.join(FOLLOWER)}"
        raise refusal("the cam cannot be drawn without its follower", scene.origin, keys, remedy=remedy)
    given = flat(design)
    values = shedding_design.values_of(scene, given)
    fault = shedding_fault.design(values)
    if fault:
        raise refusal(f"the cam cannot be drawn: {fault}", scene.origin, "mechanism", remedy="Correct it")
    sampler = shedding_design.sampler(scene, given)
    return Cam(sampler, Follower(**{name: values[name] for name in FOLLOWER}))


def traced(found: Cam) -> Stations:
    """Return stations once round, the last before the first again, close enough that straight lines join them.

    No point of the profile or of the roller centre's curve is farther than CLOSE from the lines. Corners of the law
    are stations.
    """
    follower, starts = found.follower, found.sampler.cycle.starts
    allowed = max(CLOSE, NARROW * (follower.arm + follower.centre_distance))
    widths = np.diff(starts)
    there = np.flatnonzero(widths > 0.0)
    parts = np.maximum(2, np.ceil(widths[there] / math.radians(2.0)).astype(int))
    pieces, left, right = _divided(there, np.zeros(len(there)), np.ones(len(there)), parts)
    while True:
        far = _deviation(found, pieces, left, right)
        parts = np.clip(np.ceil(np.sqrt(far / allowed)).astype(int), 1, MOST_PARTS)
        if np.all(parts == 1):
            return found.stations(pieces, left)
        pieces, left, right = _divided(pieces, left, right, parts)


def _divided(pieces: Pieces, left: Floats, right: Floats, parts: NDArray[np.int_]) -> tuple[Pieces, Floats, Floats]:
    """Return intervals [left, right] of pieces, each divided into so many equal parts."""
    which = np.repeat(np.arange(len(parts)), parts)
    place = np.arange(len(which)) - np.repeat(np.cumsum(parts) - parts, parts)
    low, high, share = left[which], right[which], parts[which]
    begin, end = (low * (1 - k) + high * k for k in (place / share, (place + 1) / share))
    return pieces[which], begin, np.where(place + 1 == share, high, end)


def _deviation(found: Cam, pieces: Pieces, left: Floats, right: Floats) -> Floats:
    """Return how far, m, the curves lie from the straight lines that join the ends of each interval."""
    u = left[:, None] * (1 - INSIDE) + right[:, None] * INSIDE
    at = found.stations(np.repeat(pieces, len(INSIDE)), u.ravel())
    return np.maximum(*(_off_chord(points.reshape(*u.shape, 2)) for points in (at.profile, at.pitch)))


def _off_chord(points: Floats) -> Floats:
    """Return the greatest distance, m, of points (n, k, 2) from the straight line between first and last."""
    from_start, chord = points - points[:, :1], points[:, -1:] - points[:, :1]
    length = np.sum(chord**2, axis=2)
    share = np.sum(from_start * chord, axis=2) / np.where(length > 0.0, length, 1.0)
    nearest = np.clip(share, 0.0, 1.0)[:, :, None] * chord
    return np.asarray(np.max(np.hypot(*np.moveaxis(from_start - nearest, 2, 0)), axis=1), dtype=float)
