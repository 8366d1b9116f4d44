"""Between the NLP's variables and the spring, cam and law a person reads; figures and words of a design."""

import math

from loomopt.effects.kinds import Load
from loomopt.jobs.base import Figures
from loomopt.jobs.shedding.model import frame
from loomopt.jobs.shedding.scene import SEGMENTS, VARIABLES
from loomopt.mechanisms.cam_motion import Spline, named_knots
from loomopt.program.model import JobModel
from loomopt.program.program import Numbers, Program, Variable
from loomopt.program.sampling import Extreme, Sampler
from loomopt.program.speeds import speed_reached
from loomopt.scenes import Scene
from loomopt.units import show

CYCLE = {
    "contact_min": "lift",
    "contact_max": "cam_force",
    "law_acceleration": "law_acceleration",
    "pressure_angle_max": "pressure_angle",
    "curvature_min": "concavity",
    "curvature_max": "curvature",
}
"""Figures that are extremes over the cycle, with their quantities."""
CLOSE = 1e-9
"""Share of the largest cam force below which contact just holds."""
GAVE_WAY = 1e-7
"""A number that a target keeps has given way when it is off by this, in its natural size."""
SAME = 1e-12
"""Share of the largest |N| by which two least values are one: rise and return mirror each other."""


def design(program: Program, x: Numbers) -> dict[str, float]:
    """Return the design, SI, of NLP variables: the spring, every other number that is freed, and a free law's knots."""
    values, law = {**program.parameters, **x}, frame(program.model).law
    knots = set(law.names) if isinstance(law, Spline) else set()
    fixed = {limit.row for limit in program.limits if limit.family == "variable" and limit.sign == 0}
    chosen = [v.name for v in program.variables if v.name in fixed or _chosen(v, values[v.name])]
    free = [name for name in chosen if name not in {*VARIABLES, *knots}]
    found = {name: values[name] for name in (*VARIABLES, *free)}
    if set(SEGMENTS) & set(found):
        found["near_dwell"] = 2 * math.pi - sum(values[name] for name in SEGMENTS[:3])
    if isinstance(law, Spline) and knots & {v.name for v in program.variables}:
        found |= named_knots(map(float, law.accelerations(values)))
    return found


def _chosen(variable: Variable, value: float) -> bool:
    """Say whether a variable is a choice: it has room, or it had to give way."""
    return variable.lower < variable.upper or abs(value - variable.lower) > GAVE_WAY * variable.scale


def peaks(model: JobModel) -> dict[str, str]:
    """Return the figures that are extremes over the cycle, with their quantities."""
    found = {name: quantity for name, quantity in CYCLE.items() if model.has_quantity(quantity)}
    found |= {name: name for check in model.checks for name in check.quantities}
    return {name: quantity for name, quantity in found.items() if not (model.known_in and name == "contact_min")}


def figures(scene: Scene, sampled: Sampler) -> dict[str, float | None]:
    """Return every figure of the job for a design, SI; None for one whose numbers the scene does not have."""
    physics, static = sampled.model, sampled.static
    found: dict[str, float | None] = {name: static.get(name) for name in scene.schema.figures}
    lifts = [extreme for where in physics.known_in or (None,) for extreme in sampled.extremes("lift", where)]
    found["contact_min"], found["contact_angle"] = _least(lifts, sampled)
    for name, quantity in CYCLE.items():
        if quantity in physics.quantities:
            found[name] = sampled.peak(quantity) * (-1 if quantity == "concavity" else 1)
    found |= {name: sampled.peak(name) for check in physics.checks for name in check.quantities}
    found["contact_speed"] = None
    if not physics.known_in and any(load.moved for load in physics.loads if isinstance(load, Load)):
        speed = speed_reached(physics, sampled.values, "lift", -scene.operation["N_min"])
        found["contact_speed"] = speed if math.isfinite(speed) else None
    return found


def _least(found: list[Extreme], sampled: Sampler) -> tuple[float, float]:
    """Return the least cam force, N, and the first cam angle where it is reached, rad."""
    highest = max(extreme.height for extreme in found)
    size = max(abs(extreme.value) for extreme in found)
    alike = [extreme for extreme in found if extreme.height >= highest - SAME * size]
    return -highest, min(sampled.angle(extreme) % (2 * math.pi) for extreme in alike)


def say(scene: Scene, now: Figures, dwells_only: bool, target: str, figures: Figures) -> str:
    """Say what an optimum of the target reached, and what today's spring would do; figures, now (today's): SI.

    dwells_only: whether contact is judged in the dwells only.
    """
    size = {name: value or 0.0 for name, value in figures.items()}
    stiffness = show(size["K1"], scene.unit("K1", "stiffness"), 9)
    speed = show(size["speed"], scene.unit("speed", "angular speed"), 9)
    kept = "keeps the roller on the cam all round"
    if dwells_only:
        kept = "keeps the roller on the cam in both dwells"
    said = {
        "stiffness": f"The least return spring that {kept} has {stiffness}.",
        "law": f"With the cam law chosen too, the least return spring that {kept} has {stiffness}.",
        "force": f"The least peak cam force is {size['contact_max']:.6g} N, with a return spring of {stiffness}.",
        "speed": f"Today's spring {kept} up to {speed}.",
    }[target]
    return said if target == "speed" else f"{said} {_today(scene, now)}".strip()


def _today(scene: Scene, found: Figures) -> str:
    """Say whether today's spring holds the roller on the cam, and where and by how much it would lift off."""
    least, most = found["contact_min"] or 0.0, abs(found["contact_max"] or 0.0)
    wanted, angle = scene.operation["N_min"], math.degrees(found["contact_angle"] or 0.0)
    spring = f"Today's spring ({show(scene.mechanism['K1'], scene.unit('K1', 'stiffness'), 9)})"
    if least >= wanted - CLOSE * max(most, 1.0):
        return f"{spring} holds: the cam force is never less than {least:.6g} N."
    lost = f"the cam force would be {least:.6g} N at {angle:.4f} deg"
    speed = found["contact_speed"]
    if speed:
        lost += f"; it holds up to {show(speed, scene.unit('speed', 'angular speed'), 7)}"
    return f"{spring} would lift off: {lost}." if least < 0.0 else f"{spring} is too soft: {lost}."
