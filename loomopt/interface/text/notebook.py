"""Display in Jupyter: the text of the terminal as self-contained HTML, and a drawing of the mechanism."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from loomopt.interface.files import outputs, svg
from loomopt.interface.text import answers, scenes
from loomopt.jobs import registry
from loomopt.picture.shapes import Drawing
from loomopt.picture.table import TextTable, restore_spaces
from loomopt.scenes.designs import Design
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Evaluated, Proofs, Solution

PAGE = 720
"""Longer side of a drawing on a page of a notebook, pixels."""
_SIZE = re.compile(r'width="([\d.e+-]+)[^"]*" height="([\d.e+-]+)[^"]*"')


@dataclass(frozen=True)
class Sketch:
    """A mechanism drawn at full scale; in Jupyter it shows itself, as large as a page takes.

    drawing: its lines, circles and texts; svg: the same as SVG text.
    """

    drawing: Drawing

    @property
    def svg(self) -> str:
        """The drawing as SVG text."""
        return svg.render(self.drawing)

    @property
    def on_page(self) -> str:
        """The drawing as SVG text, as large as a page takes."""
        return _SIZE.sub(_on_page, self.svg, count=1)

    def _repr_svg_(self) -> str:
        return self.on_page

    def __repr__(self) -> str:
        return f"<Sketch {self.drawing.title}>"


def sketch(scene: Scene, design: Design, subject: outputs.DrawnSubject | None = None) -> Sketch:
    """A design's mechanism in the positions that matter; subject: the design in words, for the title.

    Raises BadInput where the scene cannot be drawn.
    """
    return Sketch(outputs.drawing(scene, design, subject))


def html(thing: object) -> str:
    """HTML of a scene, an evaluation, an answer or proofs: the text of the terminal, and the mechanism.

    The mechanism is drawn where the scene gives what a drawing needs. Raises TypeError for anything else.
    """
    match thing:
        case Scene():
            return page(scenes.parts(thing), _draw(thing, {}))
        case Solution(scene=Scene() as scene):
            return page(answers.solution(thing, scene), _draw(scene, thing.design, outputs.describe_design(thing)))
        case Evaluated(scene=Scene() as scene):
            return page(
                answers.evaluation(thing, scene, None), _draw(scene, thing.design, outputs.describe_design(thing))
            )
        case Proofs():
            return page(answers.proofs(thing))
    raise TypeError(f"a {type(thing).__name__} is not shown")


def _draw(scene: Scene, design: Design, subject: outputs.DrawnSubject | None = None) -> str:
    """Mechanism as SVG, or "" if the scene lacks numbers for a drawing."""
    return "" if registry.of(scene).views.missing(scene) else sketch(scene, design, subject)._repr_svg_()


def _on_page(size: re.Match[str]) -> str:
    """Size of a drawing on a page; its letters are scaled with it."""
    sides = [float(side) for side in size.groups()]
    width, height = (round(PAGE * side / max(sides)) for side in sides)
    return f'width="{width}" height="{height}"'


def page(parts: Sequence[str | TextTable], drawn: str = "") -> str:
    """Paragraphs and tables, then a drawing."""
    blocks = (table(part) if isinstance(part, TextTable) else f"<p>{_escape(part)}</p>" for part in parts)
    return f"<div>{''.join(blocks)}{drawn}</div>"


def table(grid: TextTable) -> str:
    """A table as HTML, numbers to the right."""
    head = "".join(f"<th>{_escape(heading)}</th>" for heading in grid.columns)
    rows = ("".join(_cell(cell, place in grid.right) for place, cell in enumerate(line)) for line in grid.lines)
    body = "".join(f"<tr>{row}</tr>" for row in rows)
    caption = f"<caption>{_escape(grid.title)}</caption>" if grid.title else ""
    return f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cell(text: str, right: bool) -> str:
    return f'<td style="text-align: {"right" if right else "left"}">{_escape(text)}</td>'


def _escape(text: str) -> str:
    return escape(restore_spaces(text))
