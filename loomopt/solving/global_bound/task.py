"""A program as branch and bound sees it: variables with finite ends, and what stands for all others."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from loomopt.maths import intervals
from loomopt.maths.intervals import Floats, Interval
from loomopt.maths.systems import Maths, Number
from loomopt.maths.systems import boxes as box_system
from loomopt.model.program import Limit, Program, Variable
from loomopt.solving.global_bound.rows import BoxRows, OpenError
from loomopt.solving.global_bound.scale import Scale


@dataclass(frozen=True)
class Task:
    """What is searched for a better design.

    names: of the variables, in order; low, high: their ends, (names,), SI; fixed: numbers all designs share, of
    variables that only loosen limits all that they may be; scale: a common scale that is left out, if there is one.
    """

    program: Program
    names: tuple[str, ...]
    low: Floats
    high: Floats
    fixed: Mapping[str, Interval]
    loosening: Mapping[str, float] = field(default_factory=dict)
    """Variables that only loosen limits, with the value that a design is given, SI."""
    scale: Scale | None = None

    @property
    def sizes(self) -> Floats:
        """The widths of the whole box, SI."""
        return np.asarray(self.high - self.low)

    @property
    def limits(self) -> list[Limit]:
        """The limits that are rows: those of variables are the box itself, or ratios."""
        return [limit for limit in self.program.limits if limit.family != "variable"]

    def numbers(self, low: Floats, high: Floats) -> dict[str, Number]:
        """Return all numbers over boxes: variables with their slopes; low, high: (names, boxes), SI."""
        count = len(self.names)
        own = {name: intervals.variable(k, count, low[k], high[k]) for k, name in enumerate(self.names)}
        return {**self.fixed, **own}

    def points(self, at: Floats) -> dict[str, Number]:
        """Return all numbers at points (names, boxes), SI, as intervals without slopes."""
        return {**self.fixed, **{name: intervals.interval(at[k][None]) for k, name in enumerate(self.names)}}

    def floats(self, at: Floats) -> dict[str, Number]:
        """Return all numbers at points (names, boxes), SI, as plain arrays."""
        known = {**self.program.parameters, **{v.name: v.lower for v in self.program.variables}, **self.loosening}
        if self.scale:
            known |= self.scale.held
        return {**known, **{name: at[k][None] for k, name in enumerate(self.names)}}

    def values(self, at: Floats) -> dict[str, float]:
        """Return all numbers at one point (names,), SI, as floats: its scale is left as the boxes have it."""
        return {name: float(np.asarray(value).ravel()[0]) for name, value in self.floats(at[:, None]).items()}

    def design(self, at: Floats) -> dict[str, float]:
        """Return the program's variables at one point (names,), SI, at a scale that its bounds allow."""
        values = self.values(at)
        found = {v.name: values[v.name] for v in self.program.variables}
        return self.scale.inside(found) if self.scale else found

    def place(self, x: Mapping[str, float]) -> Floats:
        """Return the point (names,) of the program's variables, SI, moved inside the box."""
        values = self.scale.taken_out(x) if self.scale else x
        at = np.array([values[name] for name in self.names])
        return np.asarray(np.clip(at, self.low, self.high))


def reduced(program: Program, loosening: tuple[str, ...], scale: Scale | None, most: Mapping[str, float]) -> Task:
    """Return the task of a program.

    loosening: variables that no row but a limit's reads, and that only loosen it; most: values, SI, that variables
    without a bound of their own need not exceed. Raises OpenError where a variable has no end.
    """
    maths: Maths = box_system()
    held = dict(scale.held) if scale else {}
    fixed = {name: maths.number(value) for name, value in {**program.parameters, **held}.items()}
    for v in program.variables:
        if v.name in loosening or v.lower == v.upper:
            fixed.setdefault(v.name, Interval(v.lower, v.upper))
    inside: dict[str, tuple[float, float]] = {}
    for v in (v for v in program.variables if v.name not in fixed):
        low, high = scale.ends[v.name] if scale and v.name in scale.ends else (v.lower, v.upper)
        inside[v.name] = low, min(high, most.get(v.name, high))
    for name in [name for name, ends in inside.items() if not np.all(np.isfinite(ends))]:
        inside[name] = _implied(program, fixed | {n: Interval(*ends) for n, ends in inside.items()}, name)
    _finite(program.variables, inside)
    uppers = {v.name: v.upper for v in program.variables if v.name in loosening}
    lows, highs = (np.array([ends[k] for ends in inside.values()]) for k in range(2))
    return Task(program, tuple(inside), lows, highs, fixed, uppers, scale)


def _implied(program: Program, values: Mapping[str, Interval], name: str) -> tuple[float, float]:
    """Return the ends of a variable that its limits imply: value · weight, all that the weight may be."""
    maths: Maths = box_system()
    rows = BoxRows(program.model, maths, program.model.given(maths, values), {})
    ends = values[name]
    for limit in program.limits:
        if limit.row == name and limit.family == "static":
            bound = maths.number(limit.value) * (rows.single(limit.weight) if limit.weight else 1.0)
            low = bound.low if limit.sign <= 0 else ends.low
            high = bound.high if limit.sign >= 0 else ends.high
            ends = ends.meet(Interval(low, high))
    return float(ends.low), float(ends.high)


def _finite(variables: tuple[Variable, ...], inside: Mapping[str, tuple[float, float]]) -> None:
    """Raise OpenError for a variable without ends."""
    called = {v.name: v.called for v in variables}
    for name, ends in inside.items():
        if not np.all(np.isfinite(ends)):
            raise OpenError(f"{called[name]} is not bounded")
