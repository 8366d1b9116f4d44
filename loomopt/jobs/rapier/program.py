"""From a rapier scene and a target to the program: variables, limits, objectives and their natural sizes."""

import math
from typing import Any

from loomopt.errors import BadInput
from loomopt.jobs.rapier import match as rapier_match
from loomopt.jobs.rapier.model import AFTER, BEFORE, SLEY, SLEY_ASSEMBLY, Rapier
from loomopt.jobs.rapier.reading import read
from loomopt.jobs.rapier.scene import CLOSES, VARIABLES
from loomopt.maths import FLOAT
from loomopt.mechanisms import rapier_drive, rapier_faults
from loomopt.program.numbers import bounds as bounds_of
from loomopt.program.numbers import full_name, numbers
from loomopt.program.program import Integral, Limit, Objective, Program, Variable
from loomopt.program.sampling import Sampler
from loomopt.schema import Load

JERK_NODES = 64
"""Equidistant crank angles of the rms jerk: the mean of a smooth periodic function, right to rounding."""
REQUIRED = {"stroke": 0, "s_dwell": 1, "dwell_after": -1, "dwell_before": -1}
"""Numbers of the operation that targets keep, and on which side a designer could give way."""
CYCLE = {name: name for name in ("peak_acceleration", "peak_jerk", "tape_force", "peak_torque")}
STATIC = {"swing": ("swing",), "theta": ("theta",), "phi_stroke": ("phi_stroke",)} | {
    "sley_mu_min": ("sley_mu_near", "sley_mu_far")
}
S_DWELL = 0.005
"""Share of the stroke that the head may move in a usual dwell."""
ROOM = 0.01
"""Share of a bound's width that a start keeps from its ends."""


def jerk_mean() -> Integral:
    """Return the mean square of the head's jerk over the turn."""
    angles = tuple(2 * math.pi * k / JERK_NODES for k in range(JERK_NODES))
    return Integral("jerk_mean_square", "rms_jerk", "jerk_square", angles=angles, data=(0.0,) * JERK_NODES)


def match_mean(scene: Any) -> Integral:
    """Return the mean square of the head's distance from the target's table. Raises BadInput."""
    angles, travels = rapier_match.read(scene)
    return Integral("match_mean_square", "match_rms", "miss_square", angles=angles, data=travels)


def model(scene: Any, target: str = "", loads: bool = True) -> Rapier:
    """Return the drive with the loads the scene calls for and what the target reads."""
    named = {BEFORE: "dwell_before", AFTER: "dwell_after"}
    if target == "dwell":
        arcs = tuple((side, "dwell") for side in named)
    else:
        arcs = tuple((side, name) for side, name in named.items() if name in scene.operation)
    means = {"smooth": (jerk_mean,), "match": (lambda: match_mean(scene),)}.get(target, ())
    effects = [scene.job.effects[name] for name in scene.effects] if loads else []
    chosen = tuple(effect for effect in effects if isinstance(effect, Load))
    return Rapier(chosen, arcs, tuple(mean() for mean in means), frozenset(numbers(scene)))


def today(scene: Any) -> dict[str, float]:
    """Return today's design, SI, with every other number that the scene frees."""
    known = numbers(scene)
    others = [full_name(known, name) for name, bound in scene.bounds.items() if name not in VARIABLES and bound.free]
    return {name: known[name] for name in (*VARIABLES, *others)}


def bounds(scene: Any) -> dict[str, tuple[float, float]]:
    """Return lower and upper bound of every bounded number, by its full name, SI; held ones at today's value."""
    return bounds_of(scene, numbers(scene), VARIABLES)


def demand(scene: Any, target: str) -> None:
    """Raise BadInput where a target speaks of what the scene does not have."""
    for name in scene.job.targets[target].needs:
        if name not in scene.operation:
            raise BadInput(
                f"target {target} needs {name}",
                file=scene.origin,
                key=f"operation.{name}",
                remedy=f"Give operation.{name}, or choose another target.",
            )
    if target == "match":
        rapier_match.read(scene)


def program(scene: Any, target: str) -> Program:
    """Return the program of a target: all that a solve needs to know of the scene."""
    known, limited = numbers(scene), bounds(scene)
    loaded = bool({"tape_force", "peak_torque"} & set(scene.limits))
    _demand_loads(scene, loaded)
    physics = model(scene, target, loads=loaded)
    kept = [name for name in scene.job.targets[target].needs if name in known]
    sampler = Sampler(physics, {"dwell": 1.0, **known})
    reading = read(sampler)
    free = {full_name(known, name): bound.free for name, bound in scene.bounds.items()}
    variables = [_variable(name, limited[name], known) for name in limited if free.get(name)]
    named = {variable.name for variable in variables}
    limits = [limit for variable in variables for limit in _bound_limits(variable)]
    for name in (name for name in kept if name not in named):
        variables.append(Variable(name, known[name], known[name], _size(name, known), (known[name],) * 2))
        limits.append(Limit(name, REQUIRED[name], name, known[name], _size(name, known), "variable"))
    turn = (0.0, 2 * math.pi)
    variables.append(Variable("phi_stroke", *turn, 1.0, turn))
    if target == "dwell":
        variables.append(Variable("dwell", 1e-3, math.pi, 1.0, (1e-3, math.pi)))
    limits += _kept_limits(physics, kept, known)
    limits += _margins(bool(set(SLEY) & named), known)
    limits += [each for name, limit in scene.limits.items() for each in _figure_limits(name, limit, sampler)]
    taken = {variable.name for variable in variables}
    parameters = {name: value for name, value in known.items() if name not in taken}
    objectives = _objectives(target, sampler, reading.stroke)
    return Program(physics, tuple(variables), parameters, tuple(limits), objectives, _starts(variables, known))


def _demand_loads(scene: Any, loaded: bool) -> None:
    if loaded and not scene.effects:
        raise BadInput(
            "no effect in the scene makes a tape force",
            file=scene.origin,
            key="limits",
            remedy="Put on head_inertia or tape_friction, or take the limit on tape_force or peak_torque out.",
        )


def _size(name: str, known: Any) -> float:
    """Return the natural size of a number that targets keep."""
    stroke = float(known.get("stroke", 0.0))
    if name == "stroke":
        return stroke
    return max(float(known[name]), S_DWELL * stroke) if name == "s_dwell" else 1.0


def _variable(name: str, ends: tuple[float, float], known: Any) -> Variable:
    """Return a variable of natural size: angles 1 rad, lengths the largest they may be."""
    angle = name in ("alpha", "phi40", "phi30", "dwell_after", "dwell_before")
    size = 1.0 if angle else max(abs(known[name]), *map(abs, ends)) or 1.0
    return Variable(name, *ends, size, ends)


def _bound_limits(variable: Variable) -> list[Limit]:
    """Return the bounds of a variable as limits."""
    label = variable.name.rpartition(".")[2]
    if variable.lower == variable.upper:
        return [Limit(label, 0, variable.name, variable.lower, variable.scale, "variable")]
    ends = ((-1, variable.lower), (1, variable.upper))
    return [Limit(label, sign, variable.name, value, variable.scale, "variable") for sign, value in ends]


def _kept_limits(physics: Rapier, kept: list[str], known: Any) -> list[Limit]:
    """Return what stroke and dwells mean: the head at rest at its stroke, and within s_dwell on the arcs."""
    size = known["stroke"] if "stroke" in kept else 1.0
    rows = {"head at rest at phi_stroke": "rest"} | ({"stroke is reached": "stroke_short"} if "stroke" in kept else {})
    found = [Limit(name, 0, row, 0.0, size, "static", relaxable=False, hidden=True) for name, row in rows.items()]
    for side, name in physics.arcs:
        if name in (*kept, "dwell"):
            text = f"head within s_dwell {'after' if side == AFTER else 'before'} front dead centre"
            where = physics.where(side)
            row = Limit(text, 1, "dwell_travel", 1.0, 1.0, "cycle", relaxable=False, where=where, hidden=True)
            found.append(row)
    return found


def _margins(sley: bool, known: Any) -> list[Limit]:
    """Return the margins by which every dyad closes over the whole turn; the sley's where it may change."""
    found = [Limit(name, 1, row, 1.0, 1.0, "cycle", relaxable=False) for name, row in CLOSES.items()]
    rows = SLEY_ASSEMBLY if sley else ()
    return found + [Limit(row, -1, row, 0.0, known["l71"], "static", relaxable=False) for row in rows]


def _figure_limits(name: str, limit: Any, sampler: Sampler) -> list[Limit]:
    """Return the limits on one figure, row by row."""
    if name == "mu_min":
        return [Limit(name, -1, "obliquity", limit.min, 1.0, "cycle", complement=math.pi / 2)]
    if name in CYCLE:
        return [Limit(name, 1, name, limit.max, sampler.peak(name) or 1.0, "cycle")]
    if limit.min is not None and limit.min == limit.max:
        return [Limit(name, 0, STATIC[name][0], limit.min, 1.0, "static")]
    ends = [(sign, value) for sign, value in ((-1, limit.min), (1, limit.max)) if value is not None]
    return [Limit(name, sign, row, value, 1.0, "static") for sign, value in ends for row in STATIC[name]]


def _objectives(target: str, sampler: Sampler, stroke: float) -> tuple[Objective, ...]:
    peak = sampler.peak("peak_acceleration") or 1.0
    return {
        "stroke-dwell": (Objective("peak_acceleration", "peak_acceleration", "peak", peak),),
        "dwell": (Objective("dwell", "dwell_rest", "value", 1.0),),
        "smooth": (Objective("rms_jerk", "jerk_mean_square", "value", peak**2, power=2),),
        "match": (Objective("match_rms", "match_mean_square", "value", (stroke or 1.0) ** 2, power=2),),
    }[target]


def _starts(variables: list[Variable], known: Any) -> tuple[dict[str, float], ...]:
    """Return today's drive moved just inside its bounds, and the paper's own construction where it closes."""

    def inside(values: Any) -> dict[str, float]:
        found = {}
        for v in variables:
            room = ROOM * (v.upper - v.lower)
            found[v.name] = min(max(values.get(v.name, v.lower), v.lower + room), v.upper - room)
        return found

    starts = [inside(known)]
    built = constructed(known)
    if built:
        starts.append(inside({**known, **built}))
    return tuple(start for place, start in enumerate(starts) if start not in starts[:place])


def constructed(known: Any) -> dict[str, float] | None:
    """Return C0, l5 and φ40 by the paper's construction [Hong17] for a scene's stroke; None where it does not close."""
    if "stroke" not in known:
        return None
    dimensions = rapier_drive.Dimensions(**{name: known[name] for name in rapier_drive.Dimensions.__dataclass_fields__})
    swing = rapier_drive.Sley(FLOAT, dimensions).centres.swing
    try:
        layout = rapier_drive.construct(
            FLOAT, dimensions, dimensions.phi30 - swing, known["stroke"] / dimensions.travel
        )
    except (ValueError, ZeroDivisionError):
        return None
    found = {"C0x": layout.C0x, "C0y": layout.C0y, "l5": layout.reach - dimensions.l4, "phi40": layout.phi40}
    return None if rapier_faults.named({**known, **found}) else found
