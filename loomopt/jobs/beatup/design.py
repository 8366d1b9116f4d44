"""Between the NLP's variables and the design a person reads; figures and words of a design."""

import math

from loomopt.jobs.base import Figures
from loomopt.jobs.beatup.model import FRONT
from loomopt.jobs.beatup.scene import VARIABLES, RetrofitTarget
from loomopt.model.axes import opposite
from loomopt.model.numbers import Bounds
from loomopt.model.program import Goal, Numbers, Program
from loomopt.model.sampling import Sampler
from loomopt.physics.tolerances import NO_MASS
from loomopt.scenes.scene import Scene

BALANCED = 1e-8
"""|M3| at front dead centre below this share of the peak torque is called zero (words of the beat-up only)."""


BALANCE = Goal("M3_fdc", 0.0, 0.0, BALANCED, "peak_torque")
"""What target balance asks, and may find out of reach."""


def design(program: Program, x: Numbers) -> dict[str, float]:
    """Return the design, SI, of NLP variables: m4e is s/r4e² where the NLP was solved in s."""
    values = {**program.parameters, **x}
    if "s" in x:
        masses = _masses(program)
        mass = x["s"] / x["r4e"] ** 2 if x["r4e"] else min(masses)
        nearest = min(masses, key=lambda limit: abs(limit - mass))
        most = next(v.range[1] for v in program.variables if v.name == "s")
        close = abs(nearest - mass) * x["r4e"] ** 2 <= NO_MASS * most
        values["m4e"] = nearest if close else min(max(mass, min(masses)), max(masses))
    extra = [name for name in x if name not in (*VARIABLES, "s")]
    return {name: values[name] for name in (*VARIABLES, *extra)}


def _masses(program: Program) -> list[float]:
    """Return the limits of the counterweight's mass, kg."""
    return [limit.value for limit in program.limits if limit.name == "m4e"]


def values(program: Program, design: Numbers) -> dict[str, float]:
    """Return the NLP's variables, SI, of a design; a counterweight without mass stands at its largest radius.

    Where m4e = 0 the radius says nothing, unless it is asked for, and r4e = 0 would hide how s = m4e r4e² can grow.
    """
    found = {**design, "s": design["m4e"] * design["r4e"] ** 2}
    asked = {row for objective in program.objectives for row in objective.rows}
    asked |= {limit.row for limit in program.row_limits}
    if design["m4e"] == 0.0 and asked.isdisjoint({"change", "r4e", opposite("r4e")}):
        found |= {v.name: v.upper for v in program.variables if v.name == "r4e"}
    return {v.name: found[v.name] for v in program.variables}


def tidy(program: Program, x: Numbers) -> dict[str, float]:
    """Return NLP variables with a negligible counterweight taken for none, so that its mass or radius can settle."""
    known = {v.name: v for v in program.variables}
    radius, masses = known.get("r4e"), _masses(program)
    if "s" not in known or radius is None or x["s"] > NO_MASS * known["s"].range[1]:
        return dict(x)
    if min(masses) == 0.0:
        return {**x, "s": 0.0}
    return {**x, "s": min(masses) * radius.lower**2, "r4e": radius.lower}


def figures(
    scene: Scene, sampled: Sampler, design: Numbers, today: Numbers, limited: Bounds
) -> dict[str, float | None]:
    """Return every figure of the job for a design, SI; None for one whose numbers the scene does not have."""
    static = sampled.figures
    found: dict[str, float | None] = {name: static.get(name) for name in scene.schema.figures}
    found["mu_min"] = min(static["mu_near"], static["mu_far"])
    found |= {name: sampled.peak(name) for name in sampled.model.quantities}
    found |= {name: -sampled.peak(name) for name in sampled.model.least}
    weights = scene.table(RetrofitTarget).weights
    widths = {name: limited[name][1] - limited[name][0] for name in VARIABLES}
    changes = [
        weights.get(name, 1.0) * ((design[name] - old) / widths[name]) ** 2
        for name, old in today.items()
        if widths.get(name, 0.0) > 0.0
    ]
    found["change"] = math.fsum(changes)
    return found


def say(scene: Scene, target: str, figures: Figures) -> str:
    """Say in one sentence what an optimum of the target reached; figures in SI."""
    front, peak, rms = (scene.show(figures[name] or 0.0, "torque") for name in ("M3_fdc", "peak_torque", "pulse_rms"))
    jumps = any(FRONT in effect.reads for effect in scene.active)
    where = "just before front dead centre" if jumps else "at front dead centre"
    peak_text = f"the least peak crank torque over the whole cycle is {peak}"
    if target == "balance" and BALANCE.reached(figures):
        return f"Balanced: the reed torque {where} is zero, and then {peak_text}."
    if target == "balance":
        return (
            f"Balance is out of reach: the reed torque nearest to zero found {where} is {front}, and then {peak_text}."
        )
    return {
        "pulse": f"The least reed torque over the pulse is {rms} rms ({front} {where}).",
        "torque": f"With the reed torque at {front} {where}, {peak_text}.",
        "retrofit": f"Balanced with the least change from today's machine; {peak_text.replace('least ', '')}.",
    }[target]
