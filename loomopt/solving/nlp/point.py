"""Records of a solve: settings, end point, and results of other solves."""

import contextlib
import functools
import math
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from loomopt.base.records import Frozen
from loomopt.model.program import Program
from loomopt.model.sampling import Extreme, Sampler, sampled, search_together
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import NEAR, POLISH_FARTHEST, ROUNDING, SAMPLES
from loomopt.solving.nlp.rows import Multipliers

SAMPLED = ((1e-3, 180), (1e-6, 360))
"""Samples that suffice for a coarser accuracy: the error of refining from them is far smaller (same study)."""

PENALTY = 1000.0
"""First weight of each objective against the next: a weight above the level's multiplier is exact [exact penalty:
Nocedal and Wright, section 17.2]. A tenth of it suffices in the experiment; where it fails, the search raises it
(STRONGER)."""

CHECKED, MOST_CHECKED = 1.6384, 65536
"""Points of one turn on which refined values are checked, times √accuracy: the error between points falls with their
square. 16384 for the usual accuracy, where a curve that bends by its size over a radian errs by 2e-8."""

SUCCESS = frozenset({"Solve_Succeeded", "Solved_To_Acceptable_Level"})

BEATEN = "Beaten"
"""Status of a solve that was stopped because its basin is no better than the best known point."""


@dataclass(frozen=True)
class Settings:
    """Settings of a solve.

    accuracy: of whole-cycle rows, relative to their scale; it sets samples and tolerance where these are 0; penalty:
    weight between levels; callback: called at each iteration; on_step: called with a text before each long step;
    step: name of the step; farthest: most that polishing may move a design, in the variables' scales. For studies of
    methods: samples: of one turn; tolerance: of IPOPT; hessian: "exact" or IPOPT's "limited-memory"; polish:
    whether Newton's method ends a solve; uniform: number of equally spaced nodes in place of the exchange.
    """

    accuracy: float = 1e-8
    penalty: float = PENALTY
    callback: Any = None
    samples: int = 0
    tolerance: float = 0.0
    hessian: str = "exact"
    polish: bool = True
    uniform: int = 0
    farthest: float = POLISH_FARTHEST
    step: str = ""
    on_step: Callable[[str], None] | None = None

    def at(self, step: str) -> "Settings":
        """Settings of another step; reports the step."""
        settings = replace(self, step=step)
        settings.say()
        return settings

    def say(self, more: str = "") -> None:
        """Report the step that begins, with a detail."""
        if self.on_step:
            self.on_step(f"{self.step}: {more}" if self.step and more else self.step or more)

    @functools.cached_property
    def sample_count(self) -> int:
        """Samples of one turn: from 180 at an accuracy of 1e-3 to 720."""
        return self.samples or next((count for least, count in SAMPLED if self.accuracy >= least), SAMPLES)

    @property
    def check_count(self) -> int:
        """Points of one turn on which refined values are checked; the error between them falls as 1/n²."""
        return min(max(math.ceil(CHECKED / math.sqrt(self.accuracy)), 2 * self.sample_count), MOST_CHECKED)

    @property
    def excess(self) -> float:
        """Largest excess of a whole-cycle row, relative to its scale, that ends the exchange: two decades tighter.

        Newton's method, which ends a solve, needs a near start.
        """
        return max(min(self.accuracy / 100, NEAR), ROUNDING)


@dataclass(frozen=True)
class Point:
    """End point of a solve.

    x: variables, SI; status: IPOPT's, or "Not_Assembled" where the start has no finite cycle; nodes: of each family;
    violation: largest excess between nodes, relative to the row's scale.
    """

    x: dict[str, float]
    status: str
    usable: bool
    """Whether the point is worth a certificate: IPOPT converged, or gave up where all rows hold."""
    iterations: int = 0
    nodes: tuple[tuple[Extreme, ...], ...] = ()
    violation: float = math.inf
    extra: Floats = field(default_factory=lambda: np.zeros(0), compare=False)
    """The epigraph variables, or the excesses of an elastic solve, in units of the scale."""
    multipliers: Multipliers = field(default_factory=Multipliers, compare=False)
    build_seconds: float = 0.0
    binding: tuple[tuple[Extreme, ...], ...] = ()
    """Per family, the extremes whose rows bind."""
    structure: Hashable = None
    """The structure of the program it answers."""
    relaxation: dict[int, float] = field(default_factory=dict)
    """Elastic solves only: limit's place → excess it needs, SI."""
    rough: bool = False
    """Whether binding rows may not hold exactly: polishing would have moved the design farther than the settings
    allow.
    """
    value: float = math.inf
    """The NLP's objective."""


class Elastic(NamedTuple):
    """How limits are relaxed in an elastic solve, which minimises the weighted sum of their excesses.

    costs: of each excess, in its scale, in the order of `Program.excess_places`; infinite where the limit is firm,
    empty for 1 throughout. start: end point of an earlier elastic solve to start from, if any.
    """

    costs: tuple[float, ...] = ()
    start: "Point | None" = None


class Known(NamedTuple):
    """Results of earlier solves of a program.

    nodes: of each family, where its rows bind; a solve adds them to its nodes from its second round on, with x only if
    its first round ends near these variables, SI. cutoff: the NLP's objective (elastic: the sum of the excesses of
    cost 1) that a solve must stay below: a round's value is a lower bound of its basin, and the solve stops once the
    bound exceeds `most`. levels: objectives of the best, in their scales; a solve that lowers an earlier level
    continues, although its NLP objective may be larger.
    """

    nodes: tuple[tuple[Extreme, ...], ...] = ()
    cutoff: float = math.inf
    levels: tuple[float, ...] = ()
    x: Mapping[str, float] = Frozen()


def sampler_at(program: Program, x: Mapping[str, float], samples: int = SAMPLES) -> Sampler | None:
    """Sampler of a design, or None where the linkage has no real position."""
    try:
        sampler = sampled(program.model, {**program.parameters, **x}, samples)
        return sampler if all(map(math.isfinite, sampler.static.values())) else None
    except (ValueError, ZeroDivisionError, FloatingPointError):
        return None


def search_extremes(samplers: Iterable[tuple[Sampler | None, tuple[str, ...]]]) -> None:
    """Compute the extremes of quantities of designs, those of equal names in one pass; None: no design."""
    by_names: dict[tuple[str, ...], list[Sampler]] = {}
    for sampler, names in samplers:
        if sampler is not None:
            by_names.setdefault(names, []).append(sampler)
    for names, group in by_names.items():
        # A design without a number fails again where its extremes are read.
        with contextlib.suppress(ArithmeticError, TypeError, ValueError):
            search_together(group, names)


def excess(program: Program, x: Mapping[str, float]) -> float:
    """Excess of variables x (SI) over the worst limit, in the limit's scale; infinite without a cycle."""
    sampler = sampler_at(program, x) if all(variable.name in x for variable in program.variables) else None
    return math.inf if sampler is None else max((limit.violation(sampler) for limit in program.limits), default=0.0)
