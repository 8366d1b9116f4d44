"""The cam of a shedding design as curves: that of the roller's centre and the real profile, as fine as one needs."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from loomopt import maths
from loomopt.cycle import Floats, Pieces
from loomopt.designs import flat
from loomopt.jobs import registry
from loomopt.jobs.shedding.model import FOLLOWER, follower
from loomopt.mechanisms.cam_follower import Contact, Follower
from loomopt.mechanisms.dyad import Vector
from loomopt.picture import tracing
from loomopt.program.sampling import Extreme, Sampler
from loomopt.scene_errors import refusal
from loomopt.scenes import Scene

CLOSE = 5e-7
"""How far, m, a traced curve may lie from the true one: half of the micrometre that is promised."""
NARROW = 1e-8
"""The same as a share of the machine, where that is more: what a machine of a kilometre is traced by."""


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


def _rows(points: Vector) -> Floats:
    return np.column_stack((points.x, points.y))


@dataclass(frozen=True)
class Cam:
    """The cam of one design, ready to be read anywhere on its turn; numbers SI."""

    sampler: Sampler

    @property
    def follower(self) -> Follower:
        """The roller follower."""
        return follower(self.sampler.given.values)

    def stations(self, pieces: Pieces, u: Floats) -> Stations:
        """Return what stands at nodes (pieces, u) of the sampler's cycle."""
        node = self.sampler.node(pieces, u)
        pose = self.sampler.model.instant(maths.numpy(), self.sampler.given, node).pose
        return Stations(node.phi, pose.q, pose.contact(self.follower))

    def at(self, theta: Floats) -> Stations:
        """Return what stands at cam angles, rad; at a corner, just behind it."""
        return self.stations(*self.sampler.cycle.located(theta))

    @property
    def segments(self) -> dict[str, tuple[float, float]]:
        """Cam angles, rad, between which each segment lasts."""
        values = self.sampler.given.values
        far, turn, near = (float(values[f"begin.{name}"]) for name in ("far", "return", "near"))
        return {"rise": (0, far), "far dwell": (far, turn), "return": (turn, near), "near dwell": (near, 2 * math.pi)}

    @property
    def undercut(self) -> Extreme | None:
        """Where it is undercut most: the roller is larger than the circle that its centre's curve bends by."""
        sharpest = self.sampler.extremes("curvature")[0]
        return sharpest if sharpest.value * self.follower.roller_radius >= 1.0 else None


def missing(scene: Scene) -> tuple[str, ...]:
    """Return the keys of the follower that a scene does not give: without them there is no cam to draw."""
    return tuple(name for name in FOLLOWER if scene.mechanism.get(name) is None)


def cam(scene: Scene, design: Mapping[str, Any]) -> Cam:
    """Return the cam of a design, SI (today's number for what it does not name). Raises BadInput where there is none.

    A cam that is undercut is one.
    """
    lacking = missing(scene)
    if lacking:
        keys = ", ".join(f"mechanism.{name}" for name in lacking)
        remedy = f"Give them in [mechanism]; a roller follower has {', '.join(FOLLOWER)}"
        raise refusal("the cam cannot be drawn without its follower", scene.origin, keys, remedy=remedy)
    job, given = registry.of(scene), flat(design)
    fault = scene.schema.fault(job.numbers_of(scene, given))
    if fault:
        raise refusal(f"the cam cannot be drawn: {fault}", scene.origin, "mechanism", remedy="Correct it")
    return Cam(job.sampler(scene, given))


def traced(found: Cam) -> Stations:
    """Return stations once round, the last before the first again, close enough that straight lines join them.

    No point of the profile or of the roller centre's curve is farther than CLOSE from the lines. Corners of the law
    are stations.
    """

    def curves(pieces: Pieces, u: Floats) -> tuple[Floats, Floats]:
        at = found.stations(pieces, u)
        return at.profile, at.pitch

    size = found.follower.arm + found.follower.centre_distance
    return found.stations(*tracing.nodes(curves, found.sampler.cycle.starts, max(CLOSE, NARROW * size)))
