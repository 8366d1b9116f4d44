"""What a certificate says: plain records."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from loomopt.program.program import Limit, Objective
from loomopt.tolerances import ROUNDED


@dataclass(frozen=True)
class Level:
    """The KKT residuals of one objective; held: the multiplier of the objectives before it.

    price: the largest multiplier of a limit, dearest: that limit's name.
    """

    objective: str
    stationarity: float
    complementarity: float
    held: float
    price: float = 0.0
    dearest: str = ""


@dataclass(frozen=True)
class Binding:
    """A limit that binds, and the fall of the first objective it moves per unit it is loosened (SI)."""

    limit: Limit
    side: int
    objective: Objective
    worth: float


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
