"""Solve a scene's target: starts → exchange → silent levels → certificate → an answer that explains itself."""

import functools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.model.program import Program
from loomopt.model.sampling import Tally, forget
from loomopt.physics.tolerances import ACCURACY
from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Clash, Evaluation, Solution
from loomopt.solving.answer.words import Words
from loomopt.solving.certificate.verdict import GlobalBound
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.options import Everywhere, check_everywhere, check_numbers, check_sought, target_name

if TYPE_CHECKING:
    from loomopt.solving.search.search import Judged, Search

RESOLVED = 5
"""Times a search begins again with what its best needs of a steady state: each doubles it, from the fewest to the most.
"""
NOT_SOLVED = {"status": "Not_Assembled", "iterations": 0}
"""What is said of the solver where no start assembles."""


def evaluate(scene: Scene, design: Mapping[str, float] | None = None, target: str | None = None) -> Evaluation:
    """Return figures and limits of a design (SI; today's without one), nothing optimised.

    target: whose limits, the job's default without one. A limit that is exceeded by less than the rounding of the
    digits given says so. Raises BadInput for a design that does not assemble.
    """
    job, name = registry.of(scene), target_name(scene, target)
    if target:
        job.demand(scene, name)
    full = {**job.today(scene), **{scene.full(of): value for of, value in (design or {}).items()}}
    evaluate = functools.partial(_evaluated, scene, job, name)
    found = evaluate(full)
    if found.admissible:
        return found
    from loomopt.solving.answer.report import told_apart

    return told_apart(found, scene, full, evaluate)


def _evaluated(scene: Scene, job: Job, target: str, design: Mapping[str, float]) -> Evaluation:
    """Return figures and limits of a design (SI; what it does not name stays today's)."""
    return report.evaluation(scene, job, job.program(scene, target), {**job.today(scene), **design})


def solve(
    scene: Scene,
    target: str | None = None,
    *,
    accuracy: float = ACCURACY,
    starts: int | None = None,
    seed: int = 0,
    near: Solution | Sequence[Point] | None = None,
    prove: bool = False,
    everywhere: Everywhere | None = None,
    on_iteration: Callable[[int], None] | None = None,
    on_start: Callable[[int, int], None] | None = None,
    on_step: Callable[[str], None] | None = None,
) -> Solution:
    """Return the certified optimum of a scene's target, or what stands in its way.

    accuracy: relative, of whole-cycle values; starts: how many, the job's own first, then random ones from `seed`;
    without it a search for the best basin, its designs drawn with `seed`;
    near: an answer to start warm from, or where neighbours' solves ended, the best of which counts (one of another
    structure is no help and is left alone);
    prove: whether to prove every limit of the answer at every crank angle;
    everywhere: to prove that no admissible design is better, and how closely;
    on_iteration: called with each iteration's number;
    on_start: called with each start's number and how many there are;
    on_step: called with what is being done, before each step that may take long.
    Raises BadInput for an unknown target or one the scene cannot serve, KeyboardInterrupt on Ctrl-C.
    """
    forget()
    began = time.perf_counter()
    job, target = registry.of(scene), target_name(scene, target)
    job.demand(scene, target)
    check_sought(scene)
    check_numbers(accuracy, starts, seed)
    check_everywhere(everywhere)
    settings = Settings(accuracy, callback=_callback(on_iteration), on_step=on_step).at(f"building the {target}")
    imported = _import_solver()
    begun = time.perf_counter()
    program = job.program(scene, target)
    made = time.perf_counter() - begun
    today = {**job.values(program, job.today(scene)), **program.today}
    warm, before = _points(near), Tally.positions
    search = solve_program(program, job, settings, starts, seed, warm, on_start, today)
    sold = job.sizes(scene)
    search, bound = _claimed(search, everywhere, sold) if everywhere else (search, None)
    search = _least_changed(search)
    # Figures are read as finely for every answer: they are no part of what accuracy costs.
    evaluated = Tally.positions - before
    search, answer, reported = _answer(scene, target, search)
    for name, sizes in sold.items() if answer.status == "optimal" else ():
        options: dict[str, Any] = {"accuracy": accuracy, "starts": starts or 1, "seed": seed, "on_start": on_start}
        options["on_step"] = replace(settings, step=f"trying sizes of {name}").say
        from loomopt.solving.search.stock_sizes import fitted

        answer = fitted(scene, answer, name, sizes, functools.partial(solve, target=target, **options))
    if prove and answer.certificate:
        settings.at("proving")
        answer = _proven(scene, target, answer)
    answer = replace(answer, global_bound=bound)
    solver = {**answer.solver, "evaluations": evaluated}
    if answer.certificate:
        solver["error_estimate"] = answer.certificate.error
    seconds = {"import_s": imported, "build_s": made + search.built, "solve_s": search.solved - search.built}
    seconds |= {"settle_s": search.settled, "certify_s": search.certified, "report_s": reported}
    return replace(answer, solver=solver, time=seconds | {"total_s": time.perf_counter() - began})


def solve_program(
    program: Program,
    job: Job,
    settings: Settings,
    starts: int | None = None,
    seed: int = 0,
    near: Point | Sequence[Point] | None = None,
    on_start: Callable[[int, int], None] | None = None,
    today: Mapping[str, float] | None = None,
) -> "Search":
    """Return how far a search for a program's certified optimum comes; no scene is read, nothing is said in words.

    near: where neighbours' solves ended, to start warm from; one of another structure is left alone; today: today's
    machine by variable, SI, one more place to look for an admissible design from. The rest is as in `solve`. Raises
    KeyboardInterrupt on Ctrl-C.
    """
    from loomopt.solving.search.multistart import searched
    from loomopt.solving.search.search import Search

    same = [point for point in _points(near) if point.structure == program.structure]
    search = searched(Search(job, program, settings, today or {}), starts, seed, same, on_start)
    for _ in range(RESOLVED if search.best else 0):
        finer = _finer(search)
        if finer is search.program:
            break
        search = searched(replace(search, program=finer, candidates=(), best=None), starts, seed, (), on_start)
    return search


def _finer(search: "Search") -> Program:
    """Return the program with what the steady state of a search's best needs; itself where it has that, or cannot."""
    program, best = search.program, search.best
    if not program.model.states or best is None:
        return program
    from loomopt.model.model import with_words_fixed

    try:
        model = with_words_fixed(program.model, {**program.parameters, **best.x})
    except ArithmeticError:
        return program
    return program if model is program.model else replace(program, model=model)


def _points(near: Solution | Point | Sequence[Point] | None) -> Sequence[Point]:
    """Return where the solves ended that a solve is to start near."""
    near = near.point if isinstance(near, Solution) else near
    return [near] if isinstance(near, Point) else near or []


def _proven(scene: Scene, target: str, answer: Solution) -> Solution:
    """Return the answer with every limit proven, or with what is not."""
    from loomopt.solving.proof.whole_cycle import proven

    return proven(scene, target, answer)


def _claimed(
    search: "Search", everywhere: Everywhere, sold: Mapping[str, Sequence[float]]
) -> "tuple[Search, GlobalBound]":
    """Return the search, with a better best where boxes led to one, and what is proven of all designs."""
    from loomopt.solving.proof.levels import claimed

    return claimed(search, everywhere, f"{', '.join(sold)} comes in sizes, which boxes do not tell" if sold else "")


def _least_changed(search: "Search") -> "Search":
    """Return the search with what its best leaves open settled by least change from today."""
    if search.best is None or not search.best.certificate.level:
        return search
    from loomopt.solving.search import least_change

    return least_change.with_least_change(search)


def _import_solver() -> float:
    """Import CasADi where it is not yet; returns the seconds it took, so that building is not charged with it."""
    began = time.perf_counter()
    import casadi  # noqa: F401

    return time.perf_counter() - began


def _callback(on_iteration: Callable[[int], None] | None) -> Any:
    """Return the CasADi callback that reports iterations, or None."""
    if on_iteration is None:
        return None
    from loomopt.solving.nlp.ipopt import IterationCallback

    return IterationCallback(on_iteration)


def _answer(scene: Scene, target: str, search: "Search") -> "tuple[Search, Solution, float]":
    """Return the solution, or the reason there is none; the search with the time of that; seconds of saying."""
    clash, began = Clash(), time.perf_counter()
    if search.best is None and search.nearest and search.nearest.relaxed:
        from loomopt.solving.search import elastic

        clash = elastic.clash(search.program, search.nearest, search.settings, Words(scene))
        search = replace(search, solved=search.solved + time.perf_counter() - began)
    began = time.perf_counter()
    if search.best is None:
        answer = _without(scene, target, search, clash)
    else:
        answer = _with(scene, target, search, search.best)
    return search, answer, time.perf_counter() - began


def _without(scene: Scene, target: str, search: "Search", clash: Clash) -> Solution:
    """Return the answer where no design was reached."""
    from loomopt.solving.search import multistart

    job, program, points = search.job, search.program, [each.point for each in search.candidates]
    solver: dict[str, Any] = {**NOT_SOLVED, **multistart.search_counts(search)}
    if points:
        solver |= {"status": points[0].status, "iterations": sum(point.iterations for point in points)}
    today = functools.partial(_evaluated, scene, job, target, {})
    design = job.design(program, clash.x) if clash.x else job.today(scene)
    here = report.evaluation(scene, job, program, design)
    return report.without_optimum(target, here, clash, solver, today, job.explain(scene, clash.limits.values()))


def _with(scene: Scene, target: str, search: "Search", best: "Judged") -> Solution:
    """Return the answer of the best design that was reached."""
    from loomopt.solving.search import multistart

    job, program, point = search.job, search.program, best.candidate.point
    solver: dict[str, Any] = {**NOT_SOLVED, **multistart.search_counts(search)}
    solver |= {"status": point.status, "iterations": point.iterations}
    today = functools.partial(_evaluated, scene, job, target, {})
    here = report.evaluation(scene, job, program, job.design(program, best.x))
    searched = multistart.search_report(search)
    answer = report.with_optimum(job, scene, target, here, best.certificate, solver, today, searched)
    return replace(answer, point=point, optima=multistart.optima_found(search))
