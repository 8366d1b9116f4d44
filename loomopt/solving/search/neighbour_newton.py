"""Between two optima that the same rows stop: Newton's method on their KKT systems, for many programs at once.

Each program has a start of its own, between two neighbours' optima, and is taken to where the rows that stop these
are met and the slopes balance; extremes of the cycle are eliminated as they move along. All of a pass are read together
(`certificate.together`), and no program's digits depend on those beside it. What comes of it is a candidate like any
other: tie-broken, certified and made simpler by the steps of every solve. Where that does not end as it should nothing
is guessed: there is no candidate, and the program is solved as if it stood alone.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from loomopt.jobs.base import Job
from loomopt.model.limits import Limit
from loomopt.model.program import Program
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import FEASIBLE, POSITIVE, PRECISE, ROUNDING
from loomopt.solving.certificate.batch_certificate import (
    DesignAt,
    Designs,
    RowDerivatives,
    certify_batch,
    group_equal,
    shares,
    without_extremes,
)
from loomopt.solving.certificate.kkt import ActiveRow
from loomopt.solving.certificate.records import Certificate, FrameRow
from loomopt.solving.certificate.taylor_bounds import cycle_rows
from loomopt.solving.nlp.point import Point, sampler_at
from loomopt.solving.search import tie_break
from loomopt.solving.search.search import Candidate, Search, as_read, objectives

STEPS, SMALL, SMALL_SHIFT = 8, 1e-9, 1e-6
"""Newton's steps, each of which doubles the digits; the step, in natural sizes, after which what is left is below
rounding, and the shift of an extreme, in u, of which only the square moves its value."""

NEAR = 1e-3
"""How far from its start, in natural sizes, beside twice the neighbours' distance a design may end: what is farther may
be another optimum."""

LEVEL = 1e-11
"""Singular value of a KKT matrix, relative to the largest, below which its direction is left alone: a common scale of
all lengths has 1e-16."""


Frame = tuple[FrameRow, ...]


class Optimum(NamedTuple):
    """Where a neighbour's solve ended, tie-broken: variables, SI, and what stops it."""

    x: Mapping[str, float]
    frame: Frame

    def serves(self, program: Program) -> bool:
        """Say whether a program has all that it names."""
        counts = len(program.limits), len(program.objectives)
        named = self.x.keys() >= {v.name for v in program.variables}
        return named and all(row.place < counts[row.level] for row in self.frame)

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON data, from which `read_optimum` makes it again."""
        return {"x": dict(self.x), "frame": [list(row) for row in self.frame]}


def read_optimum(data: Mapping[str, Any]) -> Optimum:
    """Return the optimum that JSON data say."""
    return Optimum(dict(data["x"]), tuple(FrameRow(*row) for row in data["frame"]))


class Between(NamedTuple):
    """A program to be solved between two neighbours' optima: a share of the way from the first to the second.

    told: quantities of its model whose extremes are figures of its design, looked for with the certificate's own.
    """

    search: Search
    first: Optimum
    second: Optimum
    share: float
    told: tuple[str, ...] = ()

    @property
    def frames(self) -> tuple[Frame, ...]:
        """What may stop it: what stops the neighbours, each with the places of its extremes here."""
        frames = self.first.frame, self.second.frame
        if [row.kind for row in frames[0]] != [row.kind for row in frames[1]]:
            return frames
        pairs = zip(*frames, strict=True)
        return (tuple(a if a.u is None or b.u is None else a._replace(u=self._mixed(a.u, b.u)) for a, b in pairs),)

    def _mixed(self, first: float, second: float) -> float:
        return first + self.share * (second - first) if first != second else first

    @property
    def start(self) -> dict[str, float]:
        """Variables, SI, on the way, within this program's bounds."""
        mixed = {
            v.name: self._mixed(self.first.x[v.name], self.second.x[v.name]) for v in self.search.program.variables
        }
        return {v.name: min(max(mixed[v.name], v.lower), v.upper) for v in self.search.program.variables}

    @property
    def width(self) -> float:
        """How far apart the neighbours are, in natural sizes."""
        variables = self.search.program.variables
        return max(abs(self.first.x[v.name] - self.second.x[v.name]) / v.scale for v in variables)


def solved(asked: Sequence[Between]) -> list[Search | None]:
    """Return what each program comes to; None where it must be solved alone."""
    found: list[Search | None] = [None] * len(asked)
    for turn in range(2):
        tried = [(k, each.frames[turn]) for k, each in enumerate(asked) if not found[k] and turn < len(each.frames)]
        ended = _stationary([(asked[k], frame) for k, frame in tried])
        for k, made in zip((k for k, _ in tried), _certified(asked, tried, ended), strict=True):
            found[k] = made
    return found


def moved(asked: Sequence[Between]) -> list[dict[str, float] | None]:
    """Return where the first optimum of each program moves with the rows that stop it: variables, SI, not certified.

    None where it does not come to rest, or one of these rows would let go: then another set of rows stops it there.
    """
    return _stationary([(each, each.first.frame) for each in asked])


@dataclass(frozen=True)
class _Begun:
    """A program at its start with the rows of a frame there."""

    design: DesignAt
    frame: Frame
    width: float


def _stationary(asked: Sequence[tuple[Between, Frame]]) -> list[dict[str, float] | None]:
    """Return the variables, SI, at which the rows of each program's frame are met and its slopes balance."""
    found: list[dict[str, float] | None] = [None] * len(asked)
    begun = [_begun(each, frame) for each, frame in asked]
    known = [(k, each) for k, each in enumerate(begun) if each]
    for places in group_equal([(each.design.batch_key, tuple(row.level for row in each.frame)) for _, each in known]):
        own = [known[place] for place in places]
        for (k, _), x in zip(own, _newton([each for _, each in own]), strict=True):
            found[k] = x
    return found


def _begun(asked: Between, frame: Frame) -> _Begun | None:
    """Return a program at its start; None where that has no real cycle, or a row of the frame is not there."""
    program, start = asked.search.program, asked.start
    sampler = sampler_at(program, start)
    if sampler is None:
        return None
    rows = [_active_row(program, sampler, row) for row in frame]
    if not all(rows):
        return None
    return _Begun(DesignAt(program, start, sampler, tuple(row for row in rows if row)), frame, asked.width)


def _active_row(program: Program, sampler: Sampler, row: FrameRow) -> ActiveRow | None:
    """Return a row of a frame in a program; None where its node lies on no piece of the cycle."""
    node = None
    if row.piece is not None and row.u is not None:
        if row.piece >= sampler.cycle.pieces:
            return None
        node = Extreme(row.piece, row.u, row.sign, row.signed)
    if row.level:
        objective = program.objectives[row.place]
        return ActiveRow(objective.figure, row.reads, objective.scale, row.sign, row.place, 0.0, None, node)
    limit: Limit = program.limits[row.place]
    limit = limit if limit.sign == row.side else replace(limit, sign=row.side)
    return ActiveRow(limit.name, limit.row, limit.scale, row.sign, row.place, 0.0, limit, node)


def _newton(begun: Sequence[_Begun]) -> list[dict[str, float] | None]:
    """Return where Newton's method takes designs of one kind; None where it does not settle near its start."""
    own = Designs([each.design for each in begun])
    pieces = _chosen(begun[0].frame)
    x, u, begin = own.x, own.u, own.x
    weights = np.zeros((len(begun), len(begun[0].frame)))
    settled, lost = np.zeros(len(begun), dtype=bool), np.zeros(len(begun), dtype=bool)
    for step in range(STEPS):
        bent = own.derivatives(x, u)
        lost |= ~np.array([all(np.isfinite(part[lane]).all() for part in bent) for lane in range(len(begun))])
        moving = ~(settled | lost)
        if not moving.any():
            break
        bent = RowDerivatives(*(np.where(lost.reshape(-1, *(1,) * (part.ndim - 1)), 0.0, part) for part in bent))
        move, shift, after = _step(bent, own.inner, pieces, weights if step else None)
        x = np.where(moving[:, None], x + move * own.sizes, x)
        u = np.where(moving[:, None], np.clip(u + shift, 0.0, 1.0), u)
        weights = np.where(moving[:, None], after, weights)
        settled |= (
            moving & (np.abs(move).max(axis=1) <= SMALL) & (np.abs(shift).max(axis=1, initial=0.0) <= SMALL_SHIFT)
        )
    farthest = np.abs((x - begin) / own.sizes).max(axis=1)
    # What stops a design by a negative price does not: such an end is left before anything else is asked of it.
    one_sided = np.array([row.side != 0 or place > 0.0 for row, place in zip(begun[0].frame, pieces, strict=True)])
    lost |= (np.where(one_sided, weights, 0.0) < -POSITIVE).any(axis=1)
    return [
        _ended(each, dict(zip(own.names, x[lane].tolist(), strict=True)))
        if settled[lane] and not lost[lane] and farthest[lane] <= NEAR + 2 * each.width
        else None
        for lane, each in enumerate(begun)
    ]


def _chosen(frame: Frame) -> Floats:
    """Say of each row whether it is a piece of the objective that is sought: 1, else it is kept: 0."""
    last = max(row.place for row in frame if row.level)
    return np.array([float(row.level and row.place == last) for row in frame])


def _step(bent: RowDerivatives, inner: Floats, pieces: Floats, weights: Floats | None) -> tuple[Floats, Floats, Floats]:
    """Return Newton's step (designs, n) in natural sizes, the shifts of extremes (designs, rows), and new multipliers.

    Of: least T with each piece T and each other row 0; weights: the multipliers of the step before, without them those
    that leave the least slope.
    """
    slope, _ = bent.along_u
    share, bends = shares(bent, inner), without_extremes(bent, inner)
    # Each row's extreme is to first order where its slope along u vanishes.
    slopes = bent.slopes[:, :, :-1] - (share * slope)[:, :, None] * bent.bends[:, :, :-1, -1]
    values = bent.values - 0.5 * share * slope * slope
    count, rows, n = slopes.shape
    # The columns of the multipliers: slopes above, what each piece takes of T's own slope below.
    columns = np.concatenate([slopes.swapaxes(1, 2), np.broadcast_to(-pieces, (count, 1, rows))], axis=1)
    target = np.zeros((count, n + 1, 1))
    target[:, n] = -1.0
    if weights is None:
        weights = (np.linalg.pinv(columns, rcond=LEVEL) @ target)[:, :, 0]
    matrix = np.zeros((count, n + 1 + rows, n + 1 + rows))
    matrix[:, :n, :n] = (weights[:, None, :] @ bends.reshape(count, rows, n * n)).reshape(count, n, n)
    matrix[:, : n + 1, n + 1 :] = columns
    matrix[:, n + 1 :, : n + 1] = columns.swapaxes(1, 2)
    # T is counted from the highest piece.
    top = np.where(pieces > 0.0, values, -np.inf).max(axis=1, keepdims=True)
    right = np.concatenate([target[:, :, 0], np.where(pieces > 0.0, top - values, -values)], axis=1)
    found = (np.linalg.pinv(matrix, rcond=LEVEL) @ right[:, :, None])[:, :, 0]
    move = found[:, :n]
    mixed = (bent.bends[:, :, :-1, -1] @ move[:, :, None])[:, :, 0]
    return move, -share * (slope + mixed), found[:, n + 1 :]


def _ended(begun: _Begun, x: Mapping[str, float]) -> dict[str, float] | None:
    """Return variables, SI, put exactly on the bounds that stop them; None where one is beyond its bounds."""
    program = begun.design.program
    bounds = program.bound_limits
    held = {
        bounds[row.place].row: bounds[row.place].value for row in begun.frame if not row.level and row.place in bounds
    }
    full = {**begun.design.x, **x, **held}
    if any(not v.lower - FEASIBLE * v.scale <= full[v.name] <= v.upper + FEASIBLE * v.scale for v in program.variables):
        return None
    return {v.name: min(max(full[v.name], v.lower), v.upper) for v in program.variables}


def _certified(
    asked: Sequence[Between], tried: Sequence[tuple[int, Frame]], ended: Sequence[dict[str, float] | None]
) -> list[Search | None]:
    """Return of each program that was tried the search with its optimum, tie-broken and certified.

    As many at a time as are read together: what one step makes of a design is still there for the next.
    """
    found: list[Search | None] = [None] * len(tried)
    known = [place for place, x in enumerate(ended) if x is not None]
    for group in group_equal([tuple(row.kind for row in tried[place][1]) for place in known]):
        places = [known[k] for k in group]
        own = [(asked[tried[place][0]], x) for place in places if (x := ended[place]) is not None]
        for place, search in zip(places, _judged(own), strict=True):
            found[place] = search
    return found


def _judged(ended: Sequence[tuple[Between, dict[str, float]]]) -> Iterator[Search | None]:
    """Yield the search of each with the optimum that it ended at, variables SI, or None where that is not shown."""
    from loomopt.solving.search import least_change, mass_tradeoff

    searches = [asked.search for asked, _ in ended]
    tidied = [search.job.tidy(search.program, x) for search, (_, x) in zip(searches, ended, strict=True)]
    broken = [tie_break.moved(search.program, x) for search, x in zip(searches, tidied, strict=True)]
    there = [as_read(search, x) for search, (x, _) in zip(searches, broken, strict=True)]
    places = [k for k, (asked, _) in enumerate(ended) if _holds(asked.search.program, there[k], asked.told)]
    wanted = [(searches[k].program, there[k]) for k in places]
    accuracies = {search.settings.accuracy for search in searches}
    certificates = dict(zip(places, certify_batch(wanted, min(accuracies, default=1.0)), strict=True))
    for k, ((_, x), search) in enumerate(zip(ended, searches, strict=True)):
        program, accuracy, certificate = search.program, search.settings.accuracy, certificates.get(k)
        precise = max(min(PRECISE, accuracy), ROUNDING)
        if certificate is None or not (
            certificate.passed and certificate.residual <= precise and certificate.error <= accuracy
        ):
            yield None
            continue
        best, rules = broken[k]
        point = Point(x, "Solve_Succeeded", True, structure=program.structure)
        candidate = Candidate(point, objectives(program, there[k]), 0.0, best, replace(certificate, tie_breaks=rules))
        after = replace(search, candidates=(candidate,), best=candidate, stayed=True)
        open_still = certificate.level and len(least_change.unsettled(after, candidate)[1])
        # What is not as simple as it may be, or has a remark, is told by a search of its own.
        yield after if not open_still and mass_tradeoff.simpler(after) is after else None


def _holds(program: Program, x: Mapping[str, float], told: Sequence[str]) -> bool:
    """Say whether every limit holds at variables x (SI).

    Extremes that the certificate reads, and those of quantities that are told, are looked for at once.
    """
    sampler = sampler_at(program, x)
    if sampler is None:
        return False
    sampler.search((*(name for name, _, _ in cycle_rows(program)), *told))
    return all(limit.violation(sampler) <= FEASIBLE for limit in program.limits)


def optimum(job: Job, program: Program, x: Mapping[str, float], certificate: Certificate) -> Optimum | None:
    """Return an optimum, variables SI as they ended, from which another may begin; None of one that tells no frame."""
    if not (certificate.passed and certificate.frame):
        return None
    return Optimum(job.values(program, job.design(program, x)), certificate.frame)
