"""The shedding job: the least return spring that keeps the roller on the cam [Qiu21].

The limit of target `law` over all numbers of intervals is given too, where it has a closed form
(mechanisms/cam_limit.py). The closed form holds for loads whose sum is a steady force, a force in proportion to the
shed on either side of its middle, and inertia.
"""

import math
from collections.abc import Callable, Container, Mapping
from typing import TYPE_CHECKING, Any, final

from loomopt.base.errors import BadInput, refusal
from loomopt.base.quantities import NARROWEST
from loomopt.jobs import base
from loomopt.jobs.base import EVERY, Figures, InBox, Job, LawFamily, Studied
from loomopt.jobs.shedding.model import (
    CYCLE,
    DWELLS,
    RETURN,
    RETURN_SPRING,
    RISE,
    SEGMENT,
    FrameMotion,
    contact,
    frame,
    moving,
)
from loomopt.jobs.shedding.program import (
    CONTACT_SPEED,
    SheddingTask,
    contact_speed,
    contact_speeds,
    demand_moving,
    model,
)
from loomopt.jobs.shedding.scene import (
    SCHEMA,
    SEGMENTS,
    VARIABLES,
    HealdFrame,
    LawTarget,
    check_known,
    check_law,
    check_motion,
    follower_fault,
    has_dwells,
    read_law,
    refuse_unclear,
)
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT, Number
from loomopt.model.curves import Columns
from loomopt.model.model import Formula, JobModel
from loomopt.model.numbers import curves
from loomopt.model.program import Numbers, Program, Variable
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics import balance
from loomopt.physics.mechanisms import cam_limit, cam_spline
from loomopt.physics.mechanisms.cam_laws import LawDerivatives
from loomopt.physics.mechanisms.cam_motion import Spline, knots, named_knots
from loomopt.scenes.csv_tables import Record
from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    from loomopt.model.machines import Machines

SAME_TURN = 1e-9
"""rad; the segments' angles may miss a whole turn by this much: decimals."""
CLOSE = 1e-9
"""Share of the largest cam force below which contact just holds."""
GAVE_WAY = 1e-7
"""A number that a target keeps has given way when it is off by this, in units of its scale."""
SAME = 1e-12
"""Share of the largest |N| by which two least values are one: rise and return mirror each other."""
MOVES = " The moves, where not every force is known, are not judged."
LIMIT = "law_acceleration"
PROBES = ((RISE, 0.25, 0.125, 0.0, 0.0), (RISE, 0.75, 0.5, 1.5, -2.0), (RETURN, 0.125, 0.375, 2.0, 3.0))
"""Segment, s, u, s' and s'' at which the sum of the loads is compared with the closed form."""
ALIKE = 1e-30
"""Share of the forces by which it may differ: rounding in these digits."""
Force = Callable[[int, float, float, float, float], Number]


@final
class Shedding(Job):
    """A heald frame between its cam and its return spring."""

    name = "shedding"
    own_schema = SCHEMA
    task = SheddingTask

    def check(self, scene: Scene) -> None:
        """Raise BadInput if the cam does not close, its law is invalid, or the follower cannot work."""
        check_motion(scene)
        several = scene.table(HealdFrame).segments
        angles = [piece.angle for piece in several] if several else [scene.mechanism[name] for name in SEGMENTS]
        total = math.fsum(angles)
        for name in () if several else ("rise", "return"):
            if not scene.mechanism[name] >= NARROWEST:
                least = f"{scene.show(NARROWEST, 'angle')} and more"
                raise _refused(scene, f"mechanism.{name}", f"the {name} takes no cam angle", least)
        if abs(total - 2 * math.pi) > SAME_TURN:
            names = [f"segments.{k + 1}.angle" for k in range(len(several))] if several else SEGMENTS
            given = " + ".join(str(scene.given(f"mechanism.{name}")) for name in names)
            keys = "segments" if several else ", ".join(SEGMENTS)
            problem = f"the cam's segments add to {scene.show(total, 'angle', 9)}: {given}"
            turn = f"{scene.show(2 * math.pi, 'angle', 9)} together"
            raise _refused(scene, f"mechanism.{keys}", problem, turn, "Correct one of them.")
        if not several and not any(scene.bounds[name].free for name in SEGMENTS if name in scene.bounds):
            dwells = zip(DWELLS, has_dwells(scene.mechanism), strict=True)
            check_known(scene, {(SEGMENT, float(segment)) for segment, on in dwells if on}, "dwells")
        check_law(scene)
        reason = follower_fault(scene.mechanism, scene.show)
        if reason:
            raise _refused(scene, "mechanism", f"the cam's follower cannot work: {reason}", "")

    def model(self, scene: Scene, design: Numbers | None = None) -> JobModel:
        """Frame with the effects the scene calls for, and a design's own law where it has one."""
        knot_values = knots(design or {})
        return model(scene, Spline(len(knot_values) - 1) if knot_values else None)

    def demand(self, scene: Scene, target: str) -> None:
        """Raise BadInput if a target needs a number that the scene lacks, or today's frame cannot be followed."""
        base.demand(scene, target)
        if target == "law" and scene.table(HealdFrame).segments:
            problem, remedy = "target law chooses one law for rise and return", "Choose another target"
            raise refusal(problem, scene.origin, "mechanism.segments", remedy=remedy)
        if target == "speed":
            demand_moving(scene, "choose another target")
        if target != "law":
            refuse_unclear(scene, self._reads_accelerations(scene))
        table = scene.table(LawTarget)
        fewest, most = cam_spline.FEWEST, cam_spline.MOST
        if target == "law" and (not fewest <= table.intervals <= most or (table.symmetric and table.intervals % 2)):
            problem, key = "the number of intervals is invalid", "targets.law.intervals"
            allowed = f"{fewest} to {most}, an even number for a symmetric law"
            raise refusal(problem, scene.origin, key, table.intervals, allowed, "Write intervals = 16.")
        self.parted(scene, self.sampler(scene, self.today(scene)))

    def _reads_accelerations(self, scene: Scene) -> bool:
        """Whether the cam force, or a limit, depends on s''."""
        if {"law_acceleration", "curvature_min", "curvature_max"} & set(scene.limits):
            return True
        model, numbers = self.model(scene), self.numbers(scene)
        given, loads = model.given(FLOAT, numbers), [load for load in model.loads if load is not RETURN_SPRING]

        def force(bend: float) -> Number:
            law = LawDerivatives(0.3, 1.0, bend, 0.0)
            pose = FrameMotion(FLOAT, 0.0, numbers["travel"], RISE, 0.3, 1.0, law, -1, numbers.get("speed", 0.0))
            return balance.output_force(FLOAT, loads, pose, given, {load.name: 0.0 for load in loads})

        return bool(force(1.0) != force(0.0))

    def tables(self, scene: Scene, target: str) -> tuple[Record, ...]:
        """Remarks on the tables that are read, the cam law's first."""
        if scene.table(HealdFrame).law != "table" or target == "law":
            return super().tables(scene, target)
        return (read_law(scene).record(scene), *super().tables(scene, target))

    def design(self, program: Program, x: Numbers) -> dict[str, float]:
        """Design, SI, of NLP variables: the spring, the other free numbers, and the knots of a free law."""
        values, law = {**program.parameters, **x}, frame(program.model).law
        knots = set(law.names) if isinstance(law, Spline) else set()
        fixed = {limit.row for limit in program.bound_limits.values() if limit.sign == 0}
        chosen = [v.name for v in program.variables if v.name in fixed or _chosen(v, values[v.name])]
        free = [name for name in chosen if name not in {*VARIABLES, *knots, CONTACT_SPEED}]
        numbers = {name: values[name] for name in (*VARIABLES, *free)}
        if set(SEGMENTS) & set(numbers):
            numbers["near_dwell"] = 2 * math.pi - sum(values[name] for name in SEGMENTS[:3])
        if isinstance(law, Spline) and knots & {v.name for v in program.variables}:
            numbers |= named_knots(map(float, law.accelerations(values)))
        return numbers

    def adopted(self, scene: Scene, design: Mapping[str, Any], target: str) -> tuple[Scene, str]:
        """Scene with a design's own cam law, and the target whose limits it keeps.

        Of target law the law is then given: what remains is contact, and the bound on its acceleration.
        """
        coefficients = knots(design)
        changes: dict[str, object] = {}
        if coefficients:
            changes = {"mechanism.law": "spline", "mechanism.law_coefficients": list(map(float, coefficients))}
        if target == "law" and "law_acceleration" not in scene.limits:
            changes["limits.law_acceleration.max"] = scene.table(LawTarget).acceleration
        changed = scene.update(changes) if changes else scene
        return changed, "stiffness" if target == "law" else target

    def figures(self, scene: Scene, design: Numbers) -> Figures:
        """Every figure of the job for a design, SI; None for one whose numbers the scene does not have."""
        figures, parted = super().figures(scene, design), self.parted(scene, self.sampler(scene, design))
        return {**figures, **parted.figures} if parted else figures

    def figures_of(
        self, scene: Scene, sampled: "Sampler | Machines", names: Container[str] = EVERY
    ) -> dict[str, Number]:
        """Every figure of a machine, or of many, but those of a frame that parts; None without its numbers."""
        figures = base.static_figures(scene, sampled, names)
        peaks = {name: of for name, of in self.peaks(sampled.model).items() if name in names}
        sampled.search(("lift", *peaks.values()))
        for name, quantity in peaks.items():
            figures[name] = sampled.peak(quantity) * (-1 if quantity in ("concavity", "lift") else 1)
        figures |= {name: sampled.pushed(name) for name in peaks if name in sampled.model.pushes}
        if isinstance(sampled, Sampler):
            figures["contact_min"], figures["contact_angle"] = _least(sampled.extremes("lift"), sampled)
            return figures | ({CONTACT_SPEED: contact_speed(scene, sampled)} if CONTACT_SPEED in names else {})
        lowest = sampled.tops("lift")
        figures |= {"contact_min": -lowest.value, "contact_angle": sampled.angles(lowest) % (2 * math.pi)}
        return figures | ({CONTACT_SPEED: contact_speeds(sampled)} if CONTACT_SPEED in names else {})

    def over_cycle(self, model: JobModel) -> dict[str, str]:
        """Figures that are read over the cycle, with their quantities."""
        return {**super().over_cycle(model), CONTACT_SPEED: ""}

    def peaks(self, model: JobModel) -> dict[str, str]:
        """Figures that are extremes over the cycle, with their quantities."""
        peaks = {name: quantity for name, quantity in CYCLE.items() if model.has_quantity(quantity)}
        check_names = [name for check in model.checks for name in check.over_cycle if model.has_quantity(name)]
        return peaks | {name: name for name in check_names}

    def in_boxes(self, scene: Scene, model: JobModel) -> dict[str, InBox]:
        """Reading of each figure over a box of numbers: the least cam force and curvature are opposites."""
        opposite = {name: of for name, of in self.peaks(model).items() if of in ("concavity", "lift")}
        return super().in_boxes(scene, model) | {n: InBox(quantity=of, sign=-1.0) for n, of in opposite.items()}

    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """Sentence on an optimum of the target and on today's spring; figures in SI."""
        dwells = contact_dwells(self.model(scene))
        clause = f"keeps the roller on the cam {f'in {dwells}' if dwells else 'all round'}"
        if target == "speed":
            return f"Today's spring {clause} up to {scene.show(figures['speed'] or 0.0, 'angular speed', 9)}."
        stiffness = scene.show(figures["K1"] or 0.0, "stiffness", 9)
        text = f"The least return spring that {clause} has {stiffness}."
        if target == "law":
            text = f"With the cam law chosen too, the least return spring that {clause} has {stiffness}."
        if target == "force":
            force = scene.show(figures["contact_max"] or 0.0, "force")
            peak = f"peak cam force{f' in {dwells}' if dwells else ''} is {force}"
            text = f"The least {peak}, with a return spring of {stiffness}.{MOVES if dwells else ''}"
        return f"{text} {_today(scene, self.sampler(scene, self.today(scene)))}".strip()

    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """X with three derivatives, s'', the terms, N, the cam torque, pressure angle and curvatures."""
        after: dict[str, Formula] = {}
        if sampler.model.has_quantity("curvature"):
            after = {
                "pressure_angle [rad]": lambda at: contact(at).pressure_angle,
                "curvature [1/m]": lambda at: contact(at).curvature,
                "profile_curvature [1/m]": lambda at: contact(at).profile_curvature,
            }
        return Columns(
            {
                "X [m]": lambda at: at.pose.q,
                "X_1 [m/rad]": lambda at: at.pose.q1,
                "X_2 [m/rad^2]": lambda at: at.pose.q2,
                "X_3 [m/rad^3]": lambda at: at.pose.q3,
                "s_2 [1]": lambda at: moving(at, at.pose.law.s2),
            },
            "N",
            ("N [N]", lambda at: at.force),
            ("cam_torque [N*m]", lambda at: at.crank_torque),
            after,
        )

    def studied(self, scene: Scene) -> Studied:
        """Quantities that studies show: least springs, the cam force, and the limit of a free law."""
        # Points over the whole turn would read a force that is known in the dwells only.
        peaks = {} if self.model(scene).known_in else {"contact_max": ("cam_force", False)}
        family = LawFamily("spline intervals", "law", "targets.law.intervals", self.law_limit)
        return Studied(("stiffness", "law"), peaks, motion="X_2", family=family)

    def law_limit(self, scene: Scene, x: Mapping[str, Number]) -> Number | None:
        """Limit of K1, N/m, for target law, in 40 digits; None where the closed form does not hold.

        x: with a stiffness, N/m, for which some law keeps contact, such as a spline law's least one. The frame must
        rise and fall alike, and nothing but N_min and the law's acceleration be limited.
        """
        known, law, model = scene.mechanism, scene.table(LawTarget), self.model(scene)
        free = any(scene.bounds[name].free for name in SEGMENTS if name in scene.bounds)
        alike = known["rise"] == known["return"] and not free and not law.symmetric
        # A curve over the cam angle is not a function of position and motion.
        if curves(scene) or scene.table(HealdFrame).segments:
            return None
        if not alike or set(scene.limits) - {LIMIT} or model.known_in or model.demands:
            return None
        frame, start = (
            _frame(scene, model, self.numbers(scene)),
            systems.mpmath(cam_limit.DIGITS).number(float(x["K1"])),
        )
        return None if frame is None else cam_limit.least_stiffness(frame, start)


def _refused(scene: Scene, key: str, problem: str, allowed: str, remedy: str = "Correct it.") -> BadInput:
    return BadInput(problem, file=scene.origin, key=key, allowed=allowed, remedy=remedy)


def _chosen(variable: Variable, value: float) -> bool:
    """Whether a variable is a choice: it has room, or it had to give way."""
    return variable.lower < variable.upper or abs(value - variable.lower) > GAVE_WAY * variable.scale


def _least(extremes: list[Extreme], sampled: Sampler) -> tuple[float, float]:
    """Least cam force, N, and the first cam angle where it is reached, rad."""
    highest = max(extreme.height for extreme in extremes)
    size = max(abs(extreme.value) for extreme in extremes)
    alike = [extreme for extreme in extremes if extreme.height >= highest - SAME * size]
    return -highest, min(sampled.angle(extreme) % (2 * math.pi) for extreme in alike)


def contact_dwells(model: JobModel) -> str:
    """Dwells, in words, in which the cam force is checked; "" if it is known for the whole turn."""
    names = [SEGMENTS[k] for k in frame(model).segments if (SEGMENT, float(k)) in model.known_in]
    known = [name.replace("_", " ") for name in names]
    return "both dwells" if len(known) > 1 else f"the {known[0]}" if known else ""


def _today(scene: Scene, sampler: Sampler) -> str:
    """Sentence on today's spring: whether it holds the roller on the cam, or where and how far the roller lifts off."""
    sampler.search(("lift", "cam_force"))
    (least, angle), most = _least(sampler.extremes("lift"), sampler), sampler.peak("cam_force")
    wanted, force = scene.operation["N_min"], scene.show(least, "force")
    spring = f"Today's spring ({scene.show(scene.mechanism['K1'], 'stiffness', 9)})"
    if least >= wanted - CLOSE * max(most, 1.0):
        return f"{spring} holds: the cam force is never less than {force}."
    lost = f"the cam force would be {force} at {scene.show(angle, 'angle')}"
    speed = contact_speed(scene, sampler)
    if speed:
        lost += f"; it holds up to {scene.show(speed, 'angular speed', 7)}"
    return f"{spring} would lift off: {lost}." if least < 0.0 else f"{spring} is too soft: {lost}."


def _frame(scene: Scene, model: JobModel, numbers: Numbers) -> cam_limit.SymmetricFrame | None:
    """Frame that the loads make of it; None where their sum is another."""
    number, known = systems.mpmath(cam_limit.DIGITS).number, scene.mechanism
    force = _force(model, numbers)
    middle, inertia = force(RISE, 0.5, 0.5, 0.0, 0.0), force(RISE, 0.5, 0.5, 0.0, 1.0)
    limit = scene.limits.get(LIMIT)
    symmetric_frame = cam_limit.SymmetricFrame(
        most=number(limit.max if limit and limit.max else scene.table(LawTarget).acceleration),
        travel=number(known["travel"]),
        preload=number(scene.bounds["X0"].max if "X0" in scene.bounds else known["X0"]),
        steady=number(scene.operation["N_min"]) - middle,
        before=middle - force(RISE, 0.0, 0.0, 0.0, 0.0),
        after=force(RISE, 1.0, 1.0, 0.0, 0.0) - middle,
        inertia=inertia - middle,
    )
    size = abs(middle) + abs(symmetric_frame.before) + abs(symmetric_frame.after) + abs(symmetric_frame.inertia)
    for segment, s, u, slope, bend in PROBES:
        pull = (symmetric_frame.before if s < 0.5 else symmetric_frame.after) * (2 * s - 1)
        if abs(force(segment, s, u, slope, bend) - (middle + pull + symmetric_frame.inertia * bend)) > ALIKE * size:
            return None
    return symmetric_frame if symmetric_frame.inertia > 0 else None


def _force(model: JobModel, numbers: Numbers) -> Force:
    """Sum of all loads but the return spring at a segment, s, u, s' and s''."""
    system = systems.mpmath(cam_limit.DIGITS)
    given = model.given(system, {name: system.number(value) for name, value in numbers.items()})
    loads = [load for load in model.loads if load is not RETURN_SPRING]
    values, zero = given.values, system.number(0.0)

    def force(segment: int, s: float, u: float, slope: float, bend: float) -> Number:
        law = LawDerivatives(*map(system.number, (s, slope, bend, 0.0)))
        rate = {RISE: 1 / values["rise"], RETURN: -1 / values["return"]}[segment]
        omega = values.get("speed", zero)
        pose = FrameMotion(system, zero, values["travel"], segment, system.number(u), rate, law, -1, omega)
        past = {load.name: float(s > 0.5) for load in loads}
        return zero + balance.output_force(system, loads, pose, given, past)

    return force


JOB = Shedding()
