"""Answer of a target that starts from answers of neighbouring scenes: task, answer, optimum for the next neighbour."""

from collections.abc import Iterable, Sequence
from typing import Any

from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.model.program import Program
from loomopt.model.session import working
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Clash, Evaluated, Solution
from loomopt.solving.nlp.point import Settings
from loomopt.solving.search import neighbour_newton
from loomopt.solving.search.neighbour_newton import Optimum
from loomopt.solving.search.search import Clock, Search


def begun(
    scene: Scene, target: str, accuracy: float, neighbours: Sequence[Any]
) -> neighbour_newton.NeighbourTask | None:
    """Target between two optima; None where more than a search makes its answer, or they are of another one.

    neighbours: both optima as JSON data, and how far the target lies from the first to the second.
    """
    job = registry.of_target(scene, target)
    if job.sizes(scene):
        return None
    program = job.program(scene, target)
    first, second = map(neighbour_newton.read_optimum, neighbours[:2])
    if not (first.serves(program) and second.serves(program)):
        return None
    search = Search(job, program, Settings(accuracy), job.start(program, scene))
    return neighbour_newton.NeighbourTask(search, first, second, neighbours[2], figure_peaks(scene, job, program))


def figure_peaks(scene: Scene, job: Job, program: Program) -> tuple[str, ...]:
    """Quantities whose extremes are figures, where a program reads the very model that figures are of.

    Of a check that reads numbers which the program solves in another form there is none: only the design has them.
    """
    model = program.model
    if job.model(scene) is not model:
        return ()
    numbers = {*program.parameters, *(v.name for v in program.variables)}
    checked = {name for check in model.checks if not numbers.issuperset(check.reads) for name in check.over_cycle}
    return tuple(name for name in job.peaks(model).values() if model.has_quantity(name) and name not in checked)


def search_evaluated(searches: Iterable[tuple[Scene, Search]]) -> None:
    """Compute what the figures of searches that ended beside their neighbours read over the cycle, in one pass."""
    report.search_evaluated(
        (scene, search.job, search.program, search.job.design(search.program, search.best.x))
        for scene, search in searches
        if search.best
    )


@working()
def evaluated(scene: Scene, search: Search) -> Evaluated | None:
    """Figures of a search between neighbours; None if they do not show that its design is admissible."""
    best = search.best
    assert best is not None
    result = report.evaluation(scene, search.job, search.program, search.job.design(search.program, best.x), every=True)
    return result if result.admissible else None


@working()
def answer_of_search(scene: Scene, target: str, search: Search) -> Solution:
    """Answer of a search between neighbours."""
    clock = Clock()
    with clock.measure("report"):
        answer = report.answer(scene, target, search, Clash())
    return report.completed(answer, None, 0, clock.seconds(search))


def optimum(scene: Scene, program: Program, answer: Solution) -> Optimum | None:
    """Optimum of an answer; None if it cannot be a start, as after a trade-off of added mass."""
    if answer.status != "optimal" or answer.certificate is None or answer.alternative is not None or answer.members:
        return None
    full = {scene.full(name): value for name, value in designs.flat(answer.design).items()}
    job = registry.of(scene)
    return neighbour_newton.optimum(job, program, job.values(program, full), answer.certificate)
