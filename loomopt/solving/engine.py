"""Solve a scene's target: the optimum → sizes that are sold → proof → an answer that explains itself."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from loomopt.jobs import registry
from loomopt.model.session import Session, working
from loomopt.physics.tolerances import ACCURACY
from loomopt.scenes.scene import Scene
from loomopt.solving import optimum, options
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Solution
from loomopt.solving.nlp.ipopt import IterationCallback
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.optimum import Task
from loomopt.solving.search.search import Clock


def solve(
    scene: Scene,
    target: str | None = None,
    *,
    accuracy: float = ACCURACY,
    starts: int | None = None,
    seed: int = 0,
    near: Sequence[Point] = (),
    backed_off: Mapping[tuple[str, int], float] | None = None,
    wholly: bool = True,
    prove: bool = False,
    global_proof: options.GlobalProof | None = None,
    on_iteration: Callable[[int], None] | None = None,
    on_start: Callable[[int, int], None] | None = None,
    on_step: Callable[[str], None] | None = None,
    session: Session | None = None,
) -> Solution:
    """Certified optimum of a scene's target, or what stands in its way.

    accuracy: relative, of whole-cycle values; starts: how many, the job's own first, then random ones from `seed`;
    without it a search for the best basin, its designs drawn with `seed`; near: where neighbours' solves ended, the
    best of which counts, if of this structure; backed_off: name and sign of limits → by how much they are tightened,
    SI; wholly: whether what is added goes where it is worth next to nothing and no share is asked for; prove: whether
    every limit of the answer is proven at every crank angle; global_proof: that no admissible design is better, and
    how closely; on_iteration(number), on_start(number, how many), on_step(what): progress; session: what earlier
    solves left, the current one's without it. Raises BadInput for a target that the scene cannot serve, and
    KeyboardInterrupt on Ctrl-C.
    """
    with working(session) as cache:
        clock, name = Clock(), options.target_name(scene, target, families=not prove)
        job = registry.of_target(scene, name)
        job.demand(scene, name)
        options.check(scene, accuracy, starts, seed, global_proof)
        settings = Settings(
            accuracy, callback=IterationCallback(on_iteration) if on_iteration else None, on_step=on_step
        )
        task = Task(scene, name, settings, starts, seed, near, backed_off, wholly, global_proof, on_start)
        stock = job.sizes(scene)
        found = optimum.search(task, cache, clock, stock)
        answer = found.answer
        if stock:
            from loomopt.solving.search import stock_sizes

            step = replace(settings, step=f"trying sizes of {', '.join(stock)}")
            plain = Settings(accuracy, on_step=step.say)
            again = replace(task, settings=plain, starts=starts or 1, near=(), wholly=True, global_proof=None)
            answer = stock_sizes.fitted(
                scene, answer, stock, lambda own: optimum.search(replace(again, scene=own), cache, Clock()).answer
            )
        if prove and answer.certificate:
            from loomopt.solving.proof import whole_cycle

            settings.at("proving")
            answer = whole_cycle.proven(scene, name, answer)
        return report.completed(answer, found.bound, found.evaluations, clock.seconds(found.search))
