"""From a continuous optimum to sizes that are sold: solve again with each neighbour, keep the best."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Sentences, Solution, Words

FARTHEST_SIZE, SAME_SIZE = 4, 1e-9
"""Sizes sold that are tried on either side, and the share by which two answers to them are equally good."""

Solve = Callable[[Scene], Solution]
Stock = Mapping[str, Sequence[float]]
Tried = tuple[float, Solution]


def fitted(scene: Scene, ideal: Solution, stock: Stock, solve: Solve) -> Solution:
    """Best optimum whose numbers are at sizes that are sold; `ideal` itself where it is one already, or no optimum.

    stock: sizes (SI, ascending) by number; solve(scene): optimum of a changed scene, its numbers continuous.
    """
    for name, sizes in stock.items() if ideal.status == "optimal" else ():
        if all(abs(ideal.design[name] - size) > SAME_SIZE * size for size in sizes):
            return _at_a_size(scene, ideal, name, stock, solve)
    return ideal


def _at_a_size(scene: Scene, ideal: Solution, name: str, stock: Stock, solve: Solve) -> Solution:
    """Best optimum with one number at a size; on either side the nearest size with an admissible design is enough.

    Where there is none, `ideal` with sentences that say so, as no answer to build.
    """
    value, sizes = ideal.design[name], stock[name]
    rest = {other: own for other, own in stock.items() if other != name}

    def at_size(own: Scene) -> Solution:
        return fitted(own, solve(own), rest, solve)

    found, tried = [], []
    for side in (reversed([size for size in sizes if size < value]), (size for size in sizes if size > value)):
        for size, answer in _until_admissible(scene, name, side, at_size):
            tried.append(scene.show(size, "length"))
            found += [answer] if answer.status == "optimal" else []
    said = f"Any size would have {name} {scene.show(value, 'length')}"
    if not found:
        problem = f"No {name} that is sold gives an admissible design (tried {', '.join(tried) or 'none in bounds'})."
        sentences = Sentences(problem, explanations=(f"{said}.",))
        return replace(ideal, status="infeasible", sentences=sentences, certificate=None, binding=(), bind_together=())
    best = found[0]
    for answer in found[1:]:
        best = answer if _better(answer, best) else best
    first = next(iter(best.certificate.levels)).objective if best.certificate else ""
    reached = ideal.figures.get(first)
    figure = f" and {first} {scene.show(reached, Words(scene).kind(first), 9)}" if reached is not None else ""
    explanation = f"{said}{figure}; of those sold, tried {', '.join(tried)}."
    return replace(best, sentences=report.explained(best, explanation))


def _until_admissible(scene: Scene, name: str, sizes: Iterator[float], solve: Solve) -> Iterator[Tried]:
    """Yield sizes with their answers, ending with the first that is optimal."""
    bound = scene.bounds[name]
    for _, size in zip(range(FARTHEST_SIZE), sizes, strict=False):
        if not bound.min <= size <= bound.max:
            return
        answer = solve(scene.set(f"bounds.{name}", f"{size!r} m"))
        yield size, answer
        if answer.status == "optimal":
            return


def _better(one: Solution, other: Solution) -> bool:
    """Say whether one answer's objectives are less, level by level."""
    for level in one.certificate.levels if one.certificate else ():
        a, b = one.figures.get(level.objective) or 0.0, other.figures.get(level.objective) or 0.0
        if abs(a - b) > SAME_SIZE * max(abs(a), abs(b)):
            return a < b
    return False
