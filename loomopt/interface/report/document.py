"""Pages of answers and studies: a chapter for each, further studies as parts of a chapter."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

from loomopt.base.errors import refusal
from loomopt.base.files import suffix
from loomopt.interface.files import outputs
from loomopt.interface.report import answer, study
from loomopt.interface.report.answer import Status, Subject
from loomopt.interface.report.markup import Part
from loomopt.interface.report.page import Chapter, page
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Evaluated, Proofs
from loomopt.studies.run.rows import Row, SceneStudy

PAGES = (".html",)
ALLOWED = "fronts, sweeps, effects, sensitivities, tolerances, torque budgets, accuracy, proofs"


@runtime_checkable
class Reported(Protocol):
    """Study of an answer that gives its parts of a page."""

    def report_parts(self) -> list[Part]:
        """Parts of a page."""


class CheckedDesign(Protocol):
    """Design in its scene, with its limits checked."""

    @property
    def result(self) -> Evaluated:
        """Record of the result."""

    @property
    def scene(self) -> Scene:
        """Scene of the result."""

    @property
    def target(self) -> str:
        """Target whose limits are checked."""

    @property
    def task_name(self) -> str:
        """Target, or a summary of the task."""


def of_answer(design: CheckedDesign, results: Sequence[object] = (), doubts: Sequence[str] = ()) -> list[Chapter]:
    """Chapter of an answer, and one for each member of a family; arguments as of `of_design`."""
    first = of_design(design, results, doubts)
    if not design.result.members:
        return [first]
    return [
        first,
        *(Chapter(heading, "", status, parts) for heading, status, parts in answer.members(_subject(design))),
    ]


def of_design(design: CheckedDesign, results: Sequence[object] = (), doubts: Sequence[str] = ()) -> Chapter:
    """Chapter of an answer or an evaluation.

    results: studies of the same scene; doubts: contradictions in the design's file. Raises BadInput.
    """
    subject = _subject(design, doubts)
    return _chapter(subject.heading, subject.scene, answer.status(subject), [*answer.parts(subject), *_more(results)])


def _subject(design: CheckedDesign, doubts: Sequence[str] = ()) -> Subject:
    return Subject(design.result, design.scene, design.target, design.task_name, tuple(doubts))


def of_study(plan: SceneStudy, solved: Sequence[Row], results: Sequence[object] = ()) -> Chapter:
    """Chapter of a study; solved: the rows of all points that were. Raises BadInput."""
    parts = [*study.parts(plan, solved), *_more(results)]
    return _chapter(f"{plan.name} of {plan.heading}", plan.scene, study.status(plan, solved), parts)


def _chapter(heading: str, scene: Scene, status: Status, parts: Sequence[Part]) -> Chapter:
    return Chapter(heading, scene.title, status, parts, f"Source: {scene.source}" if scene.source else "")


def _more(results: Sequence[object]) -> list[Part]:
    return [part for result in results for part in _parts(result)]


def _parts(thing: object) -> list[Part]:
    """Parts of a chapter for a study of the answer. Raises BadInput for any other object."""
    if isinstance(thing, Reported):
        return thing.report_parts()
    if isinstance(thing, Proofs):
        from loomopt.interface.text import answers

        return [Part("Proof at every crank angle", tuple(answers.proofs(thing)))]
    raise refusal("a page does not show this", "", "report", type(thing).__name__, ALLOWED, "Give one of them")


def part_of_study(plan: SceneStudy, solved: Sequence[Row]) -> list[Part]:
    """A study as parts of another chapter, its own status first."""
    status = study.status(plan, solved)
    return [Part(f"{plan.name} of {plan.heading}", (status.verdict, *status.sentences)), *study.parts(plan, solved)]


def html(chapters: Sequence[Chapter]) -> str:
    """Page of chapters as text."""
    return page(chapters)


def write(path: Path, chapters: Sequence[Chapter]) -> None:
    """Write a page of chapters to a file. Raises BadInput."""
    suffix(path, PAGES)
    outputs.text(path, html(chapters))
