"""What target law tends to with ever more intervals, where it is known in closed form (mechanisms/cam_limit.py).

Which loads act is not asked, only whether their sum is what the closed form knows: a steady force, one in proportion
to the shed on either side of its middle, and inertia.
"""

from collections.abc import Callable, Mapping

from loomopt import balance, maths
from loomopt.jobs import registry
from loomopt.jobs.shedding.model import RETURN, RETURN_SPRING, RISE, FramePose
from loomopt.jobs.shedding.scene import SEGMENTS, LawTarget
from loomopt.maths import Number
from loomopt.mechanisms import cam_limit
from loomopt.mechanisms.cam_laws import Derivatives
from loomopt.program.model import JobModel
from loomopt.program.studied import Family
from loomopt.scenes import Scene

LIMIT = "law_acceleration"
PROBES = ((RISE, 0.25, 0.125, 0.0, 0.0), (RISE, 0.75, 0.5, 1.5, -2.0), (RETURN, 0.125, 0.375, 2.0, 3.0))
"""Segment, s, u, s' and s'' at which the sum of the loads is asked whether it is that of the closed form."""
ALIKE = 1e-30
"""Share of the forces by which it may differ: rounding in these digits."""
Force = Callable[[int, float, float, float, float], Number]


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
    return None if frame is None else cam_limit.least_stiffness(frame, maths.mpmath(cam_limit.DIGITS).number(start))


def _frame(scene: Scene, model: JobModel) -> cam_limit.Frame | None:
    """Return the frame that the loads make of it; None where their sum is another."""
    number, known = maths.mpmath(cam_limit.DIGITS).number, scene.mechanism
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
    system = maths.mpmath(cam_limit.DIGITS)
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
