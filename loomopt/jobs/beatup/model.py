"""The beat-up job: balance the reed torque of a four-bar crank-rocker within the space [Yuan24].

q = −ψ, Q = M3 (positive pushes the reed toward the fell), crank torque = Md = −M3 ψ' + drive terms.
"""

import functools
import math
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from loomopt import balance
from loomopt.balance import Given
from loomopt.jobs.beatup.poses import FrontPose, ReedPose
from loomopt.maths import Maths, Number
from loomopt.mechanisms import crank_rocker
from loomopt.program.program import Integral
from loomopt.schema import Check, Load, Values

HAIR = 5e-4
"""Share by which a dyad's triangle closes, below which peaks stand so close to it that even samples miss them."""

ASSEMBLY_MARGIN = 1.001
"""The dyad's triangle must close with this factor to spare at both ends."""


@dataclass(frozen=True)
class Beatup:
    """The crank-rocker with the effects a scene calls for.

    options: (effect, key, word) for values that choose a formula.
    """

    loads: tuple[Load, ...]
    checks: tuple[Check, ...]
    options: tuple[tuple[str, str, str], ...]
    known: frozenset[str] = field(compare=False)
    """Names of scene numbers that are given: figures whose numbers are missing are left out."""

    @functools.cached_property
    def key(self) -> Hashable:
        """What distinguishes this model's formulas from another's."""
        return "beatup", tuple(load.name for load in self.loads + self.checks), self.options, self.known

    @functools.cached_property
    def integrals(self) -> tuple[Integral, ...]:
        """The mean square of M3 over the pulse, where the cloth resists."""
        names = [load.name for load in self.loads]
        return (
            (Integral("pulse_mean_square", "pulse_rms", "M3_square", names.index("resistance")),)
            if "resistance" in names
            else ()
        )

    @property
    def switched(self) -> tuple[Load, ...]:
        """What has corners: the loads."""
        return self.loads

    def hints(self, given: Given) -> dict[str, float]:
        """Return nothing: every corner has a formula."""
        return {}

    def singular(self, given: Given) -> tuple[float, ...]:
        """Return the crank angles, rad, 0 and π, where the dyad comes within a hair of folding or stretching."""
        sides = given.values["lengths"]
        far, fold = (sides.l2 + sides.l3) ** 2, (sides.l2 - sides.l3) ** 2
        least = (1 - HAIR) ** 2
        bases = {0.0: (sides.l4 - sides.l1) ** 2, math.pi: (sides.l4 + sides.l1) ** 2}
        return tuple(angle for angle, base in bases.items() if base > least * far or fold > least * base)

    def implied(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return nothing: no variable follows from the others."""
        return {}

    @property
    def quantities(self) -> tuple[str, ...]:
        """Whole-cycle quantities whose largest |value| is a figure."""
        return ("peak_torque", *(name for check in self.checks for name in check.quantities))

    @property
    def signed(self) -> frozenset[str]:
        """No quantity: magnitudes count."""
        return frozenset()

    @property
    def assembly(self) -> dict[str, tuple[str, float]]:
        """The dyad's triangle closes: the square of its base B to D over what the links span, inside 1."""
        return {"B to D < l2 + l3": ("span_far", 1.0), "B to D > |l2 - l3|": ("span_near", 1.0)}

    @property
    def bounded(self) -> frozenset[str]:
        """None yet."""
        return frozenset()

    def given(self, maths: Maths, values: Values) -> Given:
        """Return the scene's numbers with s = m4e r4e², kg·m², and both dead centres, rad."""
        lengths = crank_rocker.Lengths(values["l1"], values["l2"], values["l3"], values["l4"])
        centres = crank_rocker.dead_centres(maths, lengths)
        derived = {"lengths": lengths, "centres": centres, "beta": centres.beta, "beta_r": centres.beta_r}
        if "s" not in values:
            derived["s"] = values["m4e"] * values["r4e"] ** 2
        own: dict[str, dict[str, Any]] = {effect.name: {} for effect in self.loads + self.checks}
        for name, value in values.items():
            effect, _, key = name.rpartition(".")
            if effect in own:
                own[effect][key] = value
        for effect, key, word in self.options:
            own[effect][key] = word
        return Given(dict(values) | derived, own)

    def corners(self, maths: Maths, given: Given) -> tuple[tuple[Number, ...], ...]:
        """Return each load's corner angles, rad."""
        return tuple(
            load.corners(maths, given.values, given.own[load.name]) if load.corners else () for load in self.loads
        )

    def pose(self, maths: Maths, given: Given, phi: Number) -> ReedPose:
        """Return the pose at crank angles φ, rad."""
        return ReedPose(phi, given.values.get("speed"), crank_rocker.Pose(maths, given.values["lengths"], phi))

    def front_angle(self, given: Given) -> Number:
        """Return β, rad."""
        return given.values["beta"]

    def quantity(self, maths: Maths, given: Given, name: str, phi: Number, switches: Sequence[Number]) -> Number:
        """Return a whole-cycle quantity, SI, at crank angle φ, rad."""
        if name in ("span_far", "span_near"):
            span = crank_rocker.span_far if name == "span_far" else crank_rocker.span_near
            return span(maths, given.values["lengths"], phi)
        pose = self.pose(maths, given, phi)
        if name == "obliquity":
            return pose.joints.obliquity
        if name == "peak_torque":
            return balance.crank_torque(maths, self.loads, pose, given, switches)
        if name == "M3_square":
            return balance.output_force(maths, self.loads, pose, given, switches) ** 2
        check = next(check for check in self.checks if name in check.quantities)
        return check.quantities[name](maths, pose, given.values, given.own[check.name])

    def static(
        self, maths: Maths, given: Given, front: Sequence[Number], names: Collection[str] | None = None
    ) -> dict[str, Number]:
        """Return figures and rows of front dead centre and of the linkage as a whole, SI; all it has without names."""
        available = self._available(given)
        wanted = available if names is None else [name for name in available if name in names]
        return {name: self._static(maths, given, front, name) for name in wanted}

    def _available(self, given: Given) -> list[str]:
        """Return the names of the static figures and rows that the scene's numbers suffice for."""
        values = given.values
        found = [*LINKAGE, *ASSEMBLY, "r4e_square"]
        found += [name for name in ("l1", "l2", "l3", "l4", "m4e", "r4e", "s") if name in values]
        found += ["M3_fdc"] if any(load.acts == "output" for load in self.loads) else []
        found += ["alpha_fdc"] if "speed" in values else []
        found += ["J4"] if "inertia" in given.own else []
        found += ["r4"] if {"m4", "r4", "m4e"} <= values.keys() else []
        return found + (["change"] if "width.l1" in values else [])

    def _static(self, maths: Maths, given: Given, front: Sequence[Number], name: str) -> Number:
        """Return one static figure or row."""
        values = given.values
        if name in LINKAGE:
            return LINKAGE[name](maths, values)
        if name in ASSEMBLY:
            return ASSEMBLY[name](values)
        if name == "M3_fdc":
            return balance.output_force(maths, self.loads, FrontPose(values), given, front)
        if name == "J4":
            own = given.own.get("counterweight_inertia", {})
            return balance.total([given.own["inertia"]["J4"], values["s"], *own.values()])
        return FIGURES[name](values) if name in FIGURES else values[name]


def eccentricity(values: Values) -> Number:
    """Return r4 of reed and counterweight together, m [Yuan24, section on eq 10]."""
    moment = values["m4"] * values["r4"] - values["m4e"] * values["r4e"]
    return moment / (values["m4"] + values["m4e"])


def change(values: Values) -> Number:
    """Return Σ weight ((x − x_today)/bound width)², the retrofit's norm."""
    names = [name.removeprefix("width.") for name in values if name.startswith("width.")]
    return balance.total(
        [values[f"weight.{x}"] * ((values[x] - values[f"today.{x}"]) / values[f"width.{x}"]) ** 2 for x in names]
    )


LINKAGE: dict[str, Callable[[Maths, Values], Number]] = {
    "swing": lambda maths, values: values["centres"].swing,
    "theta": lambda maths, values: values["centres"].theta,
    "beta": lambda maths, values: values["centres"].beta,
    "mu_near": lambda maths, values: crank_rocker.transmission_angle_near(maths, values["lengths"]),
    "mu_far": lambda maths, values: crank_rocker.transmission_angle_far(maths, values["lengths"]),
}
"""Angles of the linkage, rad."""

FIGURES: dict[str, Callable[[Values], Number]] = {
    "alpha_fdc": lambda values: values["centres"].psi_2_front * values["speed"] ** 2,
    "r4": eccentricity,
    "r4e_square": lambda values: values["r4e"] ** 2,
    "change": change,
}
"""Other figures and rows, SI."""

ASSEMBLY: dict[str, Callable[[Values], Number]] = {
    "assembly: l1 + l4 < l2 + l3": lambda v: (v["l2"] + v["l3"]) - ASSEMBLY_MARGIN * (v["l1"] + v["l4"]),
    "assembly: l1 + l2 < l3 + l4": lambda v: (v["l4"] - v["l1"]) - ASSEMBLY_MARGIN * (v["l2"] - v["l3"]),
    "assembly: l1 + l3 < l2 + l4": lambda v: (v["l4"] - v["l1"]) - ASSEMBLY_MARGIN * (v["l3"] - v["l2"]),
}
"""By how much the dyad closes beyond the margin at φ = π and (twice) at φ = 0, m; never negative."""
