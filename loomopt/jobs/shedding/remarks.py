"""What a designer should know of a cam beside its numbers: undercut, and contact that is judged in the dwells only."""

import math
from collections.abc import Mapping

from loomopt.jobs.shedding import cam_curves
from loomopt.jobs.shedding import design as shedding_design
from loomopt.jobs.shedding.cam_curves import Cam
from loomopt.program.sampling import Extreme
from loomopt.scenes import Scene

MOVING = ("inertia", "damping", "dry_friction")
"""Effects that act while the frame moves."""


def remarks(scene: Scene, design: Mapping[str, float]) -> tuple[str, ...]:
    """Return what there is to remark upon a design, SI: today's numbers for what it does not name."""
    return (*_dwells_only(scene), *_undercut(scene, design))


def undercut(found: Cam) -> Extreme | None:
    """Return where a cam is undercut most: the roller is larger than the circle its centre's curve bends by."""
    sharpest = found.sampler.extremes("curvature")[0]
    return sharpest if sharpest.value * found.follower.roller_radius >= 1.0 else None


def _undercut(scene: Scene, design: Mapping[str, float]) -> tuple[str, ...]:
    if cam_curves.missing(scene):
        return ()
    found = cam_curves.cam(scene, design)
    sharpest = undercut(found)
    if sharpest is None:
        return ()
    angle = math.degrees(found.sampler.angle(sharpest))
    roller, radius = 1000 * found.follower.roller_radius, 1000 / sharpest.value
    return (
        f"the cam is undercut at {angle:.2f} deg: the roller's centre turns there with a radius of {radius:.4g} mm, "
        f"{roller - radius:.3g} mm less than roller_radius = {roller:.6g} mm, so the profile is cut away and X not "
        f"followed. What helps: a roller_radius below {radius:.4g} mm, or a larger base_radius",
    )


def _dwells_only(scene: Scene) -> tuple[str, ...]:
    on = [name for name in MOVING if name in scene.effects]
    if not on or not shedding_design.model(scene, {}).is_level:
        return ()
    return (
        f"warp_tension with shape levels is known in the dwells only: contact is judged there, and not in the moves, "
        f'where {" and ".join(on)} act{"s" if len(on) == 1 else ""}. Choose shape = "linear" or "step" to judge the '
        f"whole cycle",
    )


__all__ = ["remarks", "undercut"]
