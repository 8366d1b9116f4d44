"""The public functions: load a scene, solve it, evaluate and simulate a design."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from loomopt import designs
from loomopt.designs import Design
from loomopt.jobs.registry import load, scene
from loomopt.scenes import Scene
from loomopt.solving import engine
from loomopt.solving.asked import ACCURACY, GAP, SECONDS, Everywhere, check_numbers
from loomopt.solving.solution import Evaluation, Solution

if TYPE_CHECKING:
    import pandas as pd

    from loomopt.solving.proof import Proofs

__all__ = ["Answer", "Scene", "evaluate", "load", "prove", "scene", "simulate", "solve"]


@dataclass(frozen=True)
class Answer(Solution):
    """A solved target that shows itself: as tables, as curves, and in Jupyter."""

    scene: Scene = field(kw_only=True, repr=False)

    def table(self) -> "pd.DataFrame":
        """Return the design and its figures beside today's machine and the limits, in the scene's own units."""
        from loomopt import tables

        return tables.answer(self, self.scene)

    def curves(self) -> "pd.DataFrame":
        """Return the curves of the design over the cycle, SI, units in the column names."""
        return simulate(self.scene, self.design)

    def _repr_html_(self) -> str:
        from loomopt.views import notebook

        return notebook.answer(self, self.scene)


def solve(
    scene: Scene,
    target: str | None = None,
    *,
    accuracy: float = ACCURACY,
    starts: int | None = None,
    seed: int = 0,
    near: Solution | None = None,
    prove: bool = False,
    everywhere: bool = False,
    gap: float = GAP,
    seconds: float = SECONDS,
    on_iteration: Callable[[int], None] | None = None,
    on_start: Callable[[int, int], None] | None = None,
    on_step: Callable[[str], None] | None = None,
) -> Answer:
    """Return the certified optimum of a scene's target (the job's default without one), or why there is none.

    accuracy: relative, of every whole-cycle value, 1e-11 to 0.1. starts: the job's own first, then random ones drawn
    with `seed`. near: an answer to the same structure, from which the solve starts warm. prove: whether every
    limit is proven at every crank angle too. everywhere: whether it is proven that no admissible design is better by
    more than `gap`, relative to each objective, in at most so many seconds (`answer.global_bound`).
    on_iteration(number), on_start(number, of), on_step(what): progress. Raises BadInput, and KeyboardInterrupt on
    Ctrl-C.
    """
    found = engine.solve(
        scene,
        target,
        accuracy=accuracy,
        starts=starts,
        seed=seed,
        near=near,
        prove=prove,
        everywhere=Everywhere(gap, seconds, on_step or (lambda text: None)) if everywhere else None,
        on_iteration=on_iteration,
        on_start=on_start,
    )
    fields = {entry.name: getattr(found, entry.name) for entry in dataclasses.fields(Solution)}
    return Answer(**fields, scene=scene)


def evaluate(scene: Scene, design: Design | None = None) -> Evaluation:
    """Return figures and limits of a design (SI and rad; today's where it names nothing). Raises BadInput."""
    return engine.evaluate(scene, designs.checked(design, scene) if design else None)


def prove(scene: Scene, design: Design | None = None, target: str | None = None, *, slack: float = 1e-8) -> "Proofs":
    """Return proofs that a design's limits (SI; today's without one) hold at every crank angle, or where they fail.

    target: whose limits, the job's default without one. slack: what binding limits leave open, relative to each
    quantity's largest magnitude over the cycle. Raises BadInput.
    """
    from loomopt.solving import proof

    return proof.prove(scene, designs.checked(design, scene) if design else {}, target, slack)


def simulate(scene: Scene, design: Design | None = None, *, accuracy: float | None = None) -> "pd.DataFrame":
    """Return the curves of a design (SI; today's without one) over the cycle, units in the column names.

    accuracy: as few rows as show each column's largest magnitude to it; every half degree without. Raises BadInput.
    """
    from loomopt import tables

    if accuracy is not None:
        check_numbers(accuracy, 1)
    return tables.curves(scene, designs.checked(design, scene) if design else {}, accuracy)
