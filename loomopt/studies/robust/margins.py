"""Margins of a design's limits, in standard deviations of their figures, by linearisation."""

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
from loomopt.solving.answer.solution import SIDES, UnitFormatter
from loomopt.studies.tolerance.plan import Criterion, Plan
from loomopt.studies.tolerance.study import Slopes, slopes

ROOM_TOLERANCE = 1e-5
"""Share of a back-off by which the room of a side may differ from it while the side counts as active."""


class Margin(NamedTuple):
    """Side of a limit or band by which machines are accepted.

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
        """Required distance of the mean machine, SI; caps: the most sigmas that a limit has room for."""
        return min(sigmas, caps.get(self.name, math.inf)) * self.sigma

    def back_off(self, sigmas: float, caps: Mapping[str, float]) -> float:
        """Required distance of the nominal design, SI: a multiple of sigma from the mean, and never beyond its end."""
        return max(self.reach(sigmas, caps) + self.shift, 0.0)

    @property
    def key(self) -> tuple[str, int]:
        """Name and sign."""
        return self.name, self.sign


def margins(plan: Plan) -> tuple[Margin, ...]:
    """Margins of all sides of the criteria of a design's machines. Raises BadInput for a figure without a value."""
    sides, by_criterion = list[Margin](), slopes(plan)
    values = plan.read({name: np.full(1, plan.nominal[name]) for name in plan.tolerances})
    bands = {goal.figure for goal in plan.goals}
    for criterion in plan.criteria:
        value = float(values[criterion.name][0]) if criterion.name in values else math.nan
        if not math.isfinite(value) or not all(map(math.isfinite, by_criterion[criterion.name].by_number.values())):
            problem = f"{criterion.name} cannot have a margin, because its spread is unknown"
            raise refusal(problem, plan.scene.origin, f"limits.{criterion.name}", remedy="Take the limit out")
        for sign, end, side in ((-1, criterion.low, "low"), (1, criterion.high, "high")):
            if end is not None and math.isfinite(end):
                way = _way(plan, criterion, by_criterion[criterion.name], side)
                fixed = criterion.name in bands
                slope = _left(plan, criterion, by_criterion[criterion.name], side)
                shift = sign * math.fsum(slope[name] * plan.shifts[name] for name in plan.tolerances)
                room = sign * (end - value) - shift
                sides.append(Margin(criterion.name, sign, room, way, fixed, by_criterion[criterion.name].corner, shift))
    return tuple(sides)


def _way(plan: Plan, criterion: Criterion, slope: Slopes, side: str) -> Floats:
    """Change of a side's room by one standard deviation of each independent number, (numbers,), SI."""
    slopes = _left(plan, criterion, slope, side)
    groups = sorted({tolerance.group for tolerance in plan.tolerances.values() if tolerance.group})
    way = np.zeros(len(plan.tolerances) + len(groups))
    for k, (name, made) in enumerate(plan.tolerances.items()):
        effect = slopes[name] * plan.sigmas[name]
        way[k] = math.sqrt(1 - made.correlation) * effect
        if made.group:
            way[len(plan.tolerances) + groups.index(made.group)] += math.sqrt(made.correlation) * effect
    return way


def _left(plan: Plan, criterion: Criterion, slope: Slopes, side: str) -> dict[str, float]:
    """Slopes of a side's figure, less those of its own end where that is one of the numbers."""
    end = plan.scene.full(criterion.name) if side in criterion.follows else None
    left = {name: slope.steeper[name] - (name == end) for name in plan.tolerances}
    # A figure that is its own limit's number moves with it, and what is left of its slope is rounding.
    return {name: 0.0 if name == end and abs(value) <= ROOM_TOLERANCE else value for name, value in left.items()}


def share(
    sides: Sequence[Margin], sigmas: float, applied: Mapping[tuple[str, int], float], caps: Mapping[str, float]
) -> float:
    """Linear share of machines that satisfy all sides, if every active side has a back-off of `sigmas`.

    applied: the back-off that the design was solved with, SI, by name and sign of a side; caps: the most standard
    deviations that a limit has room for.
    """
    if not sides:
        return 1.0
    rooms = [
        side.room if side.fixed else _room(side, side.back_off(sigmas, caps), applied.get(side.key, 0.0))
        for side in sides
    ]
    ways = np.array([side.way for side in sides])
    high = np.array([room * sign for room, sign in zip(rooms, (side.sign for side in sides), strict=True)])
    low = np.where([side.sign < 0 for side in sides], high, -np.inf)
    high = np.where([side.sign > 0 for side in sides], high, np.inf)
    return joint_normal.within(ways, low, high)


def _room(margin: Margin, back_off: float, applied: float) -> float:
    """Room of a side for the mean machine with another back-off, SI; a side that stopped the design moves with it."""
    is_active = margin.room + margin.shift <= applied * (1 + ROOM_TOLERANCE) + ROOM_TOLERANCE * margin.sigma
    return back_off - margin.shift if is_active else max(margin.room, back_off - margin.shift)


def check_crossings(plan: Plan, sigmas: float) -> None:
    """Raise BadInput where a travel turns so near the level whose crossing a limit reads that some machines' jumps."""
    names, words = {criterion.name for criterion in plan.criteria}, UnitFormatter(plan.scene)
    for name, crossings in registry.of(plan.scene).crossings(plan.scene).items():
        for crossing in crossings if name in names else ():
            level = plan.nominal[crossing.level]
            for angle, height, sigma in _tops(plan, crossing):
                if not abs(height - level) > sigmas * sigma:
                    distance, reach = (words.shown(crossing.level, size, 3) for size in (abs(height - level), sigma))
                    problem = (
                        f"{name} jumps on some machines: at {plan.scene.show(angle, 'angle', 4)} the travel turns "
                        f"{distance} from {crossing.level}, which {sigmas:.3g} sigma of {reach} each reach"
                    )
                    key, remedy = f"operation.{name}", "Tighten the tolerances, or ask for fewer sigmas"
                    raise refusal(problem, plan.scene.origin, key, remedy=remedy)


def _tops(plan: Plan, crossing: Crossing) -> Iterator[tuple[float, float, float]]:
    """Angle, size and its standard deviation, SI, of the extremes of a travel up to the first past a crossing."""
    quantity, side, dwell = crossing.quantity, crossing.side, plan.figures[crossing.figure]
    heights = _extremes(plan.nominal_sampler, quantity, side)
    inside = [angle for angle in heights if 0.0 < angle < dwell]
    beyond = [angle for angle in heights if angle >= dwell][:1]
    here = {angle: heights[angle] for angle in (*inside, *beyond)}
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
    inside = [extreme for extreme in sampler.extremes(quantity) if 0.0 < extreme.u < 1.0]
    return dict(sorted(((side * sampler.angle(extreme)) % turn, abs(extreme.value)) for extreme in inside))


def narrow_band(margins: Sequence[Margin], sigmas: float, caps: Mapping[str, float]) -> tuple[str, float, float] | None:
    """Limit whose band is narrower than back-off on both sides takes, with both widths, SI; None for none."""
    sides: dict[str, dict[int, Margin]] = {}
    for margin in margins:
        if not margin.fixed:
            sides.setdefault(margin.name, {})[margin.sign] = margin
    for name, ends in sides.items():
        if len(ends) < len(SIDES):
            continue
        width, needed = ends[-1].room + ends[1].room, sum(margin.reach(sigmas, caps) for margin in ends.values())
        if width <= needed:
            return name, width, needed
    return None
