"""How an answer shows itself in Jupyter: sentence, table and drawing, as self-contained HTML."""

from html import escape
from typing import Any

from loomopt import tables
from loomopt.solving.solution import Solution
from loomopt.views import drawing, svg


def answer(solution: Solution, scene: Any) -> str:
    """Return an answer as HTML: what was found, design beside today, what binds, the mechanism."""
    head = f"<p><b>{escape(solution.problem)}, {escape(solution.target)}: {escape(solution.status)}.</b> "
    text = f"{head}{escape(solution.message)}</p>"
    table = tables.answer(solution, scene).to_html(float_format=lambda value: f"{value:.6g}", na_rep="", border=0)
    binding = "".join(
        f"<li>{escape(price.text)}: {escape(next(iter(price.worth)))} {escape(price.reading)}</li>"
        for price in solution.binding
    )
    listed = f"<p>What binds, and what loosening it is worth:</p><ul>{binding}</ul>" if binding else ""
    passed = solution.certificate is not None and solution.certificate.passed
    mark = "Certificate passed." if passed else "Not certified."
    picture = svg.render(drawing.linkage(solution.design, solution.problem))
    return f"<div>{text}{table}{listed}<p>{mark}</p>{picture}</div>"
