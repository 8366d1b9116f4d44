"""Reductions of a task to simpler tasks, as in cvxpy: applied before the solve, inverted after it."""

from collections.abc import Callable, Sequence
from typing import Protocol

from loomopt.solving.answer.solution import Solution
from loomopt.solving.optimum import Task

Solve = Callable[[Task], Solution]


class Reduction(Protocol):
    """Step from a task to a simpler one, and back."""

    def apply(self, task: Task) -> Task:
        """Simpler task, which is solved first. Raises BadInput for a task that it cannot serve."""
        ...

    def invert(self, task: Task, answer: Solution, solve: Solve) -> Solution:
        """Answer to a task.

        answer: that to the simpler task; solve(task): answer to another simpler task, where one is not enough.
        """
        ...


def solve_reduced(task: Task, pipeline: Sequence[Reduction], solve: Solve) -> Solution:
    """Answer to a task: the pipeline is applied from its first to its last reduction, and inverted in reverse.

    solve(task): answer to a task that needs no more reduction.
    """
    if not pipeline:
        return solve(task)
    first, *rest = pipeline

    def solve_simpler(simpler: Task) -> Solution:
        return solve_reduced(simpler, rest, solve)

    return first.invert(task, solve_simpler(first.apply(task)), solve_simpler)


class WholeCycleProof:
    """Proof that the answer's limits hold at every crank angle."""

    def apply(self, task: Task) -> Task:
        """Same task."""
        return task

    def invert(self, task: Task, answer: Solution, solve: Solve) -> Solution:
        """Answer with its proofs, where it is a certified design."""
        if not answer.certificate:
            return answer
        from loomopt.solving.proof import whole_cycle

        task.settings.at("proving")
        return whole_cycle.proven(task.scene, task.target, answer)
