"""Between the NLP's variables and the drive a person reads; what is read off the head's travel, refined, never off a
grid: stroke, dwells, turning points.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from loomopt.jobs.base import Figures
from loomopt.jobs.rapier.model import jerk_mean, match_mean
from loomopt.jobs.rapier.scene import FIGURES, STROKE, VARIABLES, MatchTarget, match_table
from loomopt.maths.turning_points import crossing
from loomopt.model.model import JobModel
from loomopt.model.program import Numbers, Program
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.cycle import TURN, Node
from loomopt.scenes.scene import Scene

STEPS, FARTHEST, LAST = 6, 1e-3, 1e-15
"""Newton's steps from a sampled extreme, which is right to 1e-8; rad beyond which a step leads elsewhere, and that end
them."""


def settled_turn(sampler: Sampler, derivatives: tuple[str, str], angle: float) -> float:
    """Return the crank angle, rad, of a turning point after Newton's method from nearby.

    derivatives: quantities that are the first and the second derivative in the crank angle.
    """
    for _ in range(STEPS):
        slope, bend = sampler.at_angle(derivatives, angle)
        step = slope / bend if bend else 0.0
        if abs(step) > FARTHEST:
            return angle
        angle -= step
        if abs(step) < LAST:
            break
    return angle


SAMPLES = 720
TOUCHES = 1e-9
"""Share of s_dwell by which a travel that only touches it may exceed it: less than any limit's tolerance."""


@dataclass(frozen=True)
class Reading:
    """stroke, m, reached at crank angle phi_stroke; dwells after and before front dead centre, rad."""

    stroke: float
    phi_stroke: float
    dwell_after: float
    dwell_before: float


def read(sampler: Sampler) -> Reading:
    """Return stroke and dwells of a sampled drive. Raises ValueError where it does not turn all round."""
    found = sampler.extremes("S")
    if not found or not all(math.isfinite(extreme.value) for extreme in found):
        raise ValueError("the drive does not assemble all round")
    outward = max(found, key=lambda extreme: extreme.value)
    stroke, phi = 0.0, 0.0
    if outward.value > 0.0:
        phi = settled_turn(sampler, ("S_1", "peak_acceleration"), sampler.angle(outward))
        stroke = sampler.at_angle(("S",), phi)[0]
    room = sampler.given.values.get("s_dwell")
    if room is None:
        return Reading(stroke, phi % TURN, math.nan, math.nan)
    extremes = [sampler.angle(extreme) for extreme in found]
    after, before = (_dwell(sampler, extremes, float(room), side) for side in (1, -1))
    return Reading(stroke, phi % TURN, after, before)


def _dwell(sampler: Sampler, extremes: list[float], room: float, side: int) -> float:
    """Return how far the crank turns from front dead centre, on one side, before |S| leaves `room` (m)."""
    even = np.linspace(0.0, TURN, SAMPLES + 1)
    angles = np.unique(np.concatenate([even, np.mod(side * np.array(extremes), TURN)]))

    (travels,) = sampler.quantities(("S",), Node(side * angles, {}))
    sizes = np.abs(travels)
    out = np.flatnonzero(sizes > room * (1 + TOUCHES))
    if not out.size:
        return TURN
    inside = np.flatnonzero(sizes[: out[0]] <= room)
    low, high = float(angles[inside[-1]]) if inside.size else 0.0, float(angles[out[0]])
    return crossing(lambda turned: abs(sampler.at_angle(("S",), side * turned)[0]) - room, low, high)


def follow(model: JobModel, values: Numbers) -> Mapping[str, float]:
    """Return the angle of the stroke and the least dwell; raises ValueError where the drive does not turn."""
    reading = read(sampled(model, values))
    found = {"phi_stroke": reading.phi_stroke}
    return found | ({"dwell": min(reading.dwell_after, reading.dwell_before, math.pi)} if "s_dwell" in values else {})


def design(program: Program, x: Numbers) -> dict[str, float]:
    """Return the design, SI, of NLP variables: the drive's own, and every other number that is freed."""
    fixed = {limit.row for limit in program.bound_limits.values() if limit.sign == 0} - set(STROKE)
    own = {v.name for v in program.variables if v.lower < v.upper or v.name in fixed} - {"phi_stroke", "dwell"}
    values = {**program.parameters, **x}
    return {name: values[name] for name in (*VARIABLES, *(name for name in x if name in own and name not in VARIABLES))}


def figures(scene: Scene, sampled: Sampler) -> dict[str, float | None]:
    """Return every figure of the job for a design, SI; None for one whose numbers the scene does not have."""
    reading, static = read(sampled), sampled.static
    found: dict[str, float | None] = {name: static.get(name) for name in scene.schema.figures}
    found |= {"stroke": reading.stroke, "phi_stroke": reading.phi_stroke}
    if "s_dwell" in scene.operation:
        found |= {"dwell_after": reading.dwell_after, "dwell_before": reading.dwell_before}
        found["dwell"] = min(reading.dwell_after, reading.dwell_before)
    found |= {name: sampled.peak(name) for name in sampled.model.quantities}
    found["mu_min"] = math.pi / 2 - sampled.peak("obliquity")
    found["sley_mu_min"] = min(static["sley_mu_near"], static["sley_mu_far"])
    found["rms_jerk"] = math.sqrt(sampled.mean(jerk_mean()))
    if scene.table(MatchTarget).table is not None:
        found["match_rms"] = math.sqrt(sampled.mean(match_mean(*match_table(scene))))
    return found


def say(scene: Scene, target: str, figures: Figures) -> str:
    """Say in one sentence what an optimum of the target reached; figures in SI."""

    def told(name: str, digits: int = 9) -> str:
        return scene.show(figures.get(name) or 0.0, FIGURES[name].kind, digits)

    kept = f"stroke {told('stroke')} and {told('dwell', 4)} of dwell"
    return {
        "stroke-dwell": f"With {kept}, the least peak head acceleration is {told('peak_acceleration')}.",
        "dwell": f"With stroke {told('stroke')}, the largest dwell on both sides is {told('dwell')}.",
        "smooth": f"With {kept}, the least rms head jerk is {told('rms_jerk')}.",
        "match": f"The head travel comes within {told('match_rms', 6)} rms of the table.",
    }[target]
