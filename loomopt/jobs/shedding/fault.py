"""What stops a cam law or a follower from working, in plain words; a table of a law read from its CSV file."""

import math
from collections.abc import Mapping
from typing import Any

from loomopt import scene_csv as csv_table
from loomopt.jobs.shedding.model import FOLLOWER
from loomopt.maths import FLOAT
from loomopt.mechanisms import cam_follower, cam_spline
from loomopt.mechanisms.cam_motion import PREFIX, CamLaw, Named, Spline, Tabulated
from loomopt.scene_errors import refusal

CLOSED = 1e-9
"""How far a spline law may end from s = 1, s' = 0."""
FALLS = 1e-9
"""How far its slope may fall below 0: rounding."""
FEWEST, MOST = 4, 256
"""Intervals of a spline law."""


def chosen(scene: Any) -> CamLaw:
    """Return the scene's own cam law. Raises BadInput."""
    name = scene.mechanism["law"]
    if name == "spline":
        return Spline(len(_coefficients(scene)) - 1)
    return Tabulated(_table(scene)) if name == "table" else Named(name)


def check_law(scene: Any) -> None:
    """Raise BadInput where the scene's cam law is none."""
    name = scene.mechanism["law"]
    for key, of in (("law_coefficients", "spline"), ("law_table", "table")):
        if key in scene.mechanism and name != of:
            remedy = f'Write law = "{of}", or take {key} out'
            raise refusal(f"{key} is not of law {name}", scene.origin, f"mechanism.{key}", remedy=remedy)
    if name == "spline":
        fault = spline(_coefficients(scene))
        if fault:
            raise refusal(f"the spline is no cam law: {fault}", scene.origin, "mechanism.law_coefficients")
    elif name == "table":
        _table(scene)


def _coefficients(scene: Any) -> tuple[float, ...]:
    found = scene.mechanism.get("law_coefficients")
    if found is None:
        remedy = "Give s'' at evenly spaced knots, as `loomopt solve --target law --json` finds them"
        raise refusal("law spline needs its coefficients", scene.origin, "mechanism.law_coefficients", remedy=remedy)
    return tuple(found)


def spline(accelerations: tuple[float, ...]) -> str:
    """Say why second derivatives at evenly spaced knots make no cam law; "" when they do."""
    intervals = len(accelerations) - 1
    if not FEWEST <= intervals <= MOST:
        return f"it has {intervals} intervals; {FEWEST} to {MOST} are allowed"
    if not all(map(math.isfinite, accelerations)):
        return "a coefficient is not a finite number"
    made = cam_spline.spline(FLOAT, accelerations)
    end, slope = made.end
    if abs(end - 1.0) > CLOSED or abs(slope) > CLOSED:
        return f"it ends at s = {end:.9g} with slope {slope:.3g}, not at 1 with slope 0"
    for k in range(intervals):
        low = _least_slope(made, k)
        if low < -FALLS:
            return f"it falls between u = {k / intervals:.4g} and {(k + 1) / intervals:.4g} (slope {low:.3g})"
    return ""


def _least_slope(made: cam_spline.Spline, k: int) -> float:
    """Return the least s' on an interval, where s'' is linear."""
    before, after = made.a[k : k + 2]
    turn = before / (before - after) if before < 0 < after else 1.0
    return float(min(made.v[k + 1], made.at(FLOAT, (k + turn) / made.intervals, k).s1))


def _table(scene: Any) -> cam_spline.Table:
    """Return the law of `mechanism.law_table`: cam angles and displacements of the rise, from 0 on. Raises BadInput."""
    key = "mechanism.law_table"
    given = scene.mechanism.get("law_table")
    columns = {"angle": "angle", "s": "length"}
    if given is None:
        remedy = 'Write law_table = "law.csv"; the file has the columns angle [deg], s [mm] of the rise'
        raise refusal("law table needs its file", scene.origin, key, remedy=remedy)
    (angles, heights), origin = csv_table.read(scene, given, key, columns)
    if not (angles[-1] > 0.0 and heights[-1] > 0.0):
        raise refusal("the law does not rise", origin, remedy="Give angle and s of the rise, both from 0 on")
    try:
        return cam_spline.tabulated([a / angles[-1] for a in angles], [s / heights[-1] for s in heights])
    except ValueError as error:
        raise refusal(f"the table is no cam law: {error}", origin, remedy="Correct the table") from None


def follower(numbers: Mapping[str, Any]) -> str:
    """Say why a scene's follower cannot work; "" when it can, or when the scene does not give one."""
    if any(numbers.get(name) is None for name in FOLLOWER):
        return ""
    return cam_follower.fault(cam_follower.Follower(**{name: numbers[name] for name in FOLLOWER}))


def design(numbers: Mapping[str, Any]) -> str:
    """Say why a design, SI, cannot work as this cam; "" when it can."""
    coefficients = tuple(float(value) for name, value in numbers.items() if _is_knot(name))
    fault = spline(coefficients) if coefficients else ""
    if fault:
        return f"its law is none: {fault}"
    dwell = 2 * math.pi - sum(numbers[name] for name in ("rise", "far_dwell", "return"))
    if dwell < -1e-9:
        return "rise, far dwell and return take more than a whole turn"
    return follower(numbers)


def _is_knot(name: str) -> bool:
    return name.startswith(PREFIX) and name.removeprefix(PREFIX).isdigit()
