"""Solve a scene's target: a pipeline of reductions round the continuous optimum."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace

from loomopt.jobs import registry
from loomopt.model.session import Session, working
from loomopt.physics.tolerances import ACCURACY
from loomopt.scenes.scene import Scene
from loomopt.solving import optimum, options
from loomopt.solving.answer.solution import Solution
from loomopt.solving.nlp.ipopt import IterationCallback
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.optimum import Task
from loomopt.solving.reductions.reduction import Reduction, WholeCycleProof, solve_reduced
from loomopt.solving.search.search import Clock


def solve(
    scene: Scene,
    target: str | None = None,
    *,
    accuracy: float = ACCURACY,
    starts: int | None = None,
    seed: int = 0,
    near: Sequence[Point] = (),
    mass_tradeoff: bool = True,
    prove: bool = False,
    global_proof: options.GlobalProof | None = None,
    reductions: Sequence[Reduction] = (),
    on_iteration: Callable[[int], None] | None = None,
    on_start: Callable[[int, int], None] | None = None,
    on_step: Callable[[str], None] | None = None,
    session: Session | None = None,
) -> Solution:
    """Certified optimum of a scene's target, or the limits that clash.

    Parameters
    ----------
    scene, target : scene, and name of its target; the job's default without it.
    accuracy : relative accuracy of whole-cycle values.
    starts : number of starts, the job's own first, then random ones; without it a search for the best basin.
    seed : seed of the random starts and of the search.
    near : end points of neighbours' solves; the best of those with this structure is the only start.
    mass_tradeoff : whether added mass that is worth next to nothing is left out where the scene gives no share.
    prove : whether every limit of the answer is proven at every crank angle.
    global_proof : gap and time of the proof that no admissible design is better.
    reductions : reductions that the call asks for, such as `SizeRounding`, from the outermost to the innermost.
    on_iteration, on_start, on_step : functions of (number), (number, total) and (text) that report progress.
    session : results of earlier solves; the current session's without it.

    Raises
    ------
    BadInput : the scene cannot serve the target, or an option is out of range.
    KeyboardInterrupt : Ctrl-C.
    """
    with working(session):
        clock, seconds = Clock(), Counter[str]()
        name = options.target_name(scene, target, families=not (prove or reductions))
        job = registry.of_target(scene, name)
        job.demand(scene, name)
        options.check(scene, accuracy, starts, seed, global_proof)
        callback = IterationCallback(on_iteration) if on_iteration else None
        settings = Settings(accuracy, callback=callback, on_step=on_step)
        task = Task(scene, name, settings, starts, seed, near, mass_tradeoff, global_proof, on_start)
        pipeline: list[Reduction] = [*([WholeCycleProof()] if prove else []), *reductions]
        if job.sizes(scene):
            from loomopt.solving.reductions.stock_sizes import StockSizes

            pipeline.append(StockSizes())

        def solve_continuous(simplest: Task) -> Solution:
            search_result = optimum.search(simplest)
            seconds.update(search_result.time)
            return search_result

        answer = solve_reduced(task, pipeline, solve_continuous)
        return replace(answer, time={**seconds, "total_s": clock.total})
