"""The public functions: load a scene, solve it, evaluate and simulate a design."""

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
from loomopt.solving.options import GAP, OMITTED, SECONDS, GlobalProof, check_numbers, target_name

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
    from loomopt.solving.reductions.reduction import Reduction
    from loomopt.studies.front.front import Given as Ranges
    from loomopt.studies.run.rows import Row
    from loomopt.studies.sweep import Over

Given = Scene | Evaluation | str | os.PathLike[str]
"""A scene, an answer in its own scene, or what `load` takes: a packaged name or a path."""
if TYPE_CHECKING:  # the name of a file does not show type checkers what `load` returns
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
    """Load a scene, or an answer from its JSON file.

    Parameters
    ----------
    name_or_path : name of a packaged problem, or path of a TOML scene or of an answer's JSON file.

    Returns
    -------
    Scene; for an answer's file the `Evaluation` of its design in its scene, computed anew.

    Raises
    ------
    BadInput : the file is missing or wrong.

    Examples
    --------
    >>> load("beatup-light").mechanism["l1"]
    0.031
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

    Returns
    -------
    Answer with `design`, `figures`, `binding` and `certificate`; `status` says whether the solve was successful.

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
        raise refusal("it is not an answer", "", "warm_start", warm_start, "what `solve` returned", "Give one or none")
    arguments.flag(global_proof, "global_proof")
    if not isinstance(round_to, bool):
        round_to = arguments.table(round_to, "round_to", "numbers and their steps", "Write {'l1': '0.5 mm'}, or True")
    reductions: list[Reduction] = []
    if round_to:
        from loomopt.solving.reductions.size_rounding import SizeRounding

        reductions.append(SizeRounding(None if round_to is True else round_to))
    if robust is not None or min_yield is not None:
        from loomopt.studies.robust.backoff import BackOff

        reductions.append(BackOff(robust, min_yield, seed=seed))
    if len(reductions) > 1:
        remedy = "Use --round first, then --robust with the sizes set in [bounds]"
        raise refusal("--round and --robust cannot be combined", "", "round_to", remedy=remedy)
    with cell_progress() as say:
        on_text = on_step or say
        solution = engine.solve(
            loaded,
            target,
            accuracy=accuracy,
            starts=starts,
            seed=seed,
            near=[warm_start.point] if warm_start and warm_start.point else [],
            prove=prove,
            global_proof=GlobalProof(gap, seconds, on_text or (lambda text: None)) if global_proof else None,
            reductions=reductions,
            on_iteration=on_iteration,
            on_start=on_start,
            on_step=on_text,
        )
    return results.to_answer(solution, loaded, loaded.call.target if target is None else target)


def evaluate(scene: Given, design: Design | Evaluation | None = None, target: str | None = None) -> Evaluation:
    """Figures and limits of a design, SI and rad.

    Parameters
    ----------
    scene : Scene, answer, packaged name or path.
    design : mapping of names to SI numbers or texts with units, or an answer, of which only the design is used;
        without it the design of an answer, else today's machine.
    target : target whose limits are checked; the answer's target or the job's default without it.

    Returns
    -------
    Evaluation with `design`, `figures`, `limits` and `admissible`.

    Raises
    ------
    BadInput : an argument or the scene is wrong.

    Examples
    --------
    >>> evaluation = evaluate("beatup-light", {"l1": "30.5 mm"})
    >>> round(evaluation.figures["peak_torque"], 2), evaluation.admissible
    (89.6, False)
    """
    loaded, given = _request(scene, design)
    return results.evaluate_design(loaded, given, target)


def prove(
    scene: Given, design: Design | Evaluation | None = None, target: str | None = None, *, slack: float = SLACK
) -> "Proofs":
    """Prove that the limits of a design hold at every crank angle, or find the angle where they fail.

    Parameters
    ----------
    scene : Scene, answer, packaged name or path.
    design : mapping of names to SI numbers or texts with units, or an answer, of which only the design is used;
        without it the design of an answer, else today's machine.
    target : target whose limits are proven; the job's default without it.
    slack : permitted violation, relative to the largest magnitude of each quantity over the cycle.

    Returns
    -------
    Proofs, one for each limit; `passed` is true where all limits are proven.

    Raises
    ------
    BadInput : an argument or the scene is wrong.

    Examples
    --------
    >>> prove("beatup-light").passed
    True
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
    """Curves of a design over the cycle.

    Parameters
    ----------
    scene : Scene, answer, packaged name or path.
    design : mapping of names to SI numbers or texts with units, or an answer, of which only the design is used;
        without it the design of an answer, else today's machine.
    target : target that the provenance of the table names.
    accuracy : relative accuracy of each column's largest magnitude, for as few rows as it needs; without it a row
        every half degree.
    measured : CSV file of measured curves, with `phi [deg]` and columns named as the curves. They become columns
        NAME_measured; `attrs` holds the rms difference of each one.

    Returns
    -------
    Table, SI, with units in the column names, such as `phi [rad]`.

    Raises
    ------
    BadInput : an argument or the scene is wrong.

    Examples
    --------
    >>> curves = simulate("beatup-light")
    >>> list(curves.columns[:2])
    ['phi [rad]', 'psi [rad]']
    """
    from loomopt.interface import tables

    if accuracy is not None:
        check_numbers(accuracy, 1)
    loaded, given = _request(scene, design)
    name = None if target is None and loaded.call.target is None else target_name(loaded, target)
    return tables.curves(loaded, given, accuracy, name, measured)


def budget(scene: Given, design: Design | Evaluation | None = None, *, fluctuation: float | None = None) -> "Budget":
    """Torque budget: share of each effect in the crank torque, and the size of the motor.

    Parameters
    ----------
    scene : Scene, answer, packaged name or path.
    design : mapping of names to SI numbers or texts with units, or an answer, of which only the design is used;
        without it the design of an answer, else today's machine.
    fluctuation : (largest − least)/mean speed for which a flywheel is sized.

    Returns
    -------
    Budget with the share of each effect at the peak torque, its rms and its energy per turn (`rows`), and `motor`.

    Raises
    ------
    BadInput : an argument or the scene is wrong, or no effect acts on the crank.

    Examples
    --------
    >>> len(budget("beatup-light").rows)
    2
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
    """Solve a target for every combination of scene numbers.

    Parameters
    ----------
    scene : Scene, answer, packaged name or path.
    over : dotted key → its values as in a scene, or "LO:HI:STEP UNIT".
    target : name of a target; the job's default without it.
    executor : executor of `concurrent.futures`, or a function that makes one. It does not change the rows.
    workers : number of processes on this machine, in place of `executor`.
    store : file to which each finished row is written at once.
    resume : use the rows that `store` already holds.
    accuracy, seed : as in `solve`.
    on_row : function of a row, called after each row.

    Returns
    -------
    StudyTable with a row for each combination (`rows`), as a table by `.table()`.

    Raises
    ------
    BadInput : an argument or the scene is wrong.
    KeyboardInterrupt : Ctrl-C.

    Examples
    --------
    >>> study = sweep("beatup-light", {"operation.M0": ["590 N*m", "600 N*m"]})
    >>> [round(row.figures["M3_fdc"], 4) for row in study.rows]
    [-86.9811, -76.9811]
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
    """Influence of each effect on a target, and the effects that may be left out.

    The reference has all effects of [effects] and [available] that can be combined.

    Parameters
    ----------
    scene : Scene, answer, packaged name or path.
    target : name of a target; the job's default without it.
    tolerance : permitted change of each objective without an effect, relative to the objective's scale.
    executor : executor of `concurrent.futures`, or a function that makes one. It does not change the rows.
    workers : number of processes on this machine, in place of `executor`.
    accuracy, seed : as in `solve`.
    on_row : function of a row, called after each solve.

    Returns
    -------
    EffectsStudy with `rows`, `left_out` and `kept`.

    Raises
    ------
    BadInput : an argument or the scene is wrong.
    KeyboardInterrupt : Ctrl-C.

    Examples
    --------
    >>> print(*effects("beatup-light").left_out)
    bearing_friction centrifugal
    """
    from loomopt.interface.study.effects import run_effects
    from loomopt.studies.effects.study import plan_effects

    study = plan_effects(_scene(scene), target, tolerance, accuracy=accuracy, seed=seed)
    return run_effects(study, executor, workers, on_row)


def sensitivity(
    answer: Answer | Given, target: str | None = None, *, on_step: Callable[[str], None] | None = None
) -> "SensitivityStudy":
    """Derivatives of an answer with respect to every number of its scene, and the ranges of its prices.

    Parameters
    ----------
    answer : answer of `solve`; a scene, or an argument of `load`, is solved first.
    target : target of that solve.
    on_step : function of a text that reports progress.

    Returns
    -------
    SensitivityStudy with `rows` and `prices`.

    Raises
    ------
    BadInput : an argument or the scene is wrong, or the answer is not certified.
    KeyboardInterrupt : Ctrl-C.

    Examples
    --------
    >>> study = sensitivity("beatup-light")
    >>> {row.number for row in study.rows if row.of == "M3_fdc"} >= {"operation.M0"}
    True
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
    """Spread of the figures of machines that are made to the [tolerances] of the scene, and the yield.

    Parameters
    ----------
    scene : Scene, answer, packaged name or path.
    design : mapping of names to SI numbers or texts with units, or an answer, of which only the design is used;
        without it the design of an answer, else today's machine.
    target : target whose limits judge the machines; the job's default without it.
    executor : executor of `concurrent.futures`, or a function that makes one. It does not change the rows.
    samples : number of machines, over 16 scrambles of Sobol's points.
    seed : seed of the scrambles.
    workers : number of processes on this machine, in place of `executor`.
    worst : prove the worst case of each figure within all tolerances too, which takes seconds.
    store : file to which each finished row is written at once.
    resume : use the rows that `store` already holds.
    on_step : function of a text that reports progress.

    Returns
    -------
    ToleranceStudy with `figures`, `yields` and `worst`.

    Raises
    ------
    BadInput : an argument or the scene is wrong.
    KeyboardInterrupt : Ctrl-C.

    Examples
    --------
    >>> scene = load("beatup-light").set("tolerances.l1", {"plus_minus": "0.06 mm", "sigmas": 3})
    >>> tolerance(scene, samples=1600, worst=False).figures["M3_fdc"].shares
    {'l1': 1.0}
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
    """Front of two objectives, with a certificate at every point.

    Parameters
    ----------
    scene : Scene, answer, packaged name or path.
    axes : two figures, or numbers that the scene bounds, which are freed. M3_fdc counts by magnitude.
    target : target whose requirements hold at every point, except those on the axes; the job's default without it,
        "none" for the limits of the scene alone.
    executor : executor of `concurrent.futures`, or a function that makes one. It does not change the rows.
    maximise : axes that are maximised. The others are minimised, except an axis that can only be maximised, such as
        a dwell, and one that a target of a linkage maximises.
    ranges : axis → "LO:HI UNIT", or both ends in SI, which bound the front.
    points : number of points, 40 without it. Points that locate changes of the binding limits are added.
    workers : number of processes on this machine, in place of `executor`.
    store : file to which each finished row is written at once.
    resume : use the rows that `store` already holds.
    accuracy : as in `solve`.
    on_row : function of a row, called after each row.

    Returns
    -------
    StudyTable with the rows in the order of the second axis.

    Raises
    ------
    BadInput : an argument or the scene is wrong, or an axis has no end.
    KeyboardInterrupt : Ctrl-C.

    Examples
    --------
    >>> front = pareto("beatup-light", ("peak_torque", "m4e"), points=3)
    >>> all(row.certified for row in front.rows)
    True
    """
    from loomopt.interface.study.points import run_study
    from loomopt.studies.front import front

    loaded = _scene(scene)
    axis_ranges = front.si(loaded, {} if ranges is None else ranges)
    whose = front.demanding(loaded, target)
    study = front.trade(loaded, axes, whose, maximise=maximise, ranges=axis_ranges, points=points, accuracy=accuracy)
    return run_study(study, executor, workers, store, resume, on_row)


def accuracy(scene: Given, *, full: bool = False, on_step: Callable[[str], None] | None = None) -> "AccuracyStudy":
    """Work–precision study: error and time of each numerical method.

    Parameters
    ----------
    scene : Scene, answer, packaged name or path.
    full : use more settings and repeats, which takes minutes.
    on_step : function of a text, called before each step.

    Returns
    -------
    AccuracyStudy with `rows`, `orders` and `advice`.

    Raises
    ------
    BadInput : an argument or the scene is wrong.
    KeyboardInterrupt : Ctrl-C.

    Examples
    --------
    >>> study = accuracy("beatup-light")
    >>> study.rows[0].method
    'exchange'
    """
    from loomopt.interface.study.accuracy import run_accuracy

    return run_accuracy(_scene(scene), arguments.flag(full, "full"), on_step)


def problems() -> "tuple[Head, ...]":
    """List the packaged problems.

    Returns
    -------
    Heads with `name`, `title`, `job`, `targets` and `source`, in alphabetical order.

    Raises
    ------
    BadInput : an installed problem cannot be read.

    Examples
    --------
    >>> "beatup-light" in [head.name for head in problems()]
    True
    """
    from loomopt.interface import listing

    return listing.problems()[0]


def new(job: str, path: str | os.PathLike[str]) -> "Path":
    """Write a commented scene of a job, or a copy of a packaged scene.

    Parameters
    ----------
    job : name of a job or of a packaged problem.
    path : new file that ends in .toml; for a packaged problem also in .zip, which holds all scenes of its job.

    Returns
    -------
    Path of the file.

    Raises
    ------
    BadInput : the job is unknown, or the file exists already.

    Examples
    --------
    >>> import tempfile
    >>> folder = tempfile.mkdtemp()
    >>> new("beatup-light", f"{folder}/my-loom.toml").name
    'my-loom.toml'
    """
    from loomopt.interface import listing

    return listing.new(job, arguments.path(path, "path", "a path that ends in .toml", "Name a file"))


def schema(job: str) -> dict[str, object]:
    """JSON Schema of a job's scenes, for editors.

    Parameters
    ----------
    job : name of a job, such as that of `Scene.job`.

    Returns
    -------
    JSON Schema, draft 2020-12.

    Raises
    ------
    BadInput : the job is unknown.

    Examples
    --------
    >>> job = load("beatup-light").job
    >>> "bounds" in schema(job)["properties"]
    True
    """
    from loomopt.interface.text import json_schema

    return json_schema.scene(registry.declared(arguments.text(job, "job", "a loom job", "Name one, such as beatup")))


def compare(*answers: "Evaluation | str", scene: Given | None = None) -> "Comparison":
    """Compare designs side by side in the units of the first one.

    Parameters
    ----------
    *answers : answers or evaluations of one job, and "today" for today's machine of the first one's scene.
    scene : scene in which all designs are evaluated; without it, the scene of each design.

    Returns
    -------
    Comparison with `rows`, which mark the differences; `.plot()` draws the curves.

    Raises
    ------
    BadInput : an argument or the scene is wrong.

    Examples
    --------
    >>> comparison = compare(evaluate("beatup-light", {"l1": "30.5 mm"}), "today")
    >>> comparison.rows[0].name, comparison.rows[0].values
    ('l1', (30.5, 31.0))
    """
    from loomopt.interface.study import comparison

    return comparison.compare(answers, None if scene is None else _scene(scene))


def _scene(given: Given) -> Scene:
    """Scene of an object, a packaged name or a path; of an answer its scene. Raises BadInput."""
    return _open(given)[0]


def _open(given: Given) -> tuple[Scene, dict[str, float] | None]:
    """Scene, and the checked design of an answer. Raises BadInput."""
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
    """Scene and checked design: the answer's design where none is given, else an empty one for today's machine.

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
