"""Where a solve starts, stands and ends: plain records."""

import functools
import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from loomopt.model.program import Program
from loomopt.model.sampling import Extreme, Sampler, sampled
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import NEAR, POLISH_FARTHEST, ROUNDING, SAMPLES
from loomopt.solving.nlp.rows import Multipliers

SAMPLED = ((1e-3, 180), (1e-6, 360))
"""Samples that are enough for a coarser accuracy: what refining misses at so many is far below it (same study)."""

PENALTY = 1000.0
"""Weight of each earlier objective against the next, first try: more than a level's multiplier keeps it exactly [exact
penalty: Nocedal and Wright, section 17.2]. A tenth of it does in the experiment; where it fails, the search raises it
(STRONGER)."""

CHECKED, MOST_CHECKED = 1.6384, 65536
"""Points of one turn on which refined values are checked again, times √accuracy: what is missed between points falls
with their square. 16384 for the usual accuracy, where a curve that bends by its size over a radian errs by 2e-8."""

SUCCESS = frozenset({"Solve_Succeeded", "Solved_To_Acceptable_Level"})

BEATEN = "Beaten"
"""The status of a solve that was left where its basin's least is no better than is known."""


@dataclass(frozen=True)
class Settings:
    """How to solve.

    accuracy: of whole-cycle rows, relative to their size: samples and tolerance follow from it where they are not
    given; penalty: weight between levels; callback: of each iteration; on_step: told what is being done before it may
    take long, `step` and what of it. For studies of methods: samples: of one turn; tolerance:
    IPOPT's; hessian: "exact" or IPOPT's own "limited-memory"; polished: whether Newton's method ends a solve; uniform:
    so many equal nodes of a turn instead of the exchange. farthest: natural sizes that polishing may lead.
    """

    accuracy: float = 1e-8
    penalty: float = PENALTY
    callback: Any = None
    samples: int = 0
    tolerance: float = 0.0
    hessian: str = "exact"
    polished: bool = True
    uniform: int = 0
    farthest: float = POLISH_FARTHEST
    step: str = ""
    on_step: Callable[[str], None] | None = None

    def at(self, step: str) -> "Settings":
        """Return the settings of another step, after telling it."""
        found = replace(self, step=step)
        found.say()
        return found

    def say(self, more: str = "") -> None:
        """Tell the step that begins, or more of it."""
        if self.on_step:
            self.on_step(f"{self.step}: {more}" if self.step and more else self.step or more)

    @functools.cached_property
    def sampled(self) -> int:
        """Samples of one turn: from 180 where a percent is asked to 720."""
        return self.samples or next((count for least, count in SAMPLED if self.accuracy >= least), SAMPLES)

    @property
    def checked(self) -> int:
        """Points of one turn on which refined values are checked again: what is missed between them falls as 1/n²."""
        return min(max(math.ceil(CHECKED / math.sqrt(self.accuracy)), 2 * self.sampled), MOST_CHECKED)

    @property
    def excess(self) -> float:
        """Largest excess of a whole-cycle row, relative to its size, that is left alone: two decades tighter.

        Newton's method, which ends a solve, must start near.
        """
        return max(min(self.accuracy / 100, NEAR), ROUNDING)


@dataclass(frozen=True)
class Point:
    """Where a solve ended.

    x: values of the variables, SI; status: IPOPT's word, "Not_Assembled" where the start has no finite cycle;
    nodes: per family; violation: largest excess between nodes, relative to the row's size.
    """

    x: dict[str, float]
    status: str
    reached: bool
    """Whether the point is worth a certificate: IPOPT converged, or gave up where all rows hold."""
    iterations: int = 0
    nodes: tuple[tuple[Extreme, ...], ...] = ()
    violation: float = math.inf
    extra: Floats = field(default_factory=lambda: np.zeros(0), compare=False)
    """The epigraph variables, or the excesses of an elastic solve, in natural sizes."""
    multipliers: Multipliers = field(default_factory=Multipliers, compare=False)
    built: float = 0.0
    binding: tuple[tuple[Extreme, ...], ...] = ()
    """Per family, the extremes whose rows bind."""
    structure: Hashable = None
    """The structure of the program it answers."""
    relaxed: dict[int, float] = field(default_factory=dict)
    """Elastic solves only: limit's place → excess it needs, SI."""
    rough: bool = False
    """Whether what binds may not be met exactly: that was farther than the settings let polishing lead."""
    value: float = math.inf
    """The NLP's objective."""


class Elastic(NamedTuple):
    """How limits give way in an elastic solve: the least weighted sum of their excesses is sought.

    costs: of each excess, in its natural size, in order of `Program.excess_places`; infinite where the limit is firm,
    nothing for 1 throughout. beside: where an elastic solve ended that this one starts from, if any.
    """

    costs: tuple[float, ...] = ()
    beside: "Point | None" = None


class Known(NamedTuple):
    """What other solves of a program have shown.

    nodes: of each family, where its rows bind, beside a solve's own from its second round on: what a round gives is
    less than its basin has, so that it is left as soon as it cannot come below `most`, in the NLP's objective (elastic:
    in the sum of the excesses of cost 1). levels: objectives of the best, in natural sizes; what falls below an earlier
    one is not left, for the NLP's objective weighs a small fall there against a large rise of the next.
    """

    nodes: tuple[tuple[Extreme, ...], ...] = ()
    most: float = math.inf
    levels: tuple[float, ...] = ()


def sampler_at(program: Program, x: Mapping[str, float], samples: int = SAMPLES) -> Sampler | None:
    """Return the design's sampler, or None where the linkage has no real position."""
    try:
        sampler = sampled(program.model, {**program.parameters, **x}, samples)
        return sampler if all(map(math.isfinite, sampler.static.values())) else None
    except (ValueError, ZeroDivisionError, FloatingPointError):
        return None


def excess(program: Program, x: Mapping[str, float]) -> float:
    """Return by how much variables x (SI) exceed the worst limit, in its natural size; infinite without a cycle."""
    sampler = sampler_at(program, x) if all(variable.name in x for variable in program.variables) else None
    return math.inf if sampler is None else max((limit.violation(sampler) for limit in program.limits), default=0.0)
