"""Between the NLP's variables and the drive a person reads; the moves that change one and not the other."""

import math
from collections.abc import Mapping
from typing import Any

from loomopt.jobs.rapier.model import SLEY
from loomopt.jobs.rapier.program import bounds, jerk_mean, match_mean, today
from loomopt.jobs.rapier.program import model as model_of
from loomopt.jobs.rapier.reading import read
from loomopt.jobs.rapier.scene import FIGURES, STROKE, VARIABLES
from loomopt.program.numbers import full_name, nearest_scale, numbers
from loomopt.program.program import Move, Program, Wish
from loomopt.program.sampling import Sampler

FIVE_BAR = ("l4", "l5", "l6", "l3p", "C0x", "C0y")


def moves(program: Program) -> tuple[Move, ...]:
    """Return the directions that may leave every figure unchanged: the scales of five-bar and sley four-bar."""
    names = {variable.name for variable in program.variables}
    scales = (Move("five-bar scale", FIVE_BAR, "scale"), Move("sley scale", SLEY, "scale"))
    return tuple(move for move in scales if names >= set(move.along))


def wish(scene: Any, move: Move, x: Mapping[str, float]) -> Wish | None:
    """Return what the silent levels want of a move at NLP variables x, SI: closest to today."""
    return nearest_scale(x, numbers(scene), bounds(scene), move.along)


def design(program: Program, x: Mapping[str, float]) -> dict[str, float]:
    """Return the design, SI, of NLP variables: the drive's own, and every other number that is freed."""
    fixed = {limit.row for limit in program.limits if limit.family == "variable" and limit.sign == 0} - set(STROKE)
    own = {v.name for v in program.variables if v.lower < v.upper or v.name in fixed} - {"phi_stroke", "dwell"}
    values = {**program.parameters, **x}
    return {name: values[name] for name in (*VARIABLES, *(name for name in x if name in own and name not in VARIABLES))}


def values(program: Program, design: Mapping[str, float]) -> dict[str, float]:
    """Return the NLP's variables, SI, of a design."""
    return program.completed(design)


def tidy(program: Program, x: Mapping[str, float]) -> dict[str, float]:
    """Return NLP variables as they are."""
    return dict(x)


def sampler(scene: Any, design: Mapping[str, float]) -> Sampler:
    """Return a design (SI; a scene number it does not name stays the scene's) ready to be sampled."""
    known = numbers(scene)
    return Sampler(model_of(scene), known | {full_name(known, name): value for name, value in design.items()})


def figures(scene: Any, design: Mapping[str, float]) -> dict[str, float | None]:
    """Return every figure of the job for a design, SI; None for one whose numbers the scene does not have."""
    sampled = sampler(scene, design)
    reading, static = read(sampled), sampled.static
    found: dict[str, float | None] = {name: static.get(name) for name in FIGURES}
    found |= {"stroke": reading.stroke, "phi_stroke": reading.phi_stroke}
    if "s_dwell" in scene.operation:
        found |= {"dwell_after": reading.dwell_after, "dwell_before": reading.dwell_before}
        found["dwell"] = min(reading.dwell_after, reading.dwell_before)
    found |= {name: sampled.peak(name) for name in sampled.model.quantities}
    if scene.effects and "speed" not in scene.operation and "head_inertia" in scene.effects:
        found |= {"tape_force": None, "peak_torque": None}
    found["mu_min"] = math.pi / 2 - sampled.peak("obliquity")
    found["sley_mu_min"] = min(static["sley_mu_near"], static["sley_mu_far"])
    found["rms_jerk"] = math.sqrt(sampled.mean(jerk_mean()))
    if scene.targets["match"].table is not None:
        found["match_rms"] = math.sqrt(sampled.mean(match_mean(scene)))
    return found


def peaks(model: Any) -> dict[str, str]:
    """Return the figures that are extremes over the cycle, with their quantities."""
    return {name: name for name in model.quantities} | {"stroke": "S", "mu_min": "obliquity"}


__all__ = ["design", "figures", "moves", "peaks", "sampler", "tidy", "today", "values", "wish"]
