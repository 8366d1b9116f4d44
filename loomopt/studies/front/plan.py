"""Which points of a front come next: the widest gaps halved, what is dominated again, what changes narrowed down.

Before changes are narrowed down, and when all is done, each row is tried from the design of either neighbour.

All positions are figures turned so that less is better, divided by the distance of the front's ends: b of the axis that
is limited, a of the axis that is sought. A function of finished rows alone.
"""

import heapq
import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

from loomopt.physics.tolerances import ACCURACY
from loomopt.studies.run.rows import PEAK, Change, Multiplier, Row, Side

ENDS = 0, 1
"""Points where the first axis, and the second, is least."""
BATCH = 8
"""Points of a round."""
NARROW = 1e-5
"""Share of the front within which a change is told, and a gap is not halved any more."""
ALIKE = 1e-7
"""Share of the front by which two points may differ and be one: ten times the usual accuracy."""
BENT = 0.01
"""Share by which slopes on either side of a change must differ for a kink."""
STOPS = 0.1
"""Share of its mean slope that a front must have where it ends, for a kink: beyond it nothing changes any more."""
SHEER, UPRIGHT = 2.0, 100.0
"""Times the steeper slope of two points by which a must fall between them for a jump: where that is narrowed down; and
where rows ran out before, of the front's mean slope too."""
BRANCH = 0.5
"""Share by which the change of a design may differ from that beside it, on one branch."""
SHORT = 16
"""Steps at most in which a design is moved to a neighbour's place where rows ran out before a change was narrow: in one
it may leave its basin."""
MOST_MORE = 3
"""Times the points asked for that rows may come to, with those that narrow changes down and those once dominated."""


class Touched(NamedTuple):
    """What is touched at a place in the cycle, so many times."""

    side: Side
    place: str
    times: int

    def written(self) -> tuple[str, str, int]:
        """Return it as JSON data, from which `touched` makes it again."""
        return self.side.text, self.place, self.times


def touched(row: Row) -> tuple[Touched, ...]:
    """Return what is touched at a certified row."""
    return tuple(Touched(Side.read(side), place, times) for side, place, times in row.warm["active"])


class Spot(NamedTuple):
    """A point of the front. point: its row's; b, a: its place; empty: up to where b may grow and nothing is better.

    slope: da/db; active: what is touched there; x: the variables of its design, SI.
    """

    point: int
    b: float
    a: float
    empty: float
    slope: float
    active: tuple[Touched, ...]
    x: Mapping[str, float] = {}


class FrontScale(NamedTuple):
    """From figures to positions: sign and the ends' distance of either axis (a, b), SI."""

    names: tuple[str, str]
    signs: tuple[int, int]
    origin: tuple[float, float]
    width: tuple[float, float]

    def position(self, axis: int, figure: float) -> float:
        """Return the position of a figure."""
        return (self.signs[axis] * figure - self.origin[axis]) / self.width[axis]

    def figure(self, axis: int, position: float) -> float:
        """Return the figure of a position, SI."""
        return self.signs[axis] * (self.origin[axis] + self.width[axis] * position)


class Next(NamedTuple):
    """A point to come, at most at b.

    near: rows to start from, the first one its parent; again: which row it redoes; fine: whether it narrows a change;
    spare: a row whose design is admissible there, to start from where those lead nowhere; end: which end is sought, at
    any b; beside: the rows on either side, and how far it lies from the first to the second; steps: in how many at most
    the neighbour's design is moved to the row that it redoes, which stands where that is no better; 0 for no trial.
    """

    b: float
    near: tuple[int, ...]
    again: int | None = None
    fine: bool = False
    spare: int | None = None
    end: int | None = None
    beside: tuple[int, int, float] | None = None
    steps: int = 0


def sloped(axes: tuple[str, str]) -> Multiplier:
    """Return what a row calls the slope of the first axis over the second."""
    return Multiplier(axes[0], Side(axes[1]))


def value(row: Row, axis: str) -> float:
    """Return an axis of a certified row, SI; of a magnitude without its sign."""
    return float(row.warm["axes"][axis])


def values(rows: Sequence[Row], axis: str) -> list[float]:
    """Return an axis of certified rows, SI."""
    return [value(row, axis) for row in rows if row.certified]


def spots(rows: Sequence[Row], scale: FrontScale) -> tuple[list[Spot], list[tuple[Row, int]]]:
    """Return the front's points by b, and the rows that another dominates, each with the one that does."""
    known = _best_of_each([row for row in rows if row.certified], scale)
    found = sorted((_spot(row, scale) for row in known), key=lambda spot: (spot.b, spot.a, spot.point))
    front: list[Spot] = []
    worse: list[tuple[Row, int]] = []
    by_point = {row.point: row for row in known}
    for spot in found:
        if not front or spot.a < front[-1].a - ALIKE:
            front.append(spot)
            continue
        if spot.a > front[-1].a + ALIKE:
            worse.append((by_point[spot.point], front[-1].point))
        front[-1] = front[-1]._replace(empty=max(front[-1].empty, spot.empty))
    return front, worse


def _best_of_each(rows: Sequence[Row], scale: FrontScale) -> list[Row]:
    """Return certified rows without those that redo another one in vain, and without those that were bettered so.

    What differs by rounding is in vain: in the place of the other it would have to be tried itself, and so on.
    """
    places = {row.point: [scale.position(k, value(row, name)) for k, name in enumerate(scale.names)] for row in rows}

    def is_no_better(point: int, other: int) -> bool:
        return all(here >= there - ALIKE for here, there in zip(places[point], places[other], strict=True))

    pairs = [(row.point, row.warm["again"]) for row in rows if row.warm["again"] in places]
    vain = {point for point, before in pairs if is_no_better(point, before)}
    bettered = {before for point, before in pairs if point not in vain and is_no_better(before, point)}
    return [row for row in rows if row.point not in vain | bettered]


def _spot(row: Row, scale: FrontScale) -> Spot:
    b, a = scale.position(1, value(row, scale.names[1])), scale.position(0, value(row, scale.names[0]))
    asked = row.place.get(scale.names[1])
    empty = b if asked is None else max(b, scale.position(1, asked))
    slope = row.multipliers.get(sloped(scale.names), 0.0) * scale.width[1] / scale.width[0]
    x = row.warm.get("point", {}).get("x", {})
    return Spot(row.point, b, a, empty, slope * scale.signs[0] * scale.signs[1], touched(row), x)


def following(rows: Sequence[Row], scale: FrontScale, points: int) -> list[Next]:
    """Return the next batch: what is dominated again, the widest gaps until there are enough points, then changes.

    Before these are narrowed down, and after that, each row is tried from the designs of both its neighbours until
    none gets better: a neighbour's basin may be the better one there.
    """
    front, worse = spots(rows, scale)
    by_point = {row.point: row for row in rows}
    apart = basins_apart(rows)
    again = {row.point for row in rows if row.warm.get("again") is not None}
    missed = [
        scale.position(1, row.place[scale.names[1]])
        for row in rows
        if not row.certified and row.place and row.point not in again
    ]
    # Each row is redone once from one that dominates it.
    done = {point for point, _ in _redone(rows)}
    found = [_again(row, by, scale) for row, by in worse if row.point not in done and row.point not in again][:BATCH]
    room = points - len(front) - len(missed)
    rest = MOST_MORE * points - (len(rows) - len(again))
    if room > 0 and rest > 0 and len(found) < BATCH:
        found += [_between(front, b, apart) for b in _halved(front, missed, min(BATCH - len(found), room))]
    if found:
        return found
    changing = _narrowed(front, missed, apart) if rest > 0 else []
    narrowed = [_between(front, b, apart)._replace(fine=True) for b in changing]
    if narrowed and any(row.warm.get("fine") for row in rows):
        return narrowed
    found = _trials(front, by_point, 1, scale)
    return found or narrowed or _trials(front, by_point, SHORT, scale)


def _trials(front: Sequence[Spot], rows: Mapping[int, Row], steps: int, scale: FrontScale) -> list[Next]:
    """Return the rows to be tried from their neighbours' designs: each once from each in one step.

    In several steps only those that still lie apart, of which one touches others or falls steeply to the other. Two on
    one branch are left as they are: there is no other basin to try.
    """
    known = {
        (row.warm["again"], row.parent): row.warm.get("steps") or 1 for row in rows.values() if "again" in row.warm
    }
    lost = _redone(list(rows.values())) - known.keys()
    found = []
    for k, (left, right) in enumerate(itertools.pairwise(front)):
        if _is_one_branch(front, k):
            continue
        wide = right.b - left.b > 2 * NARROW and (_changing(left, right) or _sheer(left, right))
        for here, by in ((left, right), (right, left)):
            pair = here.point, by.point
            row = rows[here.point]
            if pair in lost or known.get(pair, 0) >= steps or (steps > 1 and not (wide and row.place)):
                continue
            found.append(_again(row, by.point, scale)._replace(steps=steps, fine=bool(row.warm.get("fine"))))
    return found


def _is_one_branch(front: Sequence[Spot], k: int) -> bool:
    """Say whether points k and k + 1 lie on one branch: they touch the same, their slopes enclose the fall between
    them, and their designs differ as they do from the next one's.
    """
    left, right = front[k], front[k + 1]
    fall = (right.a - left.a) / (right.b - left.b)
    slopes = sorted((left.slope, right.slope))
    if left.active != right.active or not (left.x and slopes[0] - ALIKE <= fall <= slopes[1] + ALIKE):
        return False
    beside = [spot for spot in (*front[max(k - 1, 0) : k], *front[k + 2 : k + 3]) if spot.active == left.active]
    sizes = {name: max(spot.x[name] for spot in front) - min(spot.x[name] for spot in front) for name in left.x}

    def is_alike(other: Spot) -> bool:
        near = left if other.b < left.b else right
        share = (right.b - left.b) / abs(near.b - other.b)
        sign = 1 if near is left else -1
        for name, size in sizes.items():
            here, there = right.x[name] - left.x[name], share * sign * (near.x[name] - other.x[name])
            if abs(here - there) > ALIKE * size + BRANCH * max(abs(here), abs(there)):
                return False
        return True

    return any(map(is_alike, beside))


def solved_from(row: Row) -> Sequence[int]:
    """Return the rows from whose designs a row was solved, each by a solve of its own."""
    return () if row.warm.get("between") else row.warm.get("near") or ()


def basins_apart(rows: Sequence[Row]) -> set[frozenset[int]]:
    """Return the pairs of rows of which one's design, moved to where the other stands, is another design there."""
    return {
        frozenset((point, by))
        for row in rows
        for by in row.warm.get("apart") or ()
        for point in {row.point, row.warm["again"]} - {None}
    }


def _redone(rows: Sequence[Row]) -> set[tuple[int | None, int | None]]:
    """Return which rows have been redone, each with from which; what was lost with its process stands at its place."""
    found = set[tuple[int | None, int | None]]()
    for row in rows:
        lost = "again" not in row.warm
        alike = (other.point for other in rows if other is not row and other.place == row.place)
        found |= {(point, row.parent) for point in (alike if lost else (row.warm["again"],))}
    return found


def _again(row: Row, by: int, scale: FrontScale) -> Next:
    """Return a row once more, from another: at what was asked there, or as the end that it is."""
    if scale.names[1] in row.place:
        return Next(scale.position(1, row.place[scale.names[1]]), (by,), row.point)
    return Next(scale.position(1, value(row, scale.names[1])), (by,), row.point, end=row.warm.get("end", row.point))


def _halved(front: Sequence[Spot], missed: Sequence[float], room: int) -> list[float]:
    """Return the middles of the widest gaps, each halved again as if its halves were alike."""
    heap = []
    for left, right in itertools.pairwise(front):
        for low, high in _open(left, right, missed):
            share = (high - low) / (right.b - left.empty)
            heap.append((-max(high - low, share * (left.a - right.a)), low, high))
    heapq.heapify(heap)
    found: list[float] = []
    while heap and len(found) < room:
        width, low, high = heapq.heappop(heap)
        middle = (low + high) / 2
        found.append(middle)
        if (high - low) / 2 > NARROW:
            for end in ((low, middle), (middle, high)):
                heapq.heappush(heap, (width / 2, *end))
    return sorted(found)


def _open(left: Spot, right: Spot, missed: Sequence[float]) -> Iterator[tuple[float, float]]:
    """Yield the stretches between two points that are wide enough, parted by what was asked in vain."""
    inner = sorted(b for b in missed if left.empty < b < right.b)
    ends = (left.empty, *inner, right.b)
    yield from ((low, high) for low, high in itertools.pairwise(ends) if high - low > NARROW)


def _narrowed(front: Sequence[Spot], missed: Sequence[float], apart: Collection[frozenset[int]]) -> list[float]:
    """Return where the stretches in which the active set or the basin changes are halved, the widest first.

    At an end what stops the front takes the place of the limit on b: that is no change.
    """
    wide = []
    for left, right in itertools.pairwise(front):
        end = left is front[0] or right is front[-1]
        for low, high in _open(left, right, missed):
            if len(_changing(left, right)) > end or _sheer(left, right) or _are_apart(left, right, apart):
                wide.append((high - low, (low + high) / 2))
    return [b for _, b in sorted(wide, reverse=True)[:BATCH]]


def _are_apart(left: Spot, right: Spot, apart: Collection[frozenset[int]]) -> bool:
    """Say whether the design of one of two points, moved to the other's place, is another one there."""
    return frozenset((left.point, right.point)) in apart


def _changing(left: Spot, right: Spot) -> set[str]:
    """Return the names of what is touched at one of two points only, or elsewhere or otherwise often."""
    return {each.side.limit for each in set(left.active) ^ set(right.active)}


def _between(front: Sequence[Spot], b: float, apart: Collection[frozenset[int]]) -> Next:
    """Return a point with its parent, the nearest (of two the lower), and the other neighbour if it touches others.

    The lower one's design is admissible there. Between two basins either neighbour's design is moved there by itself.
    """
    left = max((spot for spot in front if spot.b <= b), key=lambda spot: spot.b)
    right = min((spot for spot in front if spot.b > b), key=lambda spot: spot.b)
    near, other = sorted((left, right), key=lambda spot: (abs(spot.b - b), spot.point))
    beside = left.point, right.point, (b - left.b) / (right.b - left.b)
    if _are_apart(left, right, apart):
        return Next(b, (near.point, other.point))
    if near.active != other.active:
        return Next(b, (near.point, other.point), beside=beside)
    return Next(b, (near.point,), spare=None if near is left else left.point, beside=beside)


def crossing(left: Spot, right: Spot) -> float | None:
    """Return where the tangents of two points cross, None where they are alike or cross outside."""
    if abs(left.slope - right.slope) <= BENT * max(abs(left.slope), abs(right.slope)):
        return None
    found = (right.a - left.a + left.slope * left.b - right.slope * right.b) / (left.slope - right.slope)
    return found if left.b < found < right.b else None


def changes_and_gaps(
    front: Sequence[Spot], scale: FrontScale, apart: Collection[frozenset[int]] = ()
) -> tuple[list[Change], list[tuple[float, float]]]:
    """Return what changes along the front, and the stretches of b where nothing is better, SI, in the order of b.

    apart: pairs of rows in different basins: from one to the other the design jumps, though neither axis need.
    """
    changes, gaps = list[Change](), list[tuple[float, float]]()
    for left, right in itertools.pairwise(front):
        empty = right.b - left.b > NARROW and right.b - left.empty <= 2 * NARROW and left.empty > left.b + NARROW
        empty = empty or _upright(left, right) or (right.b - left.b <= 2 * NARROW and _sheer(left, right))
        if empty:
            gaps.append((scale.figure(1, left.b), scale.figure(1, right.b)))
        other = _are_apart(left, right, apart)
        if not other and left is front[0] and len(_changing(left, right)) == 1:
            continue
        jumps = empty or other
        moved = {each.side for each in set(left.active) ^ set(right.active)}
        limits = [side for side in moved if side.limit not in scale.names or side.end == PEAK]
        if not jumps and not limits:
            continue
        at = right.b if right is front[-1] and len(_changing(left, right)) == 1 else crossing(left, right)
        narrow = right.b - left.b <= 2 * NARROW
        kind = "jump" if jumps else "kink" if (narrow and at is not None) or _stops(left, right, at) else "active set"
        place = right.b if empty else (left.b + right.b) / 2 if at is None else at
        between = scale.figure(1, left.b), scale.figure(1, right.b)
        changes.append(Change(between, kind, tuple(sorted(limits, key=lambda side: side.text)), scale.figure(1, place)))
    return changes, gaps


def _stops(left: Spot, right: Spot, at: float | None) -> bool:
    """Say whether the front ends in a slope: by the parabola through two points and the slope at the first."""
    secant = (right.a - left.a) / (right.b - left.b)
    return at == right.b and abs(2 * secant - left.slope) > STOPS * abs(secant)


def _sheer(left: Spot, right: Spot) -> bool:
    """Say whether a falls by far more between two points than the steeper of their slopes lets it."""
    steepest = max(abs(left.slope), abs(right.slope)) * (right.b - left.b)
    return left.a - right.a > SHEER * steepest + 100 * NARROW


def _upright(left: Spot, right: Spot) -> bool:
    """Say whether a falls between two points as it does in a jump alone, though rows ran out before it was narrow."""
    steepest = max(abs(left.slope), abs(right.slope), 1.0) * (right.b - left.b)
    return left.a - right.a > UPRIGHT * steepest + 100 * NARROW


def _best(rows: Mapping[int, Row], end: int, name: str, sign: int) -> Row:
    """Return the row of an end: the best of those that sought it."""
    again = [row for row in rows.values() if row.certified and row.warm["again"] == end and not row.place]
    return min((rows[end], *again), key=lambda row: sign * value(row, name))


def scaled(
    rows: Mapping[int, Row],
    names: tuple[str, str],
    signs: tuple[int, int],
    sizes: tuple[float, float],
    accuracy: float = ACCURACY,
) -> FrontScale:
    """Return the scale of a front by its ends: rows 0, where a is least, and 1, where b is; sizes: natural, SI.

    An end that was sought again counts as the better one of both. Of ends that agree to ten times the accuracy that was
    asked the distance is 0.
    """
    ends = [[signs[k] * value(_best(rows, end, names[end], signs[end]), names[k]) for k in (0, 1)] for end in ENDS]
    widths = [abs(one - other) for one, other in zip(*ends, strict=True)]
    least = max(ALIKE, 10 * accuracy)
    wide = tuple(width if width > least * size else 0.0 for width, size in zip(widths, sizes, strict=True))
    return FrontScale(names, signs, (ends[0][0], ends[1][1]), (wide[0], wide[1]))
