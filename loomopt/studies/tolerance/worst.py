"""The worst case of each figure over the box of all tolerances: found by machines, and proven by boxes.

The farthest machine that corners, Sobol's points and a search around the best of them find is claimed to be the worst
but for a gap, and the claim is proven for all machines of the box. What is not proven within the work is undecided.
"""

import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np

from loomopt.jobs.base import InBox
from loomopt.maths import sobol
from loomopt.model.limits import CycleLimit
from loomopt.model.machines import at_once
from loomopt.model.sampling import Sampler
from loomopt.model.session import working
from loomopt.physics.cycle import Floats
from loomopt.solving.proof import tolerance_box
from loomopt.solving.proof.task import OpenError
from loomopt.solving.proof.tolerance_box import AtAngle, Function, NumberBox, Outcome, Peak, Single
from loomopt.studies.tolerance.plan import ASSEMBLED, Plan

GAPS = 1e-6, 1e-3
"""Shares of a figure's range over the box by which a claim is beyond the farthest machine: the second where the first
is not proven."""
ROUNDING = 1e-11
"""The same of the figure's own size: what figures of many machines at once may be off."""
ALIKE = 1e-9
"""Share by which the nominal machine's figure in boxes may differ from the one that is told."""
MOST_CORNERS, SPREAD = 10, 1024
"""Numbers of which all corners are read, and points of the box beside them."""
AROUND, SHRUNK, ROUNDS = 64, 0.3, 8
"""Points around the farthest, by how much they draw closer from round to round, and how often."""
AGAIN = 3
"""How often a claim is raised because a machine beyond it turned up."""
SIDES = {"min": -1.0, "max": 1.0}


Farthest = dict[str, tuple[float, Floats]]
"""Side → the farthest figure found, SI, and the numbers of that machine, (numbers,)."""


class Worst(NamedTuple):
    """What a figure is over the box of all tolerances, SI.

    min, max: between them it lies on every machine, proven; None where that is undecided. found: the farthest machines
    to both sides. why: why an end is undecided, "" where none is; parts: of the box that were read.
    """

    min: float | None
    max: float | None
    found: tuple[float, float]
    why: str
    parts: int

    @property
    def proven(self) -> bool:
        """Whether both ends are."""
        return self.min is not None and self.max is not None

    def as_dict(self) -> dict[str, object]:
        """Return what `tolerance --json` prints of it."""
        found = [end if math.isfinite(end) else None for end in self.found]
        told = {"min": self.min, "max": self.max, "proven": self.proven, "found": found}
        return {**told, "parts": self.parts, "why": self.why or None}


def asked(plan: Plan) -> tuple[str, ...]:
    """Return the figures whose worst is told: those that machines are judged by, goals, and what the target seeks."""
    goals = [goal.figure for goal in plan.goals]
    sought = [level.figure for level in plan.program.objectives]
    names = dict.fromkeys([each.name for each in plan.judged] + goals + sought)
    return tuple(name for name in names if name in plan.figures or any(each.name == name for each in plan.judged))


def told(plan: Plan, executor: Executor | None = None) -> Iterator[tuple[str, Worst]]:
    """Yield each figure's worst over the box; the same whoever computes."""
    with working():
        names, open_ = asked(plan), unproven(plan)
        found = {} if open_ else farthest(plan)
    if open_:
        yield from ((name, Worst(None, None, (math.nan, math.nan), open_, 0)) for name in names)
        return
    work = functools.partial(worst, plan)
    yield from zip(names, (executor.map if executor else map)(work, names, map(found.get, names)), strict=True)


def ends(plan: Plan) -> dict[str, tuple[float, float]]:
    """Return the box of all tolerances: ends of each number, SI, rounded outward."""
    pairs = {name: (plan.nominal[name] + plan.shifts[name], half) for name, half in plan.halves.items()}
    return {
        name: (float(np.nextafter(at - half, -math.inf)), float(np.nextafter(at + half, math.inf)))
        for name, (at, half) in pairs.items()
    }


@working()
def unproven(plan: Plan) -> str:
    """Return why nothing can be proven of the machines of the box, "" where all are proven to assemble."""
    if not at_once(plan.model):
        return "a motion of its own is followed turn by turn, which boxes do not enclose"
    try:
        box = NumberBox(plan.model, plan.nominal, ends(plan))
        for phrase, (quantity, most) in plan.model.assembly.items():
            if not _below(box, plan.model.signed, quantity, most + ASSEMBLED).proven:
                return f"it is undecided whether all machines assemble: {phrase}"
    except OpenError as error:
        return str(error)
    except ValueError as error:
        return f"a formula does not run in intervals: {error}"
    return ""


def _below(box: NumberBox, signed: frozenset[str], quantity: str, most: float, read: InBox | None = None) -> Outcome:
    """Say whether a quantity's peak is at most so much."""
    one = quantity in signed or (read is not None and read.largest)
    where = read.where if read else None
    parts = [
        each
        for sign in ((1.0,) if one else (1.0, -1.0))
        for each in tolerance_box.over_cycle(box, quantity, sign, where)
    ]
    return tolerance_box.all_at_most(parts, most)


@working()
def worst(plan: Plan, name: str, found: Farthest | None) -> Worst:
    """Return a figure's worst over the box; found: the farthest of some machines, None where one lacks the figure."""
    if found is None:
        lost = "a machine within the tolerances does not assemble, or has no such figure"
        return Worst(None, None, (math.nan, math.nan), lost, 0)
    machines = {side: _climbed(plan, name, sign, *found[side]) for side, sign in SIDES.items()}
    told: dict[str, float | None] = {}
    parts, why = 0, list[str]()
    try:
        read = _in_boxes(plan, name)
        if read is None or not _same(plan, name, read, machines):
            raise OpenError(f"{name} has no formula that runs over boxes")
        box = NumberBox(plan.model, plan.nominal, ends(plan))
        for side, sign in SIDES.items():
            told[side], machines[side], used, said = _proven(plan, name, box, read, sign, machines)
            parts += used
            why += [f"{side} is {said}"] if said else []
    except OpenError as error:
        why.append(str(error))
    except ValueError as error:
        why.append(f"a formula does not run in intervals: {error}")
    return Worst(told.get("min"), told.get("max"), (machines["min"][0], machines["max"][0]), "; ".join(why), parts)


def _proven(
    plan: Plan, name: str, box: NumberBox, read: InBox, sign: float, machines: Farthest
) -> tuple[float | None, tuple[float, Floats], int, str]:
    """Return the proven end of one side, the farthest machine, the parts read, and why there is no end."""
    side = "max" if sign > 0 else "min"
    far, at = machines[side]
    used, raised = 0, 0
    gaps = list(GAPS)
    while gaps:
        width = machines["max"][0] - machines["min"][0]
        bound = far + sign * (gaps[0] * width + ROUNDING * abs(far))
        outcome = _claim(box, read, sign, bound, at, plan)
        used += outcome.parts
        if outcome.proven:
            return bound, (far, at), used, ""
        beyond = _at(plan, name, outcome.open[:, None])[0] if outcome.open is not None else math.nan
        if sign * beyond > sign * bound and raised < AGAIN and outcome.open is not None:
            far, at = _climbed(plan, name, sign, beyond, outcome.open)
            raised += 1
            continue
        gaps.pop(0)
    return None, (far, at), used, f"undecided after {used} parts of the box"


def _claim(box: NumberBox, read: InBox, sign: float, bound: float, at: Floats, plan: Plan) -> Outcome:
    """Prove sign · figure ≤ sign · bound."""
    signed = plan.model.signed
    if read.rows:
        if sign > 0:
            # The least of rows is at most so much where one of them is all over the box.
            every = [tolerance_box.at_most(_row(box, row, 1.0), bound) for row in read.rows]
            return next((each for each in every if each.proven), every[0])
        return tolerance_box.all_at_most([_row(box, row, -1.0) for row in read.rows], -bound)
    if read.leaves:
        return _left(box, read, sign, bound, plan)
    peak = (bound - read.offset) / read.sign
    if sign * read.sign > 0:
        return _below(box, signed, read.quantity, peak, read)
    return tolerance_box.at_most(Peak(box, read.quantity, _nodes(plan, read, at)), -peak)


def _row(box: NumberBox, row: str, sign: float) -> Single:
    return Single(box, lambda rows: rows.single(row) * sign)


PASSED = 2e-9
"""Share by which a level is passed, more than the reading of a crossing takes for touching."""


def _left(box: NumberBox, read: InBox, sign: float, bound: float, plan: Plan) -> Outcome:
    """Prove that |quantity| passes 1 no later, or no earlier, than after so large a turn, rad."""
    angle = read.leaves * bound
    if sign < 0:
        every: Sequence[Function] = [tolerance_box.over_angles(box, read.quantity, own, angle) for own in (1.0, -1.0)]
        return tolerance_box.all_at_most(every, 1.0)
    own = math.copysign(1.0, plan.like.at_angle((read.quantity,), angle)[0])
    return tolerance_box.at_most(AtAngle(box, read.quantity, -own, angle), -1.0 - PASSED)


NODES = 4
"""Nodes at which a peak's least value is sought."""


def _nodes(plan: Plan, read: InBox, at: Floats) -> list[tuple[int, float, float]]:
    """Return the highest extremes of a machine: piece, share of it, sign."""
    own = Sampler(plan.model, {**plan.nominal, **dict(zip(plan.made, map(float, at), strict=True))})
    found = own.extremes(read.quantity, read.where)
    if read.largest:
        found = [each for each in found if each.sign > 0]
    highest = sorted(found, key=lambda each: -each.height)[:NODES]
    return [(each.piece, each.u, each.sign) for each in highest]


def _in_boxes(plan: Plan, name: str) -> InBox | None:
    """Return how a figure is read over boxes, None where nothing says it."""
    found = plan.job.in_boxes(plan.scene, plan.model).get(name)
    if found is None:
        limit = next((each for each in plan.program.limits if each.name == name and isinstance(each, CycleLimit)), None)
        if isinstance(limit, CycleLimit) and plan.model.has_quantity(limit.row):
            found = InBox(quantity=limit.row, sign=float(limit.sign), offset=limit.told(0.0), where=limit.where)
    return found


def _same(plan: Plan, name: str, read: InBox, machines: Farthest) -> bool:
    """Say whether the nominal machine's figure is the one that is told."""
    like = plan.like
    if read.leaves:
        return True
    if read.rows:
        here = min(float(like.single(row)) for row in read.rows)
    else:
        tops = like.extremes(read.quantity, read.where)
        heights = [each.value if read.largest else each.height for each in tops]
        here = read.offset + read.sign * max(heights, default=math.nan)
    told = _at(plan, name, np.array([plan.nominal[each] for each in plan.made])[:, None])[0]
    size = max(abs(value) for value, _ in machines.values())
    if read.quantity:
        size = max(size, float(np.abs(like.at(read.quantity, *like.grid())).max()))
    return bool(abs(here - told) <= ALIKE * max(size, 1e-300))


# Machines.


def _at(plan: Plan, name: str, at: Floats) -> Floats:
    """Return a figure, SI, (machines,), of machines (numbers, machines)."""
    found: Floats = plan.read(dict(zip(plan.made, at, strict=True)), {name})[name]
    return found


def farthest(plan: Plan) -> dict[str, Farthest]:
    """Return of each figure the farthest of some machines of the box; not of one that a machine lacks."""
    low, high = (np.array([pair[k] for pair in ends(plan).values()])[:, None] for k in range(2))
    shares = sobol.points(SPREAD, len(low), plan.seed).T
    if len(low) <= MOST_CORNERS:
        corners = np.array(list(itertools.product((0.0, 1.0), repeat=len(low)))).T
    else:
        corners = np.round(sobol.points(2**MOST_CORNERS, len(low), plan.seed + 1).T)
    at = np.hstack([low * (1 - each) + high * each for each in (corners, shares)])
    names = asked(plan)
    read = plan.read(dict(zip(plan.made, at, strict=True)), names)
    found = {}
    for name in (name for name in names if np.isfinite(read[name]).all()):
        tops = {side: int(np.argmax(sign * read[name])) for side, sign in SIDES.items()}
        found[name] = {side: (float(read[name][top]), at[:, top]) for side, top in tops.items()}
    return found


def _climbed(plan: Plan, name: str, sign: float, value: float, at: Floats) -> tuple[float, Floats]:
    """Return the farthest machine near one: points around the best, ever closer, as far as the box goes."""
    low, high = (np.array([pair[k] for pair in ends(plan).values()])[:, None] for k in range(2))
    reach = 1.0
    for turn in range(ROUNDS):
        reach *= SHRUNK
        off = (2 * sobol.points(AROUND, len(low), plan.seed + turn).T - 1) * reach * (high - low)
        near = np.clip(at[:, None] + off, low, high)
        one = at[:, None] + np.zeros((len(at), 2 * len(at)))
        one[:, : len(at)][np.diag_indices(len(at))] = low[:, 0]
        one[:, len(at) :][np.diag_indices(len(at))] = high[:, 0]
        every = np.hstack([near, one])
        values = _at(plan, name, every)
        values = np.where(np.isfinite(values), sign * values, -np.inf)
        top = int(np.argmax(values))
        if values[top] > sign * value:
            value, at = sign * float(values[top]), every[:, top]
    return value, at
