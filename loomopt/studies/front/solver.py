"""One point of a front: least of one axis with the other at most so much, then least of the other; its whole answer."""

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
from loomopt.solving.answer.solution import Clash, Evaluated, Finding, Sentences, Solution, Words
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
"""Natural sizes beyond which a variable without a bound has no end: no machine is so far from today's."""
ENDS = {-1: "min", 0: "fixed", 1: "max"}


def capped(axis: Traded) -> str:
    """Return what the limit on an axis is called."""
    return f"{axis.axis.name} at most as asked"


class Asking(NamedTuple):
    """One program of a front.

    first: which axis comes first, 0 or 1; caps: the largest value of each axis, None for no limit; levels: 1 for the
    first axis alone, 2 for the other after it.
    """

    first: Literal[0, 1]
    caps: tuple[float | None, float | None]
    levels: Literal[1, 2] = 1


@dataclass(frozen=True)
class Reached:
    """What a point came to: status, reason and, where there is a design, its figures, prices and where it stood."""

    status: str
    reason: str | None
    design: Mapping[str, Any] = field(default_factory=dict)
    figures: Mapping[str, float | None] = field(default_factory=dict)
    multipliers: Mapping[Multiplier, float] = field(default_factory=dict)
    reached: Mapping[str, bool] = field(default_factory=dict)
    warm: Mapping[str, Any] = field(default_factory=dict)

    @property
    def certified(self) -> bool:
        """Whether it is as good as an answer."""
        return self.status == "optimal"


class Moved(NamedTuple):
    """Where a neighbour's design moves to in another program, not certified.

    figure: of the axis sought there, SI; led: whether it kept to its basin: Newton's method or pivots led all the way.
    """

    point: Point
    figure: float
    led: bool


class Solver:
    """The programs of one front, and how they are solved; axes: the first is sought, the second is what it costs."""

    def __init__(self, scene: Scene, target: str | None, asked: Requested, accuracy: float) -> None:
        self.scene, self.accuracy, self.job = scene, accuracy, registry.of(scene)
        self.base, axes = self.job.traded(scene, target, asked)
        self.axes: tuple[Traded, Traded] = (axes[0], axes[1])

    @property
    def slope(self) -> Multiplier:
        """What a row calls the slope of the first axis over the second."""
        return sloped((self.axes[0].axis.name, self.axes[1].axis.name))

    @property
    def held(self) -> int:
        """How many levels come before the axes."""
        return len(self.base.objectives) - 2

    def runaway(self, x: Mapping[str, float]) -> str:
        """Return which variable without a bound is out of all proportion at x (SI); "" for none."""
        loose = (v for v in self.base.variables if not math.isfinite(v.upper if x[v.name] > 0 else v.lower))
        return next((v.called for v in loose if abs(x[v.name]) > RUNAWAY * v.scale), "")

    def unstopped(self, x: Mapping[str, float]) -> str:
        """Return which variable is at x (SI) at an end of what it can be that no limit gives it; "" for none."""
        limits = {(limit.row, limit.sign) for limit in self.base.limits}
        for v in (v for v in self.base.variables if v.lower < v.upper):
            ends = {side for side, end in ((-1, v.lower), (1, v.upper)) if abs(x[v.name] - end) <= ACTIVE * v.scale}
            if any({(v.name, side), (v.name, 0)}.isdisjoint(limits) for side in ends):
                return v.called
        return ""

    def program(self, asking: Asking) -> Program:
        """Return a program of the front: caps are limits whose values are parameters of what is built."""
        levels = self.base.objectives
        pair = levels[-2:] if asking.first == 0 else levels[:-3:-1]
        caps = [
            limit
            for axis, cap in zip(self.axes, asking.caps, strict=True)
            if cap is not None
            for limit in axis.limits(capped(axis), cap)
        ]
        levels = (*levels[:-2], *pair[: asking.levels])
        # What is traded is not left to the least change from today.
        traded = {row for level in pair for row in level.rows}
        moves = tuple(move for move in self.base.moves if not traded & {*move.along, *map(opposite, move.along)})
        return replace(self.base, objectives=levels, limits=(*self.base.limits, *caps), moves=moves)

    def solve(
        self,
        asking: Asking,
        near: Sequence[Mapping[str, Any]],
        wide: bool | None,
        spare: Sequence[Mapping[str, Any]] = (),
    ) -> Reached:
        """Return what a program comes to, from neighbours' rows.

        wide: whether a search goes beyond their basins; None for none even where they lead nowhere; spare: rows from
        which it starts where the others lead nowhere.

        Where the limit on the other axis has a price, nothing is as good with less of it: then one level is enough. So
        it is where the other one cannot be certified after it.
        """
        search = self._searched(asking, near, wide, spare)
        if search.passed and not self._priced(search, asking):
            found = self._begun(asking._replace(levels=2))
            after = solve_from(found, search.ranked[0].point.x)
            after = certify_best(after) if after.usable else after
            if wide and after.passed and may_be_tied(search):
                after = self._spread(after)
            if wide and not after.passed:
                after = search_starts(found, None, 0, (), None)
            if after.passed:
                search, asking = after, asking._replace(levels=2)
        return self._told(least_change.with_least_change(search), asking)

    def solve_neighbours(self, asked: Sequence[Asking], ends: Sequence[Sequence[Any]]) -> list[Reached | None]:
        """Return what programs of one level come to between two optima; None of one that must be solved alone.

        ends: both optima as JSON data, and how far a program lies from the first to the second.
        """
        begun = []
        for asking, (*optima, share) in zip(asked, ends, strict=True):
            first, second = map(neighbour_newton.read_optimum, optima)
            begun.append(neighbour_newton.NeighbourTask(self._begun(asking), first, second, share, self._peaks))
        searches = zip(asked, neighbour_newton.solve_between(begun), strict=True)
        return [
            self._told(search, of)
            if search and self._priced(search, of) and fallback.is_no_worse_than_today(search)
            else None
            for of, search in searches
        ]

    def moved(self, asked: Sequence[Asking], ends: Sequence[Sequence[Any]]) -> list[Moved | None]:
        """Return where a neighbour's optimum moves to each program with the rows that stop it.

        None where other rows stop it there. ends: as of `solve_neighbours`, the neighbour's optimum first.
        """
        begun = []
        for asking, (*optima, _) in zip(asked, ends, strict=True):
            first, second = map(neighbour_newton.read_optimum, optima)
            begun.append(neighbour_newton.NeighbourTask(self._begun(asking), first, second, 0.0))
        return [
            None if x is None else self._moved(Point(x, "Solve_Succeeded", True), each.search, 0, led=True)
            for each, x in zip(begun, neighbour_newton.move_with_rows(begun), strict=True)
        ]

    def solved_from(
        self, asking: Asking, near: Mapping[str, Any], held: Sequence[float], begin: float | None, steps: int
    ) -> Moved | None:
        """Return where a neighbour's design moves to in a program by solves on the way; None where one ends nowhere.

        held: what the target holds along the front; where that is not kept, no design counts; begin: the value of the
        second axis, natural, at the neighbour; steps: how many there may be at most: one that pivots do not lead is
        halved, as it may leave its basin.
        """
        share, step, found = 0.0, 1.0, None
        while share < 1.0:
            there, (other, end) = share + step, asking.caps
            cap = end if begin is None or end is None else begin + there * (end - begin)
            search = self._from(self._begun(asking._replace(caps=(other, cap))), [near])
            candidate = search.candidates[0] if search.usable else None
            if step * steps > 1.0 and (candidate is None or candidate.point.iterations):
                step /= 2
                continue
            if candidate is None:
                return None
            if any(one > other + ALIKE for one, other in zip(candidate.objectives[: self.held], held, strict=True)):
                return None
            led = not candidate.point.iterations and (found is None or found.led)
            found, share = self._moved(candidate.point, search, asking.first, led), there
            near = {"point": rows.written(found.point, search.program)}
        return found

    def _moved(self, point: Point, search: Search, first: int, led: bool) -> Moved:
        return Moved(point, self._figure(self.axes[first], search.program, point.x), led)

    def rests(self, asking: Asking, point: Point) -> bool:
        """Say whether a point is a certified optimum of a program, as good or bad as others may be.

        Its cap on the other axis must have a price: else it is only the neighbour's own design, or nothing moves it.
        """
        search = self._begun(asking)
        at = replace(point, structure=search.program.structure)
        candidate = Candidate(at, objectives(search.program, point.x))
        search = certify_best(replace(search, candidates=(candidate,)))
        return search.passed and self._priced(search, asking)

    @lazy
    def _peaks(self) -> tuple[str, ...]:
        return neighbour_answer.told_peaks(self.scene, self.job, self.base)

    def _begun(self, asking: Asking) -> Search:
        return Search(self.job, self.program(asking), Settings(self.accuracy), self._today)

    @lazy
    def _today(self) -> Mapping[str, float]:
        """Today's machine by variable, SI."""
        return self.job.start(self.base, self.scene)

    def _searched(
        self,
        asking: Asking,
        near: Sequence[Mapping[str, Any]],
        wide: bool | None,
        spare: Sequence[Mapping[str, Any]] = (),
    ) -> Search:
        """Return the search for the best of a program."""
        search = self._begun(asking)
        for known in (near, spare):
            if not search.passed:
                search = self._beside(search, known)
        if wide and search.passed:
            search = self._spread(search)
        if not (search.passed or wide is None):
            search = search_without_inactive(search, None, 0, (), None) or search_starts(search, None, 0, (), None)
        return fallback.no_worse(search)

    def _beside(self, search: Search, near: Sequence[Mapping[str, Any]]) -> Search:
        """Return the search after solves from neighbours' rows, its best judged."""
        search = self._from(search, near)
        return certify_best(search) if search.usable else search

    def _from(self, search: Search, near: Sequence[Mapping[str, Any]]) -> Search:
        """Return the search after solves from neighbours' rows."""
        program = search.program
        for data in near:
            point = rows.read(data["point"], program)
            if point:
                search = solve_from(search, point.x, point)
            elif start := exchange.complete_start(program, data["point"]["x"]):
                search = solve_from(search, start)
        return search

    def _spread(self, search: Search) -> Search:
        """Return a search whose best passed after a look at other basins, where there may be any."""
        return search if search.program.single else certify_best(search_basins(search, 0, None))

    def _priced(self, search: Search, asking: Asking) -> bool:
        """Say whether the limit on the other axis has a price at the level of the first."""
        sought, paid = self.axes[asking.first], self.axes[1 - asking.first]
        prices = search.best.certificate.binding if search.best else ()
        cap, figure = capped(paid), sought.axis.name
        return any(price.limit.name == cap and price.objective.figure == figure for price in prices)

    def _told(self, search: Search, asking: Asking) -> Reached:
        best = search.best
        if best is None:
            status = "infeasible" if search.clashes else "failed"
            last = search.candidates[-1].point.status if search.candidates else "no start assembles"
            return Reached(status, "limits clash: no admissible design was found" if search.clashes else last)
        program = search.program
        here = report.evaluation(self.scene, self.job, self.base, self.job.design(program, best.x), every=True)
        held = self._held(search, best, asking)
        certified = best.certificate.passed and here.admissible and not held
        reason = held or "; ".join(best.certificate.reasons) or "a limit does not hold on independent evaluation"
        status = "optimal" if certified else "uncertified"
        axes = {axis.axis.name: self._figure(axis, program, best.x) for axis in self.axes}
        told = {
            "point": rows.written(replace(best.point, x=dict(best.x)), program),
            "active": self._active(program, best.x),
            "axes": axes,
            "held": list(objectives(program, best.x)[: self.held]),
        }
        optimum = None
        if asking[::2] == (0, 1):
            optimum = neighbour_newton.optimum(self.job, program, best.x, best.certificate)
        told |= {"optimum": optimum.as_dict()} if optimum else {}
        return Reached(
            status,
            None if certified else reason,
            dict(here.design),
            dict(here.figures.items()),
            self._multipliers(best, axes, asking),
            dict(here.reached),
            told,
        )

    def _held(self, search: Search, best: Candidate, asking: Asking) -> str:
        """Return why the point does not count, though one may be there: an axis is above its cap; "" where it does."""
        sampler = sampled(search.program.model, {**search.program.parameters, **best.x})
        for axis, cap in zip(self.axes, asking.caps, strict=True):
            size = axis.objective.scale
            if cap is not None and axis.objective.merit(sampler) / size > cap / size + FEASIBLE:
                return f"{axis.axis.name} comes out above what was asked"
        return ""

    def _figure(self, axis: Traded, program: Program, x: Mapping[str, float]) -> float:
        """Return an axis at variables x (SI): of a magnitude without its sign."""
        return axis.figure(axis.objective.merit(sampled(program.model, {**program.parameters, **x})))

    def _multipliers(self, best: Candidate, figures: Mapping[str, float], asking: Asking) -> dict[Multiplier, float]:
        """Return what each limit is worth for the first objective it moves, SI, and the slope along the front."""
        sought, paid = self.axes
        found: dict[Multiplier, float] = {}
        slope, caps = 0.0, [capped(axis) for axis in self.axes]
        for price in best.certificate.binding:
            if price.limit.name == capped(paid):
                slope -= price.worth if price.objective.figure == sought.axis.name else 0.0
            elif price.limit.name not in caps:
                each = Multiplier(price.objective.figure, Side(price.limit.name, ENDS[price.side]))
                found[each] = found.get(each, 0.0) + price.worth
        here = figures[paid.axis.name]
        told = {self.slope: sought.sign * slope * paid.slope(here) + 0.0} if asking.first == 0 else {}
        return {**told, **found}

    def _active(self, program: Program, x: Mapping[str, float]) -> list[tuple[str, str, int]]:
        """Return what is touched, and where the first axis stands highest, as JSON data."""
        sampler = sampled(program.model, {**program.parameters, **x})
        found = active_set(replace(program, objectives=(self.axes[0].objective,)), sampler)
        own = {name for axis in self.axes for name in (axis.axis.name, capped(axis))}
        count: Counter[tuple[Side, str]] = Counter()
        for row in found.rows[: found.limits]:
            limit = row.limit
            if limit and limit.name not in own and limit.row not in program.fixed:
                count[Side(limit.name, ENDS[limit.sign]), _place(sampler, row)] += 1
        for k in found.levels[0]:
            count[Side(self.axes[0].axis.name, PEAK), _place(sampler, found.rows[k])] += 1
        return sorted(Touched(side, place, times).written() for (side, place), times in count.items())


def _place(sampler: Sampler, row: ActiveRow) -> str:
    """Return where in the cycle a row stands, by the switches there and its sign; "" for a row of no angle."""
    if row.node is None:
        return f"{row.reads} {row.sign:+g}"
    switch = sampler.cycle.switch(row.node.piece)
    return f"{row.reads} {row.sign:+g} {[float(value) for value in switch.values()]}"


Cap = tuple[Traded, float]
"""An axis and the largest value of what is sought the least of."""


@dataclass(frozen=True)
class FrontTerms:
    """What judges the designs of a front: what its target demands of all of them, and limits on its axes.

    traded: both axes; base: what is demanded; program: with the limits on axes too.
    """

    scene: Scene
    target: str | None
    traded: tuple[Traded, Traded]
    base: Program
    program: Program
    caps: tuple[Cap, ...]

    @property
    def said(self) -> str:
        """Both axes."""
        return " against ".join(axis.called for axis in self.traded)

    @property
    def axes(self) -> list[str]:
        """The figures of both axes."""
        return [axis.axis.name for axis in self.traded]

    @property
    def job(self) -> Job:
        """The scene's job."""
        return registry.of(self.scene)

    def evaluation(self, design: Mapping[str, float]) -> Evaluated:
        """Return a design's figures and limits; design: SI, what it does not name is today's."""
        named = {self.scene.full(name): value for name, value in design.items()}
        return self.whole({**self.job.today(self.scene), **named})

    def whole(self, design: Mapping[str, float]) -> Evaluated:
        """Return figures and limits of a design by full names, SI."""
        found = report.evaluation(self.scene, self.job, self.base, design)
        limits = list(found.limits)
        for finding in (self._finding(cap, found, design) for cap in self.caps):
            same = next((k for k, limit in enumerate(limits) if limit.name == finding.name), len(limits))
            limits[same : same + 1] = [_tightest(finding, *limits[same : same + 1])]
        return replace(found, limits=tuple(limits), terms=self)

    def proofs(self, design: Mapping[str, float], slack: float) -> "Proofs":
        """Return proofs of a design's limits (SI). Raises BadInput."""
        from loomopt.solving.proof import whole_cycle

        program = replace(self.program, limits=_named(self))
        return replace(whole_cycle.prove(self.scene, design, self.target, slack, program), target=self.said)

    def _finding(self, cap: Cap, found: Evaluated, design: Mapping[str, float]) -> Finding:
        """Return the limit on an axis beside its figure."""
        axis, most = cap
        values = {**self.program.parameters, **self.job.values(self.program, design)}
        merit = axis.objective.merit(sampled(self.program.model, values))
        ok = merit <= most + FEASIBLE * axis.objective.scale
        name, figure, end = axis.axis.name, axis.figure(merit), _end(axis, most)
        if axis.objective.is_magnitude:
            return Finding(name, found.figures.get(name) or figure, -end, end, ok)
        low, high = (None, end) if axis.sign > 0 else (end, None)
        return Finding(name, figure, low, high, ok)


def _end(axis: Traded, cap: float) -> float:
    """Return the figure of the largest value of an axis, SI; what is only rounding is 0."""
    figure = axis.figure(cap)
    return figure if abs(figure) > SHOWN_AS_ZERO * axis.objective.scale ** (1 / axis.axis.power) else 0.0


def _tightest(one: Finding, *others: Finding) -> Finding:
    """Return limits on the same as one."""
    for other in others:
        low = max((end for end in (one.min, other.min) if end is not None), default=None)
        high = min((end for end in (one.max, other.max) if end is not None), default=None)
        one = one._replace(min=low, max=high, ok=one.ok and other.ok)
    return one


def _named(terms: FrontTerms) -> tuple[Limit, ...]:
    """Return all limits, those on axes under the axis' own name where their row is the figure itself."""
    plain = {capped(axis): axis.axis.name for axis, _ in terms.caps if _is_figure(axis)}
    return tuple(replace(limit, name=plain.get(limit.name, limit.name)) for limit in terms.program.limits)


def _is_figure(axis: Traded) -> bool:
    return axis.sign > 0 and axis.axis.power == 1 and axis.axis.offset == 0.0


def whole_answer(solver: Solver, target: str | None, found: Reached, asking: Asking, began: float) -> Solution:
    """Return what a point of a front came to as the answer that a solve gives; began: when its solve did, s.

    asking: what was asked, but for the number of levels.
    """
    solved = time.perf_counter()
    caps = tuple((axis, cap) for axis, cap in zip(solver.axes, asking.caps, strict=True) if cap is not None)
    programs = [solver.program(asking._replace(levels=levels)) for levels in (1, 2)]
    for program in programs:
        point = rows.read(found.warm.get("point", {}), program)
        if point:
            terms = FrontTerms(solver.scene, target, solver.axes, solver.base, program, caps)
            here = terms.whole(solver.job.design(solver.base, point.x))
            certificate = certify(program, _as_read(solver.job, program, point.x), solver.accuracy)
            made = _certified(solver, terms, here, certificate, found, asking)
            return replace(made, point=point, time=_time(began, solved))
    terms = FrontTerms(solver.scene, target, solver.axes, solver.base, programs[0], caps)
    made = _without(solver, terms, found)
    return replace(made, terms=terms, time=_time(began, solved))


def _without(solver: Solver, terms: FrontTerms, found: Reached) -> Solution:
    """Return the answer where no design was reached: the nearest one there is, and what clashes."""
    clash = clashing(solver, terms.program) if found.status == "infeasible" else Clash()
    here = terms.whole(solver.job.design(solver.base, clash.x)) if clash.x else report.nowhere(solver.scene)
    today = functools.partial(terms.evaluation, {})
    told = {"status": found.reason, "accuracy": solver.accuracy}
    explained = solver.job.explain(solver.scene, clash.limits.values())
    made = report.without_optimum(terms.target or "", here, clash, told, today, explained)
    sentences = Sentences(f"No design was found: {found.reason}.")
    return made if clash.limits else replace(made, status=found.status, sentences=sentences)


def clashing(solver: Solver, program: Program) -> Clash:
    """Return the limits of a program that cannot all be kept, and what helps; nothing where that is not found."""
    job, scene = solver.job, solver.scene
    today = job.start(program, scene)
    search = multistart.run_search(Search(job, program, Settings(solver.accuracy), today))
    return elastic.clash(search, Words(scene))


def _certified(
    solver: Solver, terms: FrontTerms, here: Evaluated, certificate: Certificate, found: Reached, asking: Asking
) -> Solution:
    """Return the answer of a design that was reached."""
    words = Words(solver.scene)
    explicit = _explicit(terms, certificate)
    prices, together = report.prices(words, explicit), report.joint_prices(words, explicit)
    if found.reason:
        sentences = Sentences(f"A design was reached but not certified: {found.reason}.")
    else:
        sentences = Sentences(_sought(words, terms, asking), report.stops(prices, together))
    return Solution(
        **vars(here),
        target=terms.target or "",
        status=found.status,
        sentences=sentences,
        binding=prices,
        bind_together=together,
        certificate=certificate,
        solver={"accuracy": solver.accuracy},
        today=functools.partial(terms.evaluation, {}),
    )


def _as_read(job: Job, program: Program, x: Mapping[str, float]) -> dict[str, float]:
    """Return the variables, SI, of the design that a person reads of x (SI)."""
    return job.values(program, job.design(program, x))


def _explicit(terms: FrontTerms, certificate: Certificate) -> Certificate:
    """Return a certificate with what binds, a limit on an axis as a limit of its figure."""
    caps = {capped(axis): (axis, cap) for axis, cap in terms.caps}

    def slope(each: Binding) -> float:
        if each.limit.name not in caps:
            return 1.0
        axis, cap = caps[each.limit.name]
        return abs(axis.slope(_end(axis, cap)))

    def told(each: Binding) -> Binding:
        if each.limit.name not in caps:
            return each
        axis, cap = caps[each.limit.name]
        limit = each.limit
        if not axis.objective.is_magnitude:
            limit = replace(limit, sign=axis.sign, value=_end(axis, cap))
        worth = each.worth * slope(each)
        return each._replace(limit=replace(limit, name=axis.axis.name), side=limit.sign, worth=worth)

    together = []
    for joint in certificate.bind_together:
        slopes = np.array([slope(each) for each in joint.bindings])
        together.append(replace(joint, bindings=tuple(map(told, joint.bindings)), costs=slopes[:, None] * joint.costs))
    return replace(certificate, binding=tuple(map(told, certificate.binding)), bind_together=tuple(together))


def _sought(words: Words, terms: FrontTerms, asking: Asking) -> str:
    """Return what was sought as a sentence."""
    sought, other = terms.traded[asking.first], terms.traded[1 - asking.first]
    held = [
        f"{axis.called} at {'most' if axis.sign > 0 else 'least'} {words.shown(axis.axis.name, _end(axis, cap))}"
        for axis, cap in terms.caps
    ]
    both = len(terms.program.objectives) == len(terms.base.objectives)
    after = f", then the {other.sense} {other.called}" if both else ""
    return f"The {sought.sense} {sought.called}{' with ' if held else ''}{' and '.join(held)}{after}."


def _time(began: float, solved: float) -> dict[str, float]:
    """Return the seconds of a solve, and of what was told of it after it."""
    now = time.perf_counter()
    parts = {"import_s": 0.0, "build_s": 0.0, "solve_s": solved - began, "settle_s": 0.0, "certify_s": now - solved}
    return {**parts, "report_s": 0.0, "total_s": now - began}
