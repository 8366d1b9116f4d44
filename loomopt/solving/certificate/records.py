"""Records of a certificate and of a global proof."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from loomopt.model.limits import Limit
from loomopt.model.objectives import Objective, ObjectiveSense
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import ROUNDED
from loomopt.solving.certificate.multiplier_set import MultiplierSet


class Level(NamedTuple):
    """KKT residuals of one objective.

    higher_levels: sum of the multipliers of the objectives before it; price: largest multiplier of a limit; dearest:
    name of that limit.
    """

    objective: str
    stationarity: float
    complementarity: float
    higher_levels: float
    price: float = 0.0
    dearest: str = ""


class Binding(NamedTuple):
    """A binding limit, and the fall of the first objective that it moves per unit of loosening (SI)."""

    limit: Limit
    side: int
    objective: Objective
    worth: float


@dataclass(frozen=True)
class JointBinding:
    """Limits that are worth more together than alone, for example at equal extremes.

    bindings: one of each limit, with its worth alone, SI; costs: (limits, rows), mask of each limit's multipliers,
    times the fall of the objective's figure per SI unit; multipliers: all that balance the slopes.
    """

    bindings: tuple[Binding, ...]
    costs: Floats = field(compare=False, repr=False)
    multipliers: MultiplierSet = field(compare=False, repr=False)

    def worth(self, steps: Sequence[float]) -> float:
        """Fall of the objective's figure, SI, when each limit is loosened by its step, SI."""
        return self.multipliers.least(np.array(steps) @ self.costs)


def worth_of(bindings: Sequence[Binding]) -> float:
    """Worth of all rows of a limit together, for the first objective that the first of them moves, SI."""
    return sum(binding.worth for binding in bindings if binding.objective == bindings[0].objective)


class FrameRow(NamedTuple):
    """A row that stops an optimum, by its properties that neighbours share.

    level: whether it is a piece of an objective, else of a limit; place: of either in the program; side: the limit's
    sign; piece, u: place in the cycle, None without a node; signed: whether the value counts, not its magnitude.
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
        """Key that must be equal in two optima for a path between them."""
        return *self[:6], self.u if self.u in (0.0, 1.0) else None


@dataclass(frozen=True)
class Certificate:
    """Results of the checks of a design; `reasons`: of a failure."""

    passed: bool
    reasons: tuple[str, ...]
    levels: tuple[Level, ...]
    feasibility: float
    violation: float
    minimum: bool
    unique: bool
    binding: tuple[Binding, ...] = ()
    by: str = "40 digits"
    """Kind of derivatives: "jets" or "40 digits"."""
    clear: bool = True
    """Whether every quantity is far enough from its threshold for these derivatives."""
    whole_cycle: str = "refined"
    """How whole-cycle values are checked between points: "refined", "bounded" or "proven"."""
    tie_breaks: tuple[str, ...] = field(default=())
    correction: Mapping[str, float] = field(default_factory=dict)
    """Newton's step, SI, to the stationary point nearby; empty without curvature."""
    step: float = 0.0
    """Length of Newton's step, scaled."""
    level: tuple[Mapping[str, float], ...] = ()
    """Directions, scaled and orthonormal, without curvature at the last level."""
    change: Level | None = None
    """Residuals of the level of least change from today, if there is one."""
    frame: tuple[FrameRow, ...] = field(default=(), repr=False)
    """Rows that stop the design: touched limits, vanishing objectives, and the pieces of the deciding level; empty
    where levels before that one do not vanish, because their curvature then decides.
    """
    open: tuple[str, ...] = ()
    """Variables, by the designer's names, whose values are arbitrary: other values are as good."""
    bind_together: tuple[JointBinding, ...] = field(default=(), repr=False)
    """Limits that are worth more together than alone."""
    prices_unique: bool = True
    """Whether every limit has one price: loosening it a little gains as much as tightening it costs."""

    @property
    def choices(self) -> tuple[str, ...]:
        """Rules that chose among equally good designs, and the variables that are left open."""
        return (*self.tie_breaks, *([f"open: {', '.join(self.open)}"] if self.open else []))

    @property
    def binding_groups(self) -> tuple[tuple[Binding, ...], ...]:
        """Binding limits, all rows of each limit and side together."""
        groups: dict[tuple[str, int], tuple[Binding, ...]] = {}
        for binding in self.binding:
            key = binding.limit.name, binding.side
            groups[key] = (*groups.get(key, ()), binding)
        return tuple(groups.values())

    @property
    def error(self) -> float:
        """Estimate of the relative error of the answer, scaled.

        The largest of: excess of limits, excess between points, complementarity, and the length of Newton's step.
        """
        complementarity = max((level.complementarity for level in self.levels), default=0.0)
        return max(self.feasibility, self.violation, complementarity, self.step, ROUNDED)

    @property
    def residual(self) -> float:
        """Largest KKT residual of all levels."""
        return max((max(level.stationarity, level.complementarity) for level in self.levels), default=0.0)


class GlobalLevel(NamedTuple):
    """Bound of one objective over all admissible designs that are as good at the levels before it.

    objective: its figure; sense: whether it is minimised or maximised; best: value of the answer, SI; bound: bound
    of all designs, SI; gap: between the two, relative; band: by how much a design may be worse than `best` and still
    count at later levels, SI; proven: whether the gap is small enough.
    """

    objective: str
    sense: ObjectiveSense
    best: float
    bound: float
    gap: float
    band: float
    proven: bool


class GlobalBound(NamedTuple):
    """Proven bounds of all admissible designs; boxes, seconds: cost of the proof; why: reason if it is not proven."""

    levels: tuple[GlobalLevel, ...]
    boxes: int
    seconds: float
    why: str = ""

    @property
    def proven(self) -> bool:
        """Whether no admissible design is better, level by level, by more than the required gap."""
        return not self.why

    @property
    def gap(self) -> float:
        """Largest gap of all levels, relative; infinite without a bound."""
        return max((level.gap for level in self.levels), default=math.inf)

    def as_dict(self) -> dict[str, Any]:
        """Object that `solve --json` prints."""
        return {
            "proven": self.proven,
            "gap": self.gap if math.isfinite(self.gap) else None,
            "bound": {level.objective: level.bound for level in self.levels if math.isfinite(level.bound)},
            "band": {level.objective: level.band for level in self.levels[:-1]},
            "boxes": self.boxes,
            "seconds": self.seconds,
            "why": self.why or None,
        }
