"""From a beat-up scene and a target to the program: variables, limits, objectives and their natural sizes."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from loomopt.errors import BadInput
from loomopt.jobs.beatup.model import ASSEMBLY, Beatup
from loomopt.jobs.beatup.scene import FIGURES, VARIABLES
from loomopt.program.numbers import bounds as bounds_of
from loomopt.program.numbers import full_name, words
from loomopt.program.numbers import numbers as numbers_of
from loomopt.program.program import Limit, Objective, Program, Variable
from loomopt.program.sampling import Sampler
from loomopt.schema import Check, Load

LENGTHS = ("l1", "l2", "l3", "l4")
COUNTERWEIGHT = ("m4e", "r4e")
ROWS = {"mu_min": ("mu_near", "mu_far")}
"""Figures that are the least of several smooth rows."""
USED = {"s": 0.4, "m4e": 0.5, "r4e": 0.9}
MUCH = {"m4e": 0.98, "r4e": 0.9}
"""Shares of the counterweight's room that a solve starts from."""
SAMPLES = 180
"""Samples of one turn that are enough for a size."""
MASKED = 1e-3
"""A reed torque that moves by less than this share of the resistance is scaled by the resistance."""
CYCLE_FIGURES = ("peak_torque", "bearing_force", "shaking_force")


def model(scene: Any, known: Mapping[str, float] | None = None) -> Beatup:
    """Return the mechanism with the effects the scene calls for; known: its numbers, where they are at hand."""
    effects = [scene.job.effects[name] for name in scene.effects]
    return Beatup(
        tuple(effect for effect in effects if isinstance(effect, Load)),
        tuple(effect for effect in effects if isinstance(effect, Check)),
        words(scene),
        frozenset(known or numbers(scene)),
    )


def numbers(scene: Any) -> dict[str, float]:
    """Return every number of the scene by name, SI, today's lengths also as today.*."""
    return numbers_of(scene) | {f"today.{name}": scene.mechanism[name] for name in LENGTHS}


def today(scene: Any) -> dict[str, float]:
    """Return today's design, SI, with every other number that the scene bounds."""
    known = numbers(scene)
    others = [full_name(known, name) for name in scene.bounds if name not in VARIABLES]
    return {name: known[name] for name in (*VARIABLES, *others)}


def bounds(scene: Any) -> dict[str, tuple[float, float]]:
    """Return lower and upper bound of every bounded number, by its full name, SI; held ones at today's value."""
    return bounds_of(scene, numbers(scene), VARIABLES)


def program(scene: Any, target: str) -> Program:
    """Return the program of a target: all that a solve needs to know of the scene."""
    known = numbers(scene)
    limited = bounds_of(scene, known, VARIABLES)
    physics = model(scene, known)
    sizes = _Sizes(physics, known, limited)
    direct = _reads_counterweight(scene, target, limited)
    names = [name for name in limited if direct or name != "m4e"]
    variables = [Variable(name, *limited[name], sizes.variable(name), limited[name]) for name in names]
    if not direct:
        most = limited["m4e"][1] * limited["r4e"][1] ** 2
        variables.append(Variable("s", -math.inf, math.inf, sizes.inertia, (0.0, most)))
    _demand_figures(scene, physics, sizes.sampler)
    limits = [limit for variable in variables for limit in _bound_limits(scene, variable)]
    limits += [] if direct else _mass_limits(limited["m4e"], sizes)
    limits += [limit for name, limit in scene.limits.items() for limit in _figure_limits(name, limit, sizes)]
    limits += [Limit(row, -1, row, 0.0, sizes.length, "static", relaxable=False) for row in ASSEMBLY]
    limits += _target_limits(scene, target, sizes)
    taken = {variable.name for variable in variables} | {"m4e"}
    parameters = {name: value for name, value in known.items() if name not in taken}
    if target == "retrofit":
        parameters |= _change_parameters(scene, known, limited)
    starts = _starts(variables, known, direct, target == "retrofit")
    return Program(physics, tuple(variables), parameters, tuple(limits), _objectives(target, sizes), starts)


class _Sizes:
    """Natural sizes of this machine, SI, from today's design: what the NLP is scaled by."""

    def __init__(self, physics: Beatup, known: Mapping[str, float], limited: Mapping[str, tuple[float, float]]) -> None:
        sampler = Sampler(physics, known, SAMPLES)
        resistance = known.get("M0", 0.0) if "resistance.pulse" in known else 0.0
        front = sampler.static.get("M3_fdc", 0.0)
        self.known, self.limited, self.sampler = known, limited, sampler
        self.length = known["l4"]
        self.inertia = max(known.get("inertia.J4", 0.0), limited["m4e"][1] * limited["r4e"][1] ** 2) or 1.0
        self.peak = (sampler.peak("peak_torque") if physics.loads else 0.0) or 1.0
        # What a design can change of the reed torque is its share beside the resistance.
        self.torque = max(abs(front - resistance), MASKED * resistance) or self.peak
        self.mean_square = self.torque * max(self.torque, resistance)

    def variable(self, name: str) -> float:
        """Return the size of a variable: its kind's, or its own largest value."""
        if name in LENGTHS:
            return self.length
        return max(abs(self.known[name]), *map(abs, self.limited[name])) or self.length

    def figure(self, name: str) -> float:
        """Return the size of a figure."""
        kind = FIGURES[name].kind
        if name == "peak_torque":
            return self.peak
        if name in CYCLE_FIGURES:
            return self.sampler.peak(name) or 1.0
        fixed = {"torque": self.torque, "length": self.length, "inertia": self.inertia, "angle": 1.0}
        return fixed.get(kind) or abs(self.sampler.static[name]) or 1.0


def demand(scene: Any, target: str) -> None:
    """Raise BadInput where a target speaks of what the scene does not have."""
    effects = [scene.job.effects[name] for name in scene.effects]
    if not any(isinstance(effect, Load) and effect.acts == "output" for effect in effects):
        raise BadInput(
            f"target {target} needs a reed torque, and no effect in the scene makes one",
            file=scene.origin,
            key="effects",
            allowed=", ".join(scene.job.effects),
            remedy="Add the table [effects.inertia] with J4, or another effect.",
        )
    for name in scene.job.targets[target].needs_effects:
        if name not in scene.effects:
            raise BadInput(
                f"target {target} needs the effect {name}",
                file=scene.origin,
                key=f"effects.{name}",
                remedy=f"Add the table [effects.{name}], or choose another target.",
            )
    resisted = "M0" in scene.operation and "resistance" in scene.effects
    if target == "torque" and scene.targets["torque"].M3_tolerance is None and not resisted:
        raise BadInput(
            "target torque needs a tolerance for the reed torque",
            file=scene.origin,
            key="targets.torque.M3_tolerance",
            remedy='Set it, as in M3_tolerance = "8 N*m", or add the effect resistance: then it is 1 % of M0.',
        )
    for name in scene.targets["retrofit"].weights if target == "retrofit" else ():
        if name not in VARIABLES:
            raise BadInput(
                f"{name} is no design variable",
                file=scene.origin,
                key=f"targets.retrofit.weights.{name}",
                allowed=", ".join(VARIABLES),
                remedy="Name a design variable.",
            )


def _demand_figures(scene: Any, physics: Beatup, sampler: Sampler) -> None:
    """Raise BadInput for a limit on a figure that nothing in the scene gives."""
    for name in scene.limits:
        if not set(ROWS.get(name, (name,))) <= {*sampler.figures, *physics.quantities}:
            raise BadInput(
                f"nothing in the scene gives the figure {name}",
                file=scene.origin,
                key=f"limits.{name}",
                allowed="figures whose numbers and effects the scene has",
                remedy=f"Take the limit off, or add what {name} needs.",
            )


def _reads_counterweight(scene: Any, target: str, limited: Mapping[str, tuple[float, float]]) -> bool:
    """Say whether m4e and r4e matter apart from s = m4e r4e², or leave no room for s."""
    loads = [scene.job.effects[name] for name in scene.effects]
    read = any(set(effect.reads) & set(COUNTERWEIGHT) for effect in loads if isinstance(effect, Load))
    read = read or bool({"r4", "bearing_force", "shaking_force"} & set(scene.limits)) or target == "retrofit"
    fixed = all(limited[name][0] == limited[name][1] for name in COUNTERWEIGHT)
    return read or fixed or limited["r4e"][1] == 0.0


def _bound_limits(scene: Any, variable: Variable) -> list[Limit]:
    """Return the bounds of a variable the scene bounds, as limits; one that it leaves alone is held, not limited."""
    label = variable.name.rpartition(".")[2]
    if label not in scene.bounds or variable.name == "s":
        return []
    if variable.lower == variable.upper:
        return [Limit(label, 0, variable.name, variable.lower, variable.scale, "variable")]
    ends = ((-1, variable.lower), (1, variable.upper))
    return [
        Limit(label, sign, variable.name, value, variable.scale, "variable", relaxable=sign > 0 or value > 0.0)
        for sign, value in ends
    ]


def _starts(
    variables: Sequence[Variable], known: Mapping[str, float], direct: bool, retrofit: bool
) -> tuple[dict[str, float], ...]:
    """Return today's machine moved just inside its bounds, with a good part of the counterweight in use.

    Never today's own m4e = r4e = 0 alone, where a gradient sees no way to use a counterweight. Where mass and radius
    matter by themselves, little and much of it are optima of their own: then there is a second start.
    """
    first = {}
    for v in variables:
        room = 0.01 * (v.upper - v.lower) if math.isfinite(v.upper - v.lower) else 0.0
        first[v.name] = min(max(known.get(v.name, 0.0), v.lower + room), v.upper - room)

    def using(shares: Mapping[str, float]) -> dict[str, float]:
        given = {v.name: v.range for v in variables if v.name in shares}
        return first | {name: low + shares[name] * (high - low) for name, (low, high) in given.items()}

    found = [using(USED), *([first] if retrofit else [using(MUCH)] if direct else [])]
    return tuple(start for place, start in enumerate(found) if start not in found[:place])


def _mass_limits(mass: tuple[float, float], sizes: _Sizes) -> list[Limit]:
    """Return the counterweight's mass bounds as limits on s against r4e²."""
    if mass[0] == mass[1]:
        return [Limit("m4e", 0, "s", mass[0], sizes.inertia, "static", "r4e_square")]
    ends = ((-1, mass[0]), (1, mass[1]))
    return [
        Limit("m4e", sign, "s", value, sizes.inertia, "static", "r4e_square", relaxable=sign > 0 or value > 0.0)
        for sign, value in ends
    ]


def _figure_limits(name: str, limit: Any, sizes: _Sizes) -> list[Limit]:
    """Return the limits on one figure, row by row."""
    family: Literal["static", "cycle"] = "cycle" if name in CYCLE_FIGURES else "static"
    scale = sizes.figure(name)
    if limit.min is not None and limit.min == limit.max:
        return [Limit(name, 0, name, limit.min, scale, "static")]
    ends = [(sign, value) for sign, value in ((-1, limit.min), (1, limit.max)) if value is not None]
    rows = ROWS.get(name, (name,))
    return [Limit(name, sign, row, value, scale, family) for sign, value in ends for row in rows]


def _target_limits(scene: Any, target: str, sizes: _Sizes) -> list[Limit]:
    """Return what the target itself demands of the reed torque at front dead centre."""
    if target == "retrofit":
        return [Limit("M3_fdc", 0, "M3_fdc", 0.0, sizes.torque, "static")]
    if target != "torque":
        return []
    tolerance = scene.targets["torque"].M3_tolerance
    tolerance = 0.01 * scene.operation["M0"] if tolerance is None else tolerance
    if tolerance == 0.0:
        return [Limit("M3_fdc", 0, "M3_fdc", 0.0, sizes.torque, "static")]
    return [Limit("M3_fdc", sign, "M3_fdc", sign * tolerance, sizes.torque, "static") for sign in (-1, 1)]


def _change_parameters(scene: Any, known: Mapping[str, float], limited: Mapping[str, Any]) -> dict[str, float]:
    """Return today's values, bound widths and weights of the retrofit's norm; a fixed variable weighs nothing."""
    weights = scene.targets["retrofit"].weights
    found: dict[str, float] = {}
    for name in VARIABLES:
        width = limited[name][1] - limited[name][0]
        found |= {f"today.{name}": known[name], f"width.{name}": width or 1.0}
        found[f"weight.{name}"] = weights.get(name, 1.0) if width else 0.0
    return found


def _objectives(target: str, sizes: _Sizes) -> tuple[Objective, ...]:
    """Return the target's levels in order."""
    peak = Objective("peak_torque", "peak_torque", "peak", sizes.peak)
    return {
        "balance": (Objective("M3_fdc", "M3_fdc", "magnitude", sizes.torque), peak),
        "torque": (peak,),
        "pulse": (Objective("pulse_rms", "pulse_mean_square", "value", sizes.mean_square, power=2),),
        "retrofit": (Objective("change", "change", "value", 1.0),),
    }[target]
