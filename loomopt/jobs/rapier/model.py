"""The rapier job: stroke and dwells of a five-bar drive on the sley [Hong17].

q = S, the head's travel from front dead centre; Q = force in the tape; crank torque = Q S'. Crank angle φ1 from FDC.
"""

import functools
import math
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from loomopt import balance, maths
from loomopt.balance import Given
from loomopt.jobs.beatup.model import HAIR
from loomopt.jobs.rapier import reading as rapier_reading
from loomopt.maths import Maths, Number
from loomopt.mechanisms import crank_rocker, rapier_drive
from loomopt.mechanisms.dyad import Vector, dot
from loomopt.program import spikes
from loomopt.program.program import Integral
from loomopt.program.sampling import Sampler
from loomopt.schema import Arcs, Load, Switched, Values

ASSEMBLY_MARGIN = 1.001
"""Every dyad's triangle must close with this factor to spare at both ends."""
DIMENSIONS = tuple(entry.name for entry in fields(rapier_drive.Dimensions))
SLEY = ("l1", "l2", "l3", "l71")
SAMPLED = 2 * math.pi / 360
"""rad; where a singular position is sought between samples."""
BEFORE, AFTER = -1.0, 1.0
"""Switch of the dwell arcs on either side of front dead centre."""
TURN = "turn."


@dataclass(frozen=True)
class HeadPose(balance.Motion):
    """The head at crank angles φ1, rad, any shape; what no load reads is not computed."""

    joints: rapier_drive.Pose
    front: Vector
    omega: Number
    omega_dot: Number = None

    @property
    def phi(self) -> Number:
        """Crank angle φ1, rad."""
        return self.joints.phi1

    @functools.cached_property
    def q(self) -> Number:
        """S, m [Hong17, eq 1]."""
        return self.joints.dimensions.travel * self.joints.phi63(self.front)

    @functools.cached_property
    def q1(self) -> Number:
        """S', m/rad."""
        return self.joints.dimensions.travel * self.joints.phi63_1

    @functools.cached_property
    def q2(self) -> Number:
        """S'', m/rad²."""
        return self.joints.dimensions.travel * self.joints.phi63_2

    @functools.cached_property
    def q3(self) -> Number:
        """Third derivative of S, m/rad³."""
        return self.joints.dimensions.travel * self.joints.phi63_3


def _arc(sides: tuple[float, ...], angle: float, corners: tuple[float, ...]) -> float:
    """Return on which side's dwell arc a crank angle lies, 0 for neither; corners: the arcs' outer ends."""
    for side, end in zip(sides, corners, strict=False):
        inside = angle % (2 * math.pi) if side == AFTER else -angle % (2 * math.pi)
        if inside < abs(end):
            return side
    return 0.0


@dataclass(frozen=True)
class Rapier:
    """The rapier drive with the loads a scene calls for.

    arcs: (side, name of the value that is the dwell on that side); integrals: the means a target asks for.
    """

    loads: tuple[Load, ...]
    arcs: tuple[tuple[float, str], ...]
    integrals: tuple[Integral, ...] = ()
    known: frozenset[str] = field(default=frozenset(), compare=False)
    """Names of scene numbers that are given: figures whose numbers are missing are left out."""

    @functools.cached_property
    def key(self) -> Hashable:
        """What distinguishes this model's formulas from another's."""
        means = tuple((integral.name, len(integral.angles)) for integral in self.integrals)
        return "rapier", tuple(load.name for load in self.loads), self.arcs, means, self.known

    @functools.cached_property
    def switched(self) -> tuple[Switched, ...]:
        """What has corners: the loads, then the dwell arcs."""
        return (*self.loads, Arcs("dwell", functools.partial(_arc, tuple(side for side, _ in self.arcs))))

    def where(self, side: float) -> tuple[int, float]:
        """Return how a limit names the dwell arc on one side."""
        return len(self.loads), side

    @property
    def quantities(self) -> tuple[str, ...]:
        """Whole-cycle quantities whose largest |value| is a figure."""
        loads = ("peak_torque", "tape_force") if self.loads else ()
        return ("peak_acceleration", "peak_jerk", *loads)

    @property
    def signed(self) -> frozenset[str]:
        """No quantity: magnitudes count."""
        return frozenset()

    @property
    def assembly(self) -> dict[str, tuple[str, float]]:
        """Both dyads' triangles close: the square of their base over what the links span, inside 1."""
        five_bar = {"five-bar: C to B2 < l5 + l6": "span_far", "five-bar: C to B2 > |l5 - l6|": "span_near"}
        sley = {"sley: A to B0 < l2 + l3": "sley_span_far", "sley: A to B0 > |l2 - l3|": "sley_span_near"}
        return {name: (quantity, 1.0) for name, quantity in (five_bar | sley).items()}

    @property
    def bounded(self) -> frozenset[str]:
        """None yet."""
        return frozenset()

    def given(self, maths: Maths, values: Values) -> Given:
        """Return the scene's numbers, the sley's stand, and the driving link's direction at front dead centre."""
        dimensions = rapier_drive.Dimensions(**{name: values[name] for name in DIMENSIONS})
        centres = rapier_drive.Sley(maths, dimensions).centres
        derived = {
            "dimensions": dimensions,
            "centres": centres,
            "beta": centres.beta,
            "frame_angle": values["phi30"] - centres.psi_front,
        }
        stand = rapier_drive.Stand(derived["beta"], derived["frame_angle"])
        front = rapier_drive.Pose(maths, dimensions, stand, 0).relative
        derived |= {"front_x": front.x, "front_y": front.y}
        own: dict[str, dict[str, Any]] = {load.name: {} for load in self.loads}
        for name, value in values.items():
            effect, _, key = name.rpartition(".")
            if effect in own:
                own[effect][key] = value
        found = Given({**values, **derived}, own)
        derived["turns"] = tuple(self._turn(maths, found, value) for n, value in values.items() if n.startswith(TURN))
        return Given({**values, **derived}, own)

    def _turn(self, maths: Maths, given: Given, hint: Number) -> Number:
        """Return the crank angle, rad, near a hint where the head turns: one Newton step, so that it moves along."""
        pose = self.pose(maths, given, hint)
        return hint - pose.q1 / pose.q2

    def pose(self, maths: Maths, given: Given, phi: Number) -> HeadPose:
        """Return the pose at crank angles φ1, rad."""
        values = given.values
        stand = rapier_drive.Stand(values["beta"], values["frame_angle"])
        joints = rapier_drive.Pose(maths, values["dimensions"], stand, phi)
        return HeadPose(joints, Vector(values["front_x"], values["front_y"]), values.get("speed"))

    def corners(self, maths: Maths, given: Given) -> tuple[tuple[Number, ...], ...]:
        """Return the corner angles, rad, of each load, and the ends of the dwell arcs with front dead centre."""
        loads = [load.corners(maths, given.values, given.own[load.name]) if load.corners else () for load in self.loads]
        ends = tuple(given.values[name] if side == AFTER else -given.values[name] for side, name in self.arcs)
        return (*loads, (*ends, 0) if ends else ())

    def hints(self, given: Given) -> dict[str, float]:
        """Return where the head turns, the first turn onto its way out; nothing where no load changes there."""
        if not any(load.name == "tape_friction" for load in self.loads):
            return {}
        turns = rapier_reading.turns(lambda phi: self.pose(maths.numpy(), given, phi))
        return {f"{TURN}{k}": angle for k, angle in enumerate(turns)}

    def singular(self, given: Given) -> tuple[float, ...]:
        """Return the crank angles, rad, where a dyad comes within a hair of folding or stretching."""
        angles = np.linspace(0.0, 2 * math.pi, 361)
        found = []
        for name in ("span_far", "span_near", "sley_span_far", "sley_span_near"):

            def height(at: Any, name: str = name) -> Any:
                return np.asarray(self.quantity(maths.numpy(), given, name, at, []))

            top = float(angles[int(np.argmax(height(angles)))])
            if height(np.array([top]))[0] > 1 - 10 * HAIR:
                top = spikes.sectioned(height, top - SAMPLED, top + SAMPLED)
                found += [top] if height(np.array([top]))[0] > (1 - HAIR) ** 2 else []
        return tuple(found)

    def implied(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the angle of the stroke and the least dwell; raises ValueError where the drive does not turn."""
        sampler = Sampler(self, values)
        reading = rapier_reading.read(sampler)
        found = {"phi_stroke": reading.phi_stroke}
        if "s_dwell" in values:
            found["dwell"] = min(reading.dwell_after, reading.dwell_before, math.pi)
        return found

    def front_angle(self, given: Given) -> Number:
        """Return 0: φ1 counts from front dead centre."""
        return 0.0

    def quantity(self, maths: Maths, given: Given, name: str, phi: Number, switches: Sequence[Number]) -> Number:
        """Return a whole-cycle quantity, SI, at crank angle φ1, rad."""
        pose, values = self.pose(maths, given, phi), given.values
        if name == "S":
            return pose.q
        if name == "S_1":
            return pose.q1
        if name == "peak_acceleration":
            return pose.q2
        if name == "peak_jerk":
            return pose.q3
        if name == "jerk_square":
            return pose.q3**2
        if name == "miss_square":
            return (pose.q - switches[-1]) ** 2
        if name == "dwell_travel":
            return pose.q / values["s_dwell"]
        if name == "obliquity":
            return pose.joints.obliquity
        if name in ("span_far", "span_near"):
            return self._span(values, pose.joints, name)
        if name in ("sley_span_far", "sley_span_near"):
            span = crank_rocker.span_far if name == "sley_span_far" else crank_rocker.span_near
            return span(maths, _sley(values), phi + values["beta"])
        force = balance.output_force(maths, self.loads, pose, given, switches[: len(self.loads)])
        return force if name == "tape_force" else force * pose.q1

    def _span(self, values: Values, pose: rapier_drive.Pose, name: str) -> Number:
        """Return the square of C to B2 over what links l5 and l6 can span, 1 at the margin."""
        square, far = dot(pose.base, pose.base), values["l5"] + values["l6"]
        if name == "span_far":
            return ASSEMBLY_MARGIN**2 * square / far**2
        return (ASSEMBLY_MARGIN * (values["l5"] - values["l6"])) ** 2 / square

    def static(
        self, maths: Maths, given: Given, front: Sequence[Number], names: Collection[str] | None = None
    ) -> dict[str, Number]:
        """Return figures and rows of single positions and of the sley four-bar, SI; all it has without names."""
        available = [*SLEY_ROWS]
        available += ["phi_stroke", "rest"] if "phi_stroke" in given.values else []
        available += ["stroke_short"] if {"phi_stroke", "stroke"} <= given.values.keys() else []
        available += ["dwell", "dwell_rest"] if "dwell" in given.values else []
        wanted = available if names is None else [name for name in available if name in names]
        return {name: self._static(maths, given, name) for name in wanted}

    def _static(self, maths: Maths, given: Given, name: str) -> Number:
        values = given.values
        if name in SLEY_ROWS:
            return SLEY_ROWS[name](maths, values)
        if name == "dwell_rest":
            return maths.pi - values["dwell"]
        if name in values:
            return values[name]
        pose = self.pose(maths, given, values["phi_stroke"])
        return pose.q1 if name == "rest" else pose.q - values["stroke"]


def _sley(values: Values) -> crank_rocker.Lengths:
    return rapier_drive.sley_lengths(values["dimensions"])


SLEY_ASSEMBLY: dict[str, Callable[[Maths, Values], Number]] = {
    "assembly: l1 + l71 < l2 + l3": lambda m, v: (v["l2"] + v["l3"]) - ASSEMBLY_MARGIN * (v["l1"] + v["l71"]),
    "assembly: l1 + l2 < l3 + l71": lambda m, v: (v["l71"] - v["l1"]) - ASSEMBLY_MARGIN * (v["l2"] - v["l3"]),
    "assembly: l1 + l3 < l2 + l71": lambda m, v: (v["l71"] - v["l1"]) - ASSEMBLY_MARGIN * (v["l3"] - v["l2"]),
}
"""By how much the sley's dyad closes beyond the margin, m; never negative."""

SLEY_ROWS: dict[str, Callable[[Maths, Values], Number]] = {
    "swing": lambda maths, values: values["centres"].swing,
    "theta": lambda maths, values: values["centres"].theta,
    "sley_mu_near": lambda maths, values: crank_rocker.transmission_angle_near(maths, _sley(values)),
    "sley_mu_far": lambda maths, values: crank_rocker.transmission_angle_far(maths, _sley(values)),
    **SLEY_ASSEMBLY,
}
"""Angles of the sley four-bar, rad, and its margins."""
