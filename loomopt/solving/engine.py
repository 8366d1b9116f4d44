"""Solve a scene's target: search → tie-break → certificate → proof → an answer that explains itself."""

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from loomopt.jobs import registry
from loomopt.model.sampling import SAMPLERS
from loomopt.model.session import Session, working
from loomopt.physics.tolerances import ACCURACY
from loomopt.scenes.scene import Scene
from loomopt.solving import options
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Clash, Solution, Words
from loomopt.solving.nlp.ipopt import IterationCallback
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.search import multistart, tie_break
from loomopt.solving.search.search import Clock, Search


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
    """Return the certified optimum of a scene's target, or what stands in its way.

    accuracy: relative, of whole-cycle values; starts: how many, the job's own first, then random ones from `seed`;
    without it a search for the best basin, its designs drawn with `seed`; near: where neighbours' solves ended, the
    best of which counts, if of this structure; backed_off: name and sign of limits → by how much they are tightened,
    SI; wholly: whether what is added goes where it is worth next to nothing and no share is asked for; prove: whether
    every limit of the answer is proven at every crank angle; global_proof: that no admissible design is better, and
    how closely; on_iteration(number), on_start(number, how many), on_step(what): progress; session: what earlier
    solves left, the current one's without it. Raises BadInput for a target that the scene cannot serve, and
    KeyboardInterrupt on Ctrl-C.
    """
    with working(session) as own:
        clock, target = Clock(), options.target_name(scene, target, families=not prove)
        job = registry.of_target(scene, target)
        job.demand(scene, target)
        options.check(scene, accuracy, starts, seed, global_proof)
        callback = IterationCallback(on_iteration) if on_iteration else None
        settings = Settings(accuracy, callback=callback, on_step=on_step).at(f"building the {target}")
        with clock.charged("import"):
            import casadi  # noqa: F401  # so that building is not charged with it
        with clock.charged("build"):
            program = job.program(scene, target).backed_off(backed_off or {})
            if not wholly and program.added and program.added.wholly:
                program = replace(program, added=None)
        today = job.start(program, scene)
        # How many positions a solve evaluates does not depend on the one before.
        own.forget(SAMPLERS, tie_break.JUDGED)
        begun = own.positions
        search = multistart.resolved(Search(job, program, settings, today), starts, seed, near, on_start)
        bound, sold = None, job.sizes(scene)
        if global_proof:
            from loomopt.solving.proof import levels

            refused = f"{', '.join(sold)} comes in sizes, which boxes do not tell" if sold else ""
            search, bound = levels.claimed(search, global_proof, refused)
        if search.best:
            from loomopt.solving.search import mass_tradeoff

            search = mass_tradeoff.settled(search)
        # Figures are read as finely for every answer: they are no part of what accuracy costs.
        evaluations = own.positions - begun

        clash = Clash()
        if search.best is None:
            from loomopt.solving.search import elastic

            with clock.charged("solve"):
                clash = elastic.clash(search, Words(scene))
        with clock.charged("report"):
            answer = report.answer(scene, target, search, clash)
        for name, sizes in sold.items() if answer.status == "optimal" else ():
            from loomopt.solving.search import stock_sizes

            say = replace(settings, step=f"trying sizes of {name}").say
            again = functools.partial(solve, target=target, accuracy=accuracy, starts=starts or 1, seed=seed)
            solved = functools.partial(again, on_start=on_start, on_step=say, backed_off=backed_off)
            answer = stock_sizes.fitted(scene, answer, name, sizes, solved)
        if prove and answer.certificate:
            from loomopt.solving.proof import whole_cycle

            settings.at("proving")
            answer = whole_cycle.proven(scene, target, answer)
        return report.completed(answer, bound, evaluations, clock.seconds(search))
