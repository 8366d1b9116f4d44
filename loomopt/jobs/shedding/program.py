"""Program of a shedding scene and a target: variables, limits, objectives and starts."""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, final

import numpy as np

from loomopt.base.errors import refusal
from loomopt.base.records import Frozen, lazy
from loomopt.jobs.base import Ends, Minima, Task, bound_limits, ends, size_read
from loomopt.jobs.shedding import model as shedding
from loomopt.jobs.shedding.model import AT_REST, CYCLE, FASTEST, FOLLOWER, LIFT, RETURN_SPRING, law_rows
from loomopt.jobs.shedding.scene import (
    SEGMENTS,
    VARIABLES,
    HealdFrame,
    LawTarget,
    cam_law,
    has_dwells,
    moves,
    program_numbers,
)
from loomopt.maths import systems
from loomopt.maths.systems import Number, numpy
from loomopt.model import drive
from loomopt.model.limits import BoundLimit, Limit
from loomopt.model.model import JobModel
from loomopt.model.numbers import numbers, words
from loomopt.model.objectives import Objective, Peak, Value
from loomopt.model.program import Goal, Move, Numbers, Variable, goals, nothing_follows
from loomopt.model.reading import Quantities
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.cycle import Floats, Node, Pieces
from loomopt.physics.effects.kinds import Check, Load, owned
from loomopt.physics.mechanisms import cam_spline
from loomopt.physics.mechanisms.cam_motion import CamLaw, Spline, accelerations, named_knots
from loomopt.physics.tolerances import ACCURACY, START_ROOM
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    from loomopt.model.machines import Machines

SPEED_AT_REST, SPEED_STEPS, SPEED_CONVERGED = 1e-12, 30, 1e-8
"""Largest speed that keeps a bound: share of the largest value by which one at rest may miss it, for rounding; Newton's
steps at most, and the share of the speed after which there is none left to take: the next would be its square."""


def speed_reached(model: JobModel, values: Mapping[str, float], name: str, most: float, slack: float = 0.0) -> float:
    """Speed, rad/s, up to which a signed quantity is at most `most`, SI; infinite without such a speed.

    It is quadratic in the speed at every crank angle: the first root is sampled, then followed by Newton's method
    with the refined largest value. 0 if the bound is violated at rest. slack, SI: permitted excess at rest and
    up to the speed of the mechanism, because a solve meets an active bound only to rounding.
    """
    nominal = float(values["speed"])
    at_rest = sampled(model, {**values, "speed": 0.0})
    speed = _crossing_speed(at_rest, nominal, name, most, slack)
    if not (slack > 0.0 and speed < nominal and sampled(model, values).peak(name) <= most + slack):
        return speed
    return nominal if nominal <= _crossing_speed(at_rest, nominal, name, most + slack, slack) else speed


def solved_speed(
    name: str, reached: Callable[[Sampler], float], model: JobModel, values: Mapping[str, float]
) -> dict[str, float]:
    """Speed, rad/s, that follows from all other numbers, by name; {} where no such speed exists."""
    speed = reached(sampled(model, values))
    return {name: speed} if math.isfinite(speed) else {}


def _crossing_speed(at_rest: Sampler, unit: float, name: str, most: float, slack: float) -> float:
    """Speed, rad/s, up to which a quantity stays at most `most`; unit: a speed to read it at, rad/s."""
    nodes = at_rest.node(*at_rest.grid())
    rest, ahead, back = -_at_speeds(at_rest, name, nodes, (0.0, unit, -unit))
    rounding = SPEED_AT_REST * float(np.abs([rest, ahead]).max())
    spare = rest + most
    if spare.min() < -max(rounding, slack):
        return 0.0
    square, linear = (ahead + back) / 2 - rest, (ahead - back) / 2
    shares = _first_roots(square, linear, np.maximum(spare, 0.0), rounding)
    share = float(shares.min())
    return math.inf if math.isinf(share) else _refined_speed(at_rest, name, most, unit * share)


def _at_speeds(at_rest: Sampler, name: str, nodes: Node, speeds: Sequence[float]) -> Floats:
    """(speeds, nodes): a quantity at each of several speeds, rad/s."""
    values = {**at_rest.values, **at_rest.hints, "speed": np.array(speeds)[:, None]}
    given = at_rest.model.given(numpy(), values)
    (quantity,) = Quantities(at_rest.model, (numpy(), numpy()), given)((name,), nodes)
    at_rest.session.positions += quantity.size
    return np.broadcast_to(quantity, (len(speeds), len(nodes.phi)))


def _first_roots(square: Floats, linear: Floats, spare: Floats, rounding: float) -> Floats:
    """Least positive x with square x² + linear x + spare = 0 at each angle, infinite without one."""
    with np.errstate(divide="ignore", invalid="ignore"):
        inside = linear**2 - 4 * square * spare
        root = 2 * spare / (-linear + np.sqrt(np.maximum(inside, 0.0)))
    falls = (inside >= 0.0) & (root > 0.0) & ((np.abs(square) > rounding) | (np.abs(linear) > rounding))
    return np.where(falls, root, np.inf)


def _refined_speed(at_rest: Sampler, name: str, most: float, speed: float) -> float:
    """Speed, rad/s, where the refined largest value is `most`, from one nearby."""
    for _ in range(SPEED_STEPS):
        top = sampled(at_rest.model, {**at_rest.values, "speed": speed}).extremes(name)[0]
        node = at_rest.node(np.array([top.piece]), np.array([top.u]))
        still, twice = _at_speeds(at_rest, name, node, (0.0, 2 * speed)).ravel().tolist()
        slope = (twice - still) / (2 * speed)
        if not slope > 0.0:
            break
        step = (most - top.value) / slope
        speed += step
        if abs(step) <= SPEED_CONVERGED * speed:
            break
    return speed


SPEED = "operation.speed"
CONTACT_SPEED = "contact_speed"
ONE_OPTIMUM = "the problem is one of linear programmes"
SLOWER = 0.9
"""A start's speed over the one that today's spring survives."""
SPARE = 1.1
"""A start's stiffness over the least that keeps contact at today's law and preload."""
SPEEDS = frozenset(("speed", CONTACT_SPEED))
"""The cam shaft's speed, and the one up to which contact holds: each is free where it is traded."""
LINEAR = SPEEDS | {"K1", "X0", "contact_max", "contact_min", "spring_force_max", "spring_stretch"}
"""Figures that are linear in K1, K1 X0 and the speed's square, or a quotient of such figures."""
LEAST_SPARE = 1e-3
"""Of rounding: what a force is taken to spare where it spares none, so that its inverse is a number."""
LEAST_STRETCH = 1e-3
"""Share of the largest elongation below which a spring is as good as slack."""
MEGA = 1e6


def scene_numbers(scene: Scene) -> dict[str, float]:
    """Every number of the scene by name, SI, the knots of a spline law included."""
    return (
        numbers(scene)
        | program_numbers(scene)
        | named_knots(map(float, scene.table(HealdFrame).law_coefficients or ()))
    )


def model(scene: Scene, law: CamLaw | None = None, speed_rows: tuple[str, ...] = ()) -> JobModel:
    """Frame with the effects of the scene; law: replaces that of the scene; speed_rows: of model.SPEED_ROWS."""
    free = any(scene.bounds[name].free for name in SEGMENTS if name in scene.bounds)
    several = moves(scene)
    dwells = (True, True) if free or several else has_dwells(scene.mechanism)
    known = frozenset((*scene_numbers(scene), *((CONTACT_SPEED,) if FASTEST in speed_rows else ())))
    law = next((move.law for move in several if move.law), law)
    return shedding.model(law or cam_law(scene), dwells, scene.active, words(scene), known, speed_rows, several)


def largest_contact_speed(sampler: Sampler, least: float) -> float:
    """Speed, rad/s, up to which the cam force is at least `least`, N, to the accuracy of a solve."""
    slack = ACCURACY * abs(sampler.static["spring_force_max"])
    return speed_reached(sampler.model, sampler.values, "lift", -least, slack)


def has_contact_speed(physics: JobModel) -> bool:
    """Whether the speed at which the roller leaves the cam is known, because a load grows with the speed."""
    unknown = drive.motor(physics.effects) or physics.known_in
    return not unknown and any(load.moved for load in physics.loads if isinstance(load, Load))


def contact_speed(scene: Scene, sampler: Sampler) -> float | None:
    """Speed, rad/s, up to which the roller stays on the cam; None if there is no such speed, or it is unknown."""
    if not has_contact_speed(sampler.model):
        return None
    speed = largest_contact_speed(sampler, scene.operation["N_min"])
    return speed if math.isfinite(speed) else None


def contact_speeds(machines: "Machines") -> Floats | None:
    """Speed, rad/s, up to which each roller stays on its cam, (machines,); infinite without such a speed.

    As in `speed_reached`, but the inverse of the first root over the cam angle is refined like a curve.
    """
    if not has_contact_speed(machines.model):
        return None
    nominal, least = machines.values["speed"], machines.values["N_min"]
    slack = ACCURACY * np.abs(machines.static["spring_force_max"])
    runs = [machines.at_numbers(speed=share * nominal) for share in (0.0, 1.0, -1.0)]
    reached = nominal / _inverse_shares(machines, runs, least - 0.0 * slack)
    in_contact = (reached < nominal) & (machines.peak(LIFT) <= slack - least)
    if not in_contact.any():
        return np.asarray(reached)
    return np.asarray(
        np.where(in_contact & (nominal <= nominal / _inverse_shares(machines, runs, least - slack)), nominal, reached)
    )


def _inverse_shares(machines: "Machines", runs: "Sequence[Machines]", least: Floats) -> Floats:
    """Speed of each machine over the one up to which its cam force stays at least `least`, N, (machines,).

    runs: the machines at rest, at their speed, and backward.
    """
    sampled = [run.sampled(LIFT) for run in runs]
    slack = ACCURACY * np.abs(machines.static["spring_force_max"])
    rounding = SPEED_AT_REST * np.abs(sampled[:2]).max(axis=(0, 1))

    def inverse(lifts: Sequence[Floats], which: Number) -> Floats:
        rest, ahead, back = (-lift for lift in lifts)
        square, linear, spare = (ahead + back) / 2 - rest, (ahead - back) / 2, rest - least[which]
        inside = linear**2 - 4 * square * np.maximum(spare, 0.0)
        falls = (inside >= 0.0) & ((np.abs(square) > rounding[which]) | (np.abs(linear) > rounding[which]))
        root = (np.sqrt(np.maximum(inside, 0.0)) - linear) / (2 * np.maximum(spare, LEAST_SPARE * rounding[which]))
        return np.where(falls & (root > 0.0), root, 0.0)

    def at(pieces: Pieces, u: Floats, which: Pieces) -> Floats:
        return inverse([run.at(LIFT, pieces, u, which) for run in runs], which)

    on = machines.model.counted(machines.like.cycle, LIFT)
    tops = machines.highest(inverse(sampled, np.arange(machines.count)), True, on, at)
    lost = (-sampled[0][on[machines.pieces]] - least).min(axis=0) < -np.maximum(rounding, slack)
    return np.where(lost, np.inf, tops.value)


def demand_moving(scene: Scene, instead: str) -> None:
    """Raise BadInput if contact does not depend on the speed; instead: remedy in the message."""
    if contact_speed(scene, sampled(model(scene), scene_numbers(scene))) is None:
        problem = "nothing limits the speed: the roller stays on the cam at any speed"
        keys = "effects.inertia.M, mechanism.travel, effects.warp_tension.shape"
        allowed = "a moving mass, a travel, and a warp tension that is known in the moves (linear, step)"
        raise refusal(problem, scene.origin, keys, allowed=allowed, remedy=f"Correct them, or {instead}.")


@final
class SpringScale:
    """Scales of spring and forces. force, N: largest sum of the loads without the spring; stiffness, N/m: for contact.

    sampler: the frame today; stretch: the largest elongation its spring may have, m; most: its largest stiffness.
    """

    def __init__(self, sampler: Sampler, stretch: float, most: float) -> None:
        given = sampler.given
        pieces, u = sampler.grid()
        at = sampler.model.instant(systems.numpy(), given, sampler.node(pieces, u))
        acting = {name: term for name, term in at.terms().items() if name != RETURN_SPRING.name}
        parts = [np.broadcast_to(np.asarray(term, dtype=float), u.shape) for term in acting.values()]
        self.travelled: Floats = np.asarray(at.pose.q, dtype=float)
        self.others: Floats = np.sum(parts, axis=0) if parts else np.zeros(u.shape)
        least = float(given.values.get("N_min", 0.0))
        self.force = float(np.sum(np.abs(parts), axis=0).max() if parts else 0.0) + least or 1.0
        self.stretch = stretch
        preload = stretch - float(given.values["travel"])
        self.needed = self.stiffness_for(least, preload) or (self.force / stretch if stretch > 0.0 else 1.0)
        self.stiffness = min(self.needed, most) or self.needed

    def stiffness_for(self, least: float, preload: float) -> float:
        """Stiffness, N/m, that keeps the cam force above `least`, N, at a preload, m, as sampled."""
        elongated = np.maximum(self.travelled + preload, min(LEAST_STRETCH * self.stretch, preload) or LEAST_STRETCH)
        return float(max(0.0, np.max((least - self.others) / elongated)))


@final
class SheddingTask(Task):
    """Task of the frame between cam and return spring; for the target law the knots of the cam are variables."""

    read_from = Frozen({name: (row,) for name, row in CYCLE.items()} | {CONTACT_SPEED: ()})
    remedy = f"Give the follower ({', '.join(FOLLOWER)}), or take the limit out."

    @lazy
    def law(self) -> Spline | None:
        """Free cam law of the target law; None for other targets."""
        table = self.scene.table(LawTarget)
        return Spline(table.intervals, table.symmetric) if self.target == "law" else None

    @lazy
    def known(self) -> dict[str, float]:
        """Every number of the scene, with the knots of its law, or the starting knots of a free law."""
        return scene_numbers(self.scene) | named_knots(cam_spline.cycloid_like(self.law.intervals) if self.law else ())

    @property
    def varies_speed(self) -> bool:
        """Whether the speed of the cam shaft is optimised."""
        return self.target == "speed" or "speed" in self.traded

    @property
    def varies_contact_speed(self) -> bool:
        """Whether the speed up to which contact holds is optimised."""
        return CONTACT_SPEED in self.traded

    @lazy
    def minima(self) -> Minima:
        """Minimum of the speed up to which contact holds, or of the shaft speed if that is optimised."""
        limit = self.scene.limits.get(CONTACT_SPEED)
        if limit is None or not limit.min:
            return {}
        return {
            "speed" if self.varies_speed and not self.varies_contact_speed else CONTACT_SPEED: [
                (CONTACT_SPEED, limit.min)
            ]
        }

    @lazy
    def speed_rows(self) -> tuple[str, ...]:
        """Rows of contact at rest and at the speed up to which it must hold. Raises BadInput without such a speed."""
        if self.minima:
            demand_moving(self.scene, f"take limits.{CONTACT_SPEED} out")
        if self.varies_contact_speed:
            demand_moving(self.scene, "trade another axis")
            return AT_REST, FASTEST
        if not self.minima:
            return ()
        # The row at the frame's own speed exists already; the same row twice would have no price.
        least = self.scene.limits[CONTACT_SPEED].min
        is_checked = self.varies_speed or ("speed" not in self.limited and self.known["speed"] == least)
        return (AT_REST,) if is_checked else (AT_REST, FASTEST)

    @lazy
    def model(self) -> JobModel:
        """The frame with its law, and with the rows of contact at other speeds."""
        return model(self.scene, self.law, self.speed_rows)

    @lazy
    def fastest(self) -> float:
        """Speed up to which today's spring keeps contact, rad/s; 0 if no speed is optimised."""
        if not (self.varies_speed or self.varies_contact_speed):
            return 0.0
        speed = largest_contact_speed(
            sampled(model(self.scene), scene_numbers(self.scene)), self.scene.operation["N_min"]
        )
        return speed if 0.0 < speed < math.inf else self.known["speed"]

    @lazy
    def fixed_names(self) -> list[str]:
        """Numbers that the target does not change: the travel, and the speed if an effect needs it."""
        needed = {key for effect in self.scene.active for key in effect.needs}
        travel = ["travel"] if "travel" in self.scene.mechanism else []
        return [*travel, *(["speed"] if SPEED in needed else [])]

    @lazy
    def checks(self) -> list[Check[Any]]:
        """The checks that are on."""
        return [effect for effect in self.scene.active if isinstance(effect, Check)]

    def decides(self, check: Check[Any]) -> bool:
        """Whether a check affects the program by a demand, an objective, a limit or an axis."""
        names = {*self.scene.limits, *self.traded}
        return bool(check.demands or check.least or check.axes or names & {*check.over_cycle, *check.rows})

    # Variables.

    @lazy
    def bounded(self) -> tuple[Variable, ...]:
        """Variables of the target, and fixed numbers as variables with equal bounds, so that they have a price."""
        scene, known = self.scene, self.known
        free = {scene.full(name) for name, bound in scene.bounds.items() if bound.free} - {"near_dwell"}
        ends = {name: pair for name, pair in self.limited.items() if name in free}
        ends["X0"] = self.limited["X0"]
        ends["K1"] = self.limited["K1"] if "K1" in scene.bounds else (0.0, math.inf)
        if self.target == "speed":
            given = {owned(check, key) for check in self.checks for key in check.table.model_fields}
            ends |= {name: (known[name],) * 2 for name in ends if name in given}
            # A check's own numbers may give K1.
            tied = any("K1" in c.reads and any(d.sign == 0 for d in c.demands) for c in self.checks)
            ends |= {"X0": (known["X0"],) * 2} | ({} if tied else {"K1": (known["K1"],) * 2})
        speed_names = [
            name
            for name, is_free in (("speed", self.varies_speed), (CONTACT_SPEED, self.varies_contact_speed))
            if is_free
        ]
        ends |= {name: self.limited.get(name, (1e-3 * self.fastest, math.inf)) for name in speed_names}
        for name in self.fixed_names:
            ends.setdefault(name, (known[name], known[name]))
        most, knots = self.most_acceleration, self.law.names if self.law else ()
        return (
            *(self.variable(name, pair) for name, pair in ends.items()),
            *(Variable(name, -math.inf, math.inf, most, (-most, most), "law") for name in knots),
        )

    def scale(self, name: str, ends: Ends) -> float:
        """Variable's scale, SI."""
        if name == "K1":
            return self.sizes.stiffness
        if name in SEGMENTS:
            return 1.0
        if name == CONTACT_SPEED or (name == "speed" and self.fastest):
            return self.fastest
        finite = [abs(end) for end in (*ends, self.known[name]) if math.isfinite(end)]
        return max(finite) or 1.0

    def room(self, name: str, ends: Ends) -> Ends:
        """Range of the random starts, SI."""
        if name == "K1":
            least = min(max(ends[0], 0.1 * self.sizes.needed), ends[1])
            return least, min(ends[1], 10.0 * self.sizes.needed)
        return ends[0], min(ends[1], 3.0 * self.known.get(name, self.fastest)) if math.isinf(ends[1]) else ends[1]

    # Limits.

    def limits(self) -> list[Limit]:
        """All limits in order."""
        limits = [*self.bounds(), *self.floors(), *self.contact(), *self.angles()]
        return [*limits, *self.figures(), *self.demands(), *self.law_limits()]

    def bounds(self) -> list[Limit]:
        """Bounds of variables as limits; a requirement can be relaxed on one side only."""
        limits: list[Limit] = []
        knots = set(self.law.names) if self.law else set()
        for v in (v for v in self.bounded if v.name not in knots):
            if v.lower == v.upper:
                sign = -1 if v.name in self.fixed_names else 1 if self.target == "speed" and v.name in VARIABLES else 0
                bounded = v.called in self.scene.bounds or sign
                limits += [BoundLimit(v.called, sign, v.name, v.lower, v.scale)] if bounded else []
                continue
            from_scene = v.name not in SPEEDS or v.name in self.limited
            limits += [
                replace(limit, relaxable=from_scene and limit.value > 0.0, hidden=not from_scene)
                for limit in bound_limits(v)
            ]
        return limits

    def contact(self) -> list[Limit]:
        """Limit of contact where the pull of the warp is known; also at the speed that is an axis."""
        least, size = self.known["N_min"], self.sizes.force
        row = FASTEST if self.varies_contact_speed and not self.varies_speed else LIFT
        limit = self.row_limit("N_min", -1, row, least, size, relaxable=least > 0.0)
        speed_limits = [replace(limit, row=other_row, hidden=True) for other_row in self.speed_rows if other_row != row]
        if least > 0.0:
            # A demanded force beyond contact may give way; contact itself may not.
            return [limit, replace(limit, name="contact", value=0.0, relaxable=False, hidden=True), *speed_limits]
        return [limit, *speed_limits]

    def angles(self) -> list[Limit]:
        """Limits on the near dwell, the remainder of the turn, if another angle is free."""
        if not any(self.scene.bounds[name].free for name in SEGMENTS if name in self.scene.bounds):
            return []
        low, high = self.limited.get("near_dwell", (0.0, math.inf))
        return [
            self.row_limit("near_dwell", sign, "near_dwell", value, 1.0, relaxable=value > 0.0)
            for sign, value in ends(low, high)
            if math.isfinite(value)
        ]

    def figure(self, name: str, low: float | None, high: float | None) -> list[Limit]:
        """Limits of the scene on a figure; the least of a quantity is the largest of its negative."""
        if name == CONTACT_SPEED or (name == "law_acceleration" and self.law):
            return []
        row, sides = (
            CYCLE.get(name, name),
            [(sign, value) for sign, value in ((-1, low), (1, high)) if value is not None],
        )
        return [self.row_limit(name, sign, row, value, self.limit_size(name, value)) for sign, value in sides]

    def limit_size(self, name: str, value: float) -> float:
        """Scale of a limit on a figure: the loads for a force, else the demanded value."""
        if name.startswith("contact"):
            return self.sizes.force
        row = CYCLE.get(name, name)
        return abs(value) or (abs(self.sampler.peak(row)) if self.model.has_quantity(row) else 0.0) or 1.0

    def margin_size(self, row: str) -> float:
        """Scale of a check's margins; 0 if the frame gives none."""
        known = {"stiffness": self.sizes.stiffness, "pressure": 100 * MEGA, "force": self.sizes.force}
        return known.get(self.scene.schema.margins.get(row, ""), 0.0)

    @property
    def most_acceleration(self) -> float:
        """Largest |s''| of a free law."""
        limit = self.scene.limits.get("law_acceleration")
        bound = limit.max if limit else None
        return float(self.scene.table(LawTarget).acceleration if bound is None else bound)

    def law_limits(self) -> list[Limit]:
        """Limits of a free cam law: it ends at 1 at rest, never decreases, and limits its peak s''."""
        law = self.law
        if law is None:
            return []
        most, rows = self.most_acceleration, law_rows(law)
        knots = range(1, law.intervals // 2 + 1 if law.mirrored else law.intervals)
        firm = [("law_end", 0, 1.0), *([] if law.mirrored else [("law_end_slope", 0, 0.0)])]
        firm += [(f"law_slope_{k}", -1, 0.0) for k in knots]
        limits = [
            self.row_limit(row, sign, row, value, 1.0, relaxable=False) for row, sign, value in firm if row in rows
        ]
        peaks = [f"law_{side}_{k}" for side in ("push", "pull") for k in knots]
        return [
            *(replace(limit, hidden=True) for limit in limits),
            *(self.row_limit("law_acceleration", 1, row, most, most) for row in peaks if row in rows),
        ]

    def goals(self) -> tuple[Goal, ...]:
        """Goal of contact, which may be impossible."""
        return goals(replace(n, name="contact_min") for n in self.contact() if n.name == "N_min" and n.row == LIFT)

    # Levels, starts and moves.

    def objectives(self) -> tuple[Objective, ...]:
        """Levels of the target in order; the objectives of checks follow the spring."""
        if self.target == "force":
            return (Peak("contact_max", "cam_force", self.sizes.force),)
        if self.target == "speed":
            return (Value("speed", "cam_period", 1 / self.fastest, power=-1),)
        return Value("K1", "K1", self.sizes.stiffness), *self.least()

    def starts(self) -> tuple[dict[str, float], ...]:
        """Today's spring moved inside its bounds, stiff enough for contact; for the force, a short one too."""
        starts, room = [], START_ROOM
        for preload in (1.0 - room, room) if self.target == "force" else (1.0 - room,):
            start = self.inside(self.known)
            for v in self.variables:
                if v.name in SPEEDS and self.fastest:
                    start[v.name] = min(max(SLOWER * self.fastest, v.lower), v.upper)
                if v.name == "X0":
                    start[v.name] = v.lower + preload * (v.upper - v.lower)
            stiff = SPARE * self.sizes.stiffness_for(self.known["N_min"], start["X0"])
            low, high = next((v.lower, v.upper) for v in self.variables if v.name == "K1")
            start["K1"] = min(max(stiff, low), high)
            starts.append(start)
        return tuple(starts)

    def moves(self) -> list[Move]:
        """Moves of variables that may have no influence: the preload, and those that checks name."""
        rooms = {v.name for v in self.variables if v.lower < v.upper}
        preload = [self.move("preload", "X0")] if "X0" in rooms else []
        return [*preload, *(move for move in self.axis_moves() if set(move.along) <= rooms)]

    def follow(self) -> Callable[[JobModel, Numbers], Numbers]:
        """Function for the speed up to which contact holds, if that is optimised."""
        reached = functools.partial(largest_contact_speed, least=self.known["N_min"])
        return functools.partial(solved_speed, CONTACT_SPEED, reached) if self.varies_contact_speed else nothing_follows

    def today(self) -> Numbers:
        """Knots of a free law nearest to the scene's own."""
        if self.law is None:
            return {}
        return named_knots(accelerations(cam_law(self.scene), scene_numbers(self.scene), self.law.intervals))

    def uniqueness_reason(self) -> str:
        """Why every local optimum is the best there is; "" where that is not so.

        Every force is linear in K1 and K1 X0, and in the speed's square, but power is not [Qiu21, eq 6]. With a free
        law any stiffer spring keeps contact too, and the laws that do for one stiffness are convex.
        """
        free = {v.name for v in self.variables if v.lower < v.upper} - set(self.law.names if self.law else ())
        spring = free <= {"K1", "X0"} and (not self.law or set(self.scene.limits) <= {"law_acceleration"})
        traded = self.traded and set(self.traded) <= LINEAR and free <= {"K1", "X0", *SPEEDS}
        unique = spring or bool(traded) or free == {"speed"}
        linear = not any(map(self.decides, self.checks)) and unique and (spring or drive.POWER not in self.scene.limits)
        return ONE_OPTIMUM if linear else ""

    # Scales.

    @lazy
    def sizes(self) -> SpringScale:
        """Scales of the spring and of forces, from today's frame."""
        most = self.limited["K1"][1] if "K1" in self.scene.bounds else math.inf
        return SpringScale(self.sampler, self.limited["X0"][1] + self.known["travel"], most)

    def figure_size(self, name: str) -> float:
        """Scale of a figure."""
        return self.limit_size(name, 0.0) if name in CYCLE else size_read(self.sampler, name, self.scene.schema.figures)
