"""Between the NLP's variables and the spring, cam and law a person reads; figures and words of a design.

What target law tends to with ever more intervals stands here too, where it is known in closed form
(mechanisms/cam_limit.py). Which loads act is not asked, only whether their sum is what the closed form knows: a steady
force, one in proportion to the shed on either side of its middle, and inertia.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np

from loomopt.jobs import registry
from loomopt.jobs.base import Family, Figures
from loomopt.jobs.shedding.model import RETURN, RETURN_SPRING, RISE, FramePose, frame
from loomopt.jobs.shedding.scene import SEGMENTS, VARIABLES, LawTarget
from loomopt.maths import systems
from loomopt.maths.systems import Number
from loomopt.model import drive
from loomopt.model.model import JobModel
from loomopt.model.program import Numbers, Program, Variable
from loomopt.model.sampling import Extreme, Sampler
from loomopt.model.speeds import speed_reached
from loomopt.physics import balance
from loomopt.physics.cycle import Floats
from loomopt.physics.effects.kinds import Load
from loomopt.physics.mechanisms import cam_limit
from loomopt.physics.mechanisms.cam_laws import Derivatives
from loomopt.physics.mechanisms.cam_motion import Spline, named_knots
from loomopt.physics.tolerances import ACCURACY
from loomopt.scenes.scene import Scene

CYCLE = {
    "contact_min": "lift",
    "contact_max": "cam_force",
    "law_acceleration": "law_acceleration",
    "pressure_angle_max": "pressure_angle",
    "curvature_min": "concavity",
    "curvature_max": "curvature",
    **{figure.name: figure.name for figure in drive.FIGURES},
}
"""Figures that are extremes over the cycle, with their quantities."""
CLOSE = 1e-9
"""Share of the largest cam force below which contact just holds."""
GAVE_WAY = 1e-7
"""A number that a target keeps has given way when it is off by this, in its natural size."""
LEAST_STRETCH = 1e-3
"""Share of the largest elongation below which a spring is as good as slack."""
MEGA = 1e6
CONTACT_SPEED = "contact_speed"
SAME = 1e-12
"""Share of the largest |N| by which two least values are one: rise and return mirror each other."""
MOVES = " The moves, where not every force is known, are not judged."
LIMIT = "law_acceleration"
PROBES = ((RISE, 0.25, 0.125, 0.0, 0.0), (RISE, 0.75, 0.5, 1.5, -2.0), (RETURN, 0.125, 0.375, 2.0, 3.0))
"""Segment, s, u, s' and s'' at which the sum of the loads is asked whether it is that of the closed form."""
ALIKE = 1e-30
"""Share of the forces by which it may differ: rounding in these digits."""
Force = Callable[[int, float, float, float, float], Number]


def design(program: Program, x: Numbers) -> dict[str, float]:
    """Return the design, SI, of NLP variables: the spring, every other number that is freed, and a free law's knots."""
    values, law = {**program.parameters, **x}, frame(program.model).law
    knots = set(law.names) if isinstance(law, Spline) else set()
    fixed = {limit.row for limit in program.bound_limits.values() if limit.sign == 0}
    chosen = [v.name for v in program.variables if v.name in fixed or _chosen(v, values[v.name])]
    free = [name for name in chosen if name not in {*VARIABLES, *knots, CONTACT_SPEED}]
    found = {name: values[name] for name in (*VARIABLES, *free)}
    if set(SEGMENTS) & set(found):
        found["near_dwell"] = 2 * math.pi - sum(values[name] for name in SEGMENTS[:3])
    if isinstance(law, Spline) and knots & {v.name for v in program.variables}:
        found |= named_knots(map(float, law.accelerations(values)))
    return found


def _chosen(variable: Variable, value: float) -> bool:
    """Say whether a variable is a choice: it has room, or it had to give way."""
    return variable.lower < variable.upper or abs(value - variable.lower) > GAVE_WAY * variable.scale


def peaks(model: JobModel) -> dict[str, str]:
    """Return the figures that are extremes over the cycle, with their quantities."""
    found = {name: quantity for name, quantity in CYCLE.items() if model.has_quantity(quantity)}
    return found | {name: name for check in model.checks for name in check.quantities}


def figures(scene: Scene, sampled: Sampler) -> dict[str, float | None]:
    """Return every figure of the job for a design, SI; None for one whose numbers the scene does not have."""
    found: dict[str, float | None] = {name: sampled.static.get(name) for name in scene.schema.figures}
    for name, quantity in peaks(sampled.model).items():
        found[name] = sampled.peak(quantity) * (-1 if quantity == "concavity" else 1)
    return found | contact(scene, sampled)


def contact(scene: Scene, sampled: Sampler) -> dict[str, float | None]:
    """Return the figures of the cam force, SI, and the speed up to which the roller stays on the cam."""
    physics = sampled.model
    found: dict[str, float | None] = {"contact_max": sampled.peak("cam_force")}
    found["contact_min"], found["contact_angle"] = _least(sampled.extremes("lift"), sampled)
    found[CONTACT_SPEED] = None
    unknown = drive.motor(physics.effects) or physics.known_in
    if not unknown and any(load.moved for load in physics.loads if isinstance(load, Load)):
        speed = survived(sampled, scene.operation["N_min"])
        found[CONTACT_SPEED] = speed if math.isfinite(speed) else None
    return found


def survived(sampled: Sampler, least: float) -> float:
    """Return the speed, rad/s, up to which the cam force stays at least `least`, N, as closely as a solve keeps it."""
    slack = ACCURACY * abs(sampled.static["spring_force_max"])
    return speed_reached(sampled.model, sampled.values, "lift", -least, slack)


def _least(found: list[Extreme], sampled: Sampler) -> tuple[float, float]:
    """Return the least cam force, N, and the first cam angle where it is reached, rad."""
    highest = max(extreme.height for extreme in found)
    size = max(abs(extreme.value) for extreme in found)
    alike = [extreme for extreme in found if extreme.height >= highest - SAME * size]
    return -highest, min(sampled.angle(extreme) % (2 * math.pi) for extreme in alike)


def judged(model: JobModel) -> str:
    """Return the dwells, in words, that the cam force is judged in; "" where it is known all round."""
    names = [SEGMENTS[int(value)] for _, value in model.known_in if int(value) in frame(model).segments]
    known = [name.replace("_", " ") for name in names]
    return "both dwells" if len(known) > 1 else f"the {known[0]}" if known else ""


def say(scene: Scene, now: Figures, dwells: str, target: str, figures: Figures) -> str:
    """Say what an optimum of the target reached, and what today's spring would do; figures, now (today's): SI.

    dwells: what alone the cam force is judged in; "" for all round.
    """
    size = {name: value or 0.0 for name, value in figures.items()}
    stiffness, speed = scene.show(size["K1"], "stiffness", 9), scene.show(size["speed"], "angular speed", 9)
    kept = f"keeps the roller on the cam {f'in {dwells}' if dwells else 'all round'}"
    peak = f"peak cam force{f' in {dwells}' if dwells else ''} is {scene.show(size['contact_max'], 'force')}"
    said = {
        "stiffness": f"The least return spring that {kept} has {stiffness}.",
        "law": f"With the cam law chosen too, the least return spring that {kept} has {stiffness}.",
        "force": f"The least {peak}, with a return spring of {stiffness}.{MOVES if dwells else ''}",
        "speed": f"Today's spring {kept} up to {speed}.",
    }[target]
    return said if target == "speed" else f"{said} {_today(scene, now)}".strip()


def _today(scene: Scene, found: Figures) -> str:
    """Say whether today's spring holds the roller on the cam, and where and by how much it would lift off."""
    least, most = found["contact_min"] or 0.0, abs(found["contact_max"] or 0.0)
    wanted, force = scene.operation["N_min"], scene.show(least, "force")
    spring = f"Today's spring ({scene.show(scene.mechanism['K1'], 'stiffness', 9)})"
    if least >= wanted - CLOSE * max(most, 1.0):
        return f"{spring} holds: the cam force is never less than {force}."
    lost = f"the cam force would be {force} at {scene.show(found['contact_angle'] or 0.0, 'angle')}"
    speed = found[CONTACT_SPEED]
    if speed:
        lost += f"; it holds up to {scene.show(speed, 'angular speed', 7)}"
    return f"{spring} would lift off: {lost}." if least < 0.0 else f"{spring} is too soft: {lost}."


class Sizes:
    """force, N: the largest sum of the loads' magnitudes, the spring apart; stiffness, N/m: what keeps contact.

    sampler: the frame today; stretch: the largest elongation its spring may have, m; most: its largest stiffness.
    """

    def __init__(self, sampler: Sampler, stretch: float, most: float) -> None:
        self.sampler = sampler
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
        """Return the stiffness, N/m, that keeps the cam force above `least`, N, at a preload, m, as sampled."""
        elongated = np.maximum(self.travelled + preload, min(LEAST_STRETCH * self.stretch, preload) or LEAST_STRETCH)
        return float(max(0.0, np.max((least - self.others) / elongated)))

    def figure(self, name: str, quantity: str, value: float) -> float:
        """Return the size of a figure over the cycle."""
        if name.startswith("contact"):
            return self.force
        return abs(value) or abs(self.sampler.peak(quantity)) or 1.0

    def margin(self, kind: str) -> float:
        """Return what a check's margins of a kind are measured by; 0 where nothing of the frame says."""
        return {"stiffness": self.stiffness, "pressure": 100 * MEGA, "force": self.force}.get(kind, 0.0)


def least_stiffness(scene: Scene, start: Number) -> Number | None:
    """Return the limit of K1, N/m, for target law, in 40 digits; None where the closed form does not hold.

    start: a stiffness, N/m, for which some law keeps contact, such as a spline law's least one. The frame must rise
    and fall alike, and nothing but N_min and the law's acceleration be limited.
    """
    known, law, model = scene.mechanism, scene.table(LawTarget), registry.of(scene).model(scene)
    free = any(scene.bounds[name].free for name in SEGMENTS if name in scene.bounds)
    alike = known["rise"] == known["return"] and not free and not law.symmetric
    if not alike or set(scene.limits) - {LIMIT} or model.known_in or model.demands:
        return None
    frame = _frame(scene, model)
    return None if frame is None else cam_limit.least_stiffness(frame, systems.mpmath(cam_limit.DIGITS).number(start))


def _frame(scene: Scene, model: JobModel) -> cam_limit.Frame | None:
    """Return the frame that the loads make of it; None where their sum is another."""
    number, known = systems.mpmath(cam_limit.DIGITS).number, scene.mechanism
    force = _force(scene, model)
    middle, inertia = force(RISE, 0.5, 0.5, 0.0, 0.0), force(RISE, 0.5, 0.5, 0.0, 1.0)
    limit = scene.limits.get(LIMIT)
    found = cam_limit.Frame(
        most=number(limit.max if limit and limit.max else scene.table(LawTarget).acceleration),
        travel=number(known["travel"]),
        preload=number(scene.bounds["X0"].max if "X0" in scene.bounds else known["X0"]),
        steady=number(scene.operation["N_min"]) - middle,
        before=middle - force(RISE, 0.0, 0.0, 0.0, 0.0),
        after=force(RISE, 1.0, 1.0, 0.0, 0.0) - middle,
        inertia=inertia - middle,
    )
    size = abs(middle) + abs(found.before) + abs(found.after) + abs(found.inertia)
    for segment, s, u, slope, bend in PROBES:
        pull = (found.before if s < 0.5 else found.after) * (2 * s - 1)
        if abs(force(segment, s, u, slope, bend) - (middle + pull + found.inertia * bend)) > ALIKE * size:
            return None
    return found if found.inertia > 0 else None


def _force(scene: Scene, model: JobModel) -> Force:
    """Return the sum of all loads but the return spring at a segment, s, u, s' and s''."""
    system = systems.mpmath(cam_limit.DIGITS)
    numbers = registry.of(scene).numbers(scene)
    given = model.given(system, {name: system.number(value) for name, value in numbers.items()})
    loads = [load for load in model.loads if load is not RETURN_SPRING]
    values, zero = given.values, system.number(0.0)

    def force(segment: int, s: float, u: float, slope: float, bend: float) -> Number:
        law = Derivatives(*map(system.number, (s, slope, bend, 0.0)))
        rate = {RISE: 1 / values["rise"], RETURN: -1 / values["return"]}[segment]
        omega = values.get("speed", zero)
        pose = FramePose(system, zero, values["travel"], segment, system.number(u), rate, law, -1, omega)
        past = {load.name: float(s > 0.5) for load in loads}
        return zero + balance.output_force(system, loads, pose, given, past)

    return force


def _limit(scene: Scene, x: Mapping[str, Number]) -> Number | None:
    return least_stiffness(scene, float(x["K1"]))


FAMILY = Family("spline intervals", "law", "targets.law.intervals", _limit)
