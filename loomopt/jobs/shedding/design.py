"""Between the NLP's variables and the spring, cam and law a person reads."""

import math
from collections.abc import Mapping
from typing import Any

from loomopt.jobs.shedding.limits import CYCLE
from loomopt.jobs.shedding.model import Shedding
from loomopt.jobs.shedding.pose import DWELLS
from loomopt.jobs.shedding.program import bounds, named, numbers
from loomopt.jobs.shedding.program import model as model_of
from loomopt.jobs.shedding.program import today as today
from loomopt.jobs.shedding.reading import contact_speed
from loomopt.jobs.shedding.scene import FIGURES, SEGMENTS, VARIABLES
from loomopt.mechanisms.cam_motion import PREFIX, Spline
from loomopt.program.numbers import full_name
from loomopt.program.program import Move, Program, Variable, Wish
from loomopt.program.sampling import Extreme, Sampler

GAVE_WAY = 1e-7
"""A number that a target keeps has given way when it is off by this, in its natural size."""
SAME = 1e-12
"""Share of the largest |N| by which two least values are one: rise and return mirror each other."""


def moves(program: Program) -> tuple[Move, ...]:
    """Return what may leave everything unchanged: a preload that is not needed, and the coils' initial tension."""
    room = {v.name for v in program.variables if v.lower < v.upper}
    axes = {"preload": "X0", "initial tension": "coil.initial_tension"}
    return tuple(Move(name, (along,), "axis") for name, along in axes.items() if along in room)


def wish(scene: Any, move: Move, x: Mapping[str, float]) -> Wish | None:
    """Return what the silent levels want of a move: the value nearest today's, SI."""
    (name,) = move.along
    low, high = bounds(scene)[name]
    return Wish({name: min(max(numbers(scene)[name], low), high)}, "least change from today")


def design(program: Program, x: Mapping[str, float]) -> dict[str, float]:
    """Return the design, SI, of NLP variables: the spring, every other number that is freed, and a free law's knots."""
    values = {**program.parameters, **x}
    fixed = {limit.row for limit in program.limits if limit.family == "variable" and limit.sign == 0}
    chosen = [v.name for v in program.variables if v.name in fixed or _chosen(v, values[v.name])]
    free = [name for name in chosen if not name.startswith(PREFIX)]
    found = {name: values[name] for name in (*VARIABLES, *(name for name in free if name not in VARIABLES))}
    if set(SEGMENTS) & set(found):
        found["near_dwell"] = 2 * math.pi - sum(values[name] for name in SEGMENTS[:3])
    law = getattr(program.model, "law", None)
    if isinstance(law, Spline) and set(law.names) & {v.name for v in program.variables}:
        found |= {f"{PREFIX}{k}": float(value) for k, value in enumerate(law.accelerations(values))}
    return found


def _chosen(variable: Variable, value: float) -> bool:
    """Say whether a variable is a choice: it has room, or it had to give way."""
    return variable.lower < variable.upper or abs(value - variable.lower) > GAVE_WAY * variable.scale


def values(program: Program, design: Mapping[str, float]) -> dict[str, float]:
    """Return the NLP's variables, SI, of a design."""
    return program.completed({**program.parameters, **design})


def tidy(program: Program, x: Mapping[str, float]) -> dict[str, float]:
    """Return NLP variables as they are."""
    return dict(x)


def model(scene: Any, design: Mapping[str, float]) -> Shedding:
    """Return the frame of a design: with its own law where it has one."""
    intervals = named(design)
    return model_of(scene, Spline(intervals) if intervals else None)


def values_of(scene: Any, design: Mapping[str, float]) -> dict[str, float]:
    """Return all numbers of a design, SI; a scene number it does not name stays the scene's."""
    known = numbers(scene)
    return known | {(name if name.startswith(PREFIX) else full_name(known, name)): v for name, v in design.items()}


def adopted(scene: Any, design: Mapping[str, Any], target: str) -> tuple[Any, str]:
    """Return the scene with a design's own cam law, and the target whose limits it keeps.

    Of target law the law is then given: what remains is contact, and the bound on its acceleration.
    """
    intervals, changes = named(design), {}
    if intervals:
        law = [float(design[f"{PREFIX}{k}"]) for k in range(intervals + 1)]
        changes = {"mechanism.law": "spline", "mechanism.law_coefficients": law}
    if target == "law" and "law_acceleration" not in scene.limits:
        changes["limits.law_acceleration.max"] = scene.targets["law"].acceleration
    changed = scene.update(changes) if changes else scene
    return changed, "stiffness" if target == "law" else target


def peaks(model: Any) -> dict[str, str]:
    """Return the figures that are extremes over the cycle, with their quantities."""
    found = {name: quantity for name, quantity in CYCLE.items() if quantity in ("lift", *model.quantities)}
    return {name: quantity for name, quantity in found.items() if not (model.is_level and name == "contact_min")}


def sampler(scene: Any, design: Mapping[str, float]) -> Sampler:
    """Return a design ready to be sampled."""
    return Sampler(model(scene, design), values_of(scene, design))


def figures(scene: Any, design: Mapping[str, float]) -> dict[str, float | None]:
    """Return every figure of the job for a design, SI; None for one whose numbers the scene does not have."""
    sampled = sampler(scene, design)
    physics: Any = sampled.model
    static = sampled.static
    found: dict[str, float | None] = {name: static.get(name) for name in FIGURES}
    arcs = [(0, float(dwell)) for dwell in DWELLS] if physics.is_level else [None]
    found["contact_min"], found["contact_angle"] = _least(
        [e for w in arcs for e in sampled.extremes("lift", w)], sampled
    )
    for name, quantity in CYCLE.items():
        if quantity in physics.quantities:
            found[name] = sampled.peak(quantity) * (-1 if quantity == "concavity" else 1)
    found["contact_speed"] = None
    if "inertia" in scene.effects and not physics.is_level:
        speed = contact_speed(physics, values_of(scene, design), scene.operation["N_min"])
        found["contact_speed"] = speed if math.isfinite(speed) else None
    return found


def _least(found: list[Extreme], sampled: Sampler) -> tuple[float, float]:
    """Return the least cam force, N, and the first cam angle where it is reached, rad."""
    highest = max(extreme.height for extreme in found)
    size = max(abs(extreme.value) for extreme in found)
    alike = [extreme for extreme in found if extreme.height >= highest - SAME * size]
    return -highest, min(sampled.angle(extreme) % (2 * math.pi) for extreme in alike)
