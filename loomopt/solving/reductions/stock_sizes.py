"""From a continuous optimum to sizes that are sold: solve again with each neighbour, keep the best."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Sentences, Solution, UnitFormatter
from loomopt.solving.optimum import Task
from loomopt.solving.reductions.reduction import Solve

FARTHEST_SIZE, SAME_SIZE = 4, 1e-9
"""Sizes sold that are tried on either side, and the share by which two answers to them are equally good."""

Stock = Mapping[str, Sequence[float]]
Tried = tuple[float, Solution]
SolveScene = Callable[[Scene], Solution]


class StockSizes:
    """Reduction of numbers that come in sizes only to continuous ones."""

    def apply(self, task: Task) -> Task:
        """Task with continuous numbers, of whose sizes no global proof knows."""
        stock = task.job.sizes(task.scene)
        return replace(
            task, no_global_proof=f"{', '.join(stock)} comes in sizes, which boxes do not tell" if stock else ""
        )

    def invert(self, task: Task, answer: Solution, solve: Solve) -> Solution:
        """Best answer at sizes in stock next to the continuous optimum, with the counts of its search."""
        stock = task.job.sizes(task.scene)
        if not stock or answer.status != "optimal":
            return answer
        step = task.at(f"trying sizes of {', '.join(stock)}")
        local = replace(step, starts=task.starts or 1, near=(), mass_tradeoff=True, global_proof=None)
        best = fitted(task.scene, answer, stock, lambda scene: solve(replace(local, scene=scene)))
        solver = {**best.solver, "evaluations": answer.solver["evaluations"]}
        return replace(best, solver=solver, global_bound=answer.global_bound)


def fitted(scene: Scene, ideal: Solution, stock: Stock, solve: SolveScene) -> Solution:
    """Best optimum whose numbers are at sizes that are sold; `ideal` itself where it is one already, or no optimum.

    stock: sizes (SI, ascending) by number; solve(scene): optimum of a changed scene, its numbers continuous.
    """
    for name, sizes in stock.items() if ideal.status == "optimal" else ():
        if all(abs(ideal.design[name] - size) > SAME_SIZE * size for size in sizes):
            return _at_a_size(scene, ideal, name, stock, solve)
    return ideal


def _at_a_size(scene: Scene, ideal: Solution, name: str, stock: Stock, solve: SolveScene) -> Solution:
    """Best optimum with one number at a size; on either side the nearest size with an admissible design is enough.

    Where there is none, `ideal` with sentences that say so, as no answer to build.
    """
    value, sizes = ideal.design[name], stock[name]
    rest = {number: values for number, values in stock.items() if number != name}

    def at_size(bounded: Scene) -> Solution:
        return fitted(bounded, solve(bounded), rest, solve)

    answers, trials = [], []
    for side in (reversed([size for size in sizes if size < value]), (size for size in sizes if size > value)):
        for size, answer in _until_admissible(scene, name, side, at_size):
            trials.append(scene.show(size, "length"))
            answers += [answer] if answer.status == "optimal" else []
    phrase = f"Any size would have {name} {scene.show(value, 'length')}"
    if not answers:
        problem = f"No {name} that is sold gives an admissible design (tried {', '.join(trials) or 'none in bounds'})."
        sentences = Sentences(problem, explanations=(f"{phrase}.",))
        return replace(ideal, status="infeasible", sentences=sentences, certificate=None, binding=(), bind_together=())
    best = answers[0]
    for answer in answers[1:]:
        best = answer if _better(answer, best) else best
    first = next(iter(best.certificate.levels)).objective if best.certificate else ""
    reached = ideal.figures.get(first)
    figure = f" and {first} {scene.show(reached, UnitFormatter(scene).kind(first), 9)}" if reached is not None else ""
    explanation = f"{phrase}{figure}; of those sold, tried {', '.join(trials)}."
    return replace(best, sentences=report.explained(best, explanation))


def _until_admissible(scene: Scene, name: str, sizes: Iterator[float], solve: SolveScene) -> Iterator[Tried]:
    """Sizes with their answers, up to the first that is optimal."""
    bound = scene.bounds[name]
    for _, size in zip(range(FARTHEST_SIZE), sizes, strict=False):
        if not bound.min <= size <= bound.max:
            return
        answer = solve(scene.set(f"bounds.{name}", f"{size!r} m"))
        yield size, answer
        if answer.status == "optimal":
            return


def _better(first: Solution, second: Solution) -> bool:
    """Whether one answer's objectives are less, level by level."""
    for level in first.certificate.levels if first.certificate else ():
        a, b = first.figures.get(level.objective) or 0.0, second.figures.get(level.objective) or 0.0
        if abs(a - b) > SAME_SIZE * max(abs(a), abs(b)):
            return a < b
    return False
