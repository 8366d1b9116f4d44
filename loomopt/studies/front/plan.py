"""Next points of a front: the widest gaps are halved, dominated rows redone, and changes located.

Before changes are located, and at the end, each row is solved again from the design of each neighbour.

Positions are figures with the sign for which less is better, divided by the distance of the front's ends: b of the
limited axis, a of the optimised axis. The plan is a function of finished rows only.
"""

import heapq
import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from loomopt.physics.tolerances import ACCURACY
from loomopt.studies.run.rows import PEAK, Change, Multiplier, Row, Side

ENDS = 0, 1
"""Points at which the first, and the second axis is least."""
BATCH = 8
"""Points of a round."""
NARROW = 1e-5
"""Share of the front to which a change is located, and below which a gap is not halved."""
ALIKE = 1e-7
"""Share of the front up to which two points are equal: ten times the usual accuracy."""
BENT = 0.01
"""Share by which slopes on either side of a change must differ for a kink."""
STOPS = 0.1
"""Least slope at an end of the front, as a share of its mean slope, for a kink there: nothing changes beyond the
end."""
SHEER, UPRIGHT = 2.0, 100.0
"""Fall of a between two points for a jump, in multiples of their steeper slope: for a located jump, and for one that is
not located (then also of the front's mean slope)."""
BRANCH = 0.5
"""Relative difference between the change of a design and that of its neighbour, on one branch."""
SHORT = 16
"""Most steps in which a design is moved to a neighbour's place when the rows do not suffice to locate a change: in one
step it may leave its basin."""
UNCERTIFIED = "uncertified", "failed"
"""Statuses of rows that show neither a design nor that there is none."""
MOST_MORE = 3
"""Most rows as a multiple of the requested points, with those that locate changes and those that were dominated."""


class Touched(NamedTuple):
    """A touched side of a limit or figure at a place in the cycle, and the number of times."""

    side: Side
    place: str
    times: int

    def written(self) -> tuple[str, str, int]:
        """The record as JSON data, the input of `touched`."""
        return self.side.text, self.place, self.times


def touched(row: Row) -> tuple[Touched, ...]:
    """Touched sides at a certified row."""
    return tuple(Touched(Side.read(side), place, times) for side, place, times in row.warm["active"])


class Spot(NamedTuple):
    """Point of the front. point: its row; b, a: its position; empty: largest b up to which no design is better.

    slope: da/db; active: touched sides; x: variables of its design, SI.
    """

    point: int
    b: float
    a: float
    empty: float
    slope: float
    active: tuple[Touched, ...]
    x: Mapping[str, float] = {}


class FrontScale(NamedTuple):
    """Scale between figures and positions: sign, origin and width of both axes (a, b), SI."""

    names: tuple[str, str]
    signs: tuple[int, int]
    origin: tuple[float, float]
    width: tuple[float, float]

    def position(self, axis: int, figure: float) -> float:
        """Position of a figure."""
        return (self.signs[axis] * figure - self.origin[axis]) / self.width[axis]

    def figure(self, axis: int, position: float) -> float:
        """Figure of a position, SI."""
        return self.signs[axis] * (self.origin[axis] + self.width[axis] * position)


class Next(NamedTuple):
    """A point to solve, at most at b.

    near: rows to start from, the first one is its parent; again: row that it redoes; fine: whether it locates a change;
    spare: row of an admissible design, to start from if the others fail; end: end of the front, at any b; rows_around:
    the rows on both sides, and the share of the way from the first to the second; steps: most steps in which the
    neighbour's design is moved to the row that it redoes, which stays if that is no better; 0 for no trial.
    """

    b: float
    near: tuple[int, ...]
    again: int | None = None
    fine: bool = False
    spare: int | None = None
    end: int | None = None
    rows_around: tuple[int, int, float] | None = None
    steps: int = 0


def sloped(axes: tuple[str, str]) -> Multiplier:
    """Multiplier of a row for the slope of the first axis over the second."""
    return Multiplier(axes[0], Side(axes[1]))


def value(row: Row, axis: str) -> float:
    """An axis of a certified row, SI; a magnitude has no sign."""
    return float(row.warm["axes"][axis])


def values(rows: Sequence[Row], axis: str) -> list[float]:
    """An axis of certified rows, SI."""
    return [value(row, axis) for row in rows if row.certified]


def spots(rows: Sequence[Row], scale: FrontScale) -> tuple[list[Spot], list[tuple[Row, int]]]:
    """Points of the front by b, and the dominated rows, each with the point that dominates it."""
    candidates = _without_repetitions([row for row in rows if row.certified], scale)
    sorted_spots = sorted((_spot(row, scale) for row in candidates), key=lambda spot: (spot.b, spot.a, spot.point))
    front: list[Spot] = []
    dominated: list[tuple[Row, int]] = []
    by_point = {row.point: row for row in candidates}
    for spot in sorted_spots:
        if not front or spot.a < front[-1].a - ALIKE:
            front.append(spot)
            continue
        if spot.a > front[-1].a + ALIKE:
            dominated.append((by_point[spot.point], front[-1].point))
        front[-1] = front[-1]._replace(empty=max(front[-1].empty, spot.empty))
    return front, dominated


def _without_repetitions(rows: Sequence[Row], scale: FrontScale) -> list[Row]:
    """Certified rows without vain repetitions, and without rows that a repetition improves.

    A repetition that differs by rounding is vain; in place of the first row it would have to be repeated again.
    """
    places = {row.point: [scale.position(k, value(row, name)) for k, name in enumerate(scale.names)] for row in rows}

    def is_no_better(point: int, other_point: int) -> bool:
        return all(
            position >= other_position - ALIKE
            for position, other_position in zip(places[point], places[other_point], strict=True)
        )

    pairs = [(row.point, row.warm["again"]) for row in rows if row.warm["again"] in places]
    vain = {point for point, first in pairs if is_no_better(point, first)}
    bettered = {first for point, first in pairs if point not in vain and is_no_better(first, point)}
    return [row for row in rows if row.point not in vain | bettered]


def _spot(row: Row, scale: FrontScale) -> Spot:
    b, a = scale.position(1, value(row, scale.names[1])), scale.position(0, value(row, scale.names[0]))
    requested = row.place.get(scale.names[1])
    empty = b if requested is None else max(b, scale.position(1, requested))
    slope = row.multipliers.get(sloped(scale.names), 0.0) * scale.width[1] / scale.width[0]
    x = row.warm.get("point", {}).get("x", {})
    return Spot(row.point, b, a, empty, slope * scale.signs[0] * scale.signs[1], touched(row), x)


def following(rows: Sequence[Row], scale: FrontScale, points: int) -> list[Next]:
    """Next batch: dominated rows again, the widest gaps until there are enough points, then changes.

    Before changes are located, and after that, each row is solved again from the designs of both neighbours until none
    improves: a neighbour's basin may be the better one there. At last, rows without a certificate are tried once more.
    """
    front, dominated = spots(rows, scale)
    by_point = {row.point: row for row in rows}
    apart = basins_apart(rows)
    again = {row.point for row in rows if row.warm.get("again") is not None}
    failed_positions = [
        scale.position(1, row.place[scale.names[1]])
        for row in rows
        if not row.certified and row.place and row.point not in again
    ]
    # Each row is redone once, from a row that dominates it.
    redone_points = {point for point, _ in _redone(rows)}
    next_points = [
        _again(row, dominating, scale)
        for row, dominating in dominated
        if row.point not in redone_points and row.point not in again
    ][:BATCH]
    points_left = points - len(front) - len(failed_positions)
    rows_left = MOST_MORE * points - (len(rows) - len(again))
    if points_left > 0 and rows_left > 0 and len(next_points) < BATCH:
        next_points += [
            _next_point(front, b, apart)
            for b in _halved(front, failed_positions, min(BATCH - len(next_points), points_left))
        ]
    if next_points:
        return next_points
    changing = _narrowed(front, failed_positions, apart) if rows_left > 0 else []
    narrowed = [_next_point(front, b, apart)._replace(fine=True) for b in changing]
    if narrowed and any(row.warm.get("fine") for row in rows):
        return narrowed
    next_points = _trials(front, by_point, 1, scale)
    return next_points or narrowed or _trials(front, by_point, SHORT, scale) or _retries(front, rows, scale)


def _retries(front: Sequence[Spot], rows: Sequence[Row], scale: FrontScale) -> list[Next]:
    """Rows without a certificate that are solved once more, from neighbours that are nearer now.

    The neighbours from which such a row was first solved may lie across a jump; later rows locate it.
    """
    redone_points = {point for point, _ in _redone(rows)}
    retries = []
    for row in rows:
        if row.status not in UNCERTIFIED or not row.warm.get("near") or row.point in redone_points:
            continue
        if row.warm.get("again") is not None or not row.place:
            continue
        b = scale.position(1, row.place[scale.names[1]])
        left = max((spot for spot in front if spot.b <= b), key=lambda spot: spot.b, default=None)
        right = min((spot for spot in front if spot.b > b), key=lambda spot: spot.b, default=None)
        near = tuple(spot.point for spot in (left, right) if spot)
        if near and not set(near) <= set(row.warm["near"]):
            retries.append(Next(b, near, row.point, fine=bool(row.warm.get("fine"))))
    return retries[:BATCH]


def _trials(front: Sequence[Spot], rows: Mapping[int, Row], steps: int, scale: FrontScale) -> list[Next]:
    """Rows to be solved again from their neighbours' designs: each once from each neighbour, in one step.

    In several steps only pairs that are still far apart, with different touched sides or a steep fall. A pair on one
    branch is skipped: it has no other basin.
    """
    steps_done = {
        (row.warm["again"], row.parent): row.warm.get("steps") or 1 for row in rows.values() if "again" in row.warm
    }
    lost_pairs = _redone(list(rows.values())) - steps_done.keys()
    trials = []
    sizes = {name: _width(front, name) for name in {name for spot in front for name in spot.x}}
    for k, (left, right) in enumerate(itertools.pairwise(front)):
        if _is_one_branch(front, k, sizes):
            continue
        wide = right.b - left.b > 2 * NARROW and (_changing(left, right) or _sheer(left, right))
        for spot, neighbour in ((left, right), (right, left)):
            pair = spot.point, neighbour.point
            row = rows[spot.point]
            if pair in lost_pairs or steps_done.get(pair, 0) >= steps or (steps > 1 and not (wide and row.place)):
                continue
            trials.append(_again(row, neighbour.point, scale)._replace(steps=steps, fine=bool(row.warm.get("fine"))))
    return trials


def _width(front: Sequence[Spot], name: str) -> float:
    """Width of the range of a variable on the front, SI."""
    numbers = [spot.x[name] for spot in front if name in spot.x]
    return max(numbers) - min(numbers)


def _is_one_branch(front: Sequence[Spot], k: int, sizes: Mapping[str, float]) -> bool:
    """Whether points k and k + 1 lie on one branch.

    They touch the same sides, their slopes enclose the fall between them, and their designs differ as they differ from
    the next point's. sizes: width of each variable's range on the front, SI.
    """
    left, right = front[k], front[k + 1]
    fall = (right.a - left.a) / (right.b - left.b)
    slopes = sorted((left.slope, right.slope))
    if left.active != right.active or not (left.x and slopes[0] - ALIKE <= fall <= slopes[1] + ALIKE):
        return False
    neighbours = [spot for spot in (*front[max(k - 1, 0) : k], *front[k + 2 : k + 3]) if spot.active == left.active]

    def is_alike(other: Spot) -> bool:
        near = left if other.b < left.b else right
        share = (right.b - left.b) / abs(near.b - other.b)
        sign = 1 if near is left else -1
        for name in left.x:
            size = sizes[name]
            change, expected = right.x[name] - left.x[name], share * sign * (near.x[name] - other.x[name])
            if abs(change - expected) > ALIKE * size + BRANCH * max(abs(change), abs(expected)):
                return False
        return True

    return any(map(is_alike, neighbours))


def solved_from(row: Row) -> Sequence[int]:
    """Rows from whose designs a row was solved, each by a separate solve."""
    return () if row.warm.get("between") else row.warm.get("near") or ()


def basins_apart(rows: Sequence[Row]) -> set[frozenset[int]]:
    """Pairs of rows of which the design of one, moved to the other's place, stays a different design."""
    return {
        frozenset((point, neighbour))
        for row in rows
        for neighbour in row.warm.get("apart") or ()
        for point in {row.point, row.warm["again"]} - {None}
    }


def _redone(rows: Sequence[Row]) -> set[tuple[int | None, int | None]]:
    """Pairs of redone rows and the rows they were redone from; a row lost with its process counts at its place."""
    pairs = set[tuple[int | None, int | None]]()
    for row in rows:
        lost = "again" not in row.warm
        same_place = (other.point for other in rows if other is not row and other.place == row.place)
        pairs |= {(point, row.parent) for point in (same_place if lost else (row.warm["again"],))}
    return pairs


def _again(row: Row, by: int, scale: FrontScale) -> Next:
    """A row once more, from another row: at the requested place, or as an end of the front."""
    if scale.names[1] in row.place:
        return Next(scale.position(1, row.place[scale.names[1]]), (by,), row.point)
    return Next(scale.position(1, value(row, scale.names[1])), (by,), row.point, end=row.warm.get("end", row.point))


def _halved(front: Sequence[Spot], missed: Sequence[float], room: int) -> list[float]:
    """Middles of the widest gaps; the halves are halved again as if they were equal."""
    heap = []
    for left, right in itertools.pairwise(front):
        for low, high in _open(left, right, missed):
            share = (high - low) / (right.b - left.empty)
            heap.append((-max(high - low, share * (left.a - right.a)), low, high))
    heapq.heapify(heap)
    middles: list[float] = []
    while heap and len(middles) < room:
        width, low, high = heapq.heappop(heap)
        middle = (low + high) / 2
        middles.append(middle)
        if (high - low) / 2 > NARROW:
            for end in ((low, middle), (middle, high)):
                heapq.heappush(heap, (width / 2, *end))
    return sorted(middles)


def _open(left: Spot, right: Spot, missed: Sequence[float]) -> Iterator[tuple[float, float]]:
    """Yield the intervals between two points that are wide enough, split at failed positions."""
    inner = sorted(b for b in missed if left.empty < b < right.b)
    ends = (left.empty, *inner, right.b)
    yield from ((low, high) for low, high in itertools.pairwise(ends) if high - low > NARROW)


def _narrowed(front: Sequence[Spot], missed: Sequence[float], apart: Collection[frozenset[int]]) -> list[float]:
    """Middles of the intervals in which the active set or the basin changes, the widest first.

    At an end, the row that stops the front replaces the limit on b: that is no change.
    """
    wide = []
    for left, right in itertools.pairwise(front):
        end = left is front[0] or right is front[-1]
        for low, high in _open(left, right, missed):
            if len(_changing(left, right)) > end or _sheer(left, right) or _are_apart(left, right, apart):
                wide.append((high - low, (low + high) / 2))
    return [b for _, b in sorted(wide, reverse=True)[:BATCH]]


def _are_apart(left: Spot, right: Spot, apart: Collection[frozenset[int]]) -> bool:
    """Whether the design of one of two points, moved to the other's place, stays a different design."""
    return frozenset((left.point, right.point)) in apart


def _changing(left: Spot, right: Spot) -> set[str]:
    """Names of the sides that are touched at one of two points only, or elsewhere, or a different number of times."""
    return {touched_side.side.limit for touched_side in set(left.active) ^ set(right.active)}


def _next_point(front: Sequence[Spot], b: float, apart: Collection[frozenset[int]]) -> Next:
    """A point with its parent, the nearest one (of two the lower), and the other neighbour if it touches others.

    The design of the lower neighbour is admissible there. Between two basins the designs of both neighbours are used.
    """
    left = max((spot for spot in front if spot.b <= b), key=lambda spot: spot.b)
    right = min((spot for spot in front if spot.b > b), key=lambda spot: spot.b)
    near, farther = sorted((left, right), key=lambda spot: (abs(spot.b - b), spot.point))
    rows_around = left.point, right.point, (b - left.b) / (right.b - left.b)
    if _are_apart(left, right, apart):
        return Next(b, (near.point, farther.point))
    if near.active != farther.active:
        return Next(b, (near.point, farther.point), rows_around=rows_around)
    return Next(b, (near.point,), spare=None if near is left else left.point, rows_around=rows_around)


def crossing(left: Spot, right: Spot) -> float | None:
    """Position at which the tangents of two points cross; None where they are alike or cross outside."""
    if abs(left.slope - right.slope) <= BENT * max(abs(left.slope), abs(right.slope)):
        return None
    position = (right.a - left.a + left.slope * left.b - right.slope * right.b) / (left.slope - right.slope)
    return position if left.b < position < right.b else None


def changes_and_gaps(
    front: Sequence[Spot], scale: FrontScale, apart: Collection[frozenset[int]] = ()
) -> tuple[list[Change], list[tuple[float, float]]]:
    """Changes along the front, and the intervals of b without a better design, SI, in the order of b.

    apart: pairs of rows in different basins: the design jumps between them, although the axes may not.
    """
    changes, gaps = list[Change](), list[tuple[float, float]]()
    for left, right in itertools.pairwise(front):
        empty = right.b - left.b > NARROW and right.b - left.empty <= 2 * NARROW and left.empty > left.b + NARROW
        empty = empty or _upright(left, right) or (right.b - left.b <= 2 * NARROW and _sheer(left, right))
        if empty:
            gaps.append((scale.figure(1, left.b), scale.figure(1, right.b)))
        is_basin_change = _are_apart(left, right, apart)
        if not is_basin_change and left is front[0] and len(_changing(left, right)) == 1:
            continue
        jumps = empty or is_basin_change
        changed_sides = {touched_side.side for touched_side in set(left.active) ^ set(right.active)}
        limits = [side for side in changed_sides if side.limit not in scale.names or side.end == PEAK]
        if not jumps and not limits:
            continue
        at = right.b if right is front[-1] and len(_changing(left, right)) == 1 else crossing(left, right)
        narrow = right.b - left.b <= 2 * NARROW
        kind = "jump" if jumps else "kink" if (narrow and at is not None) or _stops(left, right, at) else "active set"
        place = right.b if empty else (left.b + right.b) / 2 if at is None else at
        interval = scale.figure(1, left.b), scale.figure(1, right.b)
        changes.append(
            Change(interval, kind, tuple(sorted(limits, key=lambda side: side.text)), scale.figure(1, place))
        )
    return changes, gaps


def _stops(left: Spot, right: Spot, at: float | None) -> bool:
    """Whether the front ends with a slope, by the parabola through two points and the slope at the first."""
    secant = (right.a - left.a) / (right.b - left.b)
    return at == right.b and abs(2 * secant - left.slope) > STOPS * abs(secant)


def _sheer(left: Spot, right: Spot) -> bool:
    """Whether a falls far more between two points than the steeper of their slopes allows."""
    steepest = max(abs(left.slope), abs(right.slope)) * (right.b - left.b)
    return left.a - right.a > SHEER * steepest + 100 * NARROW


def _upright(left: Spot, right: Spot) -> bool:
    """Whether a falls between two points as only in a jump, although the jump is not located closely."""
    steepest = max(abs(left.slope), abs(right.slope), 1.0) * (right.b - left.b)
    return left.a - right.a > UPRIGHT * steepest + 100 * NARROW


def _best(rows: Mapping[int, Row], end: int, name: str, sign: int) -> Row:
    """Row of an end: the best of its solved rows."""
    again = [row for row in rows.values() if row.certified and row.warm["again"] == end and not row.place]
    return min((rows[end], *again), key=lambda row: sign * value(row, name))


def scaled(
    rows: Mapping[int, Row],
    names: tuple[str, str],
    signs: tuple[int, int],
    sizes: tuple[float, float],
    accuracy: float = ACCURACY,
) -> FrontScale:
    """Scale of a front by its ends: rows 0, where a is least, and 1, where b is; sizes: of the axes, SI.

    Of an end that was solved twice the better row counts. Ends that agree to ten times the accuracy have the distance
    0.
    """
    ends = [[signs[k] * value(_best(rows, end, names[end], signs[end]), names[k]) for k in (0, 1)] for end in ENDS]
    widths = [abs(first - second) for first, second in zip(*ends, strict=True)]
    tolerance = max(ALIKE, 10 * accuracy)
    wide = tuple(width if width > tolerance * size else 0.0 for width, size in zip(widths, sizes, strict=True))
    return FrontScale(names, signs, (ends[0][0], ends[1][1]), (wide[0], wide[1]))
