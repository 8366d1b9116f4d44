"""The whole answer of a front's point: its certificate and prices, limits on axes told as limits like the others."""

import functools
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.model.axes import Traded
from loomopt.model.limits import Limit
from loomopt.model.program import Program
from loomopt.model.sampling import sampled
from loomopt.physics.tolerances import FEASIBLE, SHOWN_AS_ZERO
from loomopt.scenes.scene import Scene
from loomopt.solving.answer import evaluation, report
from loomopt.solving.answer.solution import Clash, Evaluation, Finding, Solution
from loomopt.solving.answer.words import Words
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.certificate.verdict import Binding, Certificate
from loomopt.solving.nlp.point import Settings
from loomopt.solving.search import elastic, multistart
from loomopt.solving.search.search import Search
from loomopt.studies.front.solver import Asking, Reached, Solver, capped
from loomopt.studies.run import warm

if TYPE_CHECKING:
    from loomopt.solving.answer.solution import Proofs

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

    def evaluation(self, design: Mapping[str, float]) -> Evaluation:
        """Return a design's figures and limits; design: SI, what it does not name is today's."""
        named = {self.scene.full(name): value for name, value in design.items()}
        return self.whole({**self.job.today(self.scene), **named})

    def whole(self, design: Mapping[str, float]) -> Evaluation:
        """Return figures and limits of a design by full names, SI."""
        found = evaluation.evaluation(self.scene, self.job, self.base, design)
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

    def _finding(self, cap: Cap, found: Evaluation, design: Mapping[str, float]) -> Finding:
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
        one = replace(one, min=low, max=high, ok=one.ok and other.ok)
    return one


def _named(terms: FrontTerms) -> tuple[Limit, ...]:
    """Return all limits, those on axes under the axis' own name where their row is the figure itself."""
    plain = {capped(axis): axis.axis.name for axis, _ in terms.caps if _is_figure(axis)}
    return tuple(replace(limit, name=plain.get(limit.name, limit.name)) for limit in terms.program.limits)


def _is_figure(axis: Traded) -> bool:
    return axis.sign > 0 and axis.axis.power == 1 and axis.axis.offset == 0.0


def answer(solver: Solver, target: str | None, found: Reached, asking: Asking, began: float) -> Solution:
    """Return what a point of a front came to as the answer that a solve gives; began: when its solve did, s.

    asking: what was asked, but for the number of levels.
    """
    solved = time.perf_counter()
    caps = tuple((axis, cap) for axis, cap in zip(solver.axes, asking.caps, strict=True) if cap is not None)
    programs = [solver.program(asking._replace(levels=levels)) for levels in (1, 2)]
    for program in programs:
        point = warm.read(found.warm.get("point", {}), program)
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
    here = terms.whole(solver.job.design(solver.base, clash.x)) if clash.x else terms.evaluation({})
    today = functools.partial(terms.evaluation, {})
    told = {"status": found.reason, "accuracy": solver.accuracy}
    explained = solver.job.explain(solver.scene, clash.limits.values())
    made = report.without_optimum(terms.target or "", here, clash, told, today, explained)
    return made if clash.limits else replace(made, status=found.status, message=f"No design was found: {found.reason}.")


def clashing(solver: Solver, program: Program) -> Clash:
    """Return the limits of a program that cannot all be kept, and what helps; nothing where that is not found."""
    job, scene = solver.job, solver.scene
    today = {**job.values(program, job.today(scene)), **program.today}
    search = multistart.resolved(Search(job, program, Settings(solver.accuracy), today))
    return elastic.clash(search, Words(scene))


def _certified(
    solver: Solver, terms: FrontTerms, here: Evaluation, certificate: Certificate, found: Reached, asking: Asking
) -> Solution:
    """Return the answer of a design that was reached."""
    words = Words(solver.scene)
    prices = report.prices(words, replace(certificate, binding=tuple(_explicit(terms, certificate))))
    reason = f"A design was reached but not certified: {found.reason}."
    return Solution(
        **vars(here),
        target=terms.target or "",
        status=found.status,
        message=reason if found.reason else f"{_asked(words, terms, asking)} {report.stops(prices)}",
        binding=prices,
        certificate=certificate,
        solver={"accuracy": solver.accuracy},
        today=functools.partial(terms.evaluation, {}),
    )


def _as_read(job: Job, program: Program, x: Mapping[str, float]) -> dict[str, float]:
    """Return the variables, SI, of the design that a person reads of x (SI)."""
    return job.values(program, job.design(program, x))


def _explicit(terms: FrontTerms, certificate: Certificate) -> Iterator[Binding]:
    """Yield what binds, a limit on an axis as a limit of its figure."""
    caps = {capped(axis): (axis, cap) for axis, cap in terms.caps}
    for each in certificate.binding:
        if each.limit.name not in caps:
            yield each
            continue
        axis, cap = caps[each.limit.name]
        name, limit, figure = axis.axis.name, each.limit, _end(axis, cap)
        if not axis.objective.is_magnitude:
            limit = replace(limit, sign=axis.sign, value=figure)
        worth = each.worth * abs(axis.slope(figure))
        yield replace(each, limit=replace(limit, name=name), side=limit.sign, worth=worth)


def _asked(words: Words, terms: FrontTerms, asking: Asking) -> str:
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
