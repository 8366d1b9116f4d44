"""What a certificate says, and a proof of all designs: plain records."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from loomopt.model.limits import Limit
from loomopt.model.objectives import Objective, Sought
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import ROUNDED
from loomopt.solving.certificate.multiplier_set import MultiplierSet


class Level(NamedTuple):
    """The KKT residuals of one objective; held: the multiplier of the objectives before it.

    price: the largest multiplier of a limit, dearest: that limit's name.
    """

    objective: str
    stationarity: float
    complementarity: float
    held: float
    price: float = 0.0
    dearest: str = ""


class Binding(NamedTuple):
    """A limit that binds, and the fall of the first objective it moves per unit it is loosened (SI)."""

    limit: Limit
    side: int
    objective: Objective
    worth: float


@dataclass(frozen=True)
class JointBinding:
    """Limits that are worth more together than each alone, as where extremes tie.

    bindings: one of each limit, with its worth alone, SI; costs: (limits, rows), the multipliers that count for each
    limit, times the fall of the objective's figure per SI unit; multipliers: all that balance the slopes.
    """

    bindings: tuple[Binding, ...]
    costs: Floats = field(compare=False, repr=False)
    multipliers: MultiplierSet = field(compare=False, repr=False)

    def worth(self, steps: Sequence[float]) -> float:
        """Fall of the objective's figure, SI, where each limit is loosened by its step, SI, in proportion."""
        return self.multipliers.least(np.array(steps) @ self.costs)


def worth_of(bindings: Sequence[Binding]) -> float:
    """Return what all rows of a limit are worth together for the first objective that the first of them moves, SI."""
    return sum(binding.worth for binding in bindings if binding.objective == bindings[0].objective)


class FrameRow(NamedTuple):
    """A row that stops an optimum, by what is the same of it at its neighbours.

    level: whether it is a piece of an objective, else of a limit; place: of either in the program; side: the limit's
    sign; piece, u: where it stands in the cycle, None of no node; signed: whether the quantity's value counts.
    """

    level: bool
    place: int
    reads: str
    sign: float
    side: int = 0
    piece: int | None = None
    u: float | None = None
    signed: bool = False

    @property
    def kind(self) -> tuple[object, ...]:
        """What must be the same of two optima for a way between them."""
        return *self[:6], self.u if self.u in (0.0, 1.0) else None


@dataclass(frozen=True)
class Certificate:
    """What was verified of a design; reasons say why it did not pass."""

    passed: bool
    reasons: tuple[str, ...]
    levels: tuple[Level, ...]
    feasibility: float
    violation: float
    minimum: bool
    unique: bool
    binding: tuple[Binding, ...] = ()
    by: str = "40 digits"
    """Where its slopes come from: "jets" or "40 digits"."""
    clear: bool = True
    """Whether every figure that decides is far enough from its threshold for that."""
    whole_cycle: str = "refined"
    """How whole-cycle values are held between points: "refined", "bounded" or "proven"."""
    settled: tuple[str, ...] = field(default=())
    correction: Mapping[str, float] = field(default_factory=dict)
    """Newton's step, SI, toward the stationary point nearby; empty where there is no curvature to follow."""
    step: float = 0.0
    """The length of that step, in natural sizes."""
    level: tuple[Mapping[str, float], ...] = ()
    """Directions, in natural sizes and orthonormal, along which nothing curves at the last level that was judged."""
    change: Level | None = None
    """The residuals of least change from today, where that was a level of its own."""
    frame: tuple[FrameRow, ...] = field(default=(), repr=False)
    """What stops it: limits that are touched, objectives that vanish, the pieces that the level which chooses weighs;
    nothing where levels before that one do not vanish, for then it hangs on how they curve."""
    open: tuple[str, ...] = ()
    """Variables, as a designer calls them, that are left as they came, though others are as good."""
    bind_together: tuple[JointBinding, ...] = field(default=(), repr=False)
    """Limits that are worth more together than each alone."""
    prices_unique: bool = True
    """Whether every limit has one price: what it is worth to loosen it a little is what tightening it costs."""

    @property
    def choices(self) -> tuple[str, ...]:
        """What chose among equally good designs, and what was left open."""
        return (*self.settled, *([f"open: {', '.join(self.open)}"] if self.open else []))

    @property
    def priced(self) -> tuple[tuple[Binding, ...], ...]:
        """The limits that bind: all rows of each limit and side together."""
        groups: dict[tuple[str, int], tuple[Binding, ...]] = {}
        for binding in self.binding:
            key = binding.limit.name, binding.side
            groups[key] = (*groups.get(key, ()), binding)
        return tuple(groups.values())

    @property
    def error(self) -> float:
        """Estimate of the relative error of what the answer says, in natural sizes.

        What limits are exceeded by, what lies between points, prices where nothing touches, and how far Newton's
        method would still move the design.
        """
        amiss = max((level.complementarity for level in self.levels), default=0.0)
        return max(self.feasibility, self.violation, amiss, self.step, ROUNDED)

    @property
    def residual(self) -> float:
        """The largest KKT residual of all levels."""
        return max((max(level.stationarity, level.complementarity) for level in self.levels), default=0.0)


class GlobalLevel(NamedTuple):
    """What is shown of one objective at all admissible designs that are as good at the levels before it.

    objective: its figure; sense: what of it is sought; best: the answer's, bound: what no design is below, or above
    where the most is sought, SI; gap: between them, relative; band: by how much designs may be worse than `best` and
    still be asked at later levels, SI; proven: whether the gap is the one that was asked for.
    """

    objective: str
    sense: Sought
    best: float
    bound: float
    gap: float
    band: float
    proven: bool


class GlobalBound(NamedTuple):
    """What is proven of all admissible designs; boxes, seconds: what it took; why: why it is not proven."""

    levels: tuple[GlobalLevel, ...]
    boxes: int
    seconds: float
    why: str = ""

    @property
    def proven(self) -> bool:
        """Whether no admissible design is better, level by level, by more than the gap that was asked for."""
        return not self.why

    @property
    def gap(self) -> float:
        """The gap of the level that has come least far, relative; infinite without a bound."""
        return max((level.gap for level in self.levels), default=math.inf)

    def as_dict(self) -> dict[str, Any]:
        """Return the object `solve --json` prints."""
        return {
            "proven": self.proven,
            "gap": self.gap if math.isfinite(self.gap) else None,
            "bound": {level.objective: level.bound for level in self.levels if math.isfinite(level.bound)},
            "band": {level.objective: level.band for level in self.levels[:-1]},
            "boxes": self.boxes,
            "seconds": self.seconds,
            "why": self.why or None,
        }
