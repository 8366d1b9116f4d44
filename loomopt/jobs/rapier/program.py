"""From a rapier scene and a target to the program: variables, limits, objectives and their natural sizes."""

import functools
import math
from collections.abc import Callable, Collection, Mapping, Sequence

from loomopt.base.errors import BadInput
from loomopt.base.records import Frozen
from loomopt.base.refusals import refusal
from loomopt.jobs import base
from loomopt.jobs.rapier import model as rapier
from loomopt.jobs.rapier.design import follow, read
from loomopt.jobs.rapier.model import AFTER, BEFORE, CLOSES, DWELL, LOADED, SLEY, SLEY_MARGINS, jerk_mean, match_mean
from loomopt.jobs.rapier.scene import FIGURES, STROKE, match_table
from loomopt.maths.systems import FLOAT
from loomopt.model import numbers as scene_numbers
from loomopt.model.limits import BoundLimit, CycleLimit, DesignLimit, Limit
from loomopt.model.model import JobModel
from loomopt.model.moves import Move
from loomopt.model.numbers import Asked, bound_limits, demanded, distinct, ends, floored, implied, inside, numbers
from loomopt.model.objectives import Objective, Peak, Value
from loomopt.model.program import Program, Variable, goals
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.effects.kinds import Check
from loomopt.physics.mechanisms import rapier_drive
from loomopt.scenes.scene import Scene
from loomopt.scenes.tables import Limit as Limited

FIVE_BAR = ("l4", "l5", "l6", "l3p", "C0x", "C0y")
REQUIRED = {"stroke": 0, "s_dwell": 1, "dwell_after": -1, "dwell_before": -1}
"""Numbers of the operation that targets keep, and on which side a designer could give way."""
ROWS = {"sley_mu_min": ("sley_mu_near", "sley_mu_far"), "stroke": ("reach",)}
"""Figures that are the least of several smooth rows, or a row of another name."""
SIDES = {"dwell_before": BEFORE, "dwell_after": AFTER}
LOOSE = frozenset((DWELL, *SIDES, "stroke"))
"""What is a number of its own where it is sought."""
TOPS = Frozen(phi_stroke="S")
S_DWELL = 0.005
"""Share of the stroke that the head may move in a usual dwell."""


def model(
    scene: Scene, asked: Collection[str] = (), read: bool = True, dwelt: Collection[str] | None = None
) -> JobModel:
    """Return the drive with the effects the scene calls for and what is asked; read: whether effects are.

    asked: the target, or what is traded; dwelt: dwells that are asked for, those of the operation without.
    """
    read_too = {*asked, *scene.limits}
    means = [jerk_mean()] if {"smooth", "rms_jerk"} & read_too else []
    means += [match_mean(*match_table(scene))] if {"match", "match_rms"} & read_too else []
    known = {*numbers(scene), *(("phi_stroke",) if asked else ()), *((DWELL,) if DWELL in asked else ())}
    effects = scene.active if read else ()
    arcs = _arcs(asked, scene.operation if dwelt is None else dwelt)
    return rapier.model(effects, scene_numbers.words(scene), frozenset(known), arcs, tuple(means))


def _arcs(asked: Collection[str], dwelt: Collection[str]) -> tuple[tuple[float, str], ...]:
    """Return the sides on which there is a dwell, each with the value that it is."""
    if DWELL in asked:
        return tuple((side, DWELL) for side in SIDES.values())
    return tuple((side, name) for name, side in SIDES.items() if name in dwelt)


def _dwells(scene: Scene, asked: Collection[str], kept: Collection[str]) -> Asked:
    """Return what is asked of each dwell, rad, by name: by the operation, then by limits. Raises BadInput."""
    least = {name: limit.min for name, limit in scene.limits.items() if name in (DWELL, *SIDES) and limit.min}
    if DWELL in asked:
        for name in (name for name in least if name in SIDES):
            problem, remedy = "the lesser of both dwells is sought, on one angle for both sides", f"Limit {DWELL}."
            raise refusal(problem, scene.origin, f"limits.{name}", remedy=remedy)
        return {DWELL: [(DWELL, least[DWELL])]} if least else {}
    found = {name: [(name, scene.operation[name])] if name in kept else [] for name in REQUIRED if name in SIDES}
    for name, each in found.items():
        each += [(by, least[by]) for by in (name, DWELL) if by in least]
    return {name: each for name, each in found.items() if each}


def demand(scene: Scene, target: str) -> None:
    """Raise BadInput where a target speaks of what the scene does not have."""
    base.demand(scene, target)
    if target == "match":
        match_table(scene)


def program(scene: Scene, target: str) -> Program:
    """Return the program of a target: all that a solve needs to know of the scene."""
    return held(scene, target, None)[0]


def held(scene: Scene, target: str, traded: Collection[str] | None) -> tuple[Program, Callable[[str], float]]:
    """Return the program of a target, or what it ("" for none) demands of all that is traded; natural sizes of axes."""
    known = numbers(scene)
    limited = scene_numbers.bounds(scene, known)
    _demand_figures(scene, traded or ())
    asked = (target,) if traded is None else tuple(traded)
    fallen = {DWELL: ("dwell_after", "dwell_before")}
    free_ends = {end for name in traded or () for end in fallen.get(name, (name,))}
    kept = [n for n in (scene.schema.targets[target].needs if target else ()) if n in known and n not in free_ends]
    free = {scene.full(name): bound.free for name, bound in scene.bounds.items()}
    dwells = _dwells(scene, asked, [name for name in kept if not free.get(name)])
    dwelt = {*known, *dwells}
    physics = model(scene, asked, _reads_effects(scene, asked), dwelt)
    sampler = sampled(physics, {DWELL: 1.0, "phi_stroke": 0.0, **dict.fromkeys(dwells, 1.0), **known})
    labels = scene_numbers.labels(scene)
    variables = [_variable(name, limited[name], known, labels.get(name, "")) for name in limited if free.get(name)]
    named = {variable.name for variable in variables}
    limits = [limit for variable in variables for limit in bound_limits(variable)]
    own = []
    for name in (name for name in kept if name not in named):
        variables.append(Variable(name, known[name], known[name], _size(name, known), (known[name],) * 2))
        own.append(BoundLimit(name, REQUIRED[name], name, known[name], _size(name, known)))
    wanted = [limit for limit in (*limits, *own) if limit.name in kept and limit.name in FIGURES]
    turn = (0.0, 2 * math.pi)
    variables.append(Variable("phi_stroke", *turn, 1.0, turn))
    variables += [_loose(name, known) for name in asked if name in LOOSE and name not in named]
    variables, dwelling = floored(variables, dwells)
    limits += [*(limit for limit in own if limit.name not in dwells), *dwelling]
    reached = [*kept, *dwells, *(name for name in asked if name in LOOSE)]
    limits += _kept_limits(_arcs(asked, dwelt), reached, known)
    limits += _margins(bool(set(SLEY) & named), known)
    figures = [each for name, limit in scene.limits.items() for each in _figure_limits(name, limit, sampler)]
    limits += [each for each in figures if not implied(each, variables)]
    limits += demanded(scene, physics.checks, known, {})
    taken = {variable.name for variable in variables}
    parameters = {name: value for name, value in known.items() if name not in taken}
    scales = (("five-bar scale", FIVE_BAR), ("sley scale", SLEY))
    moves: list[Move] = [
        scene_numbers.scale_move(name, along, known, limited) for name, along in scales if taken >= set(along)
    ]
    moves += scene_numbers.axis_moves(scene, known, limited)
    levels = () if traded is not None else _objectives(target, sampler, read(sampler).stroke)
    objectives = (*levels, *(scene_numbers.least(sampler) if traded is None else ()))
    starts = _starts(variables, known)
    task = physics, tuple(variables), parameters, tuple(limits), objectives, starts, tuple(moves), follow, TOPS
    found = Program(*task, goals=goals(wanted))
    return found, functools.partial(_axis_size, found, sampler)


def _loose(name: str, known: Mapping[str, float]) -> Variable:
    """Return a number of the operation that is free."""
    ends = {"stroke": (0.0, math.inf)}.get(name, (1e-3, math.pi))
    around = (0.5 * known[name], 1.5 * known[name]) if name == "stroke" else ends
    return Variable(name, *ends, _size(name, known), around)


def _axis_size(program: Program, today: Sampler, name: str) -> float:
    """Return the natural size, SI, of what of an axis is sought the least of."""
    peak, stroke = today.peak("peak_acceleration") or 1.0, read(today).stroke or 1.0
    known = {"rms_jerk": peak**2, "match_rms": stroke**2, "mu_min": 1.0, "sley_mu_min": 1.0}
    return known.get(name) or scene_numbers.size(program, today, name)


def _reads_effects(scene: Scene, asked: Collection[str]) -> bool:
    """Say whether the program reads anything that effects give: then they are in it, else they are not."""
    checks = [effect for effect in scene.active if isinstance(effect, Check)]
    given = {name for check in checks for name in (*check.quantities, *check.rows)}
    return bool((given | set(LOADED)) & {*scene.limits, *asked}) or any(
        check.demands or check.least for check in checks
    )


def _demand_figures(scene: Scene, traded: Collection[str]) -> None:
    """Raise BadInput for a limit on a figure, or a dwell to trade, that nothing in the scene gives."""
    absent = [name for name in (*STROKE[1:2], *traded) if name in STROKE and name not in scene.operation]
    if set(traded) & LOOSE and absent:
        raise refusal(f"to trade {', '.join(traded)} needs {absent[0]}", scene.origin, f"operation.{absent[0]}")
    full = model(scene)
    missing = [name for name in LOADED if name in scene.limits and not full.has_quantity(name)]
    if missing:
        raise BadInput(
            "peak_power needs the speed" if full.loads else "no effect in the scene makes a tape force",
            file=scene.origin,
            key="limits",
            remedy=f"{'Give operation.speed' if full.loads else 'Put on head_inertia or tape_friction'}, or take the "
            f"limit on {missing[0]} out.",
        )


def _size(name: str, known: Mapping[str, float]) -> float:
    """Return the natural size of a number that targets keep."""
    stroke = float(known.get("stroke", 0.0))
    if name == "stroke":
        return stroke
    return max(float(known[name]), S_DWELL * stroke) if name == "s_dwell" else 1.0


def _variable(name: str, ends: tuple[float, float], known: Mapping[str, float], label: str) -> Variable:
    """Return a variable of natural size: angles 1 rad, lengths the largest they may be."""
    angle = name in ("alpha", "phi40", "phi30", "dwell_after", "dwell_before")
    size = 1.0 if angle else max(abs(known[name]), *map(abs, ends)) or 1.0
    return Variable(name, *ends, size, ends, label)


def _kept_limits(arcs: Sequence[tuple[float, str]], kept: Sequence[str], known: Mapping[str, float]) -> list[Limit]:
    """Return what stroke and dwells mean: the head at rest at its stroke, and within s_dwell on the arcs."""
    size = known["stroke"] if "stroke" in kept else 1.0
    rows = {"head at rest at phi_stroke": "rest"} | ({"stroke is reached": "stroke_short"} if "stroke" in kept else {})
    found: list[Limit] = [
        DesignLimit(name, 0, row, 0.0, size, relaxable=False, hidden=True) for name, row in rows.items()
    ]
    for side, name in arcs:
        if name in (*kept, DWELL):
            text = f"head within s_dwell {'after' if side == AFTER else 'before'} front dead centre"
            where = (DWELL, side)
            row = CycleLimit(text, 1, "dwell_travel", 1.0, 1.0, relaxable=False, where=where, hidden=True)
            found.append(row)
    return found


def _margins(sley: bool, known: Mapping[str, float]) -> list[Limit]:
    """Return the margins by which every dyad closes over the whole turn; the sley's where it may change."""
    found: list[Limit] = [CycleLimit(name, 1, row, 1.0, 1.0, relaxable=False) for name, row in CLOSES.items()]
    rows = SLEY_MARGINS if sley else ()
    return found + [DesignLimit(row, -1, row, 0.0, known["l71"], relaxable=False) for row in rows]


def _figure_limits(name: str, limit: Limited, sampler: Sampler) -> list[Limit]:
    """Return the limits on one figure, row by row."""
    if name == "mu_min" and limit.min is not None:
        return [CycleLimit(name, -1, "obliquity", limit.min, 1.0, complement=math.pi / 2)]
    if name in (DWELL, *SIDES):
        return []
    sides = ends(limit.min, limit.max)
    if sampler.model.has_quantity(name):
        size = sampler.peak(name) or 1.0
        return [CycleLimit(name, sign, name, value, size) for sign, value in sides]
    rows = ROWS.get(name, (name,)) if sides[0][0] else ROWS.get(name, (name,))[:1]
    size = sampler.single(name) if name == "rms_jerk" else read(sampler).stroke if name == "stroke" else 1.0
    if any(name in check.rows for check in sampler.model.checks):
        size = max(abs(value) for _, value in sides) or 1.0
    return [DesignLimit(name, sign, row, value, size) for sign, value in sides for row in rows]


def _objectives(target: str, sampler: Sampler, stroke: float) -> tuple[Objective, ...]:
    peak = sampler.peak("peak_acceleration") or 1.0
    return {
        "stroke-dwell": (Peak("peak_acceleration", "peak_acceleration", peak),),
        "dwell": (Value("dwell", "dwell_rest", 1.0),),
        "smooth": (Value("rms_jerk", "jerk_mean_square", peak**2, power=2),),
        "match": (Value("match_rms", "match_mean_square", (stroke or 1.0) ** 2, power=2),),
    }[target]


def _starts(variables: Sequence[Variable], known: Mapping[str, float]) -> tuple[dict[str, float], ...]:
    """Return today's drive moved just inside its bounds, and the paper's own construction where it closes."""
    built = constructed(known)
    return distinct([inside(variables, known), *([inside(variables, {**known, **built})] if built else [])])


def constructed(known: Mapping[str, float]) -> dict[str, float] | None:
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
    return None if rapier_drive.fault_of({**known, **found}) else found
