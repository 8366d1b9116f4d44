"""What a designer works with in Python: a design that was evaluated or found, as tables, curves, figures and files."""

import dataclasses
import inspect
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from loomopt.base import arguments, records
from loomopt.base.records import lazy
from loomopt.physics.tolerances import SHOWN_AS_ZERO, SLACK
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report, solution
from loomopt.solving.options import check_numbers, target_name

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from loomopt.interface.text.notebook import Sketch
    from loomopt.solving.answer.solution import Proofs

PICTURE = "a path that ends in .png, .svg or .pdf", "Name a file, or leave it out"
"""What a figure may be written to, and what to do where it is none."""


@dataclass(frozen=True, repr=False)
class Evaluation(solution.Evaluated, records.Shown):
    """A given design in its scene: its figures and limits, SI and rad; nothing was optimised.

    target: whose limits it was judged by.
    """

    scene: Scene = field(kw_only=True, compare=False)
    target: str = field(kw_only=True, default="")

    def table(self) -> "pd.DataFrame":
        """Return design and figures, a row each, beside today's machine and the limits, in the scene's own units."""
        from loomopt.interface import tables

        return tables.answer(self, self.scene)

    def to_frame(self, *, si: bool = False) -> "pd.DataFrame":
        """Return design and figures as one row, units in the column names, to be set beside others by `pd.concat`.

        si: in SI, so that rows of scenes in different units have the same columns; else in the scene's own units.
        """
        from loomopt.interface import tables

        return tables.row(self, self.scene, self.sought, self._outcome, si=arguments.flag(si, "si"))

    def curves(self) -> "pd.DataFrame":
        """Return the curves of the design over the cycle, SI, units in the column names."""
        return self.simulate()

    def plot(
        self, path: str | os.PathLike[str] | None = None, *, beside: str | os.PathLike[str] | None = None
    ) -> "Figure":
        """Return the curves over the cycle as a figure, which shows itself in Jupyter.

        path: a file to write it to as well: .png, .svg or .pdf. beside: as in `loomopt.simulate`. Raises BadInput.
        """
        from loomopt.interface.files import outputs

        place = None if path is None else Path(arguments.path(path, "path", *PICTURE))
        return outputs.plot(self, self.scene, self.target, place, beside)

    def draw(self) -> "Sketch":
        """Return the mechanism drawn at full scale, which shows itself in Jupyter. Raises BadInput."""
        from loomopt.interface.files import outputs
        from loomopt.interface.text import notebook

        return notebook.sketch(self.scene, self.design, outputs.what(self))

    def export(self, path: str | os.PathLike[str]) -> Path:
        """Write linkage or cam for the workshop, as `loomopt export` does; return the file. Raises BadInput.

        path: .dxf or .svg at true scale; .csv for the joints or the profile.
        """
        from loomopt.interface.files import outputs

        place = Path(arguments.path(path, "path", "a path that ends in .dxf, .svg or .csv", "Name a file"))
        outputs.linkage(place, self.scene, self.design, outputs.what(self))
        return place

    def evaluate(self) -> "Evaluation":
        """Return figures and limits of the design in its own scene, judged by the limits of its own target."""
        design = designs.checked(self.design, self.scene)
        if self.terms:
            return _judged(self.terms.evaluation(design), self.scene, self.target)
        return evaluated(self.scene, design, self.target)

    def simulate(
        self, *, accuracy: float | None = None, beside: str | os.PathLike[str] | None = None
    ) -> "pd.DataFrame":
        """Return the curves of the design in its own scene; accuracy, beside: as in `loomopt.simulate`."""
        from loomopt.interface import tables

        if accuracy is not None:
            check_numbers(accuracy, 1)
        return tables.curves(self.scene, self.design, accuracy, self.target, beside)

    def prove(self, *, slack: float = SLACK) -> "Proofs":
        """Return proofs of the limits of its own scene and target; slack: as in `loomopt.prove`. Raises BadInput."""
        from loomopt.solving.proof import whole_cycle

        design = designs.checked(self.design, self.scene)
        return (
            self.terms.proofs(design, slack)
            if self.terms
            else whole_cycle.prove(self.scene, design, self.target, slack)
        )

    @property
    def sought(self) -> str:
        """What it answers, or was judged by: its target, or what its terms say."""
        return self.terms.said if self.terms else self.target

    @property
    def _outcome(self) -> str:
        """What came of it, in a word."""
        return "admissible" if self.admissible else "not admissible"

    @property
    def _summary(self) -> str:
        """What a designer asks first: the figures that the target is about."""
        from loomopt.jobs import registry
        from loomopt.solving.answer.solution import Words

        sizes = dict[str, float]()
        if not self.terms:
            objectives = registry.of(self.scene).program(self.scene, self.target).objectives
            sizes = {each.figure: each.scale if each.power == 1 else 0.0 for each in objectives}
        words, all_of = Words(self.scene), {**self.design, **self.figures}
        told = list[str]()
        for name in self.terms.axes if self.terms else sizes:
            value = all_of.get(name)
            if value is not None:
                value = 0.0 if abs(value) <= SHOWN_AS_ZERO * sizes.get(name, 0.0) else value
                told.append(f"{name} {words.shown(name, value)}")
        return ", ".join(told)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.problem}, {self.sought}: {self._outcome}; {self._summary}>"


@dataclass(frozen=True, repr=False)
class Answer(Evaluation, solution.Solution):
    """A solved target: the design that was found, what binds, what is certified, and today's machine beside it."""

    @lazy
    def before(self) -> Evaluation | None:
        """Today's machine, evaluated when it is first read."""
        return _judged(self.today(), self.scene, self.target) if self.today else None

    @property
    def _outcome(self) -> str:
        return self.outcome

    @property
    def _summary(self) -> str:
        return f"limits that clash: {', '.join(self.clash)}" if self.clash else super()._summary


for _shown in (Answer, Evaluation):  # names alone: whoever reads `help` looks for what is in it, and makes none
    _signature = inspect.signature(_shown)
    _named = [each.replace(annotation=each.empty, default=each.empty) for each in _signature.parameters.values()]
    _shown.__signature__ = _signature.replace(parameters=_named, return_annotation=_signature.empty)  # type: ignore[attr-defined]


def _html(thing: records.Shown) -> str:
    from loomopt.interface.text import notebook

    return notebook.html(thing)


records.show_by(_html)


def evaluated(scene: Scene, design: Mapping[str, float] | None, target: str | None) -> Evaluation:
    """Return figures and limits of a design, checked, SI; today's without one. Raises BadInput."""
    return _judged(report.evaluate(scene, design, target), scene, target_name(scene, target))


def solved(found: solution.Solution, scene: Scene, target: str | None = None) -> Answer:
    """Return what a solve says as an object to work with; target: as the call named it."""
    return Answer(**_fields(found) | {"scene": scene, "asked": target})


def _judged(found: solution.Evaluated, scene: Scene, target: str) -> Evaluation:
    return Evaluation(**_fields(found) | {"scene": scene, "target": target})


def _fields(found: solution.Evaluated) -> dict[str, Any]:
    return {entry.name: getattr(found, entry.name) for entry in dataclasses.fields(found)}
