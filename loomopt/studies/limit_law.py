"""The least return spring over all cam laws: what a free law of ever more intervals tends to, in closed form.

With |s''| bounded, the law that needs the least spring is bang and arc: s'' stands at its bound until the cam force has
fallen to N_min; then the frame flies with N = N_min, slowed by spring, weight and warp, until it is at rest at s = 1.
On the arc s'' = −(α + β s), a straight line on each side of the middle of the shed, so that its speed follows from
energy and its duration from arc cosines; what is left is one unknown, K1, for which bang and arc fill the rise.
"""

from collections.abc import Mapping
from typing import Any

from loomopt import maths

DIGITS, ROUNDS = 40, 400
LOADS = frozenset(("weight", "warp_tension", "inertia"))
"""Effects that the closed form knows."""
LIMIT = "law_acceleration"
ANGLES = ("rise", "far_dwell", "return", "near_dwell")


def least_stiffness(scene: Any, start: float) -> Any | None:
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
    number = maths.mpmath(DIGITS).number
    limit = scene.limits.get(LIMIT)
    values = {name: number(value) for name, value in known.items() if name in ("travel", "rise")} | {
        "most": number(limit.max if limit else law.acceleration),
        "X0": number(scene.bounds["X0"].max if "X0" in scene.bounds else known["X0"]),
        "T1": number(warp.T1 if warp else 0.0),
        "T2": number(warp.T2 if warp else 0.0),
        "steady": number(scene.operation["N_min"]) + number(weight.G if weight else 0.0),
    }
    values["inertia"] = number(own["inertia"].M) * values["travel"]
    values["inertia"] *= (number(scene.operation["speed"]) / values["rise"]) ** 2
    return _root(values, number(start))


def _root(own: Mapping[str, Any], high: Any) -> Any | None:
    """Return K1 between 0 and `high` where bang and arc take the whole rise, by halving: exact, and never astray."""
    low = 0 * high
    if not _duration(own, high) <= 1:
        return None
    for _ in range(ROUNDS):
        middle = (low + high) / 2
        if middle in (low, high):
            break
        low, high = (low, middle) if _duration(own, middle) <= 1 else (middle, high)
    (alpha, beta), _ = _slopes(own, high)
    return high if alpha + beta <= own["most"] else None


def _slopes(own: Mapping[str, Any], stiffness: Any) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    """Return (α, β) of −s'' = α + β s on the arc: above the middle of the shed, s > 1/2, and before it."""
    steady, stretch = stiffness * own["X0"] - own["steady"], stiffness * own["travel"]
    after = (steady - own["T2"]) / own["inertia"], (stretch + 2 * own["T2"]) / own["inertia"]
    before = (steady - own["T1"]) / own["inertia"], (stretch + 2 * own["T1"]) / own["inertia"]
    return after, before


def _duration(own: Mapping[str, Any], stiffness: Any) -> Any:
    """Return the share of the rise that bang and arc take, infinite where the spring cannot hold the frame up."""
    context = maths.mpmath(DIGITS)
    (a, b), (c, d) = _slopes(own, stiffness)
    if not (c > 0 and a + b / 2 > 0):
        return float("inf")
    most, half = own["most"], context.number(0.5)
    junction = _meeting(context, a + most, b, 2 * a + b)
    if junction >= half:
        return context.sqrt(2 * junction / most) + _swing(context, a / b, b, 1 + a / b, 1, junction)
    square = a + 3 * b / 4
    junction = _meeting(context, c + most, d, square + c + d / 4)
    amplitude = context.sqrt((half + c / d) ** 2 + square / d)
    last = _swing(context, a / b, b, 1 + a / b, 1, half)
    return context.sqrt(2 * junction / most) + last + _swing(context, c / d, d, amplitude, half, junction)


def _meeting(context: maths.Maths, p: Any, q: Any, r: Any) -> Any:
    """Return s where the arc's energy is the bang's: the positive root of q s² + 2 p s = r."""
    return r / (p + context.sqrt(p * p + q * r))


def _swing(context: maths.Maths, level: Any, beta: Any, amplitude: Any, begin: Any, end: Any) -> Any:
    """Return the time from s = end up to s = begin on s + level = amplitude · cos(√β t)."""

    def phase(s: Any) -> Any:
        share = (s + level) / amplitude
        rest = 1 - share * share
        return context.atan2(context.sqrt(rest if rest > 0 else 0 * rest), share)

    return (phase(end) - phase(begin)) / context.sqrt(beta)
