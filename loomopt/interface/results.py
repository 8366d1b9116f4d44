"""Evaluations and answers in Python: tables, curves, figures and files of a design."""

import dataclasses
import inspect
import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from loomopt.base import arguments, records
from loomopt.base.arguments import renamed
from loomopt.base.records import attribute, lazy
from loomopt.physics.tolerances import SHOWN_AS_ZERO, SLACK
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report, solution
from loomopt.solving.options import check_numbers, target_name

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from loomopt.interface.report.animation import MovingPicture
    from loomopt.interface.study.budget import Budget
    from loomopt.interface.text.notebook import Sketch
    from loomopt.solving.answer.solution import Proofs

PICTURE = arguments.PICTURE


@dataclass(frozen=True, repr=False)
class Evaluation(records.Shown):
    """Figures and limits of a given design in its scene, SI and rad, without optimisation.

    target: target of the limits.
    """

    result: solution.Evaluated
    target: str = ""
    problem = attribute[str]()
    effects = attribute[tuple[str, ...]]()
    design = attribute[Mapping[str, Any]]()
    figures = attribute[Mapping[str, Any]]()
    units = attribute[Mapping[str, str]]()
    limits = attribute[tuple[solution.Finding, ...]]()
    reached = attribute[Mapping[str, bool]]()
    undefined = attribute[Mapping[str, str]]()
    terms = attribute[Any]()
    change = attribute[Mapping[str, Any]]()
    admissible = attribute[bool]()

    @property
    def scene(self) -> Scene:
        """Scene of the design, with all changes of the call."""
        assert self.result.scene is not None
        return self.result.scene

    @lazy
    def members(self) -> "tuple[Evaluation, ...]":
        """Members of a family, evaluated one by one."""
        from loomopt.scenes import family

        return tuple(_to_evaluation(member, self.scene, family.of_target(self.scene)) for member in self.result.members)

    def as_dict(self) -> dict[str, Any]:
        """Object that `--json` prints."""
        return self.result.as_dict(self.target)

    def table(self) -> "pd.DataFrame":
        """Design and figures, a row each, with today's machine and the limits, in the units of the scene."""
        from loomopt.interface import answer_table

        return answer_table.frame(self.result, self.scene)

    def to_frame(self, *, si: bool = False) -> "pd.DataFrame":
        """Design and figures as one row, for `pd.concat` with rows of other designs.

        Parameters
        ----------
        si : SI units, the same columns for all scenes; else the units of the scene.

        Returns
        -------
        Table of one row, with units in the column names.
        """
        from loomopt.interface import tables

        return tables.row(self.result, self.scene, self.task_name, self._outcome, si=arguments.flag(si, "si"))

    def curves(self) -> "pd.DataFrame":
        """Curves of the design over the cycle, SI, units in the column names."""
        return self.simulate()

    @renamed(beside="measured")
    def plot(
        self, path: str | os.PathLike[str] | None = None, *, measured: str | os.PathLike[str] | None = None
    ) -> "Figure":
        """Draw the curves over the cycle.

        Parameters
        ----------
        path : file to write the figure to as well: .png, .svg or .pdf.
        measured : CSV file of measured curves, as in `loomopt.simulate`.

        Returns
        -------
        Figure, which shows itself in Jupyter.

        Raises
        ------
        BadInput : an argument is wrong.
        """
        solution.demand_single(self.result, "curves")
        from loomopt.interface.files import outputs

        place = None if path is None else Path(arguments.path(path, "path", *PICTURE))
        return outputs.plot(self.result, self.scene, self.target, place, measured)

    def plot_forces(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Draw the forces of joints: their size over the turn, and their polar diagrams.

        Parameters
        ----------
        path : file to write the figure to as well: .png, .svg or .pdf.

        Returns
        -------
        Figure, which shows itself in Jupyter.

        Raises
        ------
        BadInput : an argument is wrong, or no active effect gives forces by components.
        """
        from loomopt.interface import forces

        return forces.from_curves(self.scene, self.simulate(), self.design).plot(path)

    def draw(self) -> "Sketch":
        """Draw the mechanism at full scale.

        Returns
        -------
        Sketch, which shows itself in Jupyter.

        Raises
        ------
        BadInput : the scene lacks a number that the drawing needs.
        """
        solution.demand_single(self.result, "drawing")
        from loomopt.interface.files import outputs
        from loomopt.interface.text import notebook

        return notebook.sketch(self.scene, self.design, outputs.describe_design(self.result))

    def export(self, path: str | os.PathLike[str]) -> Path:
        """Write the linkage or the cam for the workshop, as `loomopt export` does.

        Parameters
        ----------
        path : .dxf or .svg at true scale; .csv or .xlsx for the joints or the profile.

        Returns
        -------
        Path of the file.

        Raises
        ------
        BadInput : an argument is wrong.
        """
        solution.demand_single(self.result, "drawing")
        from loomopt.interface.files import outputs

        place = Path(arguments.path(path, "path", "a path that ends in .dxf, .svg, .csv or .xlsx", "Name a file"))
        outputs.linkage(place, self.scene, self.design, outputs.describe_design(self.result))
        return place

    def report(self, path: str | os.PathLike[str], *results: object) -> Path:
        """Write one self-contained page, which begins with the verdict on the design.

        Parameters
        ----------
        path : file that ends in .html.
        *results : studies of the same scene that the page shows too: fronts, sweeps, effects, sensitivities,
            tolerances, torque budgets, accuracy, proofs.

        Returns
        -------
        Path of the file.

        Raises
        ------
        BadInput : an argument is wrong.
        """
        from loomopt.interface.report import document

        place = Path(arguments.path(path, "path", "a path that ends in .html", "Name a file"))
        document.write(place, document.of_answer(self, results))
        return place

    def animate(self, path: str | os.PathLike[str] | None = None) -> "MovingPicture":
        """Animate the mechanism over its turn.

        Parameters
        ----------
        path : file to write the animation to as well: .html, .gif, or .mp4 if ffmpeg is installed.

        Returns
        -------
        Animation, which shows itself in Jupyter.

        Raises
        ------
        BadInput : an argument is wrong.
        """
        solution.demand_single(self.result, "drawing")
        from loomopt.interface.files import outputs
        from loomopt.interface.report import animation

        place = None if path is None else Path(arguments.path(path, "path", *animation.FILE))
        return animation.animate(self.scene, self.design, place, outputs.describe_design(self.result))

    def evaluate(self) -> "Evaluation":
        """Figures and limits of the design in its own scene, with the limits of its own target."""
        solution.demand_single(self.result, "figures to evaluate")
        design = designs.checked(self.design, self.scene)
        if self.terms:
            return _to_evaluation(self.terms.evaluation(design), self.scene, self.target)
        return evaluate_design(self.scene, design, self.target)

    @renamed(beside="measured")
    def simulate(
        self, *, accuracy: float | None = None, measured: str | os.PathLike[str] | None = None
    ) -> "pd.DataFrame":
        """Curves of the design over the cycle, in its scene.

        Parameters
        ----------
        accuracy, measured : as in `loomopt.simulate`.

        Returns
        -------
        Table, SI, with units in the column names.

        Raises
        ------
        BadInput : an argument is wrong.
        """
        solution.demand_single(self.result, "curves")
        from loomopt.interface import tables

        if accuracy is not None:
            check_numbers(accuracy, 1)
        return tables.curves(self.scene, self.design, accuracy, self.target, measured)

    def budget(self, *, fluctuation: float | None = None) -> "Budget":
        """Torque budget of the design, in its scene.

        Parameters
        ----------
        fluctuation : as in `loomopt.budget`.

        Returns
        -------
        Budget.

        Raises
        ------
        BadInput : no effect acts on the crank.
        """
        solution.demand_single(self.result, "torque budget")
        from loomopt.interface.study.budget import compute

        return compute(self.scene, designs.checked(self.design, self.scene), fluctuation)

    def prove(self, *, slack: float = SLACK) -> "Proofs":
        """Prove the limits of the design's target at every crank angle, in its scene.

        Parameters
        ----------
        slack : as in `loomopt.prove`.

        Returns
        -------
        Proofs, one for each limit.

        Raises
        ------
        BadInput : an argument is wrong.
        """
        from loomopt.solving.proof import whole_cycle

        solution.demand_single(self.result, "proofs")
        design = designs.checked(self.design, self.scene)
        return (
            self.terms.proofs(design, slack)
            if self.terms
            else whole_cycle.prove(self.scene, design, self.target, slack)
        )

    @property
    def task_name(self) -> str:
        """Target of the solve or of the evaluation, or the summary of its terms."""
        return self.terms.summary if self.terms else self.target

    @property
    def sought(self) -> str:
        """Former name of `task_name`."""
        _warn_of("sought", "task_name")
        return self.task_name

    @property
    def _outcome(self) -> str:
        """Outcome in a word."""
        return "admissible" if self.admissible else "not admissible"

    @property
    def _summary(self) -> str:
        """Figures that the target optimises, with values."""
        from loomopt.jobs import registry
        from loomopt.solving.answer.solution import UnitFormatter

        sizes = dict[str, float]()
        if not self.terms and self.target:
            job = registry.of_target(self.scene, self.target)
            objectives = job.program(self.scene, self.target).objectives
            sizes = {objective.figure: objective.scale if objective.power == 1 else 0.0 for objective in objectives}
        formatter, all_of = UnitFormatter(self.scene), {**self.design, **self.figures}
        parts = list[str]()
        for name in self.terms.axes if self.terms else sizes:
            value = all_of.get(name)
            if value is not None:
                value = 0.0 if abs(value) <= SHOWN_AS_ZERO * sizes.get(name, 0.0) else value
                parts.append(f"{name} {formatter.shown(name, value)}")
        return ", ".join(parts)

    def __str__(self) -> str:
        from loomopt.interface.text import answers, layout

        before = None if self._is_today else evaluate_design(self.scene, None, self.target or None)
        return layout.render(
            answers.evaluation(self.result, self.scene, before.result if before else None), layout.width()
        )

    @property
    def _is_today(self) -> bool:
        from loomopt.jobs import registry

        return designs.flat(self.design).items() <= registry.of(self.scene).today(self.scene).items()

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.problem}, {self.task_name}: {self._outcome}; {self._summary}>"


@dataclass(frozen=True, repr=False)
class Answer(Evaluation):
    """Result of a solve: the optimum, its binding limits, its certificate, and today's machine."""

    result: solution.Solution
    status = attribute[str]()
    sentences = attribute[solution.Sentences]()
    message = attribute[str]()
    explanation = attribute[str]()
    outcome = attribute[str]()
    design_is = attribute[str]()
    binding = attribute[tuple[solution.Price, ...]]()
    bind_together = attribute[tuple[solution.JointPrice, ...]]()
    certificate = attribute[Any]()
    relaxation = attribute[tuple[solution.Relaxation, ...]]()
    clash = attribute[tuple[str, ...]]()
    solver = attribute[Mapping[str, Any]]()
    time = attribute[Mapping[str, float]]()
    optima = attribute[Any]()
    proofs = attribute[Any]()
    global_bound = attribute[Any]()
    named_target = attribute[str | None]()
    alternative = attribute[Any]()
    robust = attribute[Any]()
    rounded = attribute[Any]()
    worse = attribute[tuple[solution.Worse, ...]]()
    evaluate_today = attribute[Any]()
    point = attribute[Any]()

    @lazy
    def today(self) -> Evaluation | None:
        """Today's machine, evaluated when it is first read."""
        return _to_evaluation(self.result.today, self.scene, self.target) if self.result.today else None

    @property
    def before(self) -> Evaluation | None:
        """Former name of `today`."""
        _warn_of("before", "today")
        return self.today

    @property
    def asked(self) -> str | None:
        """Former name of `named_target`."""
        _warn_of("asked", "named_target")
        return self.result.named_target

    @property
    def beside(self) -> "solution.Alternative | None":
        """Former name of `alternative`."""
        _warn_of("beside", "alternative")
        return self.result.alternative

    def __str__(self) -> str:
        from loomopt.interface.text import answers, layout

        return layout.render(answers.solution(self.result, self.scene), layout.width())

    @property
    def _outcome(self) -> str:
        return self.result.outcome

    @property
    def _summary(self) -> str:
        clash = self.result.clash
        return f"limits that clash: {', '.join(clash)}" if clash else super()._summary


def _warn_of(name: str, current: str) -> None:
    """Warn of a former name."""
    text = f"{name} is now {current}; the old name goes in the next version"
    warnings.warn(text, DeprecationWarning, stacklevel=3)


def _fields_signature(record: type) -> inspect.Signature:
    """Signature with the names of the fields of a record, for `help`."""
    known = inspect.signature(record).parameters.values()
    return inspect.Signature(
        [parameter.replace(annotation=parameter.empty, default=parameter.empty) for parameter in known]
    )


Answer.__signature__ = _fields_signature(solution.Solution)  # type: ignore[attr-defined]
Evaluation.__signature__ = _fields_signature(solution.Evaluated)  # type: ignore[attr-defined]


def _html(thing: records.Shown) -> str:
    from loomopt.interface.text import notebook

    return notebook.html(thing.result if isinstance(thing, Evaluation) else thing)


records.show_by(_html)


def evaluate_design(scene: Scene, design: Mapping[str, float] | None, target: str | None) -> Evaluation:
    """Evaluation of a checked design, SI; of today's machine without one. Raises BadInput."""
    return _to_evaluation(report.evaluate(scene, design, target), scene, target_name(scene, target))


def to_answer(record: solution.Solution, scene: Scene, target: str | None = None) -> Answer:
    """Answer of the record of a solve; target: as the call named it."""
    return Answer(dataclasses.replace(record, scene=scene, named_target=target), record.target)


def _to_evaluation(evaluated: solution.Evaluated, scene: Scene, target: str) -> Evaluation:
    return Evaluation(evaluated if evaluated.scene else dataclasses.replace(evaluated, scene=scene), target)
