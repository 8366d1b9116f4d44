"""How an answer shows itself in Jupyter: what the terminal shows, as self-contained HTML, and the mechanism drawn."""

from html import escape

from loomopt.jobs import registry
from loomopt.scenes import Scene
from loomopt.solving.solution import Solution
from loomopt.views import outputs, svg, terminal
from loomopt.views.layout import Grid, spaced


def answer(solution: Solution, scene: Scene) -> str:
    """Return an answer as HTML: what was found, design beside today, what binds, certificate, and the mechanism
    where the scene gives what a drawing needs."""
    shown = terminal.solution(solution, scene)
    parts = (table(part) if isinstance(part, Grid) else f"<p>{_escaped(part)}</p>" for part in shown)
    drawn = ""
    if not registry.of(scene).views.missing(scene):
        drawn = svg.render(outputs.drawing(scene, solution.design, outputs.what(solution)))
    return f"<div>{''.join(parts)}{drawn}</div>"


def table(grid: Grid) -> str:
    """Return a table as HTML, numbers to the right."""
    head = "".join(f"<th>{_escaped(heading)}</th>" for heading in grid.columns)
    rows = ("".join(_cell(cell, place in grid.right) for place, cell in enumerate(line)) for line in grid.lines)
    body = "".join(f"<tr>{row}</tr>" for row in rows)
    caption = f"<caption>{_escaped(grid.title)}</caption>" if grid.title else ""
    return f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cell(text: str, right: bool) -> str:
    return f'<td style="text-align: {"right" if right else "left"}">{_escaped(text)}</td>'


def _escaped(text: str) -> str:
    return escape(spaced(text))
