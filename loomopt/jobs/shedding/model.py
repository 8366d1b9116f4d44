"""The shedding model: a heald frame between its cam and its return spring [Qiu21].

q = X, the frame's displacement, down positive, 0 with the shed open upward; Q = N, the cam force on the frame, which
must never fall below N_min; cam torque = N X'. Cam angle θ from the beginning of the rise.
"""

import functools
import math
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from loomopt.base.records import lazy
from loomopt.maths.periodic_cubic import interval_at
from loomopt.maths.systems import Maths, Number
from loomopt.maths.turning_points import followed
from loomopt.model import drive
from loomopt.model.kinematics import Arcs, DerivedChain, Group
from loomopt.model.model import CycleQuantity, DesignRow, Instant, JobModel
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node
from loomopt.physics.effects.kinds import Effect, Inputs, Load, Motion
from loomopt.physics.effects.shedding import FramePose as Frame
from loomopt.physics.mechanisms.cam_follower import Contact, Follower
from loomopt.physics.mechanisms.cam_laws import LawDerivatives
from loomopt.physics.mechanisms.cam_motion import CamLaw, Spline, middle, mirrored, piece_at, segment_at
from loomopt.physics.schema import Table, Values

FOLLOWER = ("arm", "centre_distance", "base_radius", "roller_radius", "arm_swing")
RISE, FAR_DWELL, RETURN, NEAR_DWELL = range(4)
"""Numbers of the cam's segments in order."""
DWELLS = FAR_DWELL, NEAR_DWELL
LEAST, MOST = -1, 1
"""End of the range of forces in a dwell that are not determined: the least cam force, or the largest."""
SEGMENT, LAW = "segment", "law"
HALF_OPEN = "half_open"
"""The event of a half open shed, which effects may call in: X = h/2 on the rise and on the return."""
MIDDLE, MIDDLE_PIECE = "half open u", "half open piece"


class NoTable(Table):
    """No values of its own: K1 and X0 are the mechanism's."""


def spring_force(at: Inputs[Frame]) -> Number:
    """K1 (X + X0), N [Qiu21, eq 4]; K1 is of both springs together."""
    return at.values["K1"] * (at.pose.q + at.values["X0"])


RETURN_SPRING = Load(
    name="return_spring",
    summary="the return spring",
    table=NoTable,
    acts="output",
    force=spring_force,
    reads=("K1", "X0"),
)
"""The spring is always on: no table of a scene turns it on."""


@dataclass(frozen=True)
class FrameMotion(Motion):
    """The heald frame at cam angles θ, rad, any shape.

    segment: data of the node; u: the law's argument, 1 with the shed open
    downward; law: s(u) and derivatives; rate: du/dθ; worst: LEAST or MOST, for what a dwell leaves open.
    """

    maths: Maths
    theta: Number
    travel: Number
    segment: Number
    u: Number
    rate: Number
    law: LawDerivatives
    worst: Number
    omega: Number
    omega_dot: Number = None

    @property
    def phi(self) -> Number:
        """Cam angle θ, rad."""
        return self.theta

    @lazy
    def lowered(self) -> Number:
        """X/h, exactly 1 and 0 in the dwells."""
        return self.maths.choose(self.segment, (self.law.s, 1, self.law.s, 0))

    @property
    def direction(self) -> Number:
        """Sign of X˙, `worst` in the dwells."""
        return self.maths.choose(self.segment, (1, self.worst, -1, self.worst))

    @lazy
    def q(self) -> Number:
        """X, m."""
        return self.travel * self.lowered

    @lazy
    def q1(self) -> Number:
        """X', m/rad."""
        return self.travel * self.law.s1 * self.rate

    @lazy
    def q2(self) -> Number:
        """X'', m/rad²."""
        return self.travel * self.law.s2 * self.rate**2

    @lazy
    def q3(self) -> Number:
        """Third derivative of X, m/rad³."""
        return self.travel * self.law.s3 * self.rate**3

    def contact(self, follower: Follower) -> Contact:
        """Roller and cam at this position."""
        swing = follower.arm_swing
        return Contact(
            self.maths,
            follower,
            swing * self.lowered,
            swing * self.law.s1 * self.rate,
            swing * self.law.s2 * self.rate**2,
        )


@dataclass(frozen=True)
class CamFrame:
    """The frame's motion. law: the cam law; dwells: whether far and near dwell are there at all."""

    law: CamLaw
    dwells: tuple[bool, bool] = (True, True)

    @property
    def structure(self) -> Hashable:
        """The law's own, and which segments there are."""
        return "shedding", self.law.key, self.dwells

    @property
    def groups(self) -> Mapping[str, Group]:
        """None: a cam that passes its follower's check has no singular position."""
        return {}

    @lazy
    def segments(self) -> tuple[int, ...]:
        """The segments that are there."""
        return tuple(k for k, there in enumerate((True, self.dwells[0], True, self.dwells[1])) if there)

    @lazy
    def arcs(self) -> tuple[Arcs, ...]:
        """The segments, and the law's pieces."""
        return (
            Arcs(SEGMENT, self._begins, functools.partial(segment_at, self.segments)),
            Arcs(LAW, lambda maths, given: mirrored(given.values, self.law.breaks), piece_at, chain=self._chain),
        )

    @lazy
    def _chain(self) -> DerivedChain | None:
        """The knots of a spline law."""
        if not isinstance(self.law, Spline):
            return None
        inner = range(1, self.law.intervals)
        stations = tuple({SEGMENT: float(segment), LAW: float(k)} for segment in (RISE, RETURN) for k in inner)
        return DerivedChain(frozenset(self.law.names), self.law.recurrent, self.law.followed, stations)

    def _begins(self, maths: Maths, given: Given) -> tuple[Number, ...]:
        begins = (0, *(given.values[f"begin.{name}"] for name in ("far", "return", "near")))
        return tuple(begins[k] for k in self.segments)

    @lazy
    def breaks(self) -> frozenset[str]:
        """The half open shed, where it is one of the law's own breaks."""
        return frozenset((HALF_OPEN,) if self.law.symmetric and Fraction(1, 2) in self.law.breaks else ())

    def spans(self, values: Values) -> dict[str, tuple[float, float]]:
        """Cam angles, rad, between which each segment that is there lasts, by name; values: floats."""
        ends = (0.0, *(float(values[f"begin.{name}"]) for name in ("far", "return", "near")), 2 * math.pi)
        names = ("rise", "far dwell", "return", "near dwell")
        return {name: (ends[k], ends[k + 1]) for k, name in enumerate(names) if ends[k + 1] > ends[k]}

    def ends(self, values: Values) -> tuple[float, float]:
        """Cam angle, rad, with the frame at its lowest X, and one at its highest; values: floats."""
        return 0.0, float(values["begin.far"] + values["begin.return"]) / 2

    def linkage(self, maths: Maths, values: Values) -> None:
        """No values: poses read the numbers."""

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> dict[str, Number]:
        """Angles where segments begin, the law's knots, and where the shed is half open if called in."""
        values = given.values
        far = values["rise"]
        turning = far + values["far_dwell"]
        near = turning + values["return"]
        begins = {"begin.far": far, "begin.return": turning, "begin.near": near, "near_dwell": 2 * maths.pi - near}
        knots = self.law.prepared(maths, values)
        if HALF_OPEN in called:
            read = {**knots, **values, **begins}
            begins[HALF_OPEN] = mirrored(read, [self._middle(maths, read)])
        return {**begins, **knots}

    def _middle(self, maths: Maths, values: Values) -> Number:
        """U where s = 1/2; of a law that is not symmetric it moves with the law, from a hint."""
        if self.law.symmetric or MIDDLE not in values:
            return Fraction(1, 2)

        def rates(u: Number) -> tuple[Number, Number, Number]:
            there = self.law.at(maths, values, u, values[MIDDLE_PIECE])
            return 2 * there.s - 1, 2 * there.s1, 2 * there.s2

        return followed(rates, values[MIDDLE])

    def hints(self, given: Given, called: Collection[str]) -> dict[str, float]:
        """Cam angle at which a law that is not symmetric passes the middle of the shed, and its piece."""
        if HALF_OPEN not in called or self.law.symmetric:
            return {}
        return dict(zip((MIDDLE, MIDDLE_PIECE), middle(self.law, given.values), strict=True))

    def pose(self, maths: Maths, given: Given, node: Node) -> FrameMotion:
        """Pose at cam angles θ, rad; switches: segment, the law's piece, worst."""
        values, theta = given.values, node.phi
        segment, piece = node.switch[SEGMENT], node.switch[LAW]
        u = maths.choose(segment, (theta / values["rise"], 1, (values["begin.near"] - theta) / values["return"], 0))
        rate = maths.choose(segment, (1 / values["rise"], 0, -1 / values["return"], 0))
        law = self.law.at(maths, values, u, piece)
        worst = node.switch.get("worst", LEAST)
        speeds = values.get("speed"), values.get("omega_dot")
        return FrameMotion(maths, theta, values["travel"], segment, u, rate, law, worst, *speeds)

    def still(self, maths: Maths, given: Given, event: str, switch: Values) -> FrameMotion:
        """Pose at the beginning of the rise, from ahead of it."""
        return self.pose(maths, given, Node(0, {**switch, SEGMENT: 0.0, LAW: 0.0}))

    def events(self, maths: Maths, given: Given) -> dict[str, Number]:
        """Cam angles at which the segments begin, rad."""
        names = ("begin.far", "begin.return", "begin.near")
        return {"begin.rise": 0, **{name: given.values[name] for name in names}}


MOVES = {RISE: "rise", FAR_DWELL: "dwell", RETURN: "return"}
"""Names of the kinds of segments."""


class Segment(NamedTuple):
    """A segment of a motion in several: its cam law, None in a dwell, and whether X grows."""

    law: CamLaw | None
    rises: bool = False

    @property
    def kind(self) -> int:
        """The one of the four segments whose formulas are its own."""
        return FAR_DWELL if self.law is None else RISE if self.rises else RETURN


def height(k: int) -> str:
    """Name of X, m, at the end of segment k; the last one is also that at the beginning."""
    return f"segments.{k + 1}.to"


def width(k: int) -> str:
    """Name of the cam angle, rad, that segment k takes."""
    return f"segments.{k + 1}.angle"


@dataclass(frozen=True)
class ProgramMotion(FrameMotion):
    """The frame in a motion of several segments: X = low + span s(u), whose span is 0 in a dwell."""

    low: Number = None
    span: Number = None

    @lazy
    def q(self) -> Number:
        """X, m."""
        return self.low + self.span * self.law.s

    @lazy
    def lowered(self) -> Number:
        """X/h."""
        return self.q / self.travel

    @lazy
    def q1(self) -> Number:
        """X', m/rad."""
        return self.span * self.law.s1 * self.rate

    @lazy
    def q2(self) -> Number:
        """X'', m/rad²."""
        return self.span * self.law.s2 * self.rate**2

    @lazy
    def q3(self) -> Number:
        """Third derivative of X, m/rad³."""
        return self.span * self.law.s3 * self.rate**3

    def contact(self, follower: Follower) -> Contact:
        """Roller and cam at this position."""
        swing = follower.arm_swing / self.travel
        return Contact(self.maths, follower, swing * self.q, swing * self.q1, swing * self.q2)


@dataclass(frozen=True)
class CamProgram(CamFrame):
    """The frame's motion in several segments, in order from cam angle 0; their angles and heights are given numbers."""

    moves: tuple[Segment, ...] = ()

    @property
    def structure(self) -> Hashable:
        """Each segment's law and direction."""
        return "shedding", tuple((move.law.key if move.law else None, move.rises) for move in self.moves)

    @lazy
    def segments(self) -> tuple[int, ...]:
        """The kinds of segments that are there."""
        return tuple(sorted({move.kind for move in self.moves}))

    def spans(self, values: Values) -> dict[str, tuple[float, float]]:
        """Cam angles, rad, between which each segment lasts, by place and kind; values: floats."""
        begins = [float(values[f"begin.{k + 1}"]) for k in range(len(self.moves))]
        names = [f"{k} {MOVES[move.kind]}" for k, move in enumerate(self.moves, 1)]
        return dict(zip(names, zip(begins, [*begins[1:], 2 * math.pi], strict=True), strict=True))

    def ends(self, values: Values) -> tuple[float, float]:
        """Cam angles, rad, where X is first at its lowest and at its highest; values: floats."""
        tops = [float(values[height(k)]) for k in range(len(self.moves))]
        begins = [begin for begin, _ in self.spans(values).values()]
        at = dict(zip([*tops[-1:], *tops[:-1]][::-1], begins[::-1], strict=True))
        return at[min(tops)], at[max(tops)]

    @property
    def breaks(self) -> frozenset[str]:
        """No event is a break of a law: the half open shed is known only where no law breaks there."""
        return frozenset()

    @lazy
    def stretches(self) -> tuple[tuple[int, int], ...]:
        """The segment, and the piece of its law, of each stretch between corners in order."""
        stretches = []
        for k, move in enumerate(self.moves):
            count = len(move.law.breaks) + 1 if move.law else 1
            pieces = range(count) if move.rises else reversed(range(count))
            stretches += [(k, piece) for piece in pieces]
        return tuple(stretches)

    @lazy
    def arcs(self) -> tuple[Arcs, ...]:
        """The segments with the pieces of their laws."""
        return (Arcs(SEGMENT, self._begins, interval_at),)

    def _begins(self, maths: Maths, given: Given) -> tuple[Number, ...]:
        values, angles = given.values, []
        for k, move in enumerate(self.moves):
            begin, whole = values[f"begin.{k + 1}"], values[width(k)]
            angles.append(begin)
            shares = move.law.breaks if move.law else ()
            turned = shares if move.rises else tuple(1 - share for share in reversed(shares))
            angles += [begin + whole * share.numerator / share.denominator for share in turned]
        return tuple(angles)

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> dict[str, Number]:
        """Angles where segments begin, rad, and the numbers of their laws."""
        values, angle = given.values, 0
        numbers: dict[str, Number] = {}
        for k, move in enumerate(self.moves):
            numbers[f"begin.{k + 1}"] = angle
            angle = angle + values[width(k)]
            numbers |= move.law.prepared(maths, values) if move.law else {}
        if HALF_OPEN in called:
            # Of one move down and one up, each of a law that is symmetric.
            down, up = (next(k for k, move in enumerate(self.moves) if move.kind == kind) for kind in (RISE, RETURN))
            numbers[HALF_OPEN] = tuple(numbers[f"begin.{k + 1}"] + values[width(k)] / 2 for k in (down, up))
        return numbers

    def hints(self, given: Given, called: Collection[str]) -> dict[str, float]:
        """No values: every event has a formula."""
        return {}

    def pose(self, maths: Maths, given: Given, node: Node) -> FrameMotion:
        """Pose at cam angles θ, rad; switches: the stretch, by `stretches`; worst."""
        values, theta = given.values, node.phi
        place = node.switch[SEGMENT]
        segments = [k for k, _ in self.stretches]

        def chosen(numbers: Sequence[Number]) -> Number:
            """Number of the segment."""
            return maths.choose(place, [numbers[k] for k in segments])

        count = len(self.moves)
        tops = [values[height(k)] for k in range(count)]
        lows = [tops[k - 1] if move.rises or not move.law else tops[k] for k, move in enumerate(self.moves)]
        spans = [
            0 * tops[k] if not move.law else tops[k] - tops[k - 1] if move.rises else tops[k - 1] - tops[k]
            for k, move in enumerate(self.moves)
        ]
        begins, whole = [values[f"begin.{k + 1}"] for k in range(count)], [values[width(k)] for k in range(count)]
        sign = chosen([1 if move.rises else -1 for move in self.moves])
        # From the beginning of a segment in which X grows, back from the end of one in which it falls.
        since = [begin if move.rises else begin + w for move, begin, w in zip(self.moves, begins, whole, strict=True)]
        still = chosen([0 if move.law else 1 for move in self.moves])
        rate = sign * (1 - still) / chosen(whole)
        u = (theta - chosen(since)) * rate
        speeds = values.get("speed"), values.get("omega_dot")
        kind, worst = chosen([move.kind for move in self.moves]), node.switch.get("worst", LEAST)
        law = self._law(maths, given, place, u)
        arguments = (maths, theta, values["travel"], kind, u, rate, law, worst, *speeds)
        return ProgramMotion(*arguments, low=chosen(lows), span=chosen(spans))

    def _law(self, maths: Maths, given: Given, place: Number, u: Number) -> LawDerivatives:
        """Law that holds, of all that there are."""
        laws = list(dict.fromkeys(move.law for move in self.moves if move.law))
        which = [laws.index(move.law) if move.law else 0 for move in self.moves]
        values = []
        for number, law in enumerate(laws):
            piece = maths.choose(place, [piece if which[k] == number else 0 for k, piece in self.stretches])
            values.append(law.at(maths, given.values, u, piece))
        if len(values) == 1:
            return values[0]
        return LawDerivatives(
            *(
                maths.choose(place, [column[which[k]] for k, _ in self.stretches])
                for column in zip(*values, strict=True)
            )
        )

    def still(self, maths: Maths, given: Given, event: str, switch: Values) -> FrameMotion:
        """Pose at the beginning of the first segment."""
        return self.pose(maths, given, Node(0, {**switch, SEGMENT: 0.0}))

    def events(self, maths: Maths, given: Given) -> dict[str, Number]:
        """Cam angles at which the segments begin, rad."""
        return {f"begin.{k + 1}": given.values[f"begin.{k + 1}"] for k in range(len(self.moves))}


def follower(values: Values) -> Follower:
    """Roller follower."""
    return Follower(**{name: values[name] for name in FOLLOWER})


def contact(at: Instant) -> Contact:
    """Roller and cam at an instant."""
    geometry: Contact = at.pose.contact(follower(at.values))
    return geometry


def moving(at: Instant, value: Number) -> Number:
    """Value in the moves, 0 in the dwells."""
    return at.maths.choose(at.pose.segment, (value, 0, value, 0))


QUANTITIES: dict[str, CycleQuantity] = {
    "cam_force": CycleQuantity(lambda at: at.switched(worst=MOST).force, signed=True, bounded=True, loaded=True),
    "lift": CycleQuantity(lambda at: -at.force, figure=False, signed=True, bounded=True, loaded=True),
    "law_acceleration": CycleQuantity(lambda at: moving(at, at.pose.law.s2), bounded=True),
    "law_fall": CycleQuantity(lambda at: moving(at, -at.pose.law.s1), figure=False, signed=True),
}
LIFT, AT_REST, FASTEST = "lift", "contact at rest", "contact at contact_speed"
SPEED_ROWS: dict[str, CycleQuantity] = {
    AT_REST: QUANTITIES["lift"]._replace(formula=lambda at: -at.at_speed(0).force),
    FASTEST: QUANTITIES["lift"]._replace(formula=lambda at: -at.at_speed(at.values["contact_speed"]).force),
}
"""Rows that a limit on the speed up to which contact holds reads, SI."""
FOLLOWED: dict[str, CycleQuantity] = {
    "pressure_angle": CycleQuantity(lambda at: contact(at).pressure_angle),
    "curvature": CycleQuantity(lambda at: contact(at).curvature, signed=True),
    "concavity": CycleQuantity(lambda at: -contact(at).curvature, signed=True),
    "arm_angle": CycleQuantity(lambda at: contact(at).angle, figure=False),
}
"""Quantities of the frame, and of the cam where the scene gives its dimensions, SI; forces count with their sign."""

ROWS: dict[str, DesignRow] = {
    "K1": DesignRow(lambda at: at.values["K1"]),
    "X0": DesignRow(lambda at: at.values["X0"]),
    "travel": DesignRow(lambda at: at.values["travel"]),
    "spring_stretch": DesignRow(lambda at: at.values["X0"] + at.values["travel"]),
    "spring_force_max": DesignRow(lambda at: at.values["K1"] * (at.values["X0"] + at.values["travel"])),
    "near_dwell": DesignRow(lambda at: at.values["near_dwell"], ("rise",)),
    "speed": DesignRow(lambda at: at.values["speed"], ("speed",)),
    "cam_period": DesignRow(lambda at: 1 / at.values["speed"], ("speed",)),
}
"""Figures and rows of the design alone, SI."""
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


def law_rows(law: CamLaw) -> dict[str, DesignRow]:
    """Rows a spline law must keep: its end, its slope there and at the inner knots, ±s'' at these."""
    if not isinstance(law, Spline):
        return {}
    n = law.intervals

    def reads(name: str, sign: int = 1) -> DesignRow:
        return DesignRow(lambda at: at.values[name] if sign > 0 else -at.values[name])

    rows = {"law_end": reads(law.knot("s", n)), "law_end_slope": reads(law.knot("v", n))}
    rows |= {f"law_slope_{k}": reads(law.knot("v", k)) for k in range(1, n)}
    rows |= {f"law_push_{k}": reads(law.knot("a", k)) for k in range(1, n)}
    return rows | {f"law_pull_{k}": reads(law.knot("a", k), -1) for k in range(1, n)}


@functools.lru_cache(maxsize=64)
def model(
    law: CamLaw,
    dwells: tuple[bool, bool],
    effects: tuple[Effect, ...],
    words: tuple[tuple[str, str, str], ...],
    known: frozenset[str],
    speed_rows: tuple[str, ...] = (),
    moves: tuple[Segment, ...] = (),
) -> JobModel:
    """Frame with return spring and effects; speed_rows: limited rows of SPEED_ROWS; moves: several segments."""
    motion = CamProgram(law, moves=moves) if moves else CamFrame(law, dwells)
    followed = known.issuperset(FOLLOWER)
    partly = JobModel(motion, effects, words).known_in
    driven = {} if partly else drive.quantities((RETURN_SPRING, *effects), known)
    arm = {"the arm stays below 180 deg": ("arm_angle", math.pi)} if followed else {}
    return JobModel(
        motion,
        (RETURN_SPRING, *effects),
        words,
        QUANTITIES | {name: SPEED_ROWS[name] for name in speed_rows} | (FOLLOWED if followed else {}) | driven,
        ROWS | law_rows(law),
        assembled={**arm, "the cam law never falls": ("law_fall", 0.0)},
        known=known,
    )


def frame(model: JobModel) -> CamFrame:
    """Motion of a shedding model."""
    assert isinstance(model.kinematics, CamFrame)
    return model.kinematics
