"""From a rapier scene and a target to the program: variables, limits, objectives and their scales."""

import math
from collections.abc import Callable, Collection, Sequence
from typing import final

from loomopt.base.errors import BadInput, refusal
from loomopt.base.records import Frozen, lazy
from loomopt.jobs.base import Ends, Minima, Task, bound_limits, distinct, ends, size_read
from loomopt.jobs.rapier import model as rapier
from loomopt.jobs.rapier.model import (
    AFTER,
    BEFORE,
    CLOSES,
    DWELL,
    LOADED,
    SLEY,
    SLEY_MARGINS,
    TravelReading,
    jerk_mean,
    match_mean,
    read,
)
from loomopt.jobs.rapier.scene import FIGURES, STROKE, match_table
from loomopt.maths.systems import FLOAT
from loomopt.model.limits import BoundLimit, CycleLimit, DesignLimit, Limit
from loomopt.model.model import JobModel
from loomopt.model.numbers import numbers, words
from loomopt.model.objectives import Objective, Peak, Value
from loomopt.model.program import Move, Numbers, Variable
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.effects.kinds import Check
from loomopt.physics.mechanisms import rapier_drive
from loomopt.scenes.scene import Scene

FIVE_BAR = ("l4", "l5", "l6", "l3p", "C0x", "C0y")
REQUIRED = {"stroke": 0, "s_dwell": 1, "dwell_after": -1, "dwell_before": -1}
"""Numbers of the operation that targets keep, and on which side a designer could give way."""
SIDES = {"dwell_before": BEFORE, "dwell_after": AFTER}
LOOSE = frozenset((DWELL, *SIDES, "stroke"))
"""Figures that are variables where they are optimised."""
ANGLES = ("alpha", "phi40", "phi30", *SIDES)
S_DWELL = 0.005
"""Share of the stroke that the head may move in a usual dwell."""
TURN = (0.0, 2 * math.pi)


def model(
    scene: Scene, goal_names: Collection[str] = (), read: bool = True, dwell_numbers: Collection[str] | None = None
) -> JobModel:
    """Drive with the effects of the scene and the optimised figures; read: whether effects are read.

    goal_names: the target, or the axes; dwell_numbers: names of the dwells that are demanded, else the operation's.
    """
    read_too = {*goal_names, *scene.limits}
    means = [jerk_mean()] if {"smooth", "rms_jerk"} & read_too else []
    means += [match_mean(*match_table(scene))] if {"match", "match_rms"} & read_too else []
    known = {*numbers(scene), *(("phi_stroke",) if goal_names else ()), *((DWELL,) if DWELL in goal_names else ())}
    effects = scene.active if read else ()
    arcs = dwell_arcs(goal_names, scene.operation if dwell_numbers is None else dwell_numbers)
    return rapier.model(effects, words(scene), frozenset(known), arcs, tuple(means))


def dwell_arcs(goal_names: Collection[str], dwell_numbers: Collection[str]) -> tuple[tuple[float, str], ...]:
    """Sides on which there is a dwell, each with the value that it is."""
    if DWELL in goal_names:
        return tuple((side, DWELL) for side in SIDES.values())
    return tuple((side, name) for name, side in SIDES.items() if name in dwell_numbers)


def hand_over(model: JobModel, values: Numbers) -> Numbers:
    """Angle of the stroke and the least dwell; raises ValueError where the drive does not turn."""
    reading = read(sampled(model, values))
    numbers = {"phi_stroke": reading.phi_stroke}
    return numbers | ({"dwell": min(reading.dwell_after, reading.dwell_before, math.pi)} if "s_dwell" in values else {})


@final
class RapierTask(Task):
    """Design task of a drive; its stroke and dwells are optimised, or fixed variables, which gives them a price."""

    read_from = Frozen(sley_mu_min=("sley_mu_near", "sley_mu_far"), stroke=("reach",))
    tops = Frozen(phi_stroke="S")

    @property
    def goal_names(self) -> tuple[str, ...]:
        """Target, or the axes of the front."""
        return self.traded or (self.target,)

    @lazy
    def free(self) -> dict[str, Ends]:
        """Bounds of the numbers that the scene frees, by full name."""
        free = {self.scene.full(name) for name, bound in self.scene.bounds.items() if bound.free}
        return {name: ends for name, ends in self.limited.items() if name in free}

    @lazy
    def required_names(self) -> list[str]:
        """Numbers of the operation that the target needs and that are no axes."""
        traded = {end for name in self.traded for end in {DWELL: tuple(SIDES)}.get(name, (name,))}
        needs = self.scene.schema.targets[self.target].needs if self.target else ()
        return [name for name in needs if name in self.known and name not in traded]

    @lazy
    def minima(self) -> Minima:
        """Minima of the dwells, rad, by name: from the operation, then from limits. Raises BadInput."""
        limits = self.scene.limits
        least = {name: limit.min for name, limit in limits.items() if name in (DWELL, *SIDES) and limit.min}
        if DWELL in self.goal_names:
            for name in (name for name in least if name in SIDES):
                problem, remedy = (
                    "the smaller of both dwells is maximised, so one dwell alone cannot be limited",
                    f"Limit {DWELL}.",
                )
                raise refusal(problem, self.scene.origin, f"limits.{name}", remedy=remedy)
            return {DWELL: [(DWELL, least[DWELL])]} if least else {}
        names = [name for name in self.required_names if name not in self.free]
        demands = {n: [(n, self.scene.operation[n])] if n in names else [] for n in REQUIRED if n in SIDES}
        for name, pairs in demands.items():
            pairs += [(by, least[by]) for by in (name, DWELL) if by in least]
        return {name: pairs for name, pairs in demands.items() if pairs}

    @property
    def dwell_numbers(self) -> Collection[str]:
        """Numbers that are known or demanded, dwells among them."""
        return {*self.known, *self.minima}

    @lazy
    def model(self) -> JobModel:
        """Drive with the optimised figures, and with the effects if one of their figures is read."""
        checks = [effect for effect in self.scene.active if isinstance(effect, Check)]
        given = {name for check in checks for name in (*check.over_cycle, *check.rows)}
        read = bool((given | set(LOADED)) & {*self.scene.limits, *self.goal_names})
        return model(
            self.scene,
            self.goal_names,
            read or any(check.demands or check.least for check in checks),
            self.dwell_numbers,
        )

    @lazy
    def sampler(self) -> Sampler:
        """Today's drive; of a dwell that is not there yet, any angle."""
        return sampled(self.model, {DWELL: 1.0, "phi_stroke": 0.0, **dict.fromkeys(self.minima, 1.0), **self.known})

    @lazy
    def reading(self) -> TravelReading:
        """Today's stroke and dwells."""
        return read(self.sampler)

    def demand_figures(self) -> None:
        """Raise BadInput for a limit on a figure, or a dwell to trade, that nothing in the scene gives."""
        operation, traded = self.scene.operation, self.traded
        absent = [name for name in (*STROKE[1:2], *traded) if name in STROKE and name not in operation]
        if set(traded) & LOOSE and absent:
            raise refusal(
                f"to trade {', '.join(traded)} needs {absent[0]}", self.scene.origin, f"operation.{absent[0]}"
            )
        full = model(self.scene)
        missing = [name for name in LOADED if name in self.scene.limits and not full.has_quantity(name)]
        if missing:
            raise BadInput(
                "peak_power needs the speed" if full.loads else "no effect in the scene makes a tape force",
                file=self.scene.origin,
                key="limits",
                remedy=f"{'Give operation.speed' if full.loads else 'Put on head_inertia or tape_friction'}, or take "
                f"the limit on {missing[0]} out.",
            )

    # Variables.

    @lazy
    def bounded(self) -> tuple[Variable, ...]:
        """Freed numbers, numbers that the target needs, the hand-over, and figures that are variables."""
        variables = [self.variable(name, ends) for name, ends in self.free.items()]
        variables += [
            self.operated(name, (self.known[name],) * 2) for name in self.required_names if name not in self.free
        ]
        variables.append(Variable("phi_stroke", *TURN, 1.0, TURN))
        return *variables, *(self.loose(name) for name in self.goal_names if name in LOOSE and name not in self.free)

    def scale(self, name: str, ends: Ends) -> float:
        """Size of a variable: angles 1 rad, lengths the largest they may be."""
        return 1.0 if name in ANGLES else max(abs(self.known[name]), *map(abs, ends)) or 1.0

    def loose(self, name: str) -> Variable:
        """Number of the operation that is free."""
        if name == "stroke":
            return self.operated(name, (0.0, math.inf), (0.5 * self.known[name], 1.5 * self.known[name]))
        return self.operated(name, (1e-3, math.pi))

    def operated(self, name: str, ends: Ends, around: Ends | None = None) -> Variable:
        """Number of the operation as a variable; around: where random starts lie."""
        return Variable(name, *ends, self.operated_size(name), around or ends)

    def operated_size(self, name: str) -> float:
        """Scale of a number of the operation."""
        stroke = float(self.known.get("stroke", 0.0))
        if name == "stroke":
            return stroke
        return max(float(self.known[name]), S_DWELL * stroke) if name == "s_dwell" else 1.0

    # Limits.

    def limits(self) -> list[Limit]:
        """All limits; a figure whose limit a variable's bounds imply has none."""
        figures = [limit for limit in self.figures() if not self.implied(limit)]
        required = [limit for limit in self.required() if limit.name not in self.minima]
        return [
            *self.bounds(),
            *required,
            *self.floors(),
            *self.definitions(),
            *self.margins(),
            *figures,
            *self.demands(),
        ]

    def bounds(self) -> list[Limit]:
        """Bounds of the numbers that the scene frees."""
        return [limit for v in self.bounded if v.name in self.free for limit in bound_limits(v)]

    def required(self) -> list[Limit]:
        """Limits on the figures that the target keeps, on the side on which a designer could give way."""
        known = self.known
        names = [name for name in self.required_names if name not in self.free]
        return [BoundLimit(n, REQUIRED[n], n, known[n], self.operated_size(n)) for n in names]

    def goal_limits(self) -> list[Limit]:
        """Limits on figures that are goals of the target, from the bounds and from the figures it keeps."""
        return [
            limit
            for limit in (*self.bounds(), *self.required())
            if limit.name in self.required_names and limit.name in FIGURES
        ]

    def implied(self, limit: Limit) -> bool:
        """Whether the bounds of the variable of a limit's name imply the limit."""
        variable = next((v for v in self.variables if v.name == limit.name), None)
        if variable is None:
            return False
        return (limit.sign > 0 or variable.lower >= limit.value) and (limit.sign < 0 or variable.upper <= limit.value)

    def definitions(self) -> list[Limit]:
        """Limits that define stroke and dwells: the head rests at its stroke, and stays within s_dwell on the arcs.

        Without a demanded stroke, the row of the rest alone would also accept front dead centre as the hand-over. The
        hand-over is therefore a position outside the dwells at which the head turns back.
        """
        reached = {*self.required_names, *self.minima, *(name for name in self.goal_names if name in LOOSE)}
        size, rows = 1.0, {"head at rest at phi_stroke": "rest"}
        if "stroke" in reached:
            size, rows = self.known["stroke"], rows | {"stroke is reached": "stroke_short"}
        firm = {"relaxable": False, "hidden": True}
        limits: list[Limit] = [DesignLimit(name, 0, row, 0.0, size, **firm) for name, row in rows.items()]
        if "stroke" not in reached and "phi_stroke" in {*self.goal_names, *self.scene.limits}:
            least = self.known.get("s_dwell", S_DWELL * self.reading.stroke)
            limits.append(DesignLimit("head turns back at phi_stroke", 1, "turning", 0.0, size, **firm))
            limits.append(DesignLimit("phi_stroke lies outside the dwells", -1, "reach", least, size, **firm))
        for side, name in dwell_arcs(self.goal_names, self.dwell_numbers):
            if name in reached or name == DWELL:
                text = f"head within s_dwell {'after' if side == AFTER else 'before'} front dead centre"
                where = (DWELL, side)
                limits.append(CycleLimit(text, 1, "dwell_travel", 1.0, 1.0, where=where, **firm))
        return limits

    def margins(self) -> list[Limit]:
        """Margins by which every dyad closes over the whole turn; the sley's where it may change."""
        limits = [self.row_limit(name, 1, row, 1.0, 1.0, relaxable=False) for name, row in CLOSES.items()]
        rows = SLEY_MARGINS if set(SLEY) & set(self.free) else ()
        return limits + [self.row_limit(row, -1, row, 0.0, self.known["l71"], relaxable=False) for row in rows]

    def figure(self, name: str, low: float | None, high: float | None) -> list[Limit]:
        """Limits on one figure, row by row; a dwell is a variable's."""
        if name == "mu_min" and low is not None:
            return [CycleLimit(name, -1, "obliquity", low, 1.0, complement=math.pi / 2)]
        if name in (DWELL, *SIDES):
            return []
        sides, rows = ends(low, high), self.read_from.get(name, (name,))
        size = self.limit_size(name, sides)
        return [self.row_limit(name, sign, row, value, size) for sign, value in sides for row in rows]

    def limit_size(self, name: str, sides: Sequence[tuple[int, float]]) -> float:
        """Scale of a limit on a figure; sides: of the limit."""
        if self.model.has_quantity(name):
            return self.sampler.peak(name) or 1.0
        if any(name in check.rows for check in self.model.checks):
            return max(abs(value) for _, value in sides) or 1.0
        if name == "rms_jerk":
            return self.sampler.single(name)
        return self.reading.stroke if name == "stroke" else 1.0

    # Levels, starts and moves.

    def objectives(self) -> tuple[Objective, ...]:
        """Target's levels in order."""
        peak, stroke = self.sampler.peak("peak_acceleration") or 1.0, self.reading.stroke or 1.0
        levels = {
            "stroke-dwell": Peak("peak_acceleration", "peak_acceleration", peak),
            "dwell": Value("dwell", "dwell_rest", 1.0),
            "smooth": Value("rms_jerk", "jerk_mean_square", peak**2, power=2),
            "match": Value("match_rms", "match_mean_square", stroke**2, power=2),
        }
        return levels[self.target], *self.least()

    def starts(self) -> tuple[dict[str, float], ...]:
        """Today's drive moved just inside its bounds, and the paper's own construction where it closes."""
        built = paper_construction(self.known)
        return distinct([self.inside(self.known), *([self.inside({**self.known, **built})] if built else [])])

    def moves(self) -> list[Move]:
        """Scales of five-bar and sley, where all of their lengths are free, and numbers of checks."""
        taken = {variable.name for variable in self.variables}
        scales = (("five-bar scale", FIVE_BAR), ("sley scale", SLEY))
        return [*(self.scale_move(name, along) for name, along in scales if taken >= set(along)), *self.axis_moves()]

    def follow(self) -> Callable[[JobModel, Numbers], Numbers]:
        """Solved variables: the hand-over and the least dwell."""
        return hand_over

    def figure_size(self, name: str) -> float:
        """Size of a figure, of a mean its square's."""
        peak, stroke = self.sampler.peak("peak_acceleration") or 1.0, self.reading.stroke or 1.0
        sizes = {"rms_jerk": peak**2, "match_rms": stroke**2, "mu_min": 1.0, "sley_mu_min": 1.0}
        return sizes.get(name) or size_read(self.sampler, name, self.scene.schema.figures)


def paper_construction(known: Numbers) -> dict[str, float] | None:
    """C0, l5 and φ40 by the paper's construction [Hong17] for a scene's stroke; None where it does not close."""
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
    values = {"C0x": layout.C0x, "C0y": layout.C0y, "l5": layout.reach - dimensions.l4, "phi40": layout.phi40}
    return None if rapier_drive.fault_of({**known, **values}) else values
