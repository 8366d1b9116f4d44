"""The public functions: load a scene, solve it, evaluate and simulate a design."""

import functools
import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from loomopt.base import arguments
from loomopt.base.arguments import renamed
from loomopt.base.errors import refusal
from loomopt.interface import results
from loomopt.interface.results import Answer, Evaluation
from loomopt.jobs import registry
from loomopt.jobs.registry import scene
from loomopt.physics.tolerances import ACCURACY, SLACK
from loomopt.scenes.designs import Given as Design
from loomopt.scenes.scene import Call, Scene
from loomopt.solving.options import GAP, OMITTED, SECONDS, GlobalProof, check_global_proof, check_numbers, target_name

if TYPE_CHECKING:
    from concurrent.futures import Executor
    from pathlib import Path

    import pandas as pd

    from loomopt.interface.study.accuracy import AccuracyStudy
    from loomopt.interface.study.budget import Budget
    from loomopt.interface.study.comparison import Comparison
    from loomopt.interface.study.effects import EffectsStudy
    from loomopt.interface.study.points import StudyTable
    from loomopt.interface.study.sensitivity import SensitivityStudy
    from loomopt.interface.study.tolerance import ToleranceStudy
    from loomopt.scenes.packaged import Head
    from loomopt.solving.answer.solution import Proofs
    from loomopt.studies.front.front import Given as Ranges
    from loomopt.studies.run.rows import Row
    from loomopt.studies.sweep import Over

Given = Scene | Evaluation | str | os.PathLike[str]
"""A scene, an answer in its own scene, or what `load` takes: a packaged name or a path."""
if TYPE_CHECKING:  # a file's name does not tell type checkers what `load` returns, and most name scenes
    Loaded = Scene | Any
else:
    Loaded = Scene | Evaluation

__all__ = [
    "Answer",
    "Evaluation",
    "Scene",
    "accuracy",
    "budget",
    "compare",
    "effects",
    "evaluate",
    "load",
    "new",
    "pareto",
    "problems",
    "prove",
    "scene",
    "schema",
    "sensitivity",
    "simulate",
    "solve",
    "sweep",
    "tolerance",
]

MACHINES = 100_000
"""Machines that a study of tolerances draws."""


def load(name_or_path: str | os.PathLike[str]) -> Loaded:
    """Scene of a packaged name or of a TOML file; of an answer's JSON file the answer, in its own scene.

    An answer comes as the `Evaluation` of its design, computed anew. Raises BadInput.
    """
    loaded, design = _open(name_or_path)
    return loaded if design is None else results.evaluate_design(loaded, design, None)


@renamed(near="warm_start", everywhere="global_proof", yield_="min_yield", steps="round_to")
def solve(
    scene: Given,
    target: str | None = None,
    *,
    accuracy: float = ACCURACY,
    starts: int | None = None,
    seed: int = 0,
    warm_start: Answer | None = None,
    prove: bool = False,
    global_proof: bool = False,
    gap: float = GAP,
    seconds: float = SECONDS,
    robust: float | None = None,
    min_yield: float | None = None,
    round_to: Mapping[str, object] | bool = False,
    on_iteration: Callable[[int], None] | None = None,
    on_start: Callable[[int, int], None] | None = None,
    on_step: Callable[[str], None] | None = None,
) -> Answer:
    """Certified optimum of a scene's target, or the limits that clash.

    Parameters
    ----------
    scene : Scene, answer, packaged name or path.
    target : name of a target of the scene; the job's default without it.
    accuracy : relative accuracy of every whole-cycle value, 1e-11 to 0.1.
    starts : number of starts, the job's own first, then random ones; without it a search for the best basin.
    seed : seed of the random starts.
    warm_start : answer of a scene of the same structure; the solve starts there and stays in its basin.
    prove : prove every limit at every crank angle (`answer.proofs`).
    global_proof : prove that no admissible design is better by more than `gap` (`answer.global_bound`).
    gap : gap of the global proof, relative to each objective.
    seconds : time limit of the global proof, s.
    robust : standard deviations of its own figure by which every limit is backed off, by [tolerances] of the scene.
    min_yield : share of the machines made to [tolerances] that hold all limits, in place of `robust`.
    round_to : steps of sizes by number or pattern, such as {"l*": "0.5 mm"}, beside [steps] and [stock] of the scene;
        True for those of the scene alone (`answer.rounded`).
    on_iteration, on_start, on_step : functions of (number), (number, total) and (text) that report progress.

    Raises
    ------
    BadInput : an argument or the scene is wrong.
    KeyboardInterrupt : Ctrl-C.

    Examples
    --------
    >>> answer = solve("beatup-light")
    >>> round(answer.figures["M3_fdc"], 4)
    -76.9811
    """
    from loomopt.interface.progress import cell_progress
    from loomopt.solving import engine

    loaded = _scene(scene)
    for key, hook in (("on_iteration", on_iteration), ("on_start", on_start), ("on_step", on_step)):
        if hook is not None:
            arguments.called(hook, key, "a function", "Give a function, or leave it out")
    arguments.flag(prove, "prove")
    if warm_start is not None and not isinstance(warm_start, Answer):
        raise refusal("it is no answer", "", "warm_start", warm_start, "what `solve` returned", "Give one or none")
    arguments.flag(global_proof, "global_proof")
    if not isinstance(round_to, bool):
        round_to = arguments.table(round_to, "round_to", "numbers and their steps", "Write {'l1': '0.5 mm'}, or True")
    with cell_progress() as say:
        on_text = on_step or say
        proof = GlobalProof(gap, seconds, on_text or (lambda text: None)) if global_proof else None
        hooks: dict[str, Any] = {"on_iteration": on_iteration, "on_start": on_start, "on_step": on_text}
        anywhere = functools.partial(
            engine.solve,
            target=target,
            accuracy=accuracy,
            starts=starts,
            seed=seed,
            near=[warm_start.point] if warm_start and warm_start.point else [],
            **hooks,
        )
        once = functools.partial(anywhere, loaded)
        if round_to:
            from loomopt.studies.rounding import size_rounding

            if robust is not None or min_yield is not None:
                remedy = "Round first, then back off with the sizes set as bounds"
                raise refusal("sizes and back-off cannot be combined", "", "round_to", remedy=remedy)
            if proof:
                remedy = "Leave out the proof: an answer in sizes says what of the lattice was read"
                raise refusal("sizes and the global proof cannot be combined", "", "round_to", remedy=remedy)
            rounding = size_rounding.asked(loaded, target, None if round_to is True else round_to)
            told_last = functools.partial(anywhere, prove=prove)
            solution = size_rounding.solved(rounding, anywhere, told_last, on_text)
        elif robust is None and min_yield is None:
            solution = once(prove=prove, global_proof=proof)
        else:
            from loomopt.studies.robust import backoff

            request = backoff.asked(loaded, target, robust, min_yield, seed)
            check_global_proof(proof)
            last = functools.partial(once, prove=prove, global_proof=proof)
            solution = backoff.solved(request, once, last, on_text)
    return results.to_answer(solution, loaded, loaded.call.target if target is None else target)


def evaluate(scene: Given, design: Design | Evaluation | None = None, target: str | None = None) -> Evaluation:
    """Figures and limits of a design (SI and rad; today's where it names nothing). Raises BadInput.

    scene: as `load` takes it; without a design, an answer is judged as it is. design: a mapping, or an answer, of which
    the design alone is taken. target: whose limits, the answer's own or the job's default without one.
    """
    loaded, given = _request(scene, design)
    return results.evaluate_design(loaded, given, target)


def prove(
    scene: Given, design: Design | Evaluation | None = None, target: str | None = None, *, slack: float = SLACK
) -> "Proofs":
    """Proofs that a design's limits (SI; today's without one) hold at every crank angle, or where they fail.

    design: a mapping, or an answer, of which the design alone is taken. target: whose limits,
    the job's default without one. slack: what binding limits leave open, relative to each quantity's largest magnitude
    over the cycle. Raises BadInput.
    """
    from loomopt.interface.progress import cell_progress
    from loomopt.solving.proof import whole_cycle

    loaded, given = _request(scene, design)
    with cell_progress() as say:
        if say:
            say("proving")
        return whole_cycle.prove(loaded, given, target, slack)


@renamed(beside="measured")
def simulate(
    scene: Given,
    design: Design | Evaluation | None = None,
    target: str | None = None,
    *,
    accuracy: float | None = None,
    measured: str | os.PathLike[str] | None = None,
) -> "pd.DataFrame":
    """Curves of a design (SI; today's without one) over the cycle, units in the column names.

    design: a mapping, or an answer, of which the design alone is taken. target: what it was found for, to be named in
    the table's provenance. accuracy: as few rows as show each column's largest magnitude to it; every half degree
    without. measured: a CSV file of measured curves, `phi [deg]` and columns named as the curves; they become columns
    NAME_measured, and the table's `attrs` hold the rms difference of each. Raises BadInput.
    """
    from loomopt.interface import tables

    if accuracy is not None:
        check_numbers(accuracy, 1)
    loaded, given = _request(scene, design)
    name = None if target is None and loaded.call.target is None else target_name(loaded, target)
    return tables.curves(loaded, given, accuracy, name, measured)


def budget(scene: Given, design: Design | Evaluation | None = None, *, fluctuation: float | None = None) -> "Budget":
    """Return where the crank torque of a design (SI; today's without one) comes from, effect by effect.

    Each effect's share where the torque peaks, its rms, its energy a turn; what their sum asks of a motor. design: a
    mapping, or an answer, of which the design alone is taken. fluctuation: (largest − least)/mean speed that a flywheel
    is sized for. Raises BadInput, also where nothing acts on the crank.
    """
    from loomopt.interface.study.budget import compute

    return compute(*_request(scene, design), fluctuation)


def sweep(
    scene: Given,
    over: "Over",
    target: str | None = None,
    executor: "Executor | Callable[[], Executor] | None" = None,
    *,
    workers: int | None = None,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
    accuracy: float = ACCURACY,
    seed: int = 0,
    on_row: "Callable[[Row], None] | None" = None,
) -> "StudyTable":
    """A row for every combination of scene numbers, solved for a target (the job's default without one).

    over: dotted key → its values as a scene gives them, or "LO:HI:STEP UNIT". executor: any of `concurrent.futures`, or
    a function that makes one; workers: so many processes on this machine instead. The rows are the same, whoever
    computes them. store: a file that each row is written to as it comes; resume: takes those that are there. accuracy,
    seed: as in `solve`. on_row(row): called as each is there. Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    from loomopt.interface.study.points import run_study
    from loomopt.studies.sweep import plan_sweep

    study = plan_sweep(_scene(scene), over, target, accuracy=accuracy, seed=seed)
    return run_study(study, executor, workers, store, resume, on_row)


def effects(
    scene: Given,
    target: str | None = None,
    tolerance: float = OMITTED,
    executor: "Executor | Callable[[], Executor] | None" = None,
    *,
    workers: int | None = None,
    accuracy: float = ACCURACY,
    seed: int = 0,
    on_row: "Callable[[Row], None] | None" = None,
) -> "EffectsStudy":
    """Return what each effect is worth for a target (the job's default without one), and what may be left out.

    The reference has all effects of [effects] and [available] on that combine. tolerance: share of each objective's
    natural size that leaving an effect out may change. executor, workers: as in `sweep`; the study is the same whoever
    computes it. accuracy, seed: as in `solve`. on_row(row): called as each solve is there. Raises BadInput, and
    KeyboardInterrupt on Ctrl-C.
    """
    from loomopt.interface.study.effects import run_effects
    from loomopt.studies.effects.study import plan_effects

    study = plan_effects(_scene(scene), target, tolerance, accuracy=accuracy, seed=seed)
    return run_effects(study, executor, workers, on_row)


def sensitivity(
    answer: Answer | Given, target: str | None = None, *, on_step: Callable[[str], None] | None = None
) -> "SensitivityStudy":
    """How an answer moves with every number of its scene, and how far its prices hold.

    answer: what `solve` returned; a scene, or what `load` takes, is solved first, for `target`. on_step(what):
    progress. Raises BadInput, also for an answer that is not certified, and KeyboardInterrupt on Ctrl-C.
    """
    from loomopt.interface.study.sensitivity import run_sensitivity
    from loomopt.studies.sensitivity.study import plan_sensitivity

    if on_step is not None:
        arguments.called(on_step, "on_step", "a function", "Give a function, or leave it out")
    solved = answer if isinstance(answer, Answer) and answer.point else solve(_scene(answer), target)
    return run_sensitivity(plan_sensitivity(solved.scene, solved.result), on_step)


def tolerance(
    scene: Given,
    design: Design | Evaluation | None = None,
    target: str | None = None,
    executor: "Executor | Callable[[], Executor] | None" = None,
    *,
    samples: int = MACHINES,
    seed: int = 0,
    workers: int | None = None,
    worst: bool = True,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
    on_step: Callable[[str], None] | None = None,
) -> "ToleranceStudy":
    """How the machines of a design (SI; today's without one) spread as [tolerances] has them made.

    design, target: as in `evaluate`. samples: machines that are drawn, over 16 scrambles of Sobol's points by `seed`.
    worst: whether the worst case of each figure within all tolerances is proven too, which takes seconds.
    executor, workers, store, resume: as in `sweep`, a scramble a row; the study is the same whoever computes it.
    on_step(what): progress. Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    from loomopt.interface.study.tolerance import run_tolerance
    from loomopt.studies.tolerance.plan import plan_tolerance

    loaded, given = _request(scene, design)
    if on_step is not None:
        arguments.called(on_step, "on_step", "a function", "Give a function, or leave it out")
    proving, going_on = arguments.flag(worst, "worst"), arguments.flag(resume, "resume")
    plan = plan_tolerance(loaded, given, target, samples, seed)
    return run_tolerance(plan, executor, workers, on_step, proving, store, going_on)


def pareto(
    scene: Given,
    axes: Sequence[str],
    target: str | None = None,
    executor: "Executor | Callable[[], Executor] | None" = None,
    *,
    maximise: str | Sequence[str] = (),
    ranges: "Ranges | None" = None,
    points: int | None = None,
    workers: int | None = None,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
    accuracy: float = ACCURACY,
    on_row: "Callable[[Row], None] | None" = None,
) -> "StudyTable":
    """Front of two axes: what the first costs of the second, every point certified.

    axes: figures or numbers that the scene bounds, freed where it holds them; M3_fdc counts by magnitude. target: whose
    demands hold at every point, of all but the axes: the job's default without one, "none" for the scene's limits
    alone. maximise: axes of which the most is sought; of the others it is the least, but of one that offers its most
    alone, such as a dwell, or whose most a target of a linkage seeks, the most. ranges: axis → "LO:HI UNIT", or both
    ends in SI, beyond which the front does not go. points: how many are asked for, 40 without; those that narrow
    changes down come beside them. The rest is as in `sweep`. Raises BadInput, also for an end that has no least value,
    and KeyboardInterrupt on Ctrl-C.
    """
    from loomopt.interface.study.points import run_study
    from loomopt.studies.front import front

    loaded = _scene(scene)
    axis_ranges = front.si(loaded, {} if ranges is None else ranges)
    whose = front.demanding(loaded, target)
    study = front.trade(loaded, axes, whose, maximise=maximise, ranges=axis_ranges, points=points, accuracy=accuracy)
    return run_study(study, executor, workers, store, resume, on_row)


def accuracy(scene: Given, *, full: bool = False, on_step: Callable[[str], None] | None = None) -> "AccuracyStudy":
    """Return what accuracy costs in time, method by method; full: more settings and repeats, which take minutes.

    on_step(what): called before each step. Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    from loomopt.interface.study.accuracy import run_accuracy

    return run_accuracy(_scene(scene), arguments.flag(full, "full"), on_step)


def problems() -> "tuple[Head, ...]":
    """Packaged problems: name, title, job, targets and source of each. Raises BadInput."""
    from loomopt.interface import listing

    return listing.problems()[0]


def new(job: str, path: str | os.PathLike[str]) -> "Path":
    """Write a commented scene of a job to start from, or a packaged scene by its name; return the file.

    path: one that is not there yet, and ends in .toml; of a packaged scene also in .zip, which takes all scenes of its
    job. Raises BadInput.
    """
    from loomopt.interface import listing

    return listing.new(job, arguments.path(path, "path", "a path that ends in .toml", "Name a file"))


def schema(job: str) -> dict[str, object]:
    """JSON Schema of a job's scenes, for editors. Raises BadInput."""
    from loomopt.interface.text import json_schema

    return json_schema.scene(registry.declared(arguments.text(job, "job", "a loom job", "Name one, such as beatup")))


def compare(*answers: "Evaluation | str", scene: Given | None = None) -> "Comparison":
    """Designs side by side in one unit, with what differs marked; their curves by `.plot()`.

    answers: answers or evaluations of one job, and "today" for the first one's machine as it is. scene: in which all
    are judged; each in its own without it. Raises BadInput.
    """
    from loomopt.interface.study import comparison

    return comparison.compare(answers, None if scene is None else _scene(scene))


def _scene(given: Given) -> Scene:
    """A scene that is given as itself, by its name or by its path; of an answer its own. Raises BadInput."""
    return _open(given)[0]


def _open(given: Given) -> tuple[Scene, dict[str, float] | None]:
    """A scene; of an answer its own, which knows its target, and its design, checked. Raises BadInput."""
    from loomopt.scenes import designs

    if isinstance(given, Scene):
        return given, None
    if isinstance(given, Evaluation):
        return given.scene.called(Call(target=given.target or None)), designs.checked(given.design, given.scene)
    if path := registry.answer_path(given):
        loaded, handed = registry.answered(path)
        return loaded, designs.checked(handed.design, loaded, loaded.origin)
    return registry.load(given), None


def _request(scene: Given, design: Design | Evaluation | None) -> tuple[Scene, dict[str, float]]:
    """A scene and a design in it, checked: of an answer its own, where none is given; else today's, as nothing.

    Of an answer given as the design, its design alone. Raises BadInput.
    """
    from loomopt.scenes import designs

    loaded, stored_design = _open(scene)
    if isinstance(design, Evaluation):
        designs.check_job(design.scene.job, loaded, "<answer>")
        design = design.design
    if design is None or (isinstance(design, Mapping) and not design):
        return loaded, stored_design or {}
    return loaded, designs.checked(design, loaded)
