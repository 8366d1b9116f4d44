"""From a shedding scene and a target to the program: variables, limits, objectives and starts."""

import functools
import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

from loomopt.base.refusals import refusal
from loomopt.jobs import base
from loomopt.jobs.shedding import model as shedding
from loomopt.jobs.shedding.design import CONTACT_SPEED, CYCLE, Sizes, contact, survived
from loomopt.jobs.shedding.model import AT_REST, FASTEST, FOLLOWER, LIFT, law_rows
from loomopt.jobs.shedding.scene import SEGMENTS, VARIABLES, Frame, LawTarget, chosen, dwelt
from loomopt.model import drive
from loomopt.model import numbers as scene_numbers
from loomopt.model.limits import BoundLimit, CycleLimit, DesignLimit, Limit
from loomopt.model.model import JobModel
from loomopt.model.moves import AxisMove, Move, Wish
from loomopt.model.numbers import axis_moves, bound_limits, demand_figures, demanded, ends, floored, inside
from loomopt.model.objectives import Objective, Peak, Value
from loomopt.model.program import Program, Variable, goals, nothing_follows
from loomopt.model.sampling import sampled
from loomopt.model.speeds import followed
from loomopt.physics.effects.kinds import Check, owned
from loomopt.physics.mechanisms import cam_spline
from loomopt.physics.mechanisms.cam_motion import CamLaw, Spline, accelerations, named_knots
from loomopt.physics.tolerances import START_ROOM
from loomopt.scenes.scene import Scene

SPEED = "operation.speed"
ONE_OPTIMUM = "the problem is one of linear programmes"
SLOWER = 0.9
"""A start's speed over the one that today's spring survives."""
SPARE = 1.1
"""A start's stiffness over the least that keeps contact at today's law and preload."""
SPEEDS = frozenset(("speed", CONTACT_SPEED))
"""The cam shaft's speed, and the one up to which contact holds: each is free where it is traded."""
LINEAR = SPEEDS | {"K1", "X0", "contact_max", "contact_min", "spring_force_max", "spring_stretch"}
"""What is linear, or a quotient of what is, in K1, K1 X0 and the speed's square."""


def numbers(scene: Scene) -> dict[str, float]:
    """Return every number of the scene by name, SI, the knots of a spline law included."""
    knots = scene.table(Frame).law_coefficients or ()
    return scene_numbers.numbers(scene) | named_knots(map(float, knots))


def model(scene: Scene, law: CamLaw | None = None, raced: tuple[str, ...] = ()) -> JobModel:
    """Return the frame with the effects the scene calls for; law: another than the scene's; raced: of model.RACED."""
    free = any(scene.bounds[name].free for name in SEGMENTS if name in scene.bounds)
    dwells = (True, True) if free else dwelt(scene.mechanism)
    words, more = scene_numbers.words(scene), (CONTACT_SPEED,) if FASTEST in raced else ()
    return shedding.model(law or chosen(scene), dwells, scene.active, words, frozenset((*numbers(scene), *more)), raced)


def demand(scene: Scene, target: str) -> None:
    """Raise BadInput where a target speaks of what the scene does not have."""
    base.demand(scene, target)
    if target == "speed":
        _demand_moving(scene, "choose another target")
    own = scene.table(LawTarget)
    fewest, most = cam_spline.FEWEST, cam_spline.MOST
    if target == "law" and (not fewest <= own.intervals <= most or (own.symmetric and own.intervals % 2)):
        problem, key = "a law cannot have so many intervals", "targets.law.intervals"
        allowed = f"{fewest} to {most}, an even number for a symmetric law"
        raise refusal(problem, scene.origin, key, own.intervals, allowed, "Write intervals = 16.")


def _demand_moving(scene: Scene, instead: str) -> None:
    """Raise BadInput where contact holds, or is lost, whatever the speed."""
    if contact(scene, sampled(model(scene), numbers(scene)))[CONTACT_SPEED] is None:
        problem = "nothing limits the speed: as the scene stands, the roller stays on the cam at any"
        keys = "effects.inertia.M, mechanism.travel, effects.warp_tension.shape"
        allowed = "a moving mass, a travel, and a warp tension that is known in the moves (linear, step)"
        raise refusal(problem, scene.origin, keys, allowed=allowed, remedy=f"Correct them, or {instead}.")


def program(scene: Scene, target: str) -> Program:
    """Return the program of a target: all that a solve needs to know of the scene."""
    return _Task(scene, target).program()


def held(scene: Scene, target: str, traded: Collection[str]) -> tuple[Program, Callable[[str], float]]:
    """Return what a target ("" for none) demands of all that is traded; natural sizes of axes."""
    task = _Task(scene, target, traded)
    found = task.program()
    return replace(found, objectives=()), functools.partial(_axis_size, task, found)


def _axis_size(task: "_Task", program: Program, name: str) -> float:
    """Return the natural size, SI, of what of an axis is sought the least of."""
    if name in CYCLE:
        return task.sizes.figure(name, CYCLE[name], 0.0)
    return scene_numbers.size(program, task.sampler, name)


class _Task:
    """One scene and target on the way to a program."""

    def __init__(self, scene: Scene, target: str, traded: Collection[str] = ()) -> None:
        self.scene, self.target, self.traded, self.known = scene, target, frozenset(traded), numbers(scene)
        self.law: Spline | None = None
        if target == "law":
            own = scene.table(LawTarget)
            self.law = Spline(own.intervals, own.symmetric)
            start = cam_spline.cycloid_like(own.intervals)
            self.known |= named_knots(start)
        self.limited = scene_numbers.bounds(scene, self.known)
        self.sped, self.lasting = target == "speed" or "speed" in self.traded, CONTACT_SPEED in self.traded
        self.survives = [(n, each.min) for n, each in scene.limits.items() if n == CONTACT_SPEED and each.min]
        self.raced: tuple[str, ...] = (AT_REST, FASTEST) if self.survives else ()
        if self.survives:
            _demand_moving(scene, f"take limits.{CONTACT_SPEED} out")
            # At its own speed the frame is judged anyway: the same row twice would have no price.
            if self.sped or ("speed" not in self.limited and self.known["speed"] == self.survives[0][1]):
                self.raced = (AT_REST,)
        if self.lasting:
            _demand_moving(scene, "trade another axis")
            self.raced = (AT_REST, FASTEST)
        self.physics = model(scene, self.law, self.raced)
        self.sampler = sampled(self.physics, self.known)
        most = self.limited["K1"][1] if "K1" in scene.bounds else math.inf
        self.sizes = Sizes(self.sampler, self.limited["X0"][1] + self.known["travel"], most)
        needed = {key for effect in scene.active for key in effect.needs}
        self.kept = ["travel", *(["speed"] if SPEED in needed else [])]
        self.checks = [effect for effect in scene.active if isinstance(effect, Check)]
        self.tied = any("K1" in c.reads and any(d.sign == 0 for d in c.demands) for c in self.checks)
        """Whether a check's own numbers give K1."""
        self.fastest = 0.0
        if self.sped or self.lasting:
            fastest = survived(sampled(model(scene), numbers(scene)), scene.operation["N_min"])
            self.fastest = fastest if 0.0 < fastest < math.inf else self.known["speed"]

    def program(self) -> Program:
        bounded = self._variables()
        asked = {"speed" if self.sped and not self.lasting else CONTACT_SPEED: self.survives} if self.survives else {}
        variables, more = floored(bounded, asked)
        taken = {variable.name for variable in variables}
        parameters = {name: value for name, value in self.known.items() if name not in taken}
        limits = [*self._bounds(bounded), *more, *self._contact(), *self._angles(), *self._figures()]
        limits += self._checks() + (self._law(self.law) if self.law else [])
        starts, moves = self._starts(variables), self._moves(variables)
        # Every force is linear in K1 and K1 X0, and in the speed's square, but power is not [Qiu21, eq 6]. With a free
        # law any stiffer spring keeps contact too, and the laws that do for one stiffness are convex.
        free = {v.name for v in variables if v.lower < v.upper} - set(self.law.names if self.law else ())
        spring = free <= {"K1", "X0"} and (not self.law or set(self.scene.limits) <= {"law_acceleration"})
        traded = self.traded and self.traded <= LINEAR and free <= {"K1", "X0", *SPEEDS}
        told = spring or bool(traded) or free == {"speed"}
        linear = not self.checks and told and (spring or drive.POWER not in self.scene.limits)
        task = self.physics, tuple(variables), parameters, tuple(limits), self._objectives(), starts, moves
        own = accelerations(chosen(self.scene), numbers(self.scene), self.law.intervals) if self.law else ()
        contact = goals(replace(n, name="contact_min") for n in limits if n.name == "N_min" and n.row == LIFT)
        reached = functools.partial(survived, least=self.known["N_min"])
        follow = functools.partial(followed, CONTACT_SPEED, reached) if self.lasting else nothing_follows
        return Program(
            *task, today=named_knots(own), single=ONE_OPTIMUM if linear else "", goals=contact, follow=follow
        )

    def _variables(self) -> list[Variable]:
        """Return what the target may choose, and what it keeps as variables without room, which gives it a price."""
        scene, known = self.scene, self.known
        free = {scene.full(name) for name, bound in scene.bounds.items() if bound.free} - {"near_dwell"}
        ends = {name: self.limited[name] for name in self.limited if name in free}
        ends["X0"] = self.limited["X0"]
        ends["K1"] = self.limited["K1"] if "K1" in scene.bounds else (0.0, math.inf)
        if self.target == "speed":
            given = {owned(check, key) for check in self.checks for key in check.own.model_fields}
            ends |= {name: (known[name],) * 2 for name in ends if name in given}
            ends |= {"X0": (known["X0"],) * 2} | ({} if self.tied else {"K1": (known["K1"],) * 2})
        raced = [name for name, free in (("speed", self.sped), (CONTACT_SPEED, self.lasting)) if free]
        ends |= {name: self.limited.get(name, (1e-3 * self.fastest, math.inf)) for name in raced}
        for name in self.kept:
            ends.setdefault(name, (known[name], known[name]))
        labels = scene_numbers.labels(scene)
        found = [
            Variable(n, *end, self._size(n, end), self._range(n, end), labels.get(n, "")) for n, end in ends.items()
        ]
        if self.law:
            most = self.most_acceleration
            found += [Variable(name, -math.inf, math.inf, most, (-most, most), "law") for name in self.law.names]
        return found

    def _size(self, name: str, ends: tuple[float, float]) -> float:
        """Return a variable's natural size, SI."""
        if name == "K1":
            return self.sizes.stiffness
        if name in SEGMENTS:
            return 1.0
        if name == CONTACT_SPEED or (name == "speed" and self.fastest):
            return self.fastest
        finite = [abs(end) for end in (*ends, self.known[name]) if math.isfinite(end)]
        return max(finite) or 1.0

    def _range(self, name: str, ends: tuple[float, float]) -> tuple[float, float]:
        """Return where random starts lie, SI."""
        if name == "K1":
            least = min(max(ends[0], 0.1 * self.sizes.needed), ends[1])
            return least, min(ends[1], 10.0 * self.sizes.needed)
        return ends[0], min(ends[1], 3.0 * self.known.get(name, self.fastest)) if math.isinf(ends[1]) else ends[1]

    def _objectives(self) -> tuple[Objective, ...]:
        """Return the target's levels in order; what checks would have least comes after the spring."""
        if self.target == "force":
            return (Peak("contact_max", "cam_force", self.sizes.force),)
        if self.target == "speed":
            return (Value("speed", "cam_period", 1 / self.fastest, power=-1),)
        return Value("K1", "K1", self.sizes.stiffness), *scene_numbers.least(self.sampler)

    def _starts(self, variables: Sequence[Variable]) -> tuple[dict[str, float], ...]:
        """Return today's spring moved inside its bounds, stiff enough for contact; for the force, a short one too."""
        found, room = [], START_ROOM
        for preload in (1.0 - room, room) if self.target == "force" else (1.0 - room,):
            start = inside(variables, self.known)
            for v in variables:
                if v.name in SPEEDS and self.fastest:
                    start[v.name] = min(max(SLOWER * self.fastest, v.lower), v.upper)
                if v.name == "X0":
                    start[v.name] = v.lower + preload * (v.upper - v.lower)
            stiff = SPARE * self.sizes.stiffness_for(self.known["N_min"], start["X0"])
            low, high = next((v.lower, v.upper) for v in variables if v.name == "K1")
            start["K1"] = min(max(stiff, low), high)
            found.append(start)
        return tuple(found)

    def _moves(self, variables: Sequence[Variable]) -> tuple[Move, ...]:
        """Return what may leave everything unchanged: a preload that is not needed, and what checks name."""
        preload = next(v for v in variables if v.name == "X0")
        found = axis_moves(self.scene, self.known, self.limited)
        rooms = {v.name for v in variables if v.lower < v.upper}
        found = [move for move in found if set(move.along) <= rooms]
        if preload.lower == preload.upper:
            return tuple(found)
        today, bounds = {"X0": self.known["X0"]}, {"X0": self.limited["X0"]}
        return (AxisMove("preload", ("X0",), (Wish("today", scene_numbers.LEAST_CHANGE),), today, bounds), *found)

    def _bounds(self, variables: Sequence[Variable]) -> list[Limit]:
        """Return the bounds of variables as limits; a requirement gives way on one side only."""
        found: list[Limit] = []
        knots = set(self.law.names) if self.law else set()
        for v in (v for v in variables if v.name not in knots):
            if v.lower == v.upper:
                sign = -1 if v.name in self.kept else 1 if self.target == "speed" and v.name in VARIABLES else 0
                bounded = v.called in self.scene.bounds or sign
                found += [BoundLimit(v.called, sign, v.name, v.lower, v.scale)] if bounded else []
                continue
            own = v.name not in SPEEDS or v.name in self.limited
            found += [replace(each, relaxable=own and each.value > 0.0, hidden=not own) for each in bound_limits(v)]
        return found

    def _contact(self) -> list[Limit]:
        """Return the limit that is the job: contact where the warp's pull is known, up to a speed that is traded."""
        least, size = self.known["N_min"], self.sizes.force
        row = FASTEST if self.lasting and not self.sped else LIFT
        found = CycleLimit("N_min", -1, row, least, size, relaxable=least > 0.0)
        raced = [replace(found, row=other, hidden=True) for other in self.raced if other != row]
        if least > 0.0:
            # What is asked beyond contact may give way; contact itself may not.
            return [found, replace(found, name="contact", value=0.0, relaxable=False, hidden=True), *raced]
        return [found, *raced]

    def _angles(self) -> list[Limit]:
        """Return what the near dwell, which takes the rest of the turn, must keep where another angle is free."""
        if not any(self.scene.bounds[name].free for name in SEGMENTS if name in self.scene.bounds):
            return []
        low, high = self.limited.get("near_dwell", (0.0, math.inf))
        return [
            DesignLimit("near_dwell", sign, "near_dwell", value, 1.0, relaxable=value > 0.0)
            for sign, value in ends(low, high)
            if math.isfinite(value)
        ]

    def _figures(self) -> list[Limit]:
        """Return the scene's limits on figures."""
        remedy = f"Give the follower ({', '.join(FOLLOWER)}), or take the limit out."
        read = {name: (row,) for name, row in CYCLE.items()} | {CONTACT_SPEED: ()}
        demand_figures(self.scene, self.physics, read, remedy)
        found: list[Limit] = []
        for name, limit in self.scene.limits.items():
            if name == CONTACT_SPEED or (name == "law_acceleration" and self.law):
                continue
            row = CYCLE.get(name, name)
            cycle = name in CYCLE or self.physics.has_quantity(row)
            for sign, value in ((-1, limit.min), (1, limit.max)):
                if value is not None and cycle:
                    # The least of a quantity is the largest of its opposite, which the row then is.
                    found.append(CycleLimit(name, sign, row, value, self.sizes.figure(name, row, value)))
                elif value is not None:
                    found.append(DesignLimit(name, sign, name, value, abs(value) or 1.0))
        return found

    def _checks(self) -> list[Limit]:
        """Return what the effects that are checks demand."""
        margins = self.scene.schema.margins
        sizes = {d.row: self.sizes.margin(margins[d.row]) for c in self.checks for d in c.demands if d.row in margins}
        return demanded(self.scene, self.checks, self.known, sizes)

    @property
    def most_acceleration(self) -> float:
        """Return the largest |s''| a free law may have."""
        limit = self.scene.limits.get("law_acceleration")
        own = limit.max if limit else None
        return float(self.scene.table(LawTarget).acceleration if own is None else own)

    def _law(self, law: Spline) -> list[Limit]:
        """Return what makes a free law a cam law: it reaches 1 at rest, never falls, and keeps its peak s''."""
        most, firm = self.most_acceleration, {"relaxable": False, "hidden": True}
        rows = law_rows(law)
        last = [("law_end", 1.0), *([] if law.mirrored else [("law_end_slope", 0.0)])]
        found: list[Limit] = [DesignLimit(row, 0, row, value, 1.0, **firm) for row, value in last]
        knots = range(1, law.intervals // 2 + 1 if law.mirrored else law.intervals)
        slopes = [f"law_slope_{k}" for k in knots]
        found += [DesignLimit(row, -1, row, 0.0, 1.0, **firm) for row in slopes if row in rows]
        peaks = [f"law_{side}_{k}" for side in ("push", "pull") for k in knots]
        return found + [DesignLimit("law_acceleration", 1, row, most, most) for row in peaks if row in rows]
