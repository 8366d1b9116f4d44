"""Where a solve starts, stands and ends: plain records."""

import math
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from typing import Any

from loomopt.cycle import Floats
from loomopt.jobs.program import Program
from loomopt.jobs.sampling import Extreme, Sampler

PENALTY = 1000.0
"""Weight of each earlier objective against the next; it must exceed twice the held objective's multiplier."""
ROUNDING = 1e-12
"""A whole-cycle value cannot be told closer, relative to its size."""
SUCCESS = frozenset({"Solve_Succeeded", "Solved_To_Acceptable_Level"})


@dataclass(frozen=True)
class Settings:
    """How to solve: accuracy of whole-cycle rows relative to their size; weight between levels; progress callback."""

    accuracy: float = 1e-8
    penalty: float = PENALTY
    callback: Any = None

    @property
    def excess(self) -> float:
        """Largest excess of a whole-cycle row, relative to its size, that is left alone: two decades tighter."""
        return max(self.accuracy / 100, ROUNDING)


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
    raw: Mapping[str, Floats] = field(default_factory=dict)
    built: float = 0.0
    binding: tuple[tuple[Extreme, ...], ...] = ()
    """Per family, the extremes whose rows bind."""
    structure: Hashable = None
    """The structure of the program it answers."""
    relaxed: dict[int, float] = field(default_factory=dict)
    """Elastic solves only: limit's place → excess it needs, SI."""


def sampler_at(program: Program, x: Mapping[str, float]) -> Sampler | None:
    """Return the design's sampler, or None where the linkage has no real position."""
    try:
        sampler = Sampler(program.model, {**program.parameters, **x})
        return sampler if all(map(math.isfinite, sampler.static.values())) else None
    except (ValueError, ZeroDivisionError, FloatingPointError):
        return None
