"""What a person sees in the terminal: short tables, plain sentences. Rich is imported only here."""

from collections.abc import Sequence
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from loomopt.quantities import factor
from loomopt.solving.solution import Evaluation, Solution
from loomopt.solving.words import Words
from loomopt.tables import rows

NEGLIGIBLE = 1e-9
"""Shown as 0 when below this share of the column's largest neighbour."""


def grid(title: str, columns: Sequence[str], lines: Sequence[Sequence[str]], right: Sequence[int] = ()) -> Table:
    """Return a plain table; right: places of right-aligned columns."""
    table = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False)
    for place, column in enumerate(columns):
        table.add_column(column, justify="right" if place in right else "left", no_wrap=place == 0)
    for line in lines:
        table.add_row(*(Text(cell) for cell in line))
    return table


def show(*parts: Any) -> None:
    """Print tables and sentences to stdout."""
    console = Console(highlight=False, soft_wrap=False)
    for part in parts:
        console.print(Text(part) if isinstance(part, str) else part)


def solution(answer: Solution, scene: Any) -> list[Any]:
    """Return the parts of a solved target: sentence, table, what binds, certificate, time."""
    parts: list[Any] = [
        f"{answer.problem} - {answer.target}: {answer.status}",
        answer.message,
        comparison(answer, scene),
    ]
    if answer.binding:
        lines = [(price.text, f"{next(iter(price.worth))}: {price.reading}") for price in answer.binding]
        parts.append(grid("What binds, and what loosening it is worth", ("limit", "worth"), lines))
    if answer.certificate:
        parts.append(certificate_line(answer))
    if answer.solver.get("starts", 1) > 1:
        parts.append(_starts(answer, scene))
    time = answer.time
    parts.append(
        f"Time: {time['total_s']:.3f} s (import {time['import_s']:.3f}, build {time['build_s']:.3f}, "
        f"solve {time['solve_s']:.3f}, certify {time['certify_s']:.3f})"
    )
    return parts


def comparison(evaluation: Evaluation, scene: Any) -> Table:
    """Return design and figures beside today's machine and the limits."""
    lines = []
    for row in rows(evaluation, scene):
        limit = _limit(row["min"], row["max"])
        flag = "" if row["ok"] else "  <- not held"
        before = _number(row["today"]) if row["today"] is not None else ""
        unit = row["unit"] if row["unit"] != "1" else ""
        lines.append((row["name"], before, _number(row["design"]), unit, limit + flag))
    today = isinstance(evaluation, Solution)
    columns = ("", "today" if today else "", "design", "unit", "limits")
    others = [
        f"{limit.name}: {'held' if limit.ok else 'NOT held'}"
        for limit in evaluation.limits
        if limit.name not in {row["name"] for row in rows(evaluation, scene)} and not limit.ok
    ]
    table = grid("", columns, lines, right=(1, 2))
    table.caption = "; ".join(others) or None
    return table


def _number(value: float) -> str:
    """Return six significant digits; what is only rounding is 0."""
    return "0" if abs(value) < NEGLIGIBLE else f"{value:.6g}"


def _limit(low: float | None, high: float | None) -> str:
    """Return a range as text."""
    if low is not None and low == high:
        return f"= {low:.6g}"
    if low is not None and high is not None:
        return f"{low:.6g} ... {high:.6g}"
    return f">= {low:.6g}" if low is not None else f"<= {high:.6g}" if high is not None else ""


def certificate_line(answer: Solution) -> str:
    """Return the certificate in one line."""
    found = answer.certificate
    assert found is not None
    if not found.passed:
        return "Certificate: NOT passed - " + "; ".join(found.reasons)
    worst = max((level.stationarity for level in found.levels), default=0.0)
    settled = f" Settled: {'; '.join(found.settled)}." if found.settled else ""
    unique = "unique" if found.unique else "not unique before the silent rules"
    return (
        f"Certificate: passed - limits held to {max(found.feasibility, 1e-16):.0e}, stationarity {worst:.0e}, "
        f"whole cycle within {max(found.violation, 1e-16):.0e}, a minimum, {unique}.{settled}"
    )


def _starts(answer: Solution, scene: Any) -> str:
    """Return how many starts found the best, and what other optima there are."""
    solver, words = answer.solver, Words(scene)
    text = f"Starts: {solver['starts_at_best']} of {solver['starts']} reached the best."
    others = [
        ", ".join(
            f"{name} {value / factor(words.unit(name)):.6g} {words.unit(name)}"
            for name, value in figures.items()
            if value is not None
        )
        + f" ({count})"
        for figures, count in answer.optima[1:]
    ]
    return text + (f" Other optima: {'; '.join(others)}." if others else "")
