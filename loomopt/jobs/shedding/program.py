"""From a shedding scene and a target to the program: variables, limits, objectives and their natural sizes."""

import math
from collections.abc import Mapping
from typing import Any

from loomopt.errors import BadInput
from loomopt.jobs.shedding import fault as shedding_fault
from loomopt.jobs.shedding.limits import Limits
from loomopt.jobs.shedding.model import Shedding
from loomopt.jobs.shedding.pose import RETURN_SPRING
from loomopt.jobs.shedding.reading import contact_speed
from loomopt.jobs.shedding.scene import SEGMENTS, VARIABLES
from loomopt.jobs.shedding.sizes import Sizes
from loomopt.mechanisms import cam_spline
from loomopt.mechanisms.cam_motion import PREFIX, CamLaw, Spline
from loomopt.mechanisms.tension_spring import WIRES
from loomopt.program import numbers as scene_numbers
from loomopt.program.numbers import full_name, words
from loomopt.program.program import Objective, Program, Variable
from loomopt.program.sampling import Sampler
from loomopt.schema import Check, Load

DYNAMIC = ("inertia", "damping", "coil")
"""Effects that read the speed."""
ROOM = 0.01
"""Share of a bound's width that a start keeps from its ends."""
SLOWER = 0.9
"""A start's speed over the one that today's spring survives."""
SPARE = 1.1
"""A start's stiffness over the least that keeps contact at today's law and preload."""


def numbers(scene: Any) -> dict[str, float]:
    """Return every number of the scene by name, SI, the knots of a spline law included."""
    found = scene_numbers.numbers(scene)
    knots = scene.mechanism.get("law_coefficients") or ()
    return found | {f"{PREFIX}{k}": float(value) for k, value in enumerate(knots)}


def model(scene: Any, law: CamLaw | None = None) -> Shedding:
    """Return the frame with the effects the scene calls for; law: another than the scene's."""
    effects = [scene.job.effects[name] for name in scene.effects]
    loads = tuple(effect for effect in effects if isinstance(effect, Load))
    free = any(scene.bounds[name].free for name in SEGMENTS if name in scene.bounds)
    there = tuple(free or scene.mechanism[name] > 0.0 for name in ("far_dwell", "near_dwell"))
    return Shedding(
        (RETURN_SPRING, *loads),
        tuple(effect for effect in effects if isinstance(effect, Check)),
        words(scene),
        law or shedding_fault.chosen(scene),
        (there[0], there[1]),
        frozenset(numbers(scene)),
    )


def today(scene: Any) -> dict[str, float]:
    """Return today's spring, SI, with every other number that the scene frees."""
    known = numbers(scene)
    others = [full_name(known, name) for name, bound in scene.bounds.items() if name not in VARIABLES and bound.free]
    return {name: known[name] for name in (*VARIABLES, *others)}


def bounds(scene: Any) -> dict[str, tuple[float, float]]:
    """Return lower and upper bound of every bounded number, by its full name, SI; held ones at today's value."""
    return scene_numbers.bounds(scene, numbers(scene), VARIABLES)


def sizes(scene: Any) -> dict[str, tuple[float, ...]]:
    """Return the wire diameters that are sold, m, where the coils' wire is free and must be one of them."""
    own = scene.effects.get("coil")
    bound = scene.bounds.get("wire")
    free = own is not None and bound is not None and bound.free and bound.min < bound.max
    return {"wire": WIRES} if free and own.sizes == "preferred" else {}


def demand(scene: Any, target: str) -> None:
    """Raise BadInput where a target speaks of what the scene does not have."""
    for name in scene.job.targets[target].needs_effects:
        if name not in scene.effects:
            raise BadInput(
                f"target {target} needs the effect {name}",
                file=scene.origin,
                key=f"effects.{name}",
                remedy=f"Add the table [effects.{name}], or choose another target.",
            )
    if target == "speed" and (model(scene).is_level or math.isinf(_survived(scene))):
        raise BadInput(
            "nothing limits the speed: as the scene stands, the roller stays on the cam at any",
            file=scene.origin,
            key="effects.inertia.M, mechanism.travel, effects.warp_tension.shape",
            allowed="a moving mass, a travel, and a warp tension that is known in the moves (linear, step)",
            remedy="Correct them, or choose another target.",
        )
    own = scene.targets["law"]
    fewest, most = shedding_fault.FEWEST, shedding_fault.MOST
    if target == "law" and (not fewest <= own.intervals <= most or (own.symmetric and own.intervals % 2)):
        raise BadInput(
            "a law cannot have so many intervals",
            file=scene.origin,
            key="targets.law.intervals",
            value=str(own.intervals),
            allowed=f"{fewest} to {most}, an even number for a symmetric law",
            remedy="Write intervals = 16.",
        )


def _survived(scene: Any) -> float:
    """Return the speed, rad/s, up to which today's spring keeps contact."""
    return contact_speed(model(scene), numbers(scene), scene.operation["N_min"])


def program(scene: Any, target: str) -> Program:
    """Return the program of a target: all that a solve needs to know of the scene."""
    return _Task(scene, target).program()


class _Task:
    """One scene and target on the way to a program."""

    def __init__(self, scene: Any, target: str) -> None:
        self.scene, self.target = scene, target
        self.limited = bounds(scene)
        own = scene.targets["law"]
        self.law = Spline(own.intervals, own.symmetric) if target == "law" else None
        self.known = numbers(scene)
        if self.law:
            started = cam_spline.cycloid_like(self.law.intervals)
            self.known |= {f"{PREFIX}{k}": value for k, value in enumerate(started)}
        self.physics = model(scene, self.law)
        self.sampler = Sampler(self.physics, self.known)
        most = self.limited["K1"][1] if "K1" in scene.bounds else math.inf
        self.sizes = Sizes(self.sampler, self.limited["X0"][1] + self.known["travel"], most)
        self.kept = ["travel", *(["speed"] if set(DYNAMIC) & set(scene.effects) else [])]
        self.limits = Limits(scene, target, self.physics, self.known, self.limited, self.sizes, self.kept, self.law)
        self.coiled = "coil" in scene.effects
        self.fastest = 0.0
        if target == "speed":
            survived = _survived(scene)
            self.fastest = survived if 0.0 < survived < math.inf else self.known["speed"]

    def program(self) -> Program:
        variables = self._variables()
        limits = self.limits.all(variables)
        taken = {variable.name for variable in variables}
        parameters = {name: value for name, value in self.known.items() if name not in taken}
        starts = self._starts(variables)
        return Program(self.physics, tuple(variables), parameters, tuple(limits), self._objectives(), starts)

    def _variables(self) -> list[Variable]:
        """Return what the target may choose, and what it keeps as variables without room, which gives it a price."""
        scene, known = self.scene, self.known
        free = {full_name(known, name) for name, bound in scene.bounds.items() if bound.free} - {"near_dwell"}
        ends = {name: self.limited[name] for name in self.limited if name in free}
        ends["X0"] = self.limited["X0"]
        ends["K1"] = self.limited["K1"] if "K1" in scene.bounds else (0.0, math.inf)
        if self.target == "speed":
            ends |= {name: (known[name],) * 2 for name in ends if name.startswith("coil.")}
            ends |= {"X0": (known["X0"],) * 2} | ({} if self.coiled else {"K1": (known["K1"],) * 2})
            ends["speed"] = self.limited.get("speed", (1e-3 * self.fastest, math.inf))
        for name in self.kept:
            ends.setdefault(name, (known[name], known[name]))
        found = [Variable(name, *end, self._size(name, end), self._range(name, end)) for name, end in ends.items()]
        if self.law:
            most = self.limits.most_acceleration
            found += [Variable(name, -math.inf, math.inf, most, (-most, most)) for name in self.law.names]
        return found

    def _size(self, name: str, ends: tuple[float, float]) -> float:
        """Return a variable's natural size, SI."""
        if name == "K1":
            return self.sizes.stiffness
        if name in SEGMENTS:
            return 1.0
        if name == "speed" and self.fastest:
            return self.fastest
        finite = [abs(end) for end in (*ends, self.known[name]) if math.isfinite(end)]
        return max(finite) or 1.0

    def _range(self, name: str, ends: tuple[float, float]) -> tuple[float, float]:
        """Return where random starts lie, SI."""
        if name == "K1":
            least = min(max(ends[0], 0.1 * self.sizes.needed), ends[1])
            return least, min(ends[1], 10.0 * self.sizes.needed)
        return ends[0], min(ends[1], 3.0 * self.known[name]) if math.isinf(ends[1]) else ends[1]

    def _objectives(self) -> tuple[Objective, ...]:
        """Return the target's levels in order."""
        if self.target == "force":
            return (Objective("contact_max", "cam_force", "peak", self.sizes.force),)
        if self.target == "speed":
            return (Objective("speed", "cam_period", "value", 1 / self.fastest, power=-1),)
        least = Objective("K1", "K1", "value", self.sizes.stiffness)
        if not self.coiled:
            return (least,)
        return least, Objective("spring_mass", "spring_mass", "value", self.sampler.static["spring_mass"])

    def _starts(self, variables: list[Variable]) -> tuple[dict[str, float], ...]:
        """Return today's spring moved inside its bounds, stiff enough for contact; for the force, a short one too."""
        found = []
        for preload in (1.0 - ROOM, ROOM) if self.target == "force" else (1.0 - ROOM,):
            start = {}
            for v in variables:
                width = v.upper - v.lower
                room = ROOM * width if math.isfinite(width) else 0.0
                start[v.name] = min(max(self.known[v.name], v.lower + room), v.upper - room)
                if v.name == "speed" and self.fastest:
                    start["speed"] = min(max(SLOWER * self.fastest, v.lower), v.upper)
                if v.name == "X0":
                    start[v.name] = v.lower + preload * width
            stiff = SPARE * self.sizes.stiffness_for(self.known["N_min"], start["X0"])
            ends = next((v.lower, v.upper) for v in variables if v.name == "K1")
            start["K1"] = min(max(stiff, ends[0]), ends[1])
            found.append(start)
        return tuple(found)


def named(values: Mapping[str, float]) -> int:
    """Return how many intervals a spline law among values has; 0 without one."""
    knots = [name for name in values if name.startswith(PREFIX) and name.removeprefix(PREFIX).isdigit()]
    return max(0, len(knots) - 1)
