"""Solve a scene's target: starts → exchange → silent levels → certificate → an answer that explains itself."""

import functools
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.nlp import exchange
from loomopt.nlp.point import ROUNDING, Point, Settings, sampler_at
from loomopt.program.program import Objective, Program
from loomopt.program.sampling import Sampler, Tally
from loomopt.scenes import Scene
from loomopt.solving import report
from loomopt.solving.asked import ACCURACY, check_numbers, target_name
from loomopt.solving.catalogue import fitted
from loomopt.solving.certificate import FEASIBILITY, STATIONARITY, certify
from loomopt.solving.proof import proven
from loomopt.solving.settle import settle
from loomopt.solving.solution import Evaluation, Solution
from loomopt.solving.verdict import Certificate
from loomopt.solving.words import Words

MORE_STARTS = 8
"""Starts tried before a target is called infeasible or uncertified."""
SAME = 1e-7
"""Objectives that agree to this, relative to their natural size, are one optimum."""
ALIKE = 4
"""Points of one optimum that are put before the certificate."""
CORRECTIONS, PRECISE = 4, 1e-9
STRONGER, STRONGEST_PENALTY = 100.0, 1e7


def evaluate(scene: Scene, design: Mapping[str, float] | None = None, target: str | None = None) -> Evaluation:
    """Return figures and limits of a design (SI; today's without one), nothing optimised.

    Raises BadInput for a design that does not assemble.
    """
    job = registry.of(scene)
    full = {**job.today(scene), **(design or {})}
    program = job.program(scene, target or scene.schema.default_target)
    return report.evaluation(scene, job, program, full)


def solve(
    scene: Scene,
    target: str | None = None,
    *,
    accuracy: float = ACCURACY,
    starts: int = 1,
    seed: int = 0,
    near: Solution | None = None,
    prove: bool = False,
    on_iteration: Callable[[int], None] | None = None,
    on_start: Callable[[int, int], None] | None = None,
) -> Solution:
    """Return the certified optimum of a scene's target, or what stands in its way.

    accuracy: relative, of whole-cycle values; starts: how many, the job's own first, then random ones from `seed`;
    near: an answer to start warm from (one of another structure is no help and is left alone);
    prove: whether to prove every limit of the answer at every crank angle;
    on_iteration: called with each iteration's number;
    on_start: called with each start's number and how many there are.
    Raises BadInput for an unknown target or one the scene cannot serve, KeyboardInterrupt on Ctrl-C.
    """
    began, evaluated = time.perf_counter(), Tally.positions
    job, target = registry.of(scene), target_name(scene, target)
    job.demand(scene, target)
    check_numbers(accuracy, starts)
    imported = _import_solver()
    program = job.program(scene, target)
    search = _Search(scene, job, program, Settings(accuracy, callback=_callback(on_iteration)), seed)
    same = near is not None and near.point is not None and near.point.structure == program.structure
    search.run(starts, near.point if near and same else None, on_start)
    answer = search.answer(target)
    for name, sizes in job.sizes(scene).items() if answer.status == "optimal" else ():
        options: dict[str, Any] = {"accuracy": accuracy, "starts": starts, "seed": seed, "on_start": on_start}
        answer = fitted(scene, answer, name, sizes, functools.partial(solve, target=target, **options))
    answer = proven(scene, target, answer) if prove and answer.certificate else answer
    total = time.perf_counter() - began
    times = {"import_s": imported, "build_s": search.built, "solve_s": search.spent - search.built}
    solver = {**answer.solver, "evaluations": Tally.positions - evaluated}
    if answer.certificate:
        solver["error_estimate"] = answer.certificate.error
    return replace(answer, solver=solver, time={**times, "certify_s": search.certified, "total_s": total})


def _import_solver() -> float:
    """Import CasADi where it is not yet; returns the seconds it took, so that building is not charged with it."""
    began = time.perf_counter()
    import casadi  # noqa: F401

    return time.perf_counter() - began


def _callback(on_iteration: Callable[[int], None] | None) -> Any:
    """Return the CasADi callback that reports iterations, or None."""
    if on_iteration is None:
        return None
    from loomopt.nlp.callback import IterationCallback

    return IterationCallback(on_iteration)


class _Search:
    """The hunt for the best certified design, from one start or many."""

    def __init__(self, scene: Scene, job: Job, program: Program, settings: Settings, seed: int) -> None:
        self.scene, self.job, self.program, self.settings, self.seed = scene, job, program, settings, seed
        self.points: list[Point] = []
        self.built, self.spent, self.certified = 0.0, 0.0, 0.0
        self.best: Point | None = None
        self.x: dict[str, float] = {}
        self.certificate: Certificate | None = None

    def run(self, count: int, near: Point | None, on_start: Callable[[int, int], None] | None) -> None:
        """Try `count` starts; more where none is certified."""
        if near is not None and self._try(near.x, near) and self._judge():
            return
        tried = 0
        for wanted in dict.fromkeys((count, max(count, MORE_STARTS))):
            chosen = exchange.starts(self.program, wanted, self.seed)
            for start in chosen[tried:]:
                if on_start:
                    on_start(tried + 1, len(chosen))
                self._try(start, None)
                tried += 1
            if self._judge():
                return

    def _try(self, start: Mapping[str, float], warm: Point | None) -> bool:
        """Solve from one start, again with a stronger weight between levels where the first was too weak."""
        began = time.perf_counter()
        point = exchange.solve(self.program, start, self.settings, warm)
        self.spent += time.perf_counter() - began
        self.built += point.built
        self.points.append(point)
        return point.reached

    def _judge(self) -> bool:
        """Settle and certify the best point so far; says whether it passed."""
        solved = [point for point in self.points if point.reached]
        if not solved:
            return False
        best = min(solved, key=functools.cmp_to_key(self._compare))
        if best is not self.best or self.certificate is None:
            self.best = best
            self._certify(best)
        assert self.certificate is not None
        if self._too_weak(self.certificate):
            self.settings = replace(self.settings, penalty=self.settings.penalty * STRONGER)
            before = self.best, self.certificate, self.x
            if self._try(self.best.x, None):
                self.points.remove(self.best)
                return self._judge()
            self.best, self.certificate, self.x = before
        return self.certificate.passed or self._other(solved)

    def _other(self, solved: list[Point]) -> bool:
        """Say whether another point with the same objectives passes where the best one did not; then it is the best."""
        before = self.best, self.certificate, self.x
        assert self.best is not None
        alike = [point for point in solved if point is not self.best and self._compare(point, self.best) == 0]
        for point in alike[:ALIKE]:
            self._certify(point)
            if self.certificate and self.certificate.passed:
                self.best = point
                return True
        self.best, self.certificate, self.x = before
        return False

    def _too_weak(self, certificate: Certificate) -> bool:
        """Say whether an earlier objective gave way to a later one: its weight must exceed twice its multiplier."""
        if self.settings.penalty * STRONGER > STRONGEST_PENALTY:
            return False
        held = max((level.held for level in certificate.levels[1:]), default=0.0)
        earlier = any(level.stationarity > STATIONARITY for level in certificate.levels[:-1])
        return earlier or self.settings.penalty <= 2 * held

    def _certify(self, point: Point) -> None:
        """Run the silent levels and the certificate; where there is a slope left, follow it to its end."""
        began = time.perf_counter()
        self.x, self.certificate = self._judged(point.x)
        for _ in range(CORRECTIONS):
            precise = max(min(PRECISE, self.settings.accuracy), ROUNDING)
            close = self.certificate.residual <= precise and self.certificate.error <= self.settings.accuracy
            if not self.certificate.correction or close:
                break
            x, better = self._judged(self._corrected(self.x, self.certificate.correction))
            if better.residual >= self.certificate.residual or better.feasibility > FEASIBILITY:
                break
            self.x, self.certificate = x, better
        self.certified += time.perf_counter() - began

    def _judged(self, x: Mapping[str, float]) -> tuple[dict[str, float], Certificate]:
        """Return x (SI) after the silent levels, and its certificate."""
        job, program = self.job, self.program
        x, settled = settle(program, job.tidy(program, x))
        exact = job.values(program, job.design(program, x))
        return x, replace(certify(program, exact, self.settings.accuracy), settled=settled)

    def _corrected(self, x: Mapping[str, float], step: Mapping[str, float]) -> dict[str, float]:
        """Return x moved by a step, both SI, within its bounds."""
        moved = {v.name: x[v.name] + step.get(v.name, 0.0) for v in self.program.variables}
        return {v.name: min(max(moved[v.name], v.lower), v.upper) for v in self.program.variables}

    def objectives(self, point: Point) -> tuple[float, ...]:
        """Return a point's objectives in their natural sizes, true over the whole cycle."""
        return _objectives(self.program, tuple(point.x.items()))

    def _compare(self, one: Point, other: Point) -> int:
        """Order points by their objectives, level by level."""
        for a, b in zip(self.objectives(one), self.objectives(other), strict=True):
            if abs(a - b) > SAME:
                return -1 if a < b else 1
        return 0

    def answer(self, target: str) -> Solution:
        """Return the solution, or the reason there is none."""
        scene, job, program = self.scene, self.job, self.program
        solver = {"status": "Not_Assembled", "iterations": 0, "starts": len(self.points), "starts_at_best": 0}
        solver["accuracy"] = self.settings.accuracy
        before = report.evaluation(scene, job, program, job.today(scene))
        if self.best is None:
            tried = [*exchange.starts(program, MORE_STARTS, self.seed), job.values(program, job.today(scene))]
            from loomopt.solving.elastic import clash

            began = time.perf_counter()
            found = clash(program, tried, self.settings, Words(scene))
            self.spent += time.perf_counter() - began
            if found.x and not found.relaxations and self._try(found.x, None):
                # The elastic solve came upon an admissible design that no start led to.
                self._judge()
                return self.answer(target)
            if self.points:
                solver["status"] = self.points[0].status
                solver["iterations"] = sum(point.iterations for point in self.points)
            design = job.design(program, found.x) if found.x else job.today(scene)
            here = report.evaluation(scene, job, program, design)
            return report.without_optimum(target, here, found, solver, before, job.explain(scene, found.limits))
        same = [p for p in self.points if p.reached and self._compare(p, self.best) == 0]
        solver |= {
            "status": self.best.status,
            "iterations": self.best.iterations,
            "starts_at_best": len(same),
        }
        here = report.evaluation(scene, job, program, job.design(program, self.x))
        assert self.certificate is not None
        answer = report.with_optimum(job, scene, target, here, self.certificate, solver, before)
        return replace(answer, point=self.best, optima=self._optima())

    def _optima(self) -> tuple[tuple[Mapping[str, float | None], int], ...]:
        """Return the distinct optima the starts ended in, best first, with how many starts did."""
        groups: list[tuple[Point, int]] = []
        for point in sorted((p for p in self.points if p.reached), key=functools.cmp_to_key(self._compare)):
            if groups and self._compare(groups[-1][0], point) == 0:
                groups[-1] = (groups[-1][0], groups[-1][1] + 1)
            else:
                groups.append((point, 1))
        return tuple((self._reached(point), count) for point, count in groups)

    def _reached(self, point: Point) -> dict[str, float | None]:
        """Return the figures of the objectives at a point, SI."""
        sampler = sampler_at(self.program, point.x)
        if sampler is None:
            return {}
        return {o.figure: _figure(sampler, o) for o in self.program.objectives}


def _objectives(program: Program, x: tuple[tuple[str, float], ...]) -> tuple[float, ...]:
    """Return the objectives of variables x (SI) in their natural sizes; infinite where they have no value."""
    sampler = sampler_at(program, dict(x))
    if sampler is None:
        return (math.inf,) * len(program.objectives)
    return tuple(sampler.merit(objective) / objective.scale for objective in program.objectives)


def _figure(sampler: Sampler, objective: Objective) -> float:
    """Return the figure of an objective, SI: with its sign where it is a number of its own."""
    if objective.form != "peak" and objective.figure in sampler.figures:
        return sampler.figures[objective.figure]
    return float(sampler.merit(objective) ** (1 / objective.power))
