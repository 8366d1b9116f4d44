"""Between the NLP's variables and the design a person reads; the moves that change one and not the other."""

import math
from collections.abc import Mapping
from typing import Any

from loomopt.jobs.beatup.program import COUNTERWEIGHT, LENGTHS, bounds, numbers, today
from loomopt.jobs.beatup.program import model as model_of
from loomopt.jobs.beatup.scene import FIGURES, VARIABLES
from loomopt.program.numbers import full_name, nearest_scale
from loomopt.program.program import Move, Program, Wish
from loomopt.program.sampling import Sampler

NEGLIGIBLE = 1e-9
"""Share of the largest counterweight below which there is none."""


def moves(program: Program) -> tuple[Move, ...]:
    """Return the directions that may leave every figure unchanged."""
    names = {variable.name for variable in program.variables}
    axes = tuple(Move("counterweight", (name,), "axis") for name in COUNTERWEIGHT if name in names)
    return (*axes, Move("scale", LENGTHS, "scale"))


def wish(scene: Any, move: Move, x: Mapping[str, float]) -> Wish | None:
    """Return what the silent levels want of a move at NLP variables x, SI: least added mass, then closest to today."""
    limited = bounds(scene)
    old = today(scene)
    if move.kind == "scale":
        return nearest_scale(x, old, limited, move.along)
    name = move.along[0]
    if limited[name][0] == limited[name][1]:
        return None
    low, high = limited[name]
    if name == "m4e":
        return Wish({name: low}, "least added mass")
    most = limited["m4e"][1] * limited["r4e"][1] ** 2
    used = x["s"] > NEGLIGIBLE * most if "s" in x else x.get("m4e", old["m4e"]) > 0.0
    if used:
        return Wish({name: high}, "least added mass, so the largest radius")
    return Wish({name: min(max(old[name], low), high)}, "no mass, so the radius nearest today's")


def design(program: Program, x: Mapping[str, float]) -> dict[str, float]:
    """Return the design, SI, of NLP variables: m4e is s/r4e² where the NLP was solved in s."""
    values = {**program.parameters, **x}
    if "s" in x:
        masses = [limit.value for limit in program.limits if limit.name == "m4e"]
        mass = x["s"] / x["r4e"] ** 2 if x["r4e"] else min(masses)
        nearest = min(masses, key=lambda limit: abs(limit - mass))
        close = abs(nearest - mass) <= NEGLIGIBLE * max(masses)
        values["m4e"] = nearest if close else min(max(mass, min(masses)), max(masses))
    extra = [name for name in x if name not in (*VARIABLES, "s")]
    return {name: values[name] for name in (*VARIABLES, *extra)}


def values(program: Program, design: Mapping[str, float]) -> dict[str, float]:
    """Return the NLP's variables, SI, of a design; a counterweight without mass stands at its largest radius.

    Where m4e = 0 the radius says nothing, and r4e = 0 would hide how s = m4e r4e² can grow.
    """
    found = {**design, "s": design["m4e"] * design["r4e"] ** 2}
    for v in program.variables:
        if v.name == "r4e" and design["m4e"] == 0.0 and "change" not in {o.row for o in program.objectives}:
            found["r4e"] = v.upper
    return {v.name: found[v.name] for v in program.variables}


def tidy(program: Program, x: Mapping[str, float]) -> dict[str, float]:
    """Return NLP variables with a negligible counterweight taken for none, so that its mass or radius can settle."""
    masses = [limit.value for limit in program.limits if limit.name == "m4e"]
    radius = next((v for v in program.variables if v.name == "r4e"), None)
    if "s" not in x or radius is None or x["s"] > NEGLIGIBLE * max(masses) * radius.upper**2:
        return dict(x)
    if min(masses) == 0.0:
        return {**x, "s": 0.0}
    return {**x, "s": min(masses) * radius.lower**2, "r4e": radius.lower}


def sampler(scene: Any, design: Mapping[str, float]) -> Sampler:
    """Return a design (SI; a scene number it does not name stays the scene's) ready to be sampled."""
    known = numbers(scene)
    return Sampler(model_of(scene), known | {full_name(known, name): value for name, value in design.items()})


def figures(scene: Any, design: Mapping[str, float]) -> dict[str, float | None]:
    """Return every figure of the job for a design, SI; None for one whose numbers the scene does not have."""
    sampled = sampler(scene, design)
    static = sampled.figures
    found: dict[str, float | None] = {name: static.get(name) for name in FIGURES}
    found["mu_min"] = min(static["mu_near"], static["mu_far"])
    for name in sampled.model.quantities:
        found[name] = sampled.peak(name) if name != "peak_torque" or sampled.model.loads else None
    limited = bounds(scene)
    widths = {name: limited[name][1] - limited[name][0] for name in VARIABLES}
    weights = scene.targets["retrofit"].weights
    changes = [
        weights.get(name, 1.0) * ((design[name] - old) / widths[name]) ** 2
        for name, old in today(scene).items()
        if widths.get(name, 0.0) > 0.0
    ]
    found["change"] = math.fsum(changes)
    return found
