"""Certified optimum of one task, its numbers continuous: search → global proof → added mass, least change → answer."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.model.program import Program
from loomopt.model.sampling import SAMPLERS
from loomopt.model.session import current
from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Clash, Solution, UnitFormatter
from loomopt.solving.certificate.records import GlobalBound
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.options import GlobalProof
from loomopt.solving.search import multistart, tie_break
from loomopt.solving.search.search import Clock, OnStart, Search


@dataclass(frozen=True)
class Task:
    """Scene and target to be solved, with the options of `engine.solve`, all checked.

    margins: by how much limits are tightened, SI, by name and sign of the side; no_global_proof: why boxes cannot prove
    that no design is better, "" where they can.
    """

    scene: Scene
    target: str
    settings: Settings
    starts: int | None = None
    seed: int = 0
    near: Sequence[Point] = ()
    mass_tradeoff: bool = True
    global_proof: GlobalProof | None = None
    on_start: OnStart | None = None
    margins: Mapping[tuple[str, int], float] = field(default_factory=dict)
    no_global_proof: str = ""

    @property
    def job(self) -> Job:
        """Job of the scene, for all members of a family at once where the target is theirs."""
        return registry.of_target(self.scene, self.target)

    def program(self, job: Job) -> Program:
        """Program with its limits tightened by the margins, and without added mass that no share of a figure pays for.

        The mass stays where there is no tradeoff.
        """
        program = job.program(self.scene, self.target).backed_off(self.margins)
        if not self.mass_tradeoff and program.added and program.added.wholly:
            return replace(program, added=None)
        return program

    def at(self, step: str) -> "Task":
        """Task as a step of a longer solve: reports the step, and its own steps below it."""
        settings = self.settings.at(step)
        inner = replace(self.settings, on_step=settings.say) if settings.on_step else self.settings
        return replace(self, settings=inner)


def search(task: Task) -> Solution:
    """Optimum of a task, its numbers continuous; the limits that clash where there is none."""
    clock, session = Clock(), current()
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

        state, bound = levels.claimed(state, task.global_proof, task.no_global_proof)
    if state.best:
        from loomopt.solving.search import mass_tradeoff

        state = mass_tradeoff.apply_tradeoff(state)
    # Figures are read as finely for every answer: they are no part of what accuracy costs.
    evaluations = session.positions - before
    clash = Clash()
    if state.best is None:
        from loomopt.solving.search import elastic

        with clock.measure("solve"):
            clash = elastic.clash(state, UnitFormatter(scene))
    with clock.measure("report"):
        answer = report.answer(scene, task.target, state, clash)
    return report.completed(answer, bound, evaluations, clock.seconds(state))
