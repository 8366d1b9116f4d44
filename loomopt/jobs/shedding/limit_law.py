"""What target law tends to with ever more intervals, where it is known in closed form (mechanisms/cam_limit.py)."""

from collections.abc import Mapping

from loomopt import maths
from loomopt.maths import Number
from loomopt.mechanisms import cam_limit
from loomopt.program.studied import Family
from loomopt.scenes import Scene

LOADS = frozenset(("weight", "warp_tension", "inertia"))
"""Effects that the closed form knows."""
LIMIT = "law_acceleration"
ANGLES = ("rise", "far_dwell", "return", "near_dwell")


def least_stiffness(scene: Scene, start: Number) -> Number | None:
    """Return the limit of K1, N/m, for target law, in 40 digits; None where the closed form does not hold.

    start: a stiffness, N/m, for which some law keeps contact, such as a spline law's least one. No load but weight,
    inertia and a warp tension in proportion to the shed may act, the frame must rise and fall alike, and nothing but
    N_min and the law's acceleration be limited.
    """
    own, known, law = scene.effects, scene.mechanism, scene.targets["law"]
    warp, weight = own.get("warp_tension"), own.get("weight")
    simple = "inertia" in own and set(own) <= LOADS and (warp is None or warp.shape == "linear")
    free = any(scene.bounds[name].free for name in ANGLES if name in scene.bounds)
    if not simple or free or law.symmetric or known["rise"] != known["return"] or set(scene.limits) - {LIMIT}:
        return None
    number = maths.mpmath(cam_limit.DIGITS).number
    limit = scene.limits.get(LIMIT)
    travel, rise = number(known["travel"]), number(known["rise"])
    frame = cam_limit.Frame(
        most=number(limit.max if limit else law.acceleration),
        travel=travel,
        preload=number(scene.bounds["X0"].max if "X0" in scene.bounds else known["X0"]),
        steady=number(scene.operation["N_min"]) + number(weight.G if weight else 0.0),
        before=number(warp.T1 if warp else 0.0),
        after=number(warp.T2 if warp else 0.0),
        inertia=number(own["inertia"].M) * travel * (number(scene.operation["speed"]) / rise) ** 2,
    )
    return cam_limit.least_stiffness(frame, number(start))


def _limit(scene: Scene, x: Mapping[str, Number]) -> Number | None:
    return least_stiffness(scene, float(x["K1"]))


FAMILY = Family("spline intervals", "law", "targets.law.intervals", _limit)
