"""From a beat-up scene and a target to the program: variables, limits, objectives and their natural sizes."""

import functools
import math
from collections.abc import Callable, Collection, Mapping, Sequence

from loomopt.base.errors import BadInput
from loomopt.jobs import base
from loomopt.jobs.beatup import model as beatup
from loomopt.jobs.beatup.design import BALANCE
from loomopt.jobs.beatup.model import LENGTHS
from loomopt.jobs.beatup.scene import RESISTED, VARIABLES, RetrofitTarget, TorqueTarget
from loomopt.model import numbers as scene_numbers
from loomopt.model.drive import TORQUE
from loomopt.model.limits import CycleLimit, DesignLimit, Limit, RatioLimit
from loomopt.model.model import JobModel
from loomopt.model.moves import AxisMove, Move, Wish
from loomopt.model.numbers import Bounds, bound_limits, demand_figures, demanded, ends
from loomopt.model.objectives import Magnitude, Objective, Peak, Value
from loomopt.model.program import Numbers, Program, Variable, goals
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.effects.kinds import Check, Load
from loomopt.physics.tolerances import NO_MASS
from loomopt.scenes.scene import Scene
from loomopt.scenes.tables import Limit as Limited

COUNTERWEIGHT = ("m4e", "r4e")
AMPLE, LONG = 10.0, 3.0
"""Inertia beyond which no counterweight is of use, in those of the reed; radius beyond which none is built, in l4."""


def counterweight_holding(reed: float, front: float, resistance: float) -> float:
    """Return the inertia, kg·m², that holds the resistance at front dead centre, turning as the reed does today.

    reed: today's inertia, kg·m²; front: today's reed torque there with the resistance, N·m; resistance: N·m. From
    M3 = M0 − J ψ'' ω² [Yuan24, eq 2], in proportion.
    """
    return reed * abs(resistance / (front - resistance)) if front != resistance else 0.0


def counterweight_room(
    known: Mapping[str, float], bounds: Mapping[str, tuple[float, float]], inertia: float
) -> dict[str, tuple[float, float]]:
    """Return the bounds of mass, kg, and radius, m, as far as they are of use: generous ones say nothing of a machine.

    known: today's m4e, r4e and l4; inertia: of the reed or of what holds the resistance, kg·m²; 0 where there is none
    to compare with, and the bounds stay as they are.
    """
    found, ample = {name: bounds[name] for name in COUNTERWEIGHT}, AMPLE * inertia
    if found["m4e"][1] * found["r4e"][1] ** 2 > ample > 0.0:
        low, high = found["r4e"]
        found["r4e"] = low, min(high, max(low, known["r4e"], LONG * known["l4"]))
        low, high = found["m4e"]
        found["m4e"] = low, min(high, max(low, known["m4e"], ample / found["r4e"][1] ** 2))
    return found


ROWS = {"mu_min": ("mu_near", "mu_far")}
"""Figures that are the least of several smooth rows."""
USED = {"s": 0.4, "m4e": 0.5, "r4e": 0.9}
MUCH = {"m4e": 0.98, "r4e": 0.9}
"""Shares of the counterweight's room that a solve starts from."""
SAMPLES = 180
"""Samples of one turn that are enough for a size."""
MASKED = 1e-3
"""A reed torque that moves by less than this share of the resistance is scaled by the resistance."""


def model(scene: Scene, known: Mapping[str, float], design: Numbers | None = None, changes: bool = False) -> JobModel:
    """Return the mechanism with the effects the scene calls for; known: its numbers; design: what is not today's.

    changes: whether the change from today is read.
    """
    changing = tuple(VARIABLES) if changes else ()
    found = beatup.model(scene.active, scene_numbers.words(scene), frozenset(known), RESISTED, changing)
    return scene_numbers.settled(scene, found, known, design)


def numbers(scene: Scene) -> dict[str, float]:
    """Return every number of the scene by name, SI, today's lengths also as today.*."""
    return scene_numbers.numbers(scene) | {f"today.{name}": scene.mechanism[name] for name in LENGTHS}


def program(scene: Scene, target: str) -> Program:
    """Return the program of a target: all that a solve needs to know of the scene."""
    return held(scene, target, None)[0]


def held(scene: Scene, target: str, traded: Collection[str] | None) -> tuple[Program, Callable[[str], float]]:
    """Return the program of a target, or what it ("" for none) demands of all that is traded; natural sizes of axes."""
    known = numbers(scene)
    limited = scene_numbers.bounds(scene, known)
    changes = target == "retrofit" or "change" in (traded or ())
    physics = model(scene, known, changes=changes)
    sizes = _Sizes(scene, known, limited)
    direct = traded is not None or _reads_counterweight(scene, target, limited)
    variables = _variables(scene, sizes, limited, direct)
    demand_figures(scene, physics, ROWS, "Take the limit off, or add what {name} needs.")
    limits = [limit for v in variables if v.called in scene.bounds for limit in bound_limits(v, False)]
    limits += [] if direct else _mass_limits(limited["m4e"], sizes)
    limits += [each for name, limit in scene.limits.items() for each in _figure_limits(name, limit, sizes)]
    limits += demanded(scene, physics.checks, known, {})
    margins = physics.kinematics.groups[""].margins
    limits += [DesignLimit(row, -1, row, 0.0, sizes.length, relaxable=False) for row in margins]
    fallen = "M3_fdc" in (traded or ())
    asked = [] if fallen else _target_limits(scene, target, sizes)
    limits += asked
    taken = {variable.name for variable in variables} | {"m4e"}
    parameters = {name: value for name, value in known.items() if name not in taken}
    if changes:
        parameters |= _change_parameters(scene, known, limited)
    starts = _starts(variables, known, direct, target == "retrofit")
    moves = (*_moves(variables, known, limited, sizes.most), *scene_numbers.axis_moves(scene, known, limited))
    objectives = (*_objectives(target, sizes), *scene_numbers.least(sizes.sampler))
    if traded is not None:
        objectives = objectives[:1] if target == "balance" and not fallen else ()
    task = physics, tuple(variables), parameters, tuple(limits), objectives, starts, moves
    reached = goals(asked) if target != "balance" else () if fallen else (BALANCE,)
    return Program(*task, goals=reached), functools.partial(_axis_size, sizes, variables)


def _axis_size(sizes: "_Sizes", variables: Sequence[Variable], name: str) -> float:
    """Return the natural size, SI, of what of an axis is sought the least of."""
    if name not in sizes.scene.schema.figures:
        return next(v.scale for v in variables if name in (v.name, v.called))
    return {"change": 1.0, "pulse_rms": sizes.mean_square}.get(name) or sizes.figure(name)


class _Sizes:
    """Natural sizes of this machine, SI, from today's design: what the NLP is scaled by."""

    def __init__(self, scene: Scene, known: Mapping[str, float], limited: Bounds) -> None:
        physics = model(scene, known)
        sampler = sampled(physics, known, SAMPLES)
        resistance = known.get("M0", 0.0) if RESISTED[0] in scene.effects else 0.0
        front = sampler.static.get("M3_fdc", 0.0)
        self.scene, self.known, self.limited, self.sampler = scene, known, limited, sampler
        self.length = known["l4"]
        reed = max((float(own) for own in _reed(sampler)), default=0.0)
        self.room = counterweight_room(known, limited, max(reed, counterweight_holding(reed, front, resistance)))
        self.most = self.room["m4e"][1] * self.room["r4e"][1] ** 2
        self.inertia = max(reed, self.most) or 1.0
        self.peak = (sampler.peak(TORQUE) if physics.loads else 0.0) or 1.0
        # What a design can change of the reed torque is its share beside the resistance.
        self.torque = max(abs(front - resistance), MASKED * resistance) or self.peak
        self.mean_square = self.torque * max(self.torque, resistance)

    def variable(self, name: str) -> float:
        """Return the size of a variable: its kind's, or its own largest value that is of use."""
        if name in LENGTHS:
            return self.length
        return max(abs(self.known[name]), *map(abs, self.room.get(name, self.limited[name]))) or self.length

    def figure(self, name: str) -> float:
        """Return the size of a figure."""
        if name == TORQUE:
            return self.peak
        if self.sampler.model.has_quantity(name):
            return abs(self.sampler.peak(name)) or 1.0
        kind = self.scene.schema.figures[name].kind
        fixed = {"torque": self.torque, "length": self.length, "inertia": self.inertia, "angle": 1.0}
        return fixed.get(kind) or scene_numbers.figure_size(self.sampler, name)


def _reed(sampler: Sampler) -> list[float]:
    """Return today's inertia of the reed without a counterweight, kg·m², by each load that reads s."""
    given, loads = sampler.given, [load for load in sampler.model.loads if isinstance(load, Load)]
    own = [(load.moved, given.own[load.name]) for load in loads if load.moved and "s" in load.reads]
    return [moved({**given.values, "s": 0.0}, values) for moved, values in own]


def _variables(scene: Scene, sizes: _Sizes, limited: Bounds, direct: bool) -> list[Variable]:
    """Return the variables; where mass and radius of the counterweight do not matter apart, s = m4e r4e² is one."""
    labels = scene_numbers.labels(scene)
    names = [name for name in limited if direct or name != "m4e"]
    rooms = {**limited, **sizes.room}
    found = [Variable(n, *limited[n], sizes.variable(n), rooms[n], labels.get(n, "")) for n in names]
    if not direct:
        found.append(Variable("s", -math.inf, math.inf, sizes.inertia, (0.0, sizes.most)))
    return found


def demand(scene: Scene, target: str) -> None:
    """Raise BadInput where a target speaks of what the scene does not have."""
    if not any(isinstance(effect, Load) and effect.acts == "output" for effect in scene.active):
        raise BadInput(
            f"target {target} needs a reed torque, and no effect in the scene makes one",
            file=scene.origin,
            key="effects",
            allowed=", ".join(scene.schema.effects),
            remedy="Add the table [effects.inertia] with J4, or another effect.",
        )
    base.demand(scene, target)
    resisted = "M0" in scene.operation and RESISTED[0] in scene.effects
    if target == "torque" and scene.table(TorqueTarget).M3_tolerance is None and not resisted:
        raise BadInput(
            "target torque needs a tolerance for the reed torque",
            file=scene.origin,
            key="targets.torque.M3_tolerance",
            remedy='Set it, as in M3_tolerance = "8 N*m", or add the effect resistance: then it is 1 % of M0.',
        )
    for name in scene.table(RetrofitTarget).weights if target == "retrofit" else ():
        if name not in VARIABLES:
            raise BadInput(
                f"{name} is no design variable",
                file=scene.origin,
                key=f"targets.retrofit.weights.{name}",
                allowed=", ".join(VARIABLES),
                remedy="Name a design variable.",
            )


def _reads_counterweight(scene: Scene, target: str, limited: Bounds) -> bool:
    """Say whether m4e and r4e matter apart from s = m4e r4e², or leave no room for s."""
    asked = set(scene.limits)
    read = target == "retrofit" or "r4" in asked
    for effect in scene.active:
        judged = isinstance(effect, Check) and (effect.demands or asked & {*effect.quantities, *effect.rows})
        read = read or bool(set(effect.reads) & set(COUNTERWEIGHT) and (isinstance(effect, Load) or judged))
    fixed = all(limited[name][0] == limited[name][1] for name in COUNTERWEIGHT)
    return read or fixed or limited["r4e"][1] == 0.0


def _starts(
    variables: Sequence[Variable], known: Mapping[str, float], direct: bool, retrofit: bool
) -> tuple[dict[str, float], ...]:
    """Return today's machine moved just inside its bounds, with a good part of the counterweight in use.

    Never today's own m4e = r4e = 0 alone, where a gradient sees no way to use a counterweight. Where mass and radius
    matter by themselves, little and much of it are optima of their own: then there is a second start.
    """
    first = scene_numbers.inside(variables, {v.name: known.get(v.name, 0.0) for v in variables})

    def using(shares: Mapping[str, float]) -> dict[str, float]:
        given = {v.name: v.range for v in variables if v.name in shares}
        return first | {name: low + shares[name] * (high - low) for name, (low, high) in given.items()}

    return scene_numbers.distinct([using(USED), *([first] if retrofit else [using(MUCH)] if direct else [])])


def _moves(variables: Sequence[Variable], known: Mapping[str, float], limited: Bounds, most: float) -> tuple[Move, ...]:
    """Return the directions that may leave every figure unchanged: first the counterweight's, then a common scale."""
    names = {variable.name for variable in variables}
    used, above = ("s", NO_MASS * most) if "s" in names else ("m4e", 0.0)
    wishes = {
        "m4e": (Wish("least", "least added mass"),),
        "r4e": (
            Wish("most", "least added mass, so the largest radius", used, above),
            Wish("today", "no mass, so the radius nearest today's"),
        ),
    }
    axes = tuple(
        AxisMove("counterweight", (name,), wishes[name], {name: known[name]}, {name: limited[name]})
        for name in COUNTERWEIGHT
        if name in names and limited[name][0] < limited[name][1]
    )
    return (*axes, scene_numbers.scale_move("scale", LENGTHS, known, limited))


def _mass_limits(mass: tuple[float, float], sizes: _Sizes) -> list[Limit]:
    """Return the counterweight's mass bounds as limits on s against r4e²."""
    return [
        RatioLimit("m4e", sign, "s", value, sizes.inertia, "r4e_square", relaxable=sign >= 0 or value > 0.0)
        for sign, value in ends(*mass)
    ]


def _figure_limits(name: str, limit: Limited, sizes: _Sizes) -> list[Limit]:
    """Return the limits on one figure, row by row."""
    kind = CycleLimit if sizes.sampler.model.has_quantity(name) else DesignLimit
    sides = ends(limit.min, limit.max)
    rows = ROWS.get(name, (name,)) if sides[0][0] else (name,)
    return [kind(name, sign, row, value, sizes.figure(name)) for sign, value in sides for row in rows]


def _target_limits(scene: Scene, target: str, sizes: _Sizes) -> list[Limit]:
    """Return what the target itself demands of the reed torque at front dead centre."""
    if target == "retrofit":
        return [DesignLimit("M3_fdc", 0, "M3_fdc", 0.0, sizes.torque)]
    if target != "torque":
        return []
    tolerance = scene.table(TorqueTarget).M3_tolerance
    tolerance = 0.01 * scene.operation["M0"] if tolerance is None else tolerance
    sides = [(0, 0.0)] if tolerance == 0.0 else [(-1, -tolerance), (1, tolerance)]
    return [DesignLimit("M3_fdc", sign, "M3_fdc", value, sizes.torque) for sign, value in sides]


def _change_parameters(scene: Scene, known: Mapping[str, float], limited: Bounds) -> dict[str, float]:
    """Return today's values, bound widths and weights of the retrofit's norm; a fixed variable weighs nothing."""
    weights = scene.table(RetrofitTarget).weights
    found: dict[str, float] = {}
    for name in VARIABLES:
        width = limited[name][1] - limited[name][0]
        found |= {f"today.{name}": known[name], f"width.{name}": width or 1.0}
        found[f"weight.{name}"] = weights.get(name, 1.0) if width else 0.0
    return found


def _objectives(target: str, sizes: _Sizes) -> tuple[Objective, ...]:
    """Return the target's levels in order."""
    peak = Peak(TORQUE, TORQUE, sizes.peak)
    return {
        "balance": (Magnitude("M3_fdc", "M3_fdc", sizes.torque), peak),
        "torque": (peak,),
        "pulse": (Value("pulse_rms", "pulse_mean_square", sizes.mean_square, power=2),),
        "retrofit": (Value("change", "change", 1.0),),
    }.get(target, ())
