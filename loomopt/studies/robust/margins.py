"""What a design's limits leave to its machines: each side's room in standard deviations of its own figure, linear."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from loomopt.base.errors import refusal
from loomopt.jobs import registry
from loomopt.jobs.base import Crossing
from loomopt.maths import joint_normal
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.cycle import Floats
from loomopt.solving.answer.solution import SIDES, Words
from loomopt.studies.tolerance.plan import Criterion, Plan
from loomopt.studies.tolerance.study import Slopes, slopes

MET = 1e-5
"""Share of a back-off by which a side's room may differ from it and the side counts as met."""


class Margin(NamedTuple):
    """One side of what machines are judged by.

    sign: +1 where the figure may be no more; room: how far the mean machine keeps clear, SI; way: what each
    independent standard normal number does to what is left of it, (numbers,), SI; fixed: whether nothing backs it off;
    shift: how much nearer to its end the mean machine is than the nominal design, SI, by bands that are not even.
    """

    name: str
    sign: int
    room: float
    way: Floats
    fixed: bool
    corner: bool
    shift: float = 0.0

    @property
    def sigma(self) -> float:
        """The standard deviation, SI."""
        return float(np.linalg.norm(self.way))

    def reach(self, sigmas: float, caps: Mapping[str, float]) -> float:
        """How far the mean machine must keep clear, SI; caps: the most sigmas that a limit has room for."""
        return min(sigmas, caps.get(self.name, math.inf)) * self.sigma

    def back_off(self, sigmas: float, caps: Mapping[str, float]) -> float:
        """How far the nominal design must keep clear, SI: of so many sigmas from the mean, and never beyond its end."""
        return max(self.reach(sigmas, caps) + self.shift, 0.0)

    @property
    def key(self) -> tuple[str, int]:
        """Name and sign."""
        return self.name, self.sign


def margins(plan: Plan) -> tuple[Margin, ...]:
    """Margins of all sides of the criteria of a design's machines. Raises BadInput for a figure without a value."""
    found, own = list[Margin](), slopes(plan)
    values = plan.read({name: np.full(1, plan.nominal[name]) for name in plan.tolerances})
    bands = {goal.figure for goal in plan.goals}
    for each in plan.criteria:
        value = float(values[each.name][0]) if each.name in values else math.nan
        if not math.isfinite(value) or not all(map(math.isfinite, own[each.name].by_number.values())):
            problem = f"the spread of {each.name} is unknown, so that it cannot be backed off"
            raise refusal(problem, plan.scene.origin, f"limits.{each.name}", remedy="Take the limit out")
        for sign, end, side in ((-1, each.low, "low"), (1, each.high, "high")):
            if end is not None and math.isfinite(end):
                way = _way(plan, each, own[each.name], side)
                fixed = each.name in bands
                left = _left(plan, each, own[each.name], side)
                shift = sign * math.fsum(left[name] * plan.shifts[name] for name in plan.tolerances)
                room = sign * (end - value) - shift
                found.append(Margin(each.name, sign, room, way, fixed, own[each.name].corner, shift))
    return tuple(found)


def _way(plan: Plan, judged: Criterion, slope: Slopes, side: str) -> Floats:
    """Change of a side's room by one standard deviation of each independent number, (numbers,), SI."""
    left = _left(plan, judged, slope, side)
    groups = sorted({each.group for each in plan.tolerances.values() if each.group})
    way = np.zeros(len(plan.tolerances) + len(groups))
    for k, (name, made) in enumerate(plan.tolerances.items()):
        moved = left[name] * plan.sigmas[name]
        way[k] = math.sqrt(1 - made.correlation) * moved
        if made.group:
            way[len(plan.tolerances) + groups.index(made.group)] += math.sqrt(made.correlation) * moved
    return way


def _left(plan: Plan, judged: Criterion, slope: Slopes, side: str) -> dict[str, float]:
    """Slopes of a side's figure, less those of its own end where that is one of the numbers."""
    end = plan.scene.full(judged.name) if side in judged.follows else None
    left = {name: slope.steeper[name] - (name == end) for name in plan.tolerances}
    # A figure that is its own limit's number moves with it, and what is left of its slope is rounding.
    return {name: 0.0 if name == end and abs(value) <= MET else value for name, value in left.items()}


def share(
    found: Sequence[Margin], sigmas: float, applied: Mapping[tuple[str, int], float], caps: Mapping[str, float]
) -> float:
    """Linear share of machines that hold all sides, were each back-off that is met one of `sigmas`.

    applied: the back-off that the design was solved with, SI, by name and sign of a side; caps: the most standard
    deviations that a limit has room for.
    """
    if not found:
        return 1.0
    rooms = [
        each.room if each.fixed else _room(each, each.back_off(sigmas, caps), applied.get(each.key, 0.0))
        for each in found
    ]
    ways = np.array([each.way for each in found])
    high = np.array([room * sign for room, sign in zip(rooms, (each.sign for each in found), strict=True)])
    low = np.where([each.sign < 0 for each in found], high, -np.inf)
    high = np.where([each.sign > 0 for each in found], high, np.inf)
    return joint_normal.within(ways, low, high)


def _room(margin: Margin, wanted: float, applied: float) -> float:
    """What a side leaves to the mean machine with another back-off, SI; one that stopped the design goes along."""
    met = margin.room + margin.shift <= applied * (1 + MET) + MET * margin.sigma
    return wanted - margin.shift if met else max(margin.room, wanted - margin.shift)


def check_crossings(plan: Plan, sigmas: float) -> None:
    """Raise BadInput where a travel turns so near the level whose crossing a limit reads that some machines' jumps."""
    judged, words = {each.name for each in plan.criteria}, Words(plan.scene)
    for name, crossings in registry.of(plan.scene).crossings(plan.scene).items():
        for crossing in crossings if name in judged else ():
            level = plan.nominal[crossing.level]
            for angle, height, sigma in _tops(plan, crossing):
                if not abs(height - level) > sigmas * sigma:
                    beside, reach = (words.shown(crossing.level, size, 3) for size in (abs(height - level), sigma))
                    problem = (
                        f"{name} jumps on some machines: at {plan.scene.show(angle, 'angle', 4)} the travel turns "
                        f"{beside} from {crossing.level}, which {sigmas:.3g} sigma of {reach} each reach"
                    )
                    key, remedy = f"operation.{name}", "Tighten the tolerances, or ask for fewer sigmas"
                    raise refusal(problem, plan.scene.origin, key, remedy=remedy)


def _tops(plan: Plan, crossing: Crossing) -> Iterator[tuple[float, float, float]]:
    """Angle, size and its standard deviation, SI, of the extremes of a travel up to the first past a crossing."""
    quantity, side, dwell = crossing.quantity, crossing.side, plan.figures[crossing.figure]
    found = _extremes(plan.nominal_sampler, quantity, side)
    inside = [angle for angle in found if 0.0 < angle < dwell]
    beyond = [angle for angle in found if angle >= dwell][:1]
    here = {angle: found[angle] for angle in (*inside, *beyond)}
    for angle, height in here.items():
        # To first order an extreme is as high as the curve at its angle.
        sides = [
            [abs(_moved(plan, name, turn).at_angle((quantity,), side * angle)[0]) for turn in (1, -1)]
            for name in plan.tolerances
        ]
        yield side * angle, height, math.hypot(*((above - below) / 2 for above, below in sides))


def _moved(plan: Plan, name: str, sigmas: int) -> Sampler:
    """Machine with one number moved by a multiple of its standard deviation."""
    return sampled(plan.model, {**plan.nominal, name: plan.nominal[name] + sigmas * plan.sigmas[name]})


def _extremes(sampler: Sampler, quantity: str, side: int) -> dict[float, float]:
    """Extremes of |quantity| by the crank's turn from angle 0 to one side, in order."""
    turn = 2 * math.pi
    # What is highest at an end of a piece only turns with the cycle's pieces.
    inside = [each for each in sampler.extremes(quantity) if 0.0 < each.u < 1.0]
    return dict(sorted(((side * sampler.angle(each)) % turn, abs(each.value)) for each in inside))


def narrow_band(found: Sequence[Margin], sigmas: float, caps: Mapping[str, float]) -> tuple[str, float, float] | None:
    """Limit whose band is narrower than back-off on both sides takes, with both widths, SI; None for none."""
    sides: dict[str, dict[int, Margin]] = {}
    for each in found:
        if not each.fixed:
            sides.setdefault(each.name, {})[each.sign] = each
    for name, own in sides.items():
        if len(own) < len(SIDES):
            continue
        width, needed = own[-1].room + own[1].room, sum(each.reach(sigmas, caps) for each in own.values())
        if width <= needed:
            return name, width, needed
    return None
