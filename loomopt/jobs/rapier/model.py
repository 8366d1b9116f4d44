"""The rapier model: a five-bar drive on the sley, with the dwells of its head [Hong17].

q = S, the head's travel from front dead centre; Q = force in the tape; crank torque = Q S'. Crank angle φ1 from FDC.
"""

import functools
import itertools
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.maths import systems, turning_points
from loomopt.maths.systems import Maths, Number
from loomopt.maths.turning_points import crossing
from loomopt.model import drive
from loomopt.model.kinematics import Arcs, Group, four_bar
from loomopt.model.model import CycleQuantity, DesignRow, Instant, Integral, JobModel
from loomopt.model.sampling import Sampler
from loomopt.physics.balance import Given
from loomopt.physics.cycle import TURN, Floats, Node
from loomopt.physics.effects.coulomb import TURNS
from loomopt.physics.effects.kinds import Effect, Motion
from loomopt.physics.mechanisms import crank_rocker, rapier_drive
from loomopt.physics.mechanisms.dyad import Vector, dot
from loomopt.physics.schema import Values
from loomopt.physics.tolerances import ASSEMBLY_MARGIN

if TYPE_CHECKING:
    from loomopt.model.machines import Machines

DIMENSIONS = tuple(entry.name for entry in fields(rapier_drive.Dimensions))
SLEY = ("l1", "l2", "l3", "l71")
DWELL = "dwell"
BEFORE, AFTER = -1.0, 1.0
"""Switch of the dwell arcs on either side of front dead centre."""
STROKE = "S''_stroke"
"""S'' at the hand-over, m/rad², which effects may call in."""
HAND_OVER = "hand-over"
"""Name of the crank angle at which the head is farthest out, rad, where the program has no such number."""
JERK_NODES = 64
"""Equidistant crank angles of the rms jerk: the mean of a smooth periodic function, right to rounding."""


@dataclass(frozen=True)
class HeadPose(Motion):
    """Motion of the head at crank angles φ1, rad, of any shape; terms that no load reads are not computed."""

    joints: rapier_drive.RapierPose
    front: Vector
    omega: Number
    omega_dot: Number = None

    @property
    def phi(self) -> Number:
        """Crank angle φ1, rad."""
        return self.joints.phi1

    @lazy
    def q(self) -> Number:
        """S, m [Hong17, eq 1]."""
        return self.joints.dimensions.travel * self.joints.phi63(self.front)

    @lazy
    def q1(self) -> Number:
        """S', m/rad."""
        return self.joints.dimensions.travel * self.joints.phi63_1

    @lazy
    def q2(self) -> Number:
        """S'', m/rad²."""
        return self.joints.dimensions.travel * self.joints.phi63_2

    @lazy
    def q3(self) -> Number:
        """Third derivative of S, m/rad³."""
        return self.joints.dimensions.travel * self.joints.phi63_3


def _five_bar() -> Group:
    """Dyad C D B2: the distance that links l5 and l6 span, 1 at the margin, and the transmission angle at D."""

    def base(given: Given, pose: Callable[[], Any]) -> Number:
        vector = pose().joints.base
        return dot(vector, vector)

    def far(m: Maths, given: Given, phi: Number, pose: Callable[[], Any]) -> Number:
        return ASSEMBLY_MARGIN**2 * base(given, pose) / (given.values["l5"] + given.values["l6"]) ** 2

    def near(m: Maths, given: Given, phi: Number, pose: Callable[[], Any]) -> Number:
        return (ASSEMBLY_MARGIN * (given.values["l5"] - given.values["l6"])) ** 2 / base(given, pose)

    def obliquity(m: Maths, given: Given, phi: Number, pose: Callable[[], Any]) -> Number:
        return pose().joints.obliquity

    closes = {"five-bar: C to B2 < l5 + l6": "span_far", "five-bar: C to B2 > |l5 - l6|": "span_near"}
    return Group({"span_far": far, "span_near": near, "obliquity": obliquity}, closes)


class DriveLinkage(NamedTuple):
    """Quantities of the scene that all poses share; centres: the sley's dead centres."""

    dimensions: rapier_drive.Dimensions
    centres: crank_rocker.DeadCentres


def shared_linkage(given: Given) -> DriveLinkage:
    """Quantities that all poses of a machine share."""
    linkage = given.linkage
    assert isinstance(linkage, DriveLinkage)
    return linkage


@dataclass(frozen=True)
class RapierDrive:
    """The drive's motion."""

    structure: str = "rapier"
    arcs: tuple[Arcs, ...] = ()
    breaks: frozenset[str] = frozenset()

    @lazy
    def groups(self) -> Mapping[str, Group]:
        """The five-bar's dyad, and that of the sley four-bar."""
        sley = four_bar(
            SLEY,
            -1,
            lambda values: values["beta"],
            ("sley: A to B0 < l2 + l3", "sley: A to B0 > |l2 - l3|"),
        )
        return {"": _five_bar(), "sley_": sley}

    def linkage(self, maths: Maths, values: Values) -> DriveLinkage:
        """Dimensions, and the sley's dead centres."""
        dimensions = rapier_drive.Dimensions(**{name: values[name] for name in DIMENSIONS})
        return DriveLinkage(dimensions, rapier_drive.Sley(maths, dimensions).centres)

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> dict[str, Number]:
        """Sley's stand, the driving link's direction at front dead centre, and the turning points if requested."""
        values, centres = given.values, shared_linkage(given).centres
        quantities = {"beta": centres.beta, "frame_angle": values["phi30"] - centres.psi_front}
        stand = rapier_drive.Stand(quantities["beta"], quantities["frame_angle"])
        front = rapier_drive.RapierPose(maths, shared_linkage(given).dimensions, stand, 0).relative
        quantities |= {"front_x": front.x, "front_y": front.y}
        given = given._replace(values={**values, **quantities})
        if STROKE in called:
            farthest = values["phi_stroke"] if "phi_stroke" in values else values.get(HAND_OVER, 0)
            quantities[STROKE] = self.pose(maths, given, Node(farthest, {})).q2
        if TURNS in called:
            hints = [values[name] for name in itertools.takewhile(values.__contains__, map(_turn, itertools.count()))]
            quantities[TURNS] = tuple(
                turning_points.followed(lambda phi: self._rates(maths, given, phi), hint) for hint in hints
            )
        return quantities

    def _rates(self, maths: Maths, given: Given, phi: Number) -> tuple[Number, Number, Number]:
        pose = self.pose(maths, given, Node(phi, {}))
        return pose.q1, pose.q2, pose.q3

    def pose(self, maths: Maths, given: Given, node: Node) -> HeadPose:
        """Pose at crank angles φ1, rad."""
        values = given.values
        stand = rapier_drive.Stand(values["beta"], values["frame_angle"])
        joints = rapier_drive.RapierPose(maths, shared_linkage(given).dimensions, stand, node.phi)
        return HeadPose(
            joints, Vector(values["front_x"], values["front_y"]), values.get("speed"), values.get("omega_dot")
        )

    def hints(self, given: Given, called: Collection[str]) -> dict[str, float]:
        """Crank angles at which the head turns, first turns outwards, and is farthest, where their names are called."""
        if not {TURNS, STROKE} & set(called):
            return {}

        def slope(phi: Floats) -> Number:
            return self.pose(systems.numpy(), given, Node(phi, {})).q1

        turns = turning_points.turns(slope)
        hints = {_turn(k): angle for k, angle in enumerate(turns)} if TURNS in called else {}
        if STROKE in called and "phi_stroke" not in given.values:
            travels = {angle: float(self.pose(systems.FLOAT, given, Node(angle, {})).q) for angle in turns}
            hints[HAND_OVER] = max(travels, key=travels.__getitem__, default=0.0)
        return hints

    def still(self, maths: Maths, given: Given, event: str, switch: Values) -> HeadPose:
        """Pose at front dead centre, where φ1 counts from."""
        return self.pose(maths, given, Node(0 * maths.pi, switch))

    def events(self, maths: Maths, given: Given) -> dict[str, Number]:
        """Both dead centres of the sley, rad."""
        centres = shared_linkage(given).centres
        return {"front dead centre": 0, "rear dead centre": maths.pi + centres.beta_r - centres.beta}


def _turn(k: int) -> str:
    return f"turn {k}"


def _arc(sides: tuple[float, ...], angle: float, corners: tuple[float, ...]) -> float:
    """Side on whose dwell arc a crank angle lies, 0 for neither; corners: the arcs' outer ends."""
    for side, end in zip(sides, corners, strict=False):
        inside = angle % (2 * math.pi) if side == AFTER else -angle % (2 * math.pi)
        if inside < abs(end):
            return side
    return 0.0


def dwells(arcs: tuple[tuple[float, str], ...]) -> Arcs:
    """Dwells' stretches; arcs: side, and the name of the value that is the dwell there."""

    def ends(maths: Maths, given: Given) -> tuple[Number, ...]:
        angles = tuple(given.values[name] if side == AFTER else -given.values[name] for side, name in arcs)
        return (*angles, 0) if angles else ()

    return Arcs(DWELL, ends, functools.partial(_arc, tuple(side for side, _ in arcs)), arcs)


def _at_stroke(at: Instant) -> HeadPose:
    """Pose at the hand-over."""
    return at.model.kinematics.pose(at.maths, at.given, Node(at.values["phi_stroke"], {}))  # type: ignore[return-value]


QUANTITIES: dict[str, CycleQuantity] = {
    "peak_acceleration": CycleQuantity(lambda at: at.pose.q2),
    "peak_jerk": CycleQuantity(lambda at: at.pose.q3),
    "S": CycleQuantity(lambda at: at.pose.q, figure=False),
    "S_1": CycleQuantity(lambda at: at.pose.q1, figure=False),
    "jerk_square": CycleQuantity(lambda at: at.pose.q3**2, figure=False),
    "miss_square": CycleQuantity(lambda at: (at.pose.q - at.node.switch["datum"]) ** 2, figure=False),
    "dwell_travel": CycleQuantity(lambda at: at.pose.q / at.values["s_dwell"], figure=False),
}
TAPE_FORCE = {"tape_force": CycleQuantity(lambda at: at.force)}
"""Quantities of the motion, and the one of the tape that loads give, SI."""
LOADED = (*TAPE_FORCE, drive.TORQUE, drive.POWER)
"""Figures that loads give."""

ROWS: dict[str, DesignRow] = {
    "swing": DesignRow(lambda at: shared_linkage(at.given).centres.swing),
    "theta": DesignRow(lambda at: shared_linkage(at.given).centres.theta),
    "phi_stroke": DesignRow(lambda at: at.values["phi_stroke"], ("phi_stroke",)),
    "rest": DesignRow(lambda at: _at_stroke(at).q1, ("phi_stroke",)),
    "turning": DesignRow(lambda at: _at_stroke(at).q2, ("phi_stroke",)),
    "stroke_short": DesignRow(lambda at: _at_stroke(at).q - at.values["stroke"], ("phi_stroke", "stroke")),
    "reach": DesignRow(lambda at: _at_stroke(at).q, ("phi_stroke",)),
    "dwell": DesignRow(lambda at: at.values["dwell"], ("dwell",)),
    "dwell_rest": DesignRow(lambda at: at.maths.pi - at.values["dwell"], ("dwell",)),
}
"""Figures and rows of single positions and of the sley four-bar, SI."""


def jerk_mean() -> Integral:
    """Mean square of the head's jerk over the turn."""
    angles = tuple(2 * math.pi * k / JERK_NODES for k in range(JERK_NODES))
    return Integral("jerk_mean_square", "rms_jerk", "jerk_square", angles=angles, data=(0.0,) * JERK_NODES)


def match_mean(angles: tuple[float, ...], travels: tuple[float, ...]) -> Integral:
    """Mean square of the head's distance from a table of crank angles, rad, and travels, m."""
    return Integral("match_mean_square", "match_rms", "miss_square", angles=angles, data=travels)


@functools.lru_cache(maxsize=64)
def model(
    effects: tuple[Effect, ...],
    words: tuple[tuple[str, str, str], ...],
    known: frozenset[str],
    arcs: tuple[tuple[float, str], ...] = (),
    means: tuple[Integral, ...] = (),
) -> JobModel:
    """Drive with effects; arcs: dwells with limits; means: means that a target reads."""
    driven = drive.quantities(effects, known)
    quantities = QUANTITIES | (TAPE_FORCE if driven else {}) | driven
    stretches = (dwells(arcs),) if arcs else ()
    return JobModel(RapierDrive(), effects, words, quantities, ROWS, stretches, means, known=known)


SLEY_MARGINS = RapierDrive().groups["sley_"].margins
CLOSES = RapierDrive().groups[""].closes
"""Margins of the sley's dyad, and those of the five-bar's by phrase, each with its whole-cycle row: at most 1."""

# What is read off the head's travel, refined, never off a grid: stroke, dwells, turning points.

STEPS, FARTHEST, LAST = 6, 1e-3, 1e-15
"""Newton's steps from a sampled extreme, which is right to 1e-8; rad beyond which a step leads elsewhere, and that end
them."""


def polished_turn(sampler: Sampler, derivatives: tuple[str, str], angle: float) -> float:
    """Crank angle, rad, of a turning point after Newton's method from nearby.

    derivatives: quantities that are the first and the second derivative in the crank angle.
    """
    for _ in range(STEPS):
        slope, bend = sampler.at_angle(derivatives, angle)
        step = slope / bend if bend else 0.0
        if abs(step) > FARTHEST:
            return angle
        angle -= step
        if abs(step) < LAST:
            break
    return angle


SAMPLES = 720
TOUCHES = 1e-9
"""Share of s_dwell by which a travel that only touches it may exceed it: less than any limit's tolerance."""


@dataclass(frozen=True)
class TravelReading:
    """stroke, m, reached at crank angle phi_stroke; dwells after and before front dead centre, rad.

    Of one drive, or of many.
    """

    stroke: Number
    phi_stroke: Number
    dwell_after: Number
    dwell_before: Number


def read(sampler: Sampler) -> TravelReading:
    """Stroke and dwells of a sampled drive. Raises ValueError where it does not turn all round."""
    turns = sampler.extremes("S")
    if not turns or not all(math.isfinite(extreme.value) for extreme in turns):
        raise ValueError("the drive does not assemble all round")
    outward = max(turns, key=lambda extreme: extreme.value)
    stroke, phi = 0.0, 0.0
    if outward.value > 0.0:
        phi = polished_turn(sampler, ("S_1", "peak_acceleration"), sampler.angle(outward))
        stroke = sampler.at_angle(("S",), phi)[0]
    room = sampler.given.values.get("s_dwell")
    if room is None:
        return TravelReading(stroke, phi % TURN, math.nan, math.nan)
    extremes = [sampler.angle(extreme) for extreme in turns]
    after, before = (_dwell(sampler, extremes, float(room), side) for side in (1, -1))
    return TravelReading(stroke, phi % TURN, after, before)


def _dwell(sampler: Sampler, extremes: list[float], room: float, side: int) -> float:
    """Crank angle from front dead centre, on one side, over which |S| stays within `room` (m)."""
    even = np.linspace(0.0, TURN, SAMPLES + 1)
    angles = np.unique(np.concatenate([even, np.mod(side * np.array(extremes), TURN)]))

    (travels,) = sampler.quantities(("S",), Node(side * angles, {}))
    sizes = np.abs(travels)
    out = np.flatnonzero(sizes > room * (1 + TOUCHES))
    if not out.size:
        return TURN
    inside = np.flatnonzero(sizes[: out[0]] <= room)
    low, high = float(angles[inside[-1]]) if inside.size else 0.0, float(angles[out[0]])
    return crossing(lambda turned: abs(sampler.at_angle(("S",), side * turned)[0]) - room, low, high)


BATCH_STEPS = 3
"""Newton's steps from a refined extreme of many drives, which is right to 1e-6."""


def read_many(machines: "Machines") -> TravelReading:
    """Stroke and dwells of many drives at once, (machines,); no number where one does not turn all round."""
    tops = machines.tops("S", signed=True)
    phi = machines.angles(tops)
    for _ in range(BATCH_STEPS):
        slope, bend = machines.at_angles(("S_1", "peak_acceleration"), phi)
        step = slope / bend
        phi = phi - np.where(np.abs(step) <= FARTHEST, step, 0.0)
    (stroke,) = machines.at_angles(("S",), phi)
    still = tops.value <= 0.0
    stroke, phi = np.where(still, 0.0, stroke), np.where(still, 0.0, phi)
    room = machines.values.get("s_dwell")
    if room is None:
        return TravelReading(stroke, phi % TURN, math.nan, math.nan)
    after, before = (machines.leaving("S", "S_1", room, side, TOUCHES) for side in (1, -1))
    return TravelReading(stroke, phi % TURN, after, before)
