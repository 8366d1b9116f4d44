"""The shedding job: a heald frame between its cam and its return spring [Qiu21].

q = X, the frame's displacement, down positive, 0 with the shed open upward; Q = N, the cam force on the frame, which
must never fall below N_min; cam torque = N X'. Cam angle θ from the beginning of the rise.
"""

import functools
import math
from collections.abc import Callable, Collection, Hashable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from loomopt import balance
from loomopt.balance import Given
from loomopt.jobs.shedding.pose import LEAST, MOST, FramePose
from loomopt.maths import FLOAT, Maths, Number
from loomopt.mechanisms.cam_follower import Follower
from loomopt.mechanisms.cam_motion import PREFIX, CamLaw, Spline
from loomopt.program.program import Integral
from loomopt.schema import Arcs, Check, Effect, Load, Switched, Values

FOLLOWER = ("arm", "centre_distance", "base_radius", "roller_radius", "arm_swing")
MIDDLE, MIDDLE_PIECE = "middle.u", "middle.piece"


def _segment(present: tuple[int, ...], angle: float, corners: tuple[float, ...]) -> float:
    """Return the segment that a cam angle lies in; corners: where those that are present begin."""
    return float(present[sum(angle >= corner for corner in corners) - 1])


def _piece(angle: float, corners: tuple[float, ...]) -> float:
    """Return the law's piece at a cam angle; corners: its breaks on the rise, then, mirrored, those on the return."""
    half = len(corners) // 2
    return float(sum(angle >= c for c in corners[:half]) - sum(angle >= c for c in corners[half:]))


@dataclass(frozen=True)
class Shedding:
    """The heald frame with the effects a scene calls for.

    loads: the return spring first; law: the cam law; dwells: whether far and near dwell are there at all.
    freed: names of the law's own variables.
    """

    loads: tuple[Load, ...]
    checks: tuple[Check, ...]
    words: tuple[tuple[str, str, str], ...]
    law: CamLaw
    dwells: tuple[bool, bool] = (True, True)
    known: frozenset[str] = field(default=frozenset(), compare=False)
    """Names of scene numbers that are given: figures whose numbers are missing are left out."""

    @functools.cached_property
    def key(self) -> Hashable:
        """What distinguishes this model's formulas from another's."""
        effects = tuple(effect.name for effect in self.effects)
        return "shedding", effects, self.words, self.law.key, self.dwells, self.known

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Loads and checks."""
        return *self.loads, *self.checks

    @functools.cached_property
    def segments(self) -> tuple[int, ...]:
        """The segments that are there."""
        return tuple(k for k, there in enumerate((True, self.dwells[0], True, self.dwells[1])) if there)

    @functools.cached_property
    def switched(self) -> tuple[Switched, ...]:
        """What has corners: the segments, the law's pieces, the middle of the shed, then the loads."""
        segment = Arcs("segment", functools.partial(_segment, self.segments))
        return segment, Arcs("law", _piece), Arcs("middle", _piece), *self.loads

    @property
    def quantities(self) -> tuple[str, ...]:
        """Whole-cycle quantities whose largest value is a figure."""
        follower = ("pressure_angle", "curvature", "concavity") if self.has_follower else ()
        return ("cam_force", "law_acceleration", *follower)

    @property
    def signed(self) -> frozenset[str]:
        """Forces and curvatures count with their sign."""
        return frozenset(("lift", "cam_force", "curvature", "concavity", "law_fall"))

    @property
    def assembly(self) -> dict[str, tuple[str, float]]:
        """The arm stays short of the centre line's far side; the law never falls."""
        arm = {"the arm stays below 180 deg": ("arm_angle", math.pi)} if self.has_follower else {}
        return {**arm, "the cam law never falls": ("law_fall", 0.0)}

    @property
    def bounded(self) -> frozenset[str]:
        """The cam force from below and from above, and the law's acceleration."""
        return frozenset(("lift", "cam_force", "law_acceleration"))

    @property
    def integrals(self) -> tuple[Integral, ...]:
        """No means."""
        return ()

    @functools.cached_property
    def has_follower(self) -> bool:
        """Whether the scene gives the cam's dimensions."""
        return self.known.issuperset(FOLLOWER)

    @functools.cached_property
    def is_level(self) -> bool:
        """Whether the warp's pull is known in the dwells only."""
        return ("warp_tension", "shape", "levels") in self.words

    @functools.cached_property
    def has_middle(self) -> bool:
        """Whether the warp's pull has a corner in the middle of the shed."""
        return ("warp_tension", "shape", "linear") in self.words

    @functools.cached_property
    def _middle_break(self) -> bool:
        """Whether the middle of the shed is one of the law's own breaks."""
        return self.law.symmetric and Fraction(1, 2) in self.law.breaks

    def given(self, maths: Maths, values: Values) -> Given:
        """Return the scene's numbers, the angles where segments begin, the law's knots and the middle of the shed."""
        far = values["rise"]
        turning = far + values["far_dwell"]
        near = turning + values["return"]
        derived = {"begin.far": far, "begin.return": turning, "begin.near": near}
        derived["near_dwell"] = 2 * maths.pi - near
        derived |= self.law.prepared(maths, values)
        found = {**values, **derived}
        if self.has_middle and MIDDLE in values:
            derived["middle"] = self._middle(maths, found)
        own: dict[str, dict[str, Any]] = {effect.name: {} for effect in self.effects}
        for name, value in values.items():
            effect, _, key = name.rpartition(".")
            if effect in own:
                own[effect][key] = value
        for effect, key, word in self.words:
            if effect in own:
                own[effect][key] = word
        return Given({**values, **derived}, own)

    def _middle(self, maths: Maths, values: Values) -> Number:
        """Return the u where s = 1/2: one Newton step from a hint, so that it moves with the law."""
        u = values[MIDDLE]
        there = self.law.at(maths, values, u, values[MIDDLE_PIECE])
        return u - (2 * there.s - 1) / (2 * there.s1)

    def hints(self, given: Given) -> dict[str, float]:
        """Return where a law that is not symmetric passes the middle of the shed, and on which piece."""
        if not self.has_middle or self.law.symmetric:
            return {}
        breaks = [0.0, *map(float, self.law.breaks), 1.0]
        piece = max(k for k, u in enumerate(breaks[:-1]) if self.law.at(FLOAT, given.values, u, k).s < 0.5)
        low, high = breaks[piece : piece + 2]
        for _ in range(60):
            middle = (low + high) / 2
            below = self.law.at(FLOAT, given.values, middle, piece).s < 0.5
            low, high = (middle, high) if below else (low, middle)
        return {MIDDLE: (low + high) / 2, MIDDLE_PIECE: float(piece)}

    def corners(self, maths: Maths, given: Given) -> tuple[tuple[Number, ...], ...]:
        """Return the cam angles, rad, where segments begin, where the law changes, and where the shed is half open."""
        values = given.values
        begins = (0, values["begin.far"], values["begin.return"], values["begin.near"])
        middles: tuple[Number, ...] = ()
        if self.has_middle and not self._middle_break:
            share = values.get("middle")
            middles = self._mirrored(values, [Fraction(1, 2) if share is None else share])
        pieces = self._mirrored(values, self.law.breaks)
        return tuple(begins[k] for k in self.segments), pieces, middles, *[() for _ in self.loads]

    def _mirrored(self, values: Values, shares: Sequence[Any]) -> tuple[Number, ...]:
        """Return the cam angles of arguments u on the rise, then on the return, where u falls from 1 to 0."""
        rise = [_part(values["rise"], share) for share in shares]
        back = [values["begin.near"] - _part(values["return"], share) for share in shares]
        return (*rise, *back)

    def singular(self, given: Given) -> tuple[float, ...]:
        """Return nothing: a cam has no singular position that its follower's check lets pass."""
        return ()

    def implied(self, values: Values) -> dict[str, float]:
        """Return nothing: every variable stands for itself."""
        return {}

    def front_angle(self, given: Given) -> Number:
        """Return 0: the beginning of the rise."""
        return 0.0

    def pose(
        self, maths: Maths, given: Given, theta: Number, switches: Sequence[Number], worst: int = LEAST
    ) -> FramePose:
        """Return the pose at cam angles θ, rad; switches: segment, the law's piece, below the middle, then loads'."""
        values = given.values
        segment, piece, below, *_ = switches
        if self._middle_break:
            pieces = len(self.law.breaks) + 1
            below = maths.choose(piece, [2 * k // pieces for k in range(pieces)])
        u = maths.choose(segment, (theta / values["rise"], 1, (values["begin.near"] - theta) / values["return"], 0))
        rate = maths.choose(segment, (1 / values["rise"], 0, -1 / values["return"], 0))
        law = self.law.at(maths, values, u, piece)
        return FramePose(maths, values["travel"], segment, below, u, rate, law, worst, values.get("speed"))

    def quantity(self, maths: Maths, given: Given, name: str, phi: Number, switches: Sequence[Number]) -> Number:
        """Return a whole-cycle quantity, SI, at cam angle θ = phi, rad."""
        pose = self.pose(maths, given, phi, switches, MOST if name == "cam_force" else LEAST)
        if name in ("lift", "cam_force"):
            force = balance.output_force(maths, self.loads, pose, given, switches[3:])
            return -force if name == "lift" else force
        if name == "law_acceleration":
            return maths.choose(pose.segment, (pose.law.s2, 0, pose.law.s2, 0))
        if name == "law_fall":
            return maths.choose(pose.segment, (-pose.law.s1, 0, -pose.law.s1, 0))
        contact = pose.contact(self.follower(given.values))
        if name == "arm_angle":
            return contact.angle
        if name == "pressure_angle":
            return contact.pressure_angle
        return contact.curvature if name == "curvature" else -contact.curvature

    def follower(self, values: Values) -> Follower:
        """Return the roller follower."""
        return Follower(**{name: values[name] for name in FOLLOWER})

    def static(
        self, maths: Maths, given: Given, front: Sequence[Number], names: Collection[str] | None = None
    ) -> dict[str, Number]:
        """Return figures and rows of the design alone, SI; all it has without names."""
        values = given.values
        rows: dict[str, Callable[[], Number]] = {
            "K1": lambda: values["K1"],
            "X0": lambda: values["X0"],
            "travel": lambda: values["travel"],
            "spring_stretch": lambda: values["X0"] + values["travel"],
            "spring_force_max": lambda: values["K1"] * (values["X0"] + values["travel"]),
            "near_dwell": lambda: values["near_dwell"],
        }
        if "speed" in values:
            rows |= {"speed": lambda: values["speed"], "cam_period": lambda: 1 / values["speed"]}
        if isinstance(self.law, Spline):
            rows |= {name: functools.partial(_spline_row, self.law, values, name) for name in spline_rows(self.law)}
        for check in self.checks:
            own = given.own[check.name]
            rows |= {name: functools.partial(row, maths, values, own) for name, row in check.rows.items()}
        return {name: row() for name, row in rows.items() if names is None or name in names}


def _part(angle: Number, share: Any) -> Number:
    """Return a share of an angle; a fraction without rounding it first."""
    return angle * share.numerator / share.denominator if isinstance(share, Fraction) else angle * share


def spline_rows(law: Spline) -> tuple[str, ...]:
    """Return the rows a spline law must keep: its end, its slope there and at the knots, ±s'' at the knots."""
    knots = range(1, law.intervals)
    return (
        "law_end",
        "law_end_slope",
        *(f"law_slope_{k}" for k in knots),
        *(f"law_{side}_{k}" for side in ("push", "pull") for k in knots),
    )


def _spline_row(law: Spline, values: Values, name: str) -> Number:
    """Return one row of a spline law."""
    n = law.intervals
    if name == "law_end":
        return values[f"{PREFIX}s_{n}"]
    if name == "law_end_slope":
        return values[f"{PREFIX}v_{n}"]
    _, side, knot = name.split("_")
    value = values[f"{PREFIX}{'v' if side == 'slope' else 'a'}_{knot}"]
    return -value if side == "pull" else value
