"""Worst case of every figure over the box of all tolerances: a search for machines, and a proof by boxes.

Corners, Sobol's points and a search around the best of them give the farthest machine. Its figure plus a small gap is
the claimed end, which is then proven for all machines of the box. A claim that is not proven within the work is
undecided.
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

CLAIM_GAPS = 1e-6, 1e-3
"""Gaps between the farthest machine and the claim, as shares of the figure's range over the box; the second where the
first is not proven."""
ROUNDING = 1e-11
"""Additional gap as a share of the figure: rounding errors of batches of machines."""
SAME_FIGURE = 1e-9
"""Relative difference within which the box formula and the figure of the nominal machine are the same."""
MOST_CORNERS, POINTS = 10, 1024
"""Most numbers of which all corners are read, and number of further points of the box."""
NEAR_POINTS, CONTRACTION, ROUNDS = 64, 0.3, 8
"""Number of points around the farthest machine, contraction of their distance from round to round, and rounds."""
MOST_RAISES = 3
"""Most times that a claim is raised because a machine beyond it exists."""
SIDES = {"min": -1.0, "max": 1.0}


FarthestMachines = dict[str, tuple[float, Floats]]
"""Side → farthest figure, SI, and the numbers of that machine, (numbers,)."""


class Worst(NamedTuple):
    """Worst case of a figure over the box of all tolerances, SI.

    min, max: proven ends, between which the figure lies on every machine; None where undecided. farthest: figures of
    the farthest machines to both sides. why: why an end is undecided, "" otherwise. parts: number of parts of the box
    read.
    """

    min: float | None
    max: float | None
    farthest: tuple[float, float]
    why: str
    parts: int

    @property
    def proven(self) -> bool:
        """Whether both ends are proven."""
        return self.min is not None and self.max is not None

    def as_dict(self) -> dict[str, object]:
        """The part of `tolerance --json` of one figure."""
        farthest = [end if math.isfinite(end) else None for end in self.farthest]
        ends = {"min": self.min, "max": self.max, "proven": self.proven, "found": farthest}
        return {**ends, "parts": self.parts, "why": self.why or None}


def worst_case_names(plan: Plan) -> tuple[str, ...]:
    """Names of figures with a worst case: criteria of the machines, goals, and objectives of the target."""
    goals = [goal.figure for goal in plan.goals]
    objectives = [level.figure for level in plan.program.objectives]
    criteria = [criterion.name for criterion in plan.criteria]
    names = dict.fromkeys(criteria + goals + objectives)
    return tuple(name for name in names if name in plan.figures or name in criteria)


def find_worst_cases(plan: Plan, executor: Executor | None = None) -> Iterator[tuple[str, Worst]]:
    """Yield the worst case of every figure; the result does not depend on the executor."""
    with working():
        names, obstacle = worst_case_names(plan), obstacle_to_proof(plan)
        machines = {} if obstacle else find_farthest(plan)
    if obstacle:
        yield from ((name, Worst(None, None, (math.nan, math.nan), obstacle, 0)) for name in names)
        return
    work = functools.partial(find_worst_case, plan)
    yield from zip(names, (executor.map if executor else map)(work, names, map(machines.get, names)), strict=True)


def box_ends(plan: Plan) -> dict[str, tuple[float, float]]:
    """Box of all tolerances: both ends of every number, SI, rounded outward."""
    pairs = {name: (plan.nominal[name] + plan.shifts[name], half) for name, half in plan.half_widths.items()}
    return {
        name: (float(np.nextafter(at - half, -math.inf)), float(np.nextafter(at + half, math.inf)))
        for name, (at, half) in pairs.items()
    }


@working()
def obstacle_to_proof(plan: Plan) -> str:
    """Reason why no worst case can be proven; "" where all machines of the box are proven to assemble."""
    if not at_once(plan.model):
        return "an effect integrates the motion turn by turn, which boxes do not enclose"
    try:
        box = NumberBox(plan.model, plan.nominal, box_ends(plan))
        for phrase, (quantity, most) in plan.model.assembly.items():
            if not _prove_peak(box, plan.model.signed, quantity, most + ASSEMBLED).proven:
                return f"it is undecided whether all machines assemble: {phrase}"
    except OpenError as error:
        return str(error)
    except ValueError as error:
        return f"a formula does not run in intervals: {error}"
    return ""


def _prove_peak(
    box: NumberBox, signed: frozenset[str], quantity: str, most: float, read: InBox | None = None
) -> Outcome:
    """Prove that the peak of a quantity is at most `most`, SI."""
    has_sign = quantity in signed or (read is not None and read.largest)
    where = read.where if read else None
    parts = [
        part
        for sign in ((1.0,) if has_sign else (1.0, -1.0))
        for part in tolerance_box.over_cycle(box, quantity, sign, where)
    ]
    return tolerance_box.all_at_most(parts, most)


@working()
def find_worst_case(plan: Plan, name: str, farthest: FarthestMachines | None) -> Worst:
    """Worst case of one figure over the box.

    farthest: farthest of some machines, None where one of them lacks the figure.
    """
    if farthest is None:
        why_not = "a machine within the tolerances does not assemble, or lacks the figure"
        return Worst(None, None, (math.nan, math.nan), why_not, 0)
    machines = {side: _search_farther(plan, name, sign, *farthest[side]) for side, sign in SIDES.items()}
    proven_ends: dict[str, float | None] = {}
    parts, reasons = 0, list[str]()
    try:
        read = _box_formula(plan, name)
        if read is None or not _formula_agrees(plan, name, read, machines):
            raise OpenError(f"{name} has no formula for boxes")
        box = NumberBox(plan.model, plan.nominal, box_ends(plan))
        for side, sign in SIDES.items():
            proven_ends[side], machines[side], used, reason = _prove_end(plan, name, box, read, sign, machines)
            parts += used
            reasons += [f"{side} is {reason}"] if reason else []
    except OpenError as error:
        reasons.append(str(error))
    except ValueError as error:
        reasons.append(f"a formula does not run in intervals: {error}")
    farthest_figures = machines["min"][0], machines["max"][0]
    return Worst(proven_ends.get("min"), proven_ends.get("max"), farthest_figures, "; ".join(reasons), parts)


def _prove_end(
    plan: Plan, name: str, box: NumberBox, read: InBox, sign: float, machines: FarthestMachines
) -> tuple[float | None, tuple[float, Floats], int, str]:
    """Proven end of one side, SI, farthest machine, number of parts read, and the reason why there is no end."""
    side = "max" if sign > 0 else "min"
    far, at = machines[side]
    used, raised = 0, 0
    gaps = list(CLAIM_GAPS)
    while gaps:
        width = machines["max"][0] - machines["min"][0]
        bound = far + sign * (gaps[0] * width + ROUNDING * abs(far))
        outcome = _prove_bound(box, read, sign, bound, at, plan)
        used += outcome.parts
        if outcome.proven:
            return bound, (far, at), used, ""
        beyond = _read_figure(plan, name, outcome.open[:, None])[0] if outcome.open is not None else math.nan
        if sign * beyond > sign * bound and raised < MOST_RAISES and outcome.open is not None:
            far, at = _search_farther(plan, name, sign, beyond, outcome.open)
            raised += 1
            continue
        gaps.pop(0)
    return None, (far, at), used, f"undecided after {used} parts of the box"


def _prove_bound(box: NumberBox, read: InBox, sign: float, bound: float, at: Floats, plan: Plan) -> Outcome:
    """Prove sign · figure ≤ sign · bound."""
    signed = plan.model.signed
    if read.rows:
        if sign > 0:
            # The least of the rows is at most the bound where one of them is, all over the box.
            outcomes = [tolerance_box.at_most(_row(box, row, 1.0), bound) for row in read.rows]
            return next((outcome for outcome in outcomes if outcome.proven), outcomes[0])
        return tolerance_box.all_at_most([_row(box, row, -1.0) for row in read.rows], -bound)
    if read.leaves:
        return _prove_crossing(box, read, sign, bound, plan)
    peak = (bound - read.offset) / read.sign
    if sign * read.sign > 0:
        return _prove_peak(box, signed, read.quantity, peak, read)
    return tolerance_box.at_most(Peak(box, read.quantity, _highest_nodes(plan, read, at)), -peak)


def _row(box: NumberBox, row: str, sign: float) -> Single:
    """Function over the box: sign times a row."""
    return Single(box, lambda rows: rows.single(row) * sign)


CROSSING_MARGIN = 2e-9
"""Relative margin beyond a level that a crossing must have: more than what counts as touching."""


def _prove_crossing(box: NumberBox, read: InBox, sign: float, bound: float, plan: Plan) -> Outcome:
    """Prove that |quantity| passes 1 not later, or not earlier, than at the turn `bound`, rad."""
    angle = read.leaves * bound
    if sign < 0:
        both: Sequence[Function] = [tolerance_box.over_angles(box, read.quantity, side, angle) for side in (1.0, -1.0)]
        return tolerance_box.all_at_most(both, 1.0)
    side = math.copysign(1.0, plan.nominal_sampler.at_angle((read.quantity,), angle)[0])
    return tolerance_box.at_most(AtAngle(box, read.quantity, -side, angle), -1.0 - CROSSING_MARGIN)


NODES = 4
"""Number of nodes at which the least value of a peak is read."""


def _highest_nodes(plan: Plan, read: InBox, at: Floats) -> list[tuple[int, float, float]]:
    """Piece, share of it and sign of the highest extremes of a machine."""
    machine = Sampler(plan.model, {**plan.nominal, **dict(zip(plan.tolerances, map(float, at), strict=True))})
    extremes = machine.extremes(read.quantity, read.where)
    if read.largest:
        extremes = [extreme for extreme in extremes if extreme.sign > 0]
    highest = sorted(extremes, key=lambda extreme: -extreme.height)[:NODES]
    return [(extreme.piece, extreme.u, extreme.sign) for extreme in highest]


def _box_formula(plan: Plan, name: str) -> InBox | None:
    """Formula by which a figure is read over boxes; None without one."""
    formula = plan.job.in_boxes(plan.scene, plan.model).get(name)
    if formula is None:
        cycle_limits = (limit for limit in plan.program.limits if isinstance(limit, CycleLimit))
        limit = next((limit for limit in cycle_limits if limit.name == name), None)
        if limit and plan.model.has_quantity(limit.row):
            formula = InBox(quantity=limit.row, sign=float(limit.sign), offset=limit.compared(0.0), where=limit.where)
    return formula


def _formula_agrees(plan: Plan, name: str, read: InBox, machines: FarthestMachines) -> bool:
    """Whether the box formula gives the figure of the nominal machine."""
    nominal = plan.nominal_sampler
    if read.leaves:
        return True
    if read.rows:
        value = min(float(nominal.single(row)) for row in read.rows)
    else:
        extremes = nominal.extremes(read.quantity, read.where)
        heights = [extreme.value if read.largest else extreme.height for extreme in extremes]
        value = read.offset + read.sign * max(heights, default=math.nan)
    figure = _read_figure(plan, name, np.array([plan.nominal[number] for number in plan.tolerances])[:, None])[0]
    size = max(abs(value) for value, _ in machines.values())
    if read.quantity:
        size = max(size, float(np.abs(nominal.at(read.quantity, *nominal.grid())).max()))
    return bool(abs(value - figure) <= SAME_FIGURE * max(size, 1e-300))


# Machines.


def _read_figure(plan: Plan, name: str, at: Floats) -> Floats:
    """A figure, SI, (machines,), of machines (numbers, machines)."""
    values: Floats = plan.read(dict(zip(plan.tolerances, at, strict=True)), {name})[name]
    return values


def find_farthest(plan: Plan) -> dict[str, FarthestMachines]:
    """Farthest machines by figure, among corners and points of the box; without figures that a machine lacks."""
    low, high = (np.array([pair[k] for pair in box_ends(plan).values()])[:, None] for k in range(2))
    points = sobol.points(POINTS, len(low), plan.seed).T
    if len(low) <= MOST_CORNERS:
        corners = np.array(list(itertools.product((0.0, 1.0), repeat=len(low)))).T
    else:
        corners = np.round(sobol.points(2**MOST_CORNERS, len(low), plan.seed + 1).T)
    at = np.hstack([low * (1 - shares) + high * shares for shares in (corners, points)])
    names = worst_case_names(plan)
    figures = plan.read(dict(zip(plan.tolerances, at, strict=True)), names)
    farthest = {}
    for name in (name for name in names if np.isfinite(figures[name]).all()):
        tops = {side: int(np.argmax(sign * figures[name])) for side, sign in SIDES.items()}
        farthest[name] = {side: (float(figures[name][top]), at[:, top]) for side, top in tops.items()}
    return farthest


def _search_farther(plan: Plan, name: str, sign: float, value: float, at: Floats) -> tuple[float, Floats]:
    """Farthest machine near one: points around the best, closer in every round, inside the box."""
    low, high = (np.array([pair[k] for pair in box_ends(plan).values()])[:, None] for k in range(2))
    reach = 1.0
    for turn in range(ROUNDS):
        reach *= CONTRACTION
        off = (2 * sobol.points(NEAR_POINTS, len(low), plan.seed + turn).T - 1) * reach * (high - low)
        near = np.clip(at[:, None] + off, low, high)
        # Machines with one number at an end of its band.
        faces = at[:, None] + np.zeros((len(at), 2 * len(at)))
        faces[:, : len(at)][np.diag_indices(len(at))] = low[:, 0]
        faces[:, len(at) :][np.diag_indices(len(at))] = high[:, 0]
        machines = np.hstack([near, faces])
        values = _read_figure(plan, name, machines)
        values = np.where(np.isfinite(values), sign * values, -np.inf)
        top = int(np.argmax(values))
        if values[top] > sign * value:
            value, at = sign * float(values[top]), machines[:, top]
    return value, at
