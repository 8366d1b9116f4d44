"""The limits of a shedding program: bounds, contact, figures, what coils must keep, and what makes a law a cam law."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from loomopt.errors import BadInput
from loomopt.jobs.shedding.model import FOLLOWER, Shedding, spline_rows
from loomopt.jobs.shedding.pose import DWELLS
from loomopt.jobs.shedding.scene import SEGMENTS, VARIABLES
from loomopt.jobs.shedding.sizes import Sizes
from loomopt.mechanisms.cam_motion import PREFIX, Spline
from loomopt.program.program import Limit, Variable

CYCLE = {
    "contact_min": "lift",
    "contact_max": "cam_force",
    "law_acceleration": "law_acceleration",
    "pressure_angle_max": "pressure_angle",
    "curvature_min": "concavity",
    "curvature_max": "curvature",
}
"""Figures that are extremes over the cycle, with their quantities."""


@dataclass(frozen=True)
class Limits:
    """What limits are made from: scene and target, the frame, its numbers and bounds, its sizes, a law that is free.

    kept: numbers that every target keeps, as variables without room.
    """

    scene: Any
    target: str
    physics: Shedding
    known: Mapping[str, float]
    limited: Mapping[str, tuple[float, float]]
    sizes: Sizes
    kept: Collection[str]
    law: Spline | None = None

    def all(self, variables: Sequence[Variable]) -> list[Limit]:
        """Return every limit of the program."""
        found = [*self._bounds(variables), *self._contact(), *self._angles(), *self._figures(), *self._coil()]
        return found + (self._law(self.law) if self.law else [])

    def _bounds(self, variables: Sequence[Variable]) -> list[Limit]:
        """Return the bounds of variables as limits; a requirement gives way on one side only."""
        found = []
        for v in variables:
            label = v.name.rpartition(".")[2]
            if v.name.startswith(PREFIX):
                continue
            if v.lower == v.upper:
                sign = -1 if v.name in self.kept else 1 if self.target == "speed" and v.name in VARIABLES else 0
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
        found = [Limit("N_min", -1, "lift", least, size, "cycle", relaxable=least > 0.0, where=w) for w in arcs]
        if least > 0.0:
            # What is asked beyond contact may give way; contact itself may not.
            found += [replace(each, name="contact", value=0.0, relaxable=False, hidden=True) for each in found]
        return found

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

    @property
    def most_acceleration(self) -> float:
        """Return the largest |s''| a free law may have."""
        limit = self.scene.limits.get("law_acceleration")
        return float(limit.max if limit else self.scene.targets["law"].acceleration)

    def _law(self, law: Spline) -> list[Limit]:
        """Return what makes a free law a cam law: it reaches 1 at rest, never falls, and keeps its peak s''."""
        most = self.most_acceleration
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
