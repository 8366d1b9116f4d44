"""From a shedding scene and a target to the program: variables, limits, objectives and their natural sizes."""

import math
from collections.abc import Mapping
from typing import Any

from loomopt.errors import BadInput
from loomopt.jobs import numbers as scene_numbers
from loomopt.jobs import shedding_fault
from loomopt.jobs.numbers import full_name, words
from loomopt.jobs.program import Limit, Objective, Program, Variable
from loomopt.jobs.sampling import Sampler
from loomopt.jobs.shedding import FOLLOWER, Shedding, spline_rows
from loomopt.jobs.shedding_law import PREFIX, CamLaw, Spline
from loomopt.jobs.shedding_pose import DWELLS, RETURN_SPRING
from loomopt.jobs.shedding_reading import contact_speed
from loomopt.jobs.shedding_sizes import Sizes
from loomopt.jobs.shedding_tables import SEGMENTS, VARIABLES
from loomopt.mechanisms import cam_spline
from loomopt.mechanisms.tension_spring import WIRES
from loomopt.schema import Check, Load

DYNAMIC = ("inertia", "damping", "coil")
"""Effects that read the speed."""
CYCLE = {
    "contact_min": "lift",
    "contact_max": "cam_force",
    "law_acceleration": "law_acceleration",
    "pressure_angle_max": "pressure_angle",
    "curvature_min": "concavity",
    "curvature_max": "curvature",
}
"""Figures that are extremes over the cycle, with their quantities."""
ROOM = 0.01
"""Share of a bound's width that a start keeps from its ends."""
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
    if target == "speed" and math.isinf(contact_speed(model(scene), numbers(scene), scene.operation["N_min"])):
        raise BadInput(
            "the roller stays on the cam at any speed: nothing limits it",
            file=scene.origin,
            key="effects.inertia.M",
            value=scene.given("effects.inertia.M"),
            remedy="Give the moving mass, or choose another target.",
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
        self.sizes = Sizes(self.sampler, self.limited["X0"][1] + self.known["travel"])
        self.coiled = "coil" in scene.effects

    def program(self) -> Program:
        variables = self._variables()
        limits = [*self._bounds(variables), *self._contact(), *self._angles(), *self._figures(), *self._coil()]
        limits += self._law() if self.law else []
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
            ends["speed"] = self.limited.get("speed", (1e-3 * known["speed"], math.inf))
        for name in self._kept():
            ends.setdefault(name, (known[name], known[name]))
        found = [Variable(name, *end, self._size(name, end), self._range(name, end)) for name, end in ends.items()]
        if self.law:
            most = self._most_acceleration()
            found += [Variable(name, -math.inf, math.inf, most, (-most, most)) for name in self.law.names]
        return found

    def _kept(self) -> list[str]:
        """Return the numbers every target keeps."""
        return ["travel", *(["speed"] if set(DYNAMIC) & set(self.scene.effects) else [])]

    def _size(self, name: str, ends: tuple[float, float]) -> float:
        """Return a variable's natural size, SI."""
        if name == "K1":
            return self.sizes.stiffness
        if name in SEGMENTS:
            return 1.0
        finite = [abs(end) for end in (*ends, self.known[name]) if math.isfinite(end)]
        return max(finite) or 1.0

    def _range(self, name: str, ends: tuple[float, float]) -> tuple[float, float]:
        """Return where random starts lie, SI."""
        if name == "K1":
            least = min(max(ends[0], 0.1 * self.sizes.needed), ends[1])
            return least, min(ends[1], 10.0 * self.sizes.needed)
        return ends[0], min(ends[1], 3.0 * self.known[name]) if math.isinf(ends[1]) else ends[1]

    def _bounds(self, variables: list[Variable]) -> list[Limit]:
        """Return the bounds of variables as limits; a requirement gives way on one side only."""
        found = []
        for v in variables:
            label = v.name.rpartition(".")[2]
            if v.name.startswith(PREFIX):
                continue
            if v.lower == v.upper:
                sign = -1 if v.name in self._kept() else 1 if self.target == "speed" and v.name in VARIABLES else 0
                bounded = label in self.scene.bounds or sign
                found += [Limit(label, sign, v.name, v.lower, v.scale, "variable")] if bounded else []
                continue
            own = v.name != "speed" or "speed" in self.limited
            for sign, value in ((-1, v.lower), (1, v.upper)):
                if math.isfinite(value):
                    found.append(Limit(label, sign, v.name, value, v.scale, "variable", relaxable=own and value > 0.0))
        return found

    def _contact(self) -> list[Limit]:
        """Return the limit that is the job: contact all round, or where the warp's pull is known."""
        least, size = self.known["N_min"], self.sizes.force
        arcs = [(0, float(dwell)) for dwell in DWELLS] if self.physics.is_level else [None]
        return [Limit("N_min", -1, "lift", least, size, "cycle", where=where) for where in arcs]

    def _angles(self) -> list[Limit]:
        """Return what the near dwell, which takes the rest of the turn, must keep where another angle is free."""
        free = [name for name in SEGMENTS if name in self.scene.bounds and self.scene.bounds[name].free]
        if not free:
            return []
        low, high = self.limited.get("near_dwell", (0.0, math.inf))
        ends = ((0, low),) if low == high else ((-1, low), (1, high))
        return [
            Limit("near_dwell", sign, "near_dwell", value, 1.0, "static", relaxable=value > 0.0)
            for sign, value in ends
            if math.isfinite(value)
        ]

    def _figures(self) -> list[Limit]:
        """Return the scene's limits on figures."""
        found = []
        for name, limit in self.scene.limits.items():
            if name == "law_acceleration" and self.law:
                continue
            ends = [(sign, value) for sign, value in ((-1, limit.min), (1, limit.max)) if value is not None]
            for sign, value in ends:
                if name in CYCLE:
                    self._demand_quantity(name)
                    size = self.sizes.figure(name, CYCLE[name], value)
                    # The least of a quantity is the largest of its opposite, which the row then is.
                    found.append(Limit(name, sign, CYCLE[name], value, size, "cycle"))
                else:
                    found.append(Limit(name, sign, name, value, abs(value) or 1.0, "static"))
        return found

    def _demand_quantity(self, name: str) -> None:
        if CYCLE[name] not in (*self.physics.quantities, "lift"):
            raise BadInput(
                f"nothing in the scene gives the figure {name}",
                file=self.scene.origin,
                key=f"limits.{name}",
                remedy=f"Give the follower ({', '.join(FOLLOWER)}), or take the limit out.",
            )

    def _coil(self) -> list[Limit]:
        """Return what the effects that are checks demand of their rows."""
        found = []
        for check in self.physics.checks:
            for each in check.demands:
                value = each.value if isinstance(each.value, float) else self.known[f"{check.name}.{each.value}"]
                firm = each.row in self.scene.job.margins or not isinstance(each.value, str)
                size = self.sizes.margin(self.scene.job.margins.get(each.row, ""), value)
                found.append(Limit(each.row, each.sign, each.row, value, size, "static", relaxable=not firm))
        return found

    def _most_acceleration(self) -> float:
        """Return the largest |s''| a free law may have."""
        limit = self.scene.limits.get("law_acceleration")
        return float(limit.max if limit else self.scene.targets["law"].acceleration)

    def _law(self) -> list[Limit]:
        """Return what makes a free law a cam law: it reaches 1 at rest, never falls, and keeps its peak s''."""
        law = self.law
        assert law is not None
        most = self._most_acceleration()
        ends = [("law_end", 1.0), *([] if law.mirrored else [("law_end_slope", 0.0)])]
        found = [Limit(row, 0, row, value, 1.0, "static", relaxable=False, hidden=True) for row, value in ends]
        last = law.intervals // 2 if law.mirrored else law.intervals - 1
        for row in spline_rows(law)[2:]:
            _, side, knot = row.split("_")
            if int(knot) <= last and side == "slope":
                found.append(Limit(row, -1, row, 0.0, 1.0, "static", relaxable=False, hidden=True))
            elif int(knot) <= last:
                found.append(Limit("law_acceleration", 1, row, most, most, "static"))
        return found

    def _objectives(self) -> tuple[Objective, ...]:
        """Return the target's levels in order."""
        if self.target == "force":
            return (Objective("contact_max", "cam_force", "peak", self.sizes.force),)
        if self.target == "speed":
            return (Objective("contact_speed", "cam_period", "value", 1 / self.known["speed"], power=-1),)
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
