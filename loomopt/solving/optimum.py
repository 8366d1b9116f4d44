"""Certified optimum of one task, its numbers continuous: search → proof of all designs → least change → answer."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.model.program import Program
from loomopt.model.sampling import SAMPLERS
from loomopt.model.session import Session
from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Clash, Solution, Words
from loomopt.solving.certificate.records import GlobalBound
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.options import GlobalProof
from loomopt.solving.search import multistart, tie_break
from loomopt.solving.search.search import Clock, OnStart, Search


@dataclass(frozen=True)
class Task:
    """What is solved, checked; the fields are arguments of `engine.solve`, the target by name."""

    scene: Scene
    target: str
    settings: Settings
    starts: int | None = None
    seed: int = 0
    near: Sequence[Point] = ()
    backed_off: Mapping[tuple[str, int], float] | None = None
    wholly: bool = True
    global_proof: GlobalProof | None = None
    on_start: OnStart | None = None

    @property
    def job(self) -> Job:
        """Job of the scene, for all members of a family at once where the target is theirs."""
        return registry.of_target(self.scene, self.target)

    def program(self, job: Job) -> Program:
        """Program with the limits backed off, and without added mass that no share of a figure pays for."""
        program = job.program(self.scene, self.target).backed_off(self.backed_off or {})
        if not self.wholly and program.added and program.added.wholly:
            return replace(program, added=None)
        return program


class Optimum(NamedTuple):
    """Answer to a task, the search that led to it, what is proven of all designs, and positions evaluated."""

    answer: Solution
    search: Search
    bound: GlobalBound | None
    evaluations: int


def search(task: Task, session: Session, clock: Clock, stock: Collection[str] = ()) -> Optimum:
    """Search for the optimum of a task, its numbers continuous; without one the answer is what stands in its way.

    clock: counts the seconds; stock: numbers that come in sizes, of which no proof of all designs knows.
    """
    scene, job = task.scene, task.job
    settings = task.settings.at(f"building the {task.target}")
    with clock.measure("import"):
        import casadi  # noqa: F401  # so that building is not charged with it
    with clock.measure("build"):
        program = task.program(job)
    today = job.start(program, scene)
    # How many positions a solve evaluates does not depend on the one before.
    session.forget(SAMPLERS, tie_break.TESTED_MOVES)
    before = session.positions
    state = Search(job, program, settings, today)
    state = multistart.run_search(state, task.starts, task.seed, task.near, task.on_start)
    bound: GlobalBound | None = None
    if task.global_proof:
        from loomopt.solving.proof import levels

        refused = f"{', '.join(stock)} comes in sizes, which boxes do not tell" if stock else ""
        state, bound = levels.claimed(state, task.global_proof, refused)
    if state.best:
        from loomopt.solving.search import mass_tradeoff

        state = mass_tradeoff.apply_tradeoff(state)
    # Figures are read as finely for every answer: they are no part of what accuracy costs.
    evaluations = session.positions - before
    clash = Clash()
    if state.best is None:
        from loomopt.solving.search import elastic

        with clock.measure("solve"):
            clash = elastic.clash(state, Words(scene))
    with clock.measure("report"):
        answer = report.answer(scene, task.target, state, clash)
    return Optimum(answer, state, bound, evaluations)
