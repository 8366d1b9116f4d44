"""Newton's method on the KKT systems of many programs between two optima with the same active rows.

Each program starts between the optima of two neighbours and is moved to the point at which their active rows hold and
the slopes balance; extremes of the cycle are eliminated. All programs of a batch are evaluated in one pass
(`certificate.batch_derivatives`), and no result depends on the rest of the batch. The result is a candidate like that
of every solve: tie-broken, certified and simplified. If a step fails there is no candidate, and the program is solved
alone.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from loomopt.jobs.base import Job
from loomopt.model.limits import Limit
from loomopt.model.program import Program
from loomopt.model.reading import group_equal
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import FEASIBLE, POSITIVE, PRECISE, ROUNDING
from loomopt.solving.certificate.batch_certificate import certify_batch
from loomopt.solving.certificate.batch_derivatives import DesignAt, Designs, RowDerivatives, shares, without_extremes
from loomopt.solving.certificate.kkt import ActiveRow
from loomopt.solving.certificate.records import Certificate, FrameRow
from loomopt.solving.certificate.taylor_bounds import cycle_rows
from loomopt.solving.nlp.point import Point, sampler_at, search_extremes
from loomopt.solving.search import tie_break
from loomopt.solving.search.search import Candidate, Search, objectives, printed_design

STEPS, SMALL, SMALL_SHIFT = 8, 1e-9, 1e-6
"""Most Newton steps, each of which doubles the digits; the scaled step after which the error is below rounding, and the
shift of an extreme, in u, whose square is the error of its value."""

NEAR = 1e-3
"""Farthest scaled distance between start and end, besides twice the neighbours' distance: a farther end may be another
optimum."""

LEVEL = 1e-11
"""Relative singular value of a KKT matrix below which its direction is ignored: a common scale of all lengths has
1e-16."""


Frame = tuple[FrameRow, ...]


class Optimum(NamedTuple):
    """End of a neighbour's solve, tie-broken: variables, SI, and the rows that stop it."""

    x: Mapping[str, float]
    frame: Frame

    def serves(self, program: Program) -> bool:
        """Whether a program has all variables and rows of this optimum."""
        counts = len(program.limits), len(program.objectives)
        has_variables = self.x.keys() >= {v.name for v in program.variables}
        return has_variables and all(row.place < counts[row.level] for row in self.frame)

    def as_dict(self) -> dict[str, Any]:
        """JSON data, the input of `read_optimum`."""
        return {"x": dict(self.x), "frame": [list(row) for row in self.frame]}


def read_optimum(data: Mapping[str, Any]) -> Optimum:
    """Optimum of JSON data."""
    return Optimum(dict(data["x"]), tuple(FrameRow(*row) for row in data["frame"]))


class NeighbourTask(NamedTuple):
    """A program between two neighbours' optima, at a share of the way from the first to the second.

    peaks: quantities whose extremes are figures of the design, searched together with the certificate's quantities.
    """

    search: Search
    first: Optimum
    second: Optimum
    share: float
    peaks: tuple[str, ...] = ()

    @property
    def frames(self) -> tuple[Frame, ...]:
        """Rows that may stop it: those of the neighbours, with interpolated places of their extremes."""
        frames = self.first.frame, self.second.frame
        if [row.kind for row in frames[0]] != [row.kind for row in frames[1]]:
            return frames
        pairs = zip(*frames, strict=True)
        return (
            tuple(a if a.u is None or b.u is None else a._replace(u=self._interpolate(a.u, b.u)) for a, b in pairs),
        )

    def _interpolate(self, first: float, second: float) -> float:
        return first + self.share * (second - first) if first != second else first

    @property
    def start(self) -> dict[str, float]:
        """Interpolated variables, SI, within this program's bounds."""
        mixed = {
            v.name: self._interpolate(self.first.x[v.name], self.second.x[v.name])
            for v in self.search.program.variables
        }
        return {v.name: min(max(mixed[v.name], v.lower), v.upper) for v in self.search.program.variables}

    @property
    def width(self) -> float:
        """Distance of the neighbours, scaled."""
        variables = self.search.program.variables
        return max(abs(self.first.x[v.name] - self.second.x[v.name]) / v.scale for v in variables)


def solve_neighbours(requests: Sequence[NeighbourTask]) -> list[Search | None]:
    """Searches of programs with their optima; None for a program that must be solved alone."""
    searches: list[Search | None] = [None] * len(requests)
    for turn in range(2):
        attempts = [
            (k, request.frames[turn])
            for k, request in enumerate(requests)
            if not searches[k] and turn < len(request.frames)
        ]
        ends = _stationary([(requests[k], frame) for k, frame in attempts])
        for k, search in zip((k for k, _ in attempts), _certify_ends(requests, attempts, ends), strict=True):
            searches[k] = search
    return searches


def move_with_rows(requests: Sequence[NeighbourTask]) -> list[dict[str, float] | None]:
    """Variables, SI, to which the first optimum of each program moves with its active rows; not certified.

    None where Newton's method does not converge, or where a multiplier becomes negative: then other rows stop it.
    """
    return _stationary([(request, request.first.frame) for request in requests])


@dataclass(frozen=True)
class _StartDesign:
    """A program at its start, with the rows of a frame."""

    design: DesignAt
    frame: Frame
    width: float


def _stationary(requests: Sequence[tuple[NeighbourTask, Frame]]) -> list[dict[str, float] | None]:
    """Variables, SI, at which the rows of each program's frame hold and its slopes balance."""
    designs: list[dict[str, float] | None] = [None] * len(requests)
    starts = [_start_design(start, frame) for start, frame in requests]
    valid_starts = [(k, start) for k, start in enumerate(starts) if start]
    for places in group_equal(
        [(start.design.batch_key, tuple(row.level for row in start.frame)) for _, start in valid_starts]
    ):
        batch = [valid_starts[place] for place in places]
        for (k, _), x in zip(batch, _newton([start for _, start in batch]), strict=True):
            designs[k] = x
    return designs


def _start_design(request: NeighbourTask, frame: Frame) -> _StartDesign | None:
    """A program at its start; None where that has no real cycle, or lacks a row of the frame."""
    program, start = request.search.program, request.start
    sampler = sampler_at(program, start)
    if sampler is None:
        return None
    rows = [_active_row(program, sampler, row) for row in frame]
    if not all(rows):
        return None
    return _StartDesign(DesignAt(program, start, sampler, tuple(row for row in rows if row)), frame, request.width)


def _active_row(program: Program, sampler: Sampler, row: FrameRow) -> ActiveRow | None:
    """A row of a frame in a program; None where its node lies on no piece of the cycle."""
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


def _newton(starts: Sequence[_StartDesign]) -> list[dict[str, float] | None]:
    """Ends of Newton's method for designs of one kind; None where it does not converge near its start."""
    batch = Designs([start.design for start in starts])
    pieces = _objective_pieces(starts[0].frame)
    x, u, first_x = batch.x, batch.u, batch.x
    weights = np.zeros((len(starts), len(starts[0].frame)))
    converged, failed = np.zeros(len(starts), dtype=bool), np.zeros(len(starts), dtype=bool)
    for step in range(STEPS):
        rows = batch.derivatives(x, u)
        failed |= ~np.array([all(np.isfinite(part[lane]).all() for part in rows) for lane in range(len(starts))])
        active = ~(converged | failed)
        if not active.any():
            break
        rows = RowDerivatives(*(np.where(failed.reshape(-1, *(1,) * (part.ndim - 1)), 0.0, part) for part in rows))
        move, shift, new_weights = _step(rows, batch.inner, pieces, weights if step else None)
        x = np.where(active[:, None], x + move * batch.sizes, x)
        u = np.where(active[:, None], np.clip(u + shift, 0.0, 1.0), u)
        weights = np.where(active[:, None], new_weights, weights)
        converged |= (
            active & (np.abs(move).max(axis=1) <= SMALL) & (np.abs(shift).max(axis=1, initial=0.0) <= SMALL_SHIFT)
        )
    farthest = np.abs((x - first_x) / batch.sizes).max(axis=1)
    # A row with a negative multiplier stops no design: such an end is dropped before it is certified.
    is_inequality = np.array([row.side != 0 or place > 0.0 for row, place in zip(starts[0].frame, pieces, strict=True)])
    failed |= (np.where(is_inequality, weights, 0.0) < -POSITIVE).any(axis=1)
    return [
        _at_bounds(start, dict(zip(batch.names, x[lane].tolist(), strict=True)))
        if converged[lane] and not failed[lane] and farthest[lane] <= NEAR + 2 * start.width
        else None
        for lane, start in enumerate(starts)
    ]


def _objective_pieces(frame: Frame) -> Floats:
    """Mask of the rows that are pieces of the last objective: 1; the other rows are equalities: 0."""
    last = max(row.place for row in frame if row.level)
    return np.array([float(row.level and row.place == last) for row in frame])


def _step(
    derivatives: RowDerivatives, inner: Floats, pieces: Floats, weights: Floats | None
) -> tuple[Floats, Floats, Floats]:
    """Newton step (designs, n), scaled, shifts of extremes (designs, rows), and new multipliers.

    The problem is: minimise T, with every piece equal to T and every other row 0. weights: the multipliers of the step
    before; least-squares multipliers without them.
    """
    slope, _ = derivatives.along_u
    share, bends = shares(derivatives.bends, inner), without_extremes(derivatives.bends, inner)
    # To first order, each row's extreme is at the point where its slope along u vanishes.
    slopes = derivatives.slopes[:, :, :-1] - (share * slope)[:, :, None] * derivatives.bends[:, :, :-1, -1]
    values = derivatives.values - 0.5 * share * slope * slope
    count, rows, n = slopes.shape
    # The columns of the multipliers: slopes above, the coefficient of T below.
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
    solution = (np.linalg.pinv(matrix, rcond=LEVEL) @ right[:, :, None])[:, :, 0]
    move = solution[:, :n]
    mixed = (derivatives.bends[:, :, :-1, -1] @ move[:, :, None])[:, :, 0]
    return move, -share * (slope + mixed), solution[:, n + 1 :]


def _at_bounds(start: _StartDesign, x: Mapping[str, float]) -> dict[str, float] | None:
    """Variables, SI, put exactly on their active bounds; None where one is beyond its bounds."""
    program = start.design.program
    bounds = program.bound_limits
    at_bounds = {
        bounds[row.place].row: bounds[row.place].value for row in start.frame if not row.level and row.place in bounds
    }
    full = {**start.design.x, **x, **at_bounds}
    if any(not v.lower - FEASIBLE * v.scale <= full[v.name] <= v.upper + FEASIBLE * v.scale for v in program.variables):
        return None
    return {v.name: min(max(full[v.name], v.lower), v.upper) for v in program.variables}


def _certify_ends(
    requests: Sequence[NeighbourTask], attempts: Sequence[tuple[int, Frame]], ends: Sequence[dict[str, float] | None]
) -> list[Search | None]:
    """Searches of the tried programs with their optima, tie-broken and certified.

    They are processed in batches, so that results of one step are still cached in the next.
    """
    searches: list[Search | None] = [None] * len(attempts)
    valid_places = [place for place, x in enumerate(ends) if x is not None]
    for group in group_equal([tuple(row.kind for row in attempts[place][1]) for place in valid_places]):
        places = [valid_places[k] for k in group]
        batch = [(requests[attempts[place][0]], x) for place in places if (x := ends[place]) is not None]
        for place, search in zip(places, _certify_group(batch), strict=True):
            searches[place] = search
    return searches


def _certify_group(ends: Sequence[tuple[NeighbourTask, dict[str, float]]]) -> Iterator[Search | None]:
    """Yield the search of each program with its optimum, variables SI, or None where that is not certified."""
    from loomopt.solving.search import least_change, mass_tradeoff

    searches = [request.search for request, _ in ends]
    tidy_designs = [search.job.tidy(search.program, x) for search, (_, x) in zip(searches, ends, strict=True)]
    tie_breaks = tie_break.apply_moves_in_batch(
        [(search.program, x) for search, x in zip(searches, tidy_designs, strict=True)]
    )
    designs = [printed_design(search, x) for search, (x, _) in zip(searches, tie_breaks, strict=True)]
    requests = [(request.search.program, x, request.peaks) for (request, _), x in zip(ends, designs, strict=True)]
    places = [k for k, is_admissible in enumerate(_are_admissible(requests)) if is_admissible]
    certificate_requests = [(searches[k].program, designs[k]) for k in places]
    accuracies = {search.settings.accuracy for search in searches}
    certificates = dict(zip(places, certify_batch(certificate_requests, min(accuracies, default=1.0)), strict=True))
    found: list[Search | None] = [None] * len(ends)
    for k, certificate in certificates.items():
        search, (chosen, rules) = searches[k], tie_breaks[k]
        program, accuracy = search.program, search.settings.accuracy
        precise = max(min(PRECISE, accuracy), ROUNDING)
        if not (certificate.passed and certificate.residual <= precise and certificate.error <= accuracy):
            continue
        point = Point(ends[k][1], "Solve_Succeeded", True, structure=program.structure)
        candidate = Candidate(
            point, objectives(program, designs[k]), 0.0, chosen, replace(certificate, tie_breaks=rules)
        )
        found[k] = replace(search, candidates=(candidate,), best=candidate, stayed=True)
    mass_tradeoff.sample_without_mass([search for search in found if search])
    for certified in found:
        best = certified.best if certified else None
        if certified is None or best is None:
            yield None
            continue
        is_open = best.certificate.level and len(least_change.undecided(certified, best)[1])
        # A design with open directions, or with a possible mass trade-off, is solved alone.
        yield certified if not is_open and mass_tradeoff.simplify(certified) is certified else None


def _are_admissible(designs: Sequence[tuple[Program, Mapping[str, float], Sequence[str]]]) -> list[bool]:
    """Whether every limit holds at variables x (SI) of each program.

    The extremes of the certificate's quantities and of `peaks`, the last entry, are searched in one pass.
    """
    samplers = [sampler_at(program, x) for program, x, _ in designs]
    names = [(*(name for name, _, _ in cycle_rows(program)), *peaks) for program, _, peaks in designs]
    search_extremes(zip(samplers, names, strict=True))
    return [
        sampler is not None and all(limit.violation(sampler) <= FEASIBLE for limit in program.limits)
        for sampler, (program, _, _) in zip(samplers, designs, strict=True)
    ]


def optimum(job: Job, program: Program, x: Mapping[str, float], certificate: Certificate) -> Optimum | None:
    """Optimum from which a neighbour can start, variables SI as printed; None without a certified frame."""
    if not (certificate.passed and certificate.frame):
        return None
    return Optimum(job.values(program, job.design(program, x)), certificate.frame)
