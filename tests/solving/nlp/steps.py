"""A program of steps that follow one after the other: as a chain that an NLP may lift, and without one."""

import bisect
import functools
from collections.abc import Collection
from dataclasses import dataclass

from support.toy import Still

from loomopt.maths.systems import Maths, Number
from loomopt.model.kinematics import Arcs, DerivedChain
from loomopt.model.limits import CycleLimit, DesignLimit
from loomopt.model.model import CycleQuantity, DesignRow, JobModel
from loomopt.model.objectives import Value
from loomopt.model.program import Program, Variable
from loomopt.physics.balance import Given
from loomopt.physics.cycle import TURN
from loomopt.physics.schema import Values

COUNT = 12
NAMES = tuple(f"x{k}" for k in range(COUNT))
HEIGHTS = tuple(f"h{k}" for k in range(COUNT))
STEP, RAISED = "step", "raised"
HALF = 0.1, 3.3
"""Crank angles, rad, between which waves are raised: from step 1 to step 6 where steps begin."""


def heights(maths: Maths, values: Values, bend: float) -> dict[str, Number]:
    """Return h of every step, which follows from the one before: h' = h/2 + bend h² + x."""
    results: dict[str, Number] = {}
    before = maths.number(0.0)
    for name, parameters in zip(HEIGHTS, NAMES, strict=True):
        results[name] = before / 2 + bend * before**2 + values[parameters]
        before = values.get(name, results[name])
    return results


@dataclass(frozen=True)
class Steps(Still):
    """Twelve steps of one turn; bend: of what each follows from."""

    bend: float = 0.0

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> Values:
        values = given.values
        return {**heights(maths, values, self.bend), **{name: values[name] for name in HEIGHTS if name in values}}


def arcs(bend: float, lifted: bool) -> tuple[Arcs, ...]:
    """One stretch for each step, after those of the half of the turn that is raised; lifted: told as a chain."""
    stations = tuple({STEP: float(k)} for k in range(COUNT))
    follow = DerivedChain(frozenset(NAMES), HEIGHTS, lambda m, v: heights(m, v, bend), stations)
    raised = Arcs(RAISED, lambda maths, given: tuple(map(maths.number, HALF)), raised_at)
    return raised, Arcs(STEP, corners, step_at, chain=follow if lifted else None)


def corners(maths: Maths, given: Given) -> tuple[Number, ...]:
    return tuple(maths.number(k * TURN / COUNT) for k in range(COUNT))


def raised_at(angle: float, angles: tuple[float, ...]) -> float:
    return float(angles[0] <= angle % TURN < angles[1])


def step_at(angle: float, angles: tuple[float, ...]) -> float:
    return float(bisect.bisect_right(angles, angle % TURN) - 1)


def wave(at):
    """Return the height, from step to step without a jump, times a wave that is 1 where they begin, raised or not."""
    step, raised = (at.node.switch[name] for name in (STEP, RAISED))
    columns = HEIGHTS, (*HEIGHTS[1:], HEIGHTS[0])
    begin, end = (at.maths.choose(step, [at.values[name] for name in names]) for names in columns)
    share = COUNT * at.node.phi / TURN - step
    factor = at.maths.choose(raised, (1, at.values["raise"])) * (1 + (at.maths.cos(COUNT * at.node.phi) - 1) / 10)
    return (begin + share * (end - begin)) * factor


def swing(at):
    return wave(at) + at.values["x0"] ** 2 / 4


def at_design(name, at):
    return at.values[name]


def model(bend=0.0, lifted=True):
    """Return the model: whole-cycle quantities wave (signed) and swing, rows of every step's height and a bowl."""
    rows = {name: DesignRow(functools.partial(at_design, name)) for name in HEIGHTS}
    rows["bowl"] = DesignRow(lambda at: sum((at.values[name] - 2) ** 2 for name in NAMES) + at.values[HEIGHTS[-1]])
    quantities = {"wave": CycleQuantity(wave, signed=True), "swing": CycleQuantity(swing)}
    mechanism = Steps(("steps", bend, lifted), arcs=arcs(bend, lifted), bend=bend)
    return JobModel(mechanism, own_quantities=quantities, own_rows=rows)


def program(bend=0.0, lifted=True, limits=(("wave", 1, 1.5), ("h3", 1, 1.2)), where=None):
    """Return the least bowl below limits (row, sign, value)."""
    variables = tuple(Variable(name, -10.0, 10.0, 2.0, (-1.0, 1.0)) for name in NAMES)
    rows = tuple(
        CycleLimit(row, sign, row, value, 1.0, where=where)
        if row in ("wave", "swing")
        else DesignLimit(row, sign, row, value, 1.0)
        for row, sign, value in limits
    )
    start = {name: 0.1 * k for k, name in enumerate(NAMES)}
    return Program(model(bend, lifted), variables, {"raise": 1.25}, rows, (Value("bowl", "bowl", 1.0),), (start,))
