"""Point of a front: minimum of one axis with the other limited, then minimum of the other; its answer."""

import functools
import math
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.model.axes import Requested, Traded
from loomopt.model.limits import Limit
from loomopt.model.objectives import opposite
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.tolerances import ACTIVE, FEASIBLE, SHOWN_AS_ZERO
from loomopt.scenes.scene import Scene
from loomopt.solving import neighbour_answer
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Clash, Evaluated, Finding, Sentences, Solution, UnitFormatter
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.certificate.kkt import ActiveRow, active_set
from loomopt.solving.certificate.records import Binding, Certificate
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.search import elastic, fallback, least_change, multistart, neighbour_newton
from loomopt.solving.search.multistart import may_be_tied, search_basins, search_starts, search_without_inactive
from loomopt.solving.search.search import Candidate, Search, certify_best, objectives, solve_from
from loomopt.studies.front.plan import ALIKE, Touched, sloped
from loomopt.studies.run import rows
from loomopt.studies.run.rows import PEAK, Multiplier, Side

if TYPE_CHECKING:
    from loomopt.solving.answer.solution import Proofs

RUNAWAY = 100.0
"""Scaled value beyond which a variable without a bound runs away: no machine is so far from today's."""
ENDS = {-1: "min", 0: "fixed", 1: "max"}


def capped(axis: Traded) -> str:
    """Name of the limit on an axis."""
    return f"{axis.axis.name} at most at its limit"


class Subproblem(NamedTuple):
    """Program of a front.

    first: the axis that is optimised first, 0 or 1; caps: largest value of each axis, None for no limit; levels: 1 for
    the first axis alone, 2 for the other after it.
    """

    first: Literal[0, 1]
    caps: tuple[float | None, float | None]
    levels: Literal[1, 2] = 1


@dataclass(frozen=True)
class Reached:
    """Result of a point: status, reason and, if there is a design, its figures, prices and data for a warm start."""

    status: str
    reason: str | None
    design: Mapping[str, Any] = field(default_factory=dict)
    figures: Mapping[str, float | None] = field(default_factory=dict)
    multipliers: Mapping[Multiplier, float] = field(default_factory=dict)
    reached: Mapping[str, bool] = field(default_factory=dict)
    warm: Mapping[str, Any] = field(default_factory=dict)

    @property
    def certified(self) -> bool:
        """Whether the result is certified."""
        return self.status == "optimal"


class Moved(NamedTuple):
    """A neighbour's design moved to another program, not certified.

    figure: of the optimised axis, SI; same_basin: whether Newton's method or pivots led there all the way.
    """

    point: Point
    figure: float
    same_basin: bool


class Solver:
    """Programs of one front and their solves; axes: the first is optimised, the second is limited."""

    def __init__(self, scene: Scene, target: str | None, requested: Requested, accuracy: float) -> None:
        self.scene, self.accuracy, self.job = scene, accuracy, registry.of(scene)
        self.base, axes = self.job.traded(scene, target, requested)
        self.axes: tuple[Traded, Traded] = (axes[0], axes[1])

    @property
    def slope(self) -> Multiplier:
        """Multiplier of the slope of the first axis over the second."""
        return sloped((self.axes[0].axis.name, self.axes[1].axis.name))

    @property
    def level_count(self) -> int:
        """Number of levels before the axes."""
        return len(self.base.objectives) - 2

    def runaway(self, x: Mapping[str, float]) -> str:
        """Designer's name of a variable without a bound that runs away at x (SI); "" for none."""
        loose = (v for v in self.base.variables if not math.isfinite(v.upper if x[v.name] > 0 else v.lower))
        return next((v.called for v in loose if abs(x[v.name]) > RUNAWAY * v.scale), "")

    def unstopped(self, x: Mapping[str, float]) -> str:
        """Designer's name of a variable at x (SI) at an end of its range that is no limit; "" for none."""
        limits = {(limit.row, limit.sign) for limit in self.base.limits}
        for v in (v for v in self.base.variables if v.lower < v.upper):
            ends = {side for side, end in ((-1, v.lower), (1, v.upper)) if abs(x[v.name] - end) <= ACTIVE * v.scale}
            if any({(v.name, side), (v.name, 0)}.isdisjoint(limits) for side in ends):
                return v.called
        return ""

    def program(self, request: Subproblem) -> Program:
        """A program of the front; caps are limits whose values are parameters of the built NLP."""
        levels = self.base.objectives
        pair = levels[-2:] if request.first == 0 else levels[:-3:-1]
        caps = [
            limit
            for axis, cap in zip(self.axes, request.caps, strict=True)
            if cap is not None
            for limit in axis.limits(capped(axis), cap)
        ]
        levels = (*levels[:-2], *pair[: request.levels])
        # The axes are not subject to the least change from today.
        traded = {row for level in pair for row in level.rows}
        moves = tuple(move for move in self.base.moves if not traded & {*move.along, *map(opposite, move.along)})
        return replace(self.base, objectives=levels, limits=(*self.base.limits, *caps), moves=moves)

    def solve(
        self,
        request: Subproblem,
        near: Sequence[Mapping[str, Any]],
        wide: bool | None,
        spare: Sequence[Mapping[str, Any]] = (),
    ) -> Reached:
        """Result of a program, from neighbours' rows.

        wide: whether to search beyond their basins; None for no search even if all of them fail; spare: rows to start
        from if the others fail.

        If the limit on the other axis has a price, no equal design has less of it: one level is enough. One level is
        also enough if the other one cannot be certified.
        """
        search = self._searched(request, near, wide, spare)
        if search.passed and not self._priced(search, request):
            two_levels = self._begun(request._replace(levels=2))
            next_search = solve_from(two_levels, search.ranked[0].point.x)
            next_search = certify_best(next_search) if next_search.usable else next_search
            if wide and next_search.passed and may_be_tied(search):
                next_search = self._spread(next_search)
            if wide and not next_search.passed:
                next_search = search_starts(two_levels, None, 0, (), None)
            if next_search.passed:
                search, request = next_search, request._replace(levels=2)
        return self._result(least_change.with_least_change(search), request)

    def solve_neighbours(self, requests: Sequence[Subproblem], ends: Sequence[Sequence[Any]]) -> list[Reached | None]:
        """Results of programs of one level between two optima; None for a program that must be solved alone.

        ends: both optima as JSON data, and the share of the way from the first to the second.
        """
        tasks = []
        for request, (*optima, share) in zip(requests, ends, strict=True):
            first, second = map(neighbour_newton.read_optimum, optima)
            tasks.append(neighbour_newton.NeighbourTask(self._begun(request), first, second, share, self._peaks))
        searches = neighbour_newton.solve_neighbours(tasks)
        accepted = [
            search if search and self._priced(search, request) and fallback.is_no_worse_than_today(search) else None
            for request, search in zip(requests, searches, strict=True)
        ]
        report.search_evaluated(
            (self.scene, self.job, self.base, self.job.design(search.program, search.best.x))
            for search in accepted
            if search and search.best
        )
        return [
            self._result(search, request) if search else None
            for request, search in zip(requests, accepted, strict=True)
        ]

    def moved(self, requests: Sequence[Subproblem], ends: Sequence[Sequence[Any]]) -> list[Moved | None]:
        """Neighbour's optimum moved to each program with its active rows; None where other rows stop it.

        ends: as in `solve_neighbours`, the neighbour's optimum first.
        """
        tasks = []
        for request, (*optima, _) in zip(requests, ends, strict=True):
            first, second = map(neighbour_newton.read_optimum, optima)
            tasks.append(neighbour_newton.NeighbourTask(self._begun(request), first, second, 0.0))
        return [
            None if x is None else self._moved(Point(x, "Solve_Succeeded", True), task.search, 0, same_basin=True)
            for task, x in zip(tasks, neighbour_newton.move_with_rows(tasks), strict=True)
        ]

    def solved_from(
        self,
        request: Subproblem,
        near: Mapping[str, Any],
        higher_levels: Sequence[float],
        begin: float | None,
        steps: int,
    ) -> Moved | None:
        """Neighbour's design moved to a program by solves on the way; None if one of them fails.

        higher_levels: values of the target's levels along the front, which must be kept; begin: scaled value of the
        second axis at the neighbour; steps: most steps: a step that needs more than pivots is halved, as it may leave
        the basin.
        """
        share, step, result = 0.0, 1.0, None
        while share < 1.0:
            next_share, (other_cap, end) = share + step, request.caps
            cap = end if begin is None or end is None else begin + next_share * (end - begin)
            search = self._from(self._begun(request._replace(caps=(other_cap, cap))), [near])
            candidate = search.candidates[0] if search.usable else None
            if step * steps > 1.0 and (candidate is None or candidate.point.iterations):
                step /= 2
                continue
            if candidate is None:
                return None
            if any(
                level > other_cap + ALIKE
                for level, other_cap in zip(candidate.objectives[: self.level_count], higher_levels, strict=True)
            ):
                return None
            same_basin = not candidate.point.iterations and (result is None or result.same_basin)
            result, share = self._moved(candidate.point, search, request.first, same_basin), next_share
            near = {"point": rows.written(result.point, search.program)}
        return result

    def _moved(self, point: Point, search: Search, first: int, same_basin: bool) -> Moved:
        return Moved(point, self._figure(self.axes[first], search.program, point.x), same_basin)

    def rests(self, request: Subproblem, point: Point) -> bool:
        """Whether a point is a certified optimum of a program, even if others are better.

        Its cap on the other axis must have a price: otherwise it is the neighbour's design itself, or nothing moves it.
        """
        search = self._begun(request)
        point_here = replace(point, structure=search.program.structure)
        candidate = Candidate(point_here, objectives(search.program, point.x))
        search = certify_best(replace(search, candidates=(candidate,)))
        return search.passed and self._priced(search, request)

    @lazy
    def _peaks(self) -> tuple[str, ...]:
        return neighbour_answer.figure_peaks(self.scene, self.job, self.base)

    def _begun(self, request: Subproblem) -> Search:
        return Search(self.job, self.program(request), Settings(self.accuracy), self._today)

    @lazy
    def _today(self) -> Mapping[str, float]:
        """Today's machine by variable, SI."""
        return self.job.start(self.base, self.scene)

    def _searched(
        self,
        request: Subproblem,
        near: Sequence[Mapping[str, Any]],
        wide: bool | None,
        spare: Sequence[Mapping[str, Any]] = (),
    ) -> Search:
        """Search for the best of a program."""
        search = self._begun(request)
        for starts in (near, spare):
            if not search.passed:
                search = self._solve_near(search, starts)
        if wide and search.passed:
            search = self._spread(search)
        if not (search.passed or wide is None):
            search = search_without_inactive(search, None, 0, (), None) or search_starts(search, None, 0, (), None)
        return fallback.no_worse(search)

    def _solve_near(self, search: Search, near: Sequence[Mapping[str, Any]]) -> Search:
        """The search after solves from neighbours' rows, its best certified."""
        search = self._from(search, near)
        return certify_best(search) if search.usable else search

    def _from(self, search: Search, near: Sequence[Mapping[str, Any]]) -> Search:
        """The search after solves from neighbours' rows."""
        program = search.program
        for data in near:
            point = rows.read(data["point"], program)
            if point:
                search = solve_from(search, point.x, point)
            elif start := exchange.complete_start(program, data["point"]["x"]):
                search = solve_from(search, start)
        return search

    def _spread(self, search: Search) -> Search:
        """A passed search after a search of other basins, if there may be any."""
        return search if search.program.uniqueness_reason else certify_best(search_basins(search, 0, None))

    def _priced(self, search: Search, request: Subproblem) -> bool:
        """Whether the limit on the other axis has a price at the level of the first."""
        optimised, limited = self.axes[request.first], self.axes[1 - request.first]
        prices = search.best.certificate.binding if search.best else ()
        cap, figure = capped(limited), optimised.axis.name
        return any(price.limit.name == cap and price.objective.figure == figure for price in prices)

    def _result(self, search: Search, request: Subproblem) -> Reached:
        best = search.best
        if best is None:
            status = "infeasible" if search.clashes else "failed"
            last = search.candidates[-1].point.status if search.candidates else "no start assembles"
            return Reached(status, "limits clash: no admissible design was found" if search.clashes else last)
        program = search.program
        evaluated = report.evaluation(self.scene, self.job, self.base, self.job.design(program, best.x), every=True)
        cap_reason = self._cap_reason(search, best, request)
        certified = best.certificate.passed and evaluated.admissible and not cap_reason
        reason = cap_reason or "; ".join(best.certificate.reasons) or "a limit does not hold on independent evaluation"
        status = "optimal" if certified else "uncertified"
        axes = {axis.axis.name: self._figure(axis, program, best.x) for axis in self.axes}
        warm = {
            "point": rows.written(replace(best.point, x=dict(best.x)), program),
            "active": self._active(program, best.x),
            "axes": axes,
            "held": list(objectives(program, best.x)[: self.level_count]),
        }
        optimum = None
        if request[::2] == (0, 1):
            optimum = neighbour_newton.optimum(self.job, program, best.x, best.certificate)
        warm |= {"optimum": optimum.as_dict()} if optimum else {}
        return Reached(
            status,
            None if certified else reason,
            dict(evaluated.design),
            dict(evaluated.figures.items()),
            self._multipliers(best, axes, request),
            dict(evaluated.reached),
            warm,
        )

    def _cap_reason(self, search: Search, best: Candidate, request: Subproblem) -> str:
        """Reason why the point does not count, because an axis is above its cap; "" if it counts."""
        sampler = sampled(search.program.model, {**search.program.parameters, **best.x})
        for axis, cap in zip(self.axes, request.caps, strict=True):
            size = axis.objective.scale
            if cap is not None and axis.objective.merit(sampler) / size > cap / size + FEASIBLE:
                return f"{axis.axis.name} comes out above its limit"
        return ""

    def _figure(self, axis: Traded, program: Program, x: Mapping[str, float]) -> float:
        """An axis at variables x (SI); a magnitude has no sign."""
        return axis.figure(axis.objective.merit(sampled(program.model, {**program.parameters, **x})))

    def _multipliers(
        self, best: Candidate, figures: Mapping[str, float], request: Subproblem
    ) -> dict[Multiplier, float]:
        """Worth of each limit for the first objective that it moves, SI, and the slope along the front."""
        optimised, limited = self.axes
        multipliers: dict[Multiplier, float] = {}
        slope, caps = 0.0, [capped(axis) for axis in self.axes]
        for price in best.certificate.binding:
            if price.limit.name == capped(limited):
                slope -= price.worth if price.objective.figure == optimised.axis.name else 0.0
            elif price.limit.name not in caps:
                multiplier = Multiplier(price.objective.figure, Side(price.limit.name, ENDS[price.side]))
                multipliers[multiplier] = multipliers.get(multiplier, 0.0) + price.worth
        limited_figure = figures[limited.axis.name]
        slopes = (
            {self.slope: optimised.sign * slope * limited.slope(limited_figure) + 0.0} if request.first == 0 else {}
        )
        return {**slopes, **multipliers}

    def _active(self, program: Program, x: Mapping[str, float]) -> list[tuple[str, str, int]]:
        """Touched sides, and the place at which the first axis is largest, as JSON data."""
        sampler = sampled(program.model, {**program.parameters, **x})
        active = active_set(replace(program, objectives=(self.axes[0].objective,)), sampler)
        axis_names = {name for axis in self.axes for name in (axis.axis.name, capped(axis))}
        count: Counter[tuple[Side, str]] = Counter()
        for row in active.rows[: active.limits]:
            limit = row.limit
            if limit and limit.name not in axis_names and limit.row not in program.fixed:
                count[Side(limit.name, ENDS[limit.sign]), _place(sampler, row)] += 1
        for k in active.levels[0]:
            count[Side(self.axes[0].axis.name, PEAK), _place(sampler, active.rows[k])] += 1
        return sorted(Touched(side, place, times).written() for (side, place), times in count.items())


def _place(sampler: Sampler, row: ActiveRow) -> str:
    """Place in the cycle of a row, by the switches there and its sign; "" for a row without an angle."""
    if row.node is None:
        return f"{row.reads} {row.sign:+g}"
    switch = sampler.cycle.switch(row.node.piece)
    return f"{row.reads} {row.sign:+g} {[float(value) for value in switch.values()]}"


Cap = tuple[Traded, float]
"""An axis and its largest value, in the sense of its objective."""


@dataclass(frozen=True)
class FrontTerms:
    """Limits on the designs of a front: the demands of its target, and limits on its axes.

    traded: both axes; base: program of the demands; program: with the limits on axes too.
    """

    scene: Scene
    target: str | None
    traded: tuple[Traded, Traded]
    base: Program
    program: Program
    caps: tuple[Cap, ...]

    @property
    def summary(self) -> str:
        """Both axes in words."""
        return " against ".join(axis.called for axis in self.traded)

    @property
    def axes(self) -> list[str]:
        """Names of the figures of both axes."""
        return [axis.axis.name for axis in self.traded]

    @property
    def job(self) -> Job:
        """The scene's job."""
        return registry.of(self.scene)

    def evaluation(self, design: Mapping[str, float]) -> Evaluated:
        """Figures and limits of a design, SI; a missing name has today's value."""
        named = {self.scene.full(name): value for name, value in design.items()}
        return self.whole({**self.job.today(self.scene), **named})

    def whole(self, design: Mapping[str, float]) -> Evaluated:
        """Figures and limits of a design by full names, SI."""
        evaluated = report.evaluation(self.scene, self.job, self.base, design)
        limits = list(evaluated.limits)
        for finding in (self._finding(cap, evaluated, design) for cap in self.caps):
            place = next((k for k, limit in enumerate(limits) if limit.name == finding.name), len(limits))
            limits[place : place + 1] = [_tightest(finding, *limits[place : place + 1])]
        return replace(evaluated, limits=tuple(limits), terms=self)

    def proofs(self, design: Mapping[str, float], slack: float) -> "Proofs":
        """Proofs of a design's limits (SI). Raises BadInput."""
        from loomopt.solving.proof import whole_cycle

        program = replace(self.program, limits=_named(self))
        return replace(whole_cycle.prove(self.scene, design, self.target, slack, program), target=self.summary)

    def _finding(self, cap: Cap, evaluated: Evaluated, design: Mapping[str, float]) -> Finding:
        """Limit on an axis, with its figure."""
        axis, most = cap
        values = {**self.program.parameters, **self.job.values(self.program, design)}
        merit = axis.objective.merit(sampled(self.program.model, values))
        ok = merit <= most + FEASIBLE * axis.objective.scale
        name, figure, end = axis.axis.name, axis.figure(merit), _end(axis, most)
        if axis.objective.is_magnitude:
            return Finding(name, evaluated.figures.get(name) or figure, -end, end, ok)
        low, high = (None, end) if axis.sign > 0 else (end, None)
        return Finding(name, figure, low, high, ok)


def _end(axis: Traded, cap: float) -> float:
    """Figure of the largest value of an axis, SI; rounding is 0."""
    figure = axis.figure(cap)
    return figure if abs(figure) > SHOWN_AS_ZERO * axis.objective.scale ** (1 / axis.axis.power) else 0.0


def _tightest(tightest: Finding, *others: Finding) -> Finding:
    """Several limits on one figure as one limit."""
    for other in others:
        low = max((end for end in (tightest.min, other.min) if end is not None), default=None)
        high = min((end for end in (tightest.max, other.max) if end is not None), default=None)
        tightest = tightest._replace(min=low, max=high, ok=tightest.ok and other.ok)
    return tightest


def _named(terms: FrontTerms) -> tuple[Limit, ...]:
    """All limits; a limit on an axis has the axis' name if its row is the figure itself."""
    plain = {capped(axis): axis.axis.name for axis, _ in terms.caps if _is_figure(axis)}
    return tuple(replace(limit, name=plain.get(limit.name, limit.name)) for limit in terms.program.limits)


def _is_figure(axis: Traded) -> bool:
    return axis.sign > 0 and axis.axis.power == 1 and axis.axis.offset == 0.0


def whole_answer(solver: Solver, target: str | None, result: Reached, request: Subproblem, began: float) -> Solution:
    """Full answer of a point of a front; began: start of its solve, s.

    request: the program, except the number of levels.
    """
    end = time.perf_counter()
    caps = tuple((axis, cap) for axis, cap in zip(solver.axes, request.caps, strict=True) if cap is not None)
    programs = [solver.program(request._replace(levels=levels)) for levels in (1, 2)]
    for program in programs:
        point = rows.read(result.warm.get("point", {}), program)
        if point:
            terms = FrontTerms(solver.scene, target, solver.axes, solver.base, program, caps)
            evaluated = terms.whole(solver.job.design(solver.base, point.x))
            certificate = certify(program, _as_read(solver.job, program, point.x), solver.accuracy)
            answer = _certified(solver, terms, evaluated, certificate, result, request)
            return replace(answer, point=point, time=_time(began, end))
    terms = FrontTerms(solver.scene, target, solver.axes, solver.base, programs[0], caps)
    answer = _without(solver, terms, result)
    return replace(answer, terms=terms, time=_time(began, end))


def _without(solver: Solver, terms: FrontTerms, result: Reached) -> Solution:
    """Answer of a point without a design: the nearest design, and the limits that clash."""
    clash = clashing(solver, terms.program) if result.status == "infeasible" else Clash()
    evaluated = terms.whole(solver.job.design(solver.base, clash.x)) if clash.x else report.nowhere(solver.scene)
    today = functools.partial(terms.evaluation, {})
    solver_data = {"status": result.reason, "accuracy": solver.accuracy}
    explained = solver.job.explain(solver.scene, clash.limits.values())
    answer = report.without_optimum(terms.target or "", evaluated, clash, solver_data, today, explained)
    sentences = Sentences(f"No design was found: {result.reason}.")
    return answer if clash.limits else replace(answer, status=result.status, sentences=sentences)


def clashing(solver: Solver, program: Program) -> Clash:
    """Limits of a program that clash, and the relaxations that help; empty if there are none."""
    job, scene = solver.job, solver.scene
    today = job.start(program, scene)
    search = multistart.run_search(Search(job, program, Settings(solver.accuracy), today))
    return elastic.clash(search, UnitFormatter(scene))


def _certified(
    solver: Solver,
    terms: FrontTerms,
    evaluated: Evaluated,
    certificate: Certificate,
    result: Reached,
    request: Subproblem,
) -> Solution:
    """Answer of a point with a design."""
    formatter = UnitFormatter(solver.scene)
    explicit = _explicit(terms, certificate)
    prices, joint = report.prices(formatter, explicit), report.joint_prices(formatter, explicit)
    if result.reason:
        sentences = Sentences(f"A design was reached but not certified: {result.reason}.")
    else:
        sentences = Sentences(_extent(formatter, terms, request), report.stops(prices, joint))
    return Solution(
        **vars(evaluated),
        target=terms.target or "",
        status=result.status,
        sentences=sentences,
        binding=prices,
        bind_together=joint,
        certificate=certificate,
        solver={"accuracy": solver.accuracy},
        evaluate_today=functools.partial(terms.evaluation, {}),
    )


def _as_read(job: Job, program: Program, x: Mapping[str, float]) -> dict[str, float]:
    """Variables, SI, of the printed design of x (SI)."""
    return job.values(program, job.design(program, x))


def _explicit(terms: FrontTerms, certificate: Certificate) -> Certificate:
    """A certificate in which a limit on an axis is a limit of its figure."""
    caps = {capped(axis): (axis, cap) for axis, cap in terms.caps}

    def slope(binding: Binding) -> float:
        if binding.limit.name not in caps:
            return 1.0
        axis, cap = caps[binding.limit.name]
        return abs(axis.slope(_end(axis, cap)))

    def in_figures(binding: Binding) -> Binding:
        if binding.limit.name not in caps:
            return binding
        axis, cap = caps[binding.limit.name]
        limit = binding.limit
        if not axis.objective.is_magnitude:
            limit = replace(limit, sign=axis.sign, value=_end(axis, cap))
        worth = binding.worth * slope(binding)
        return binding._replace(limit=replace(limit, name=axis.axis.name), side=limit.sign, worth=worth)

    joint_bindings = []
    for joint in certificate.bind_together:
        slopes = np.array([slope(binding) for binding in joint.bindings])
        joint_bindings.append(
            replace(joint, bindings=tuple(map(in_figures, joint.bindings)), costs=slopes[:, None] * joint.costs)
        )
    return replace(
        certificate, binding=tuple(map(in_figures, certificate.binding)), bind_together=tuple(joint_bindings)
    )


def _extent(formatter: UnitFormatter, terms: FrontTerms, request: Subproblem) -> str:
    """The optimised axis and the limits as a sentence."""
    optimised, other = terms.traded[request.first], terms.traded[1 - request.first]
    caps = [
        f"{axis.called} at {'most' if axis.sign > 0 else 'least'} {formatter.shown(axis.axis.name, _end(axis, cap))}"
        for axis, cap in terms.caps
    ]
    both = len(terms.program.objectives) == len(terms.base.objectives)
    after = f", then the {other.sense} {other.called}" if both else ""
    return f"The {optimised.sense} {optimised.called}{' with ' if caps else ''}{' and '.join(caps)}{after}."


def _time(began: float, solved: float) -> dict[str, float]:
    """Seconds of a solve, and of the certificate after it."""
    now = time.perf_counter()
    parts = {"import_s": 0.0, "build_s": 0.0, "solve_s": solved - began, "settle_s": 0.0, "certify_s": now - solved}
    return {**parts, "report_s": 0.0, "total_s": now - began}
