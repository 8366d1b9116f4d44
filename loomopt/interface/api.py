"""The public functions: load a scene, solve it, evaluate and simulate a design."""

import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from loomopt.base import arguments
from loomopt.base.errors import refusal
from loomopt.interface import results
from loomopt.interface.results import Answer, Evaluation
from loomopt.jobs import registry
from loomopt.jobs.registry import scene
from loomopt.physics.tolerances import ACCURACY, SLACK
from loomopt.scenes.designs import Given as Design
from loomopt.scenes.scene import Call, Scene
from loomopt.solving.answer import solution
from loomopt.solving.options import GAP, OMITTED, SECONDS, GlobalProof, check_numbers, target_name

if TYPE_CHECKING:
    from concurrent.futures import Executor

    import pandas as pd

    from loomopt.interface.finished import DesignStudy, EffectsStudy
    from loomopt.solving.answer.solution import Proofs
    from loomopt.studies.front.front import Given as Ranges
    from loomopt.studies.run.rows import Row
    from loomopt.studies.sweep import Over

Given = Scene | solution.Evaluated | str | os.PathLike[str]
"""A scene, an answer in its own scene, or what `load` takes: a packaged name or a path."""
if TYPE_CHECKING:  # a file's name does not tell type checkers what `load` returns, and most name scenes
    Loaded = Scene | Any
else:
    Loaded = Scene | Evaluation

__all__ = [
    "Answer",
    "Evaluation",
    "Scene",
    "effects",
    "evaluate",
    "load",
    "pareto",
    "prove",
    "scene",
    "simulate",
    "solve",
    "sweep",
]


def load(name_or_path: str | os.PathLike[str]) -> Loaded:
    """Return the scene of a packaged name or of a TOML file; of an answer's JSON file the answer, in its own scene.

    An answer comes as the `Evaluation` of its design, computed anew. Raises BadInput.
    """
    own, design = _opened(name_or_path)
    return own if design is None else results.evaluated(own, design, None)


def solve(
    scene: Given,
    target: str | None = None,
    *,
    accuracy: float = ACCURACY,
    starts: int | None = None,
    seed: int = 0,
    near: solution.Solution | None = None,
    prove: bool = False,
    everywhere: bool = False,
    gap: float = GAP,
    seconds: float = SECONDS,
    on_iteration: Callable[[int], None] | None = None,
    on_start: Callable[[int, int], None] | None = None,
    on_step: Callable[[str], None] | None = None,
) -> Answer:
    """Return the certified optimum of a scene's target (the job's default without one), or why there is none.

    scene: itself, or its packaged name or path. accuracy: relative, of every whole-cycle value, 1e-11 to 0.1. starts:
    so many, the job's own first, then random ones drawn with `seed`; without it a search for the best basin. near: an
    answer to the same structure, from which the solve starts warm. prove: whether every limit is proven at every crank
    angle too. everywhere: whether it is proven that no admissible design is better by more than `gap`, relative to each
    objective, in at most so many seconds (`answer.global_bound`). on_iteration(number), on_start(number, of),
    on_step(what): progress. Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    from loomopt.interface.cli.shell import below_cell
    from loomopt.solving import engine

    own = _scene(scene)
    for key, hook in (("on_iteration", on_iteration), ("on_start", on_start), ("on_step", on_step)):
        if hook is not None:
            arguments.called(hook, key, "a function", "Give a function, or leave it out")
    arguments.flag(prove, "prove")
    if near is not None and not isinstance(near, solution.Solution):
        raise refusal("it is no answer", "", "near", near, "what `solve` has returned", "Give one, or leave it out")
    arguments.flag(everywhere, "everywhere")
    with below_cell() as say:
        told = on_step or say
        found = engine.solve(
            own,
            target,
            accuracy=accuracy,
            starts=starts,
            seed=seed,
            near=[near.point] if near and near.point else [],
            prove=prove,
            global_proof=GlobalProof(gap, seconds, told or (lambda text: None)) if everywhere else None,
            on_iteration=on_iteration,
            on_start=on_start,
            on_step=told,
        )
    return results.solved(found, own, own.call.target if target is None else target)


def evaluate(scene: Given, design: Design | solution.Evaluated | None = None, target: str | None = None) -> Evaluation:
    """Return figures and limits of a design (SI and rad; today's where it names nothing). Raises BadInput.

    scene: as `load` takes it; without a design, an answer is judged as it is. design: a mapping, or an answer, of which
    the design alone is taken. target: whose limits, the answer's own or the job's default without one.
    """
    own, given = _request(scene, design)
    return results.evaluated(own, given, target)


def prove(
    scene: Given, design: Design | solution.Evaluated | None = None, target: str | None = None, *, slack: float = SLACK
) -> "Proofs":
    """Return proofs that a design's limits (SI; today's without one) hold at every crank angle, or where they fail.

    design: a mapping, or an answer, of which the design alone is taken. target: whose limits,
    the job's default without one. slack: what binding limits leave open, relative to each quantity's largest magnitude
    over the cycle. Raises BadInput.
    """
    from loomopt.interface.cli.shell import below_cell
    from loomopt.solving.proof import whole_cycle

    own, given = _request(scene, design)
    with below_cell() as say:
        if say:
            say("proving")
        return whole_cycle.prove(own, given, target, slack)


def simulate(
    scene: Given,
    design: Design | solution.Evaluated | None = None,
    target: str | None = None,
    *,
    accuracy: float | None = None,
    beside: str | os.PathLike[str] | None = None,
) -> "pd.DataFrame":
    """Return the curves of a design (SI; today's without one) over the cycle, units in the column names.

    design: a mapping, or an answer, of which the design alone is taken. target: what it was found for, to be named in
    the table's provenance. accuracy: as few rows as show each column's largest magnitude to it; every half degree
    without. beside: a CSV file of what was measured, `phi [deg]` and columns named as the curves: it stands in columns
    of its own, NAME_measured, and the table's `attrs` tell the rms difference of each. Raises BadInput.
    """
    from loomopt.interface import tables

    if accuracy is not None:
        check_numbers(accuracy, 1)
    own, given = _request(scene, design)
    name = None if target is None and own.call.target is None else target_name(own, target)
    return tables.curves(own, given, accuracy, name, beside)


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
) -> "DesignStudy":
    """Return a row for every combination of scene numbers, solved for a target (the job's default without one).

    over: dotted key → its values as a scene gives them, or "LO:HI:STEP UNIT". executor: any of `concurrent.futures`, or
    a function that makes one; workers: so many processes on this machine instead. The rows are the same, whoever
    computes them. store: a file that each row is written to as it comes; resume: takes those that are there. accuracy,
    seed: as in `solve`. on_row(row): called as each is there. Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    from loomopt.interface.finished import conducted
    from loomopt.studies.sweep import planned

    study = planned(_scene(scene), over, target, accuracy=accuracy, seed=seed)
    return conducted(study, executor, workers, store, resume, on_row)


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
    from loomopt.interface.finished import conducted_effects
    from loomopt.studies.effects.study import planned

    study = planned(_scene(scene), target, tolerance, accuracy=accuracy, seed=seed)
    return conducted_effects(study, executor, workers, on_row)


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
) -> "DesignStudy":
    """Return the front of two axes: what the first costs of the second, every point certified.

    axes: figures or numbers that the scene bounds; M3_fdc counts by magnitude. target: whose demands hold at every
    point, of all but the axes: the job's default without one, "none" for the scene's limits alone. maximise: axes of
    which the most is sought; of the others it is the least, but of one that offers its most alone, such as a dwell, the
    most. ranges: axis → "LO:HI UNIT", or both ends in SI, beyond which the front does not go. points: how many are
    asked for, 40 without; those that narrow changes down come beside them. The rest is as in `sweep`. Raises BadInput,
    also for an end that has no least value, and KeyboardInterrupt on Ctrl-C.
    """
    from loomopt.interface.finished import conducted
    from loomopt.studies.front import front

    own = _scene(scene)
    asked = front.si(own, {} if ranges is None else ranges)
    whose = front.demanding(own, target)
    study = front.trade(own, axes, whose, maximise=maximise, ranges=asked, points=points, accuracy=accuracy)
    return conducted(study, executor, workers, store, resume, on_row)


def _scene(given: Given) -> Scene:
    """Return a scene that is given as itself, by its name or by its path; of an answer its own. Raises BadInput."""
    return _opened(given)[0]


def _opened(given: Given) -> tuple[Scene, dict[str, float] | None]:
    """Return a scene; of an answer its own, which knows its target, and its design, checked. Raises BadInput."""
    from loomopt.scenes import designs

    if isinstance(given, Scene):
        return given, None
    if isinstance(given, solution.Evaluated):
        if given.scene is None:
            raise refusal("the answer knows no scene", "", "scene", remedy="Give the scene it was found for")
        target = getattr(given, "target", None) or None
        return given.scene.called(Call(target=target)), designs.checked(given.design, given.scene)
    if path := registry.answer_path(given):
        own, handed = registry.answered(path)
        return own, designs.checked(handed.design, own, own.origin)
    return registry.load(given), None


def _request(scene: Given, design: Design | solution.Evaluated | None) -> tuple[Scene, dict[str, float]]:
    """Return a scene and a design in it, checked: of an answer its own, where none is given; else today's, as nothing.

    Of an answer given as the design, its design alone. Raises BadInput.
    """
    from loomopt.scenes import designs

    own, known = _opened(scene)
    if isinstance(design, solution.Evaluated):
        if design.scene:
            designs.check_job(design.scene.job, own, "<answer>")
        design = design.design
    if design is None or (isinstance(design, Mapping) and not design):
        return own, known or {}
    return own, designs.checked(design, own)
