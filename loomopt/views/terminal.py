"""What a person sees of an answer: a sentence, short tables, the certificate in one line."""

import math
from typing import TYPE_CHECKING

from loomopt.jobs import registry
from loomopt.scenes import Scene
from loomopt.solving.solution import Evaluation, Solution
from loomopt.solving.verdict import GlobalBound
from loomopt.solving.words import Words
from loomopt.tables import rows
from loomopt.tolerances import SHOWN_AS_ZERO
from loomopt.units import factor
from loomopt.views.layout import Grid, joined

if TYPE_CHECKING:
    from loomopt.solving.proof import Proofs


def solution(answer: Solution, scene: Scene) -> list[str | Grid]:
    """Return the parts of a solved target: sentence, table, what binds, certificate, time."""
    heading = "relaxed" if answer.relaxation else "design"
    parts: list[str | Grid] = [f"{answer.problem}, {answer.target}: {answer.status}"]
    if answer.relaxation:
        clash = ", ".join(joined(limit) for limit in answer.clash)
        parts += [f"No admissible design exists near any start. Limits that clash: {clash}.", _relaxation(answer)]
    elif answer.status == "optimal":
        parts.append(registry.of(scene).say(scene, answer.target, answer.figures))
    else:
        parts.append(answer.message)
    parts += [answer.explanation] if answer.explanation else []
    parts.append(comparison(answer, scene, answer.before, heading))
    parts += lists(answer, scene)
    if answer.certificate:
        parts.append(_binding(answer))
        parts += certificate(answer)
    if answer.global_bound:
        parts.append(everywhere(answer.global_bound, scene))
    if answer.solver.get("starts", 1) > 1:
        parts.append(_starts(answer, scene))
    time = answer.time
    parts.append(
        f"Time: {time['total_s']:.3f} s (import {time['import_s']:.3f}, build {time['build_s']:.3f}, "
        f"solve {time['solve_s']:.3f}, certify {time['certify_s']:.3f})"
    )
    return parts


def evaluation(found: Evaluation, scene: Scene, before: Evaluation | None) -> list[str | Grid]:
    """Return the parts of an evaluated design; before: today's machine, where the design is another."""
    broken = ", ".join(limit.name for limit in found.limits if not limit.ok)
    held = f"NOT admissible: {broken}" if broken else "all limits held"
    table = comparison(found, scene, before, "design" if before else "today")
    return [f"{found.problem}: {held}", table, *lists(found, scene)]


def comparison(found: Evaluation, scene: Scene, before: Evaluation | None, heading: str) -> Grid:
    """Return design and figures beside today's machine and the limits."""
    table = rows(found, scene, before)
    sizes: dict[str, float] = {}
    for row in table:
        largest = max(abs(row["design"]), abs(row["today"] or 0.0))
        sizes[row["unit"]] = max(sizes.get(row["unit"], 0.0), largest)
    lines = []
    for row in table:
        size = sizes[row["unit"]]
        today = [] if before is None else ["" if row["today"] is None else _number(row["today"], size)]
        limit = joined(_limit(row["min"], row["max"]) + ("" if row["ok"] else "  <- not held"))
        unit = "" if row["unit"] == "1" else row["unit"]
        lines.append((row["name"], *today, _number(row["design"], size), unit, limit))
    shown = {row["name"] for row in table}
    lines += [
        (limit.name, *([""] if before else []), "", "", joined("<- not held"))
        for limit in found.limits
        if limit.name not in shown and not limit.ok
    ]
    first = ("", "today") if before else ("",)
    return Grid("", (*first, heading, "unit", "limits"), tuple(lines), right=tuple(range(1, len(first) + 1)))


def lists(found: Evaluation, scene: Scene) -> list[str]:
    """Return one line for each part of a design that is a list of numbers."""
    told = registry.of(scene).views.lists
    return [
        f"{name}: {told[name].format(count=len(values))}, {min(values):.6g} ... {max(values):.6g}; see --json"
        for name, values in found.design.items()
        if name in told and values
    ]


def _number(value: float, size: float) -> str:
    """Return six significant digits; what is only rounding beside `size` is 0."""
    return "0" if abs(value) <= SHOWN_AS_ZERO * size else f"{value:.6g}"


def _limit(low: float | None, high: float | None) -> str:
    """Return a range as text."""
    if low is not None and low == high:
        return f"= {low:.6g}"
    if low is not None and high is not None:
        return f"{low:.6g} ... {high:.6g}"
    return f">= {low:.6g}" if low is not None else f"<= {high:.6g}" if high is not None else ""


def _relaxation(answer: Solution) -> Grid:
    """Return what would have to give way."""
    together = [joined(r.text) for r in answer.relaxation if not r.alone]
    alone = [joined(r.text) for r in answer.relaxation if r.alone]
    first = "all of these" if len(together) > 1 else "this"
    lines = [(first if place == 0 else "", text) for place, text in enumerate(together)]
    lines += [("or this alone" if lines else "this alone", text) for text in alone]
    return Grid("The least relaxation that helps", ("loosen", "limit"), tuple(lines))


def _binding(answer: Solution) -> str | Grid:
    """Return the limits that bind, each with its price."""
    if not answer.binding:
        return "No limit binds."
    lines = tuple((price.text, next(iter(price.worth)), price.reading) for price in answer.binding)
    return Grid("What binds, and what loosening it is worth", ("limit", "moves", "by"), lines)


def certificate(answer: Solution) -> list[str]:
    """Return the certificate in one line, and in a second one what chose among equally good designs."""
    found = answer.certificate
    assert found is not None
    if not found.passed:
        return ["Certificate NOT passed: " + "; ".join(found.reasons)]
    worst = max((level.stationarity for level in found.levels), default=0.0)
    limits, cycle = (f"{value:.0e}" if value > 0 else "0" for value in (found.feasibility, found.violation))
    unique = "unique" if found.unique else "not unique"
    line = f"Certificate passed: limits {limits}, stationarity {worst:.0e}, whole cycle {cycle}; {unique}"
    return [line, *([f"Chosen among equals: {'; '.join(found.settled)}"] if found.settled else [])]


BEYOND = {-1: "below", 1: "above"}


def everywhere(found: GlobalBound, scene: Scene) -> str:
    """Return what is proven of all admissible designs, in one line."""
    words = Words(scene)
    said: list[str] = []
    kept: list[str] = []
    for level in found.levels:
        name = f"|{level.objective}|" if level.sense == "least magnitude" else level.objective
        side = 1 if level.sense == "most" else -1
        among = f"of those with {' and '.join(kept)}, none" if kept else "no admissible design in these bounds"
        if level.bound == 0.0 and level.proven:
            said.append(f"{name} is 0, less than which there is none")
        elif math.isfinite(level.bound):
            said.append(f"{among} has {name} {BEYOND[side]} {words.bounded(level.objective, level.bound, side)}")
        kept.append(f"{name} at most {words.shown(level.objective, level.band, 2)} {BEYOND[-side]} the best")
    head = f"Proven best, gap {100 * found.gap:.2g} %" if found.proven else f"NOT proven best: {found.why}"
    cost = f" ({found.boxes} boxes, {found.seconds:.1f} s)" if found.boxes else ""
    return f"{head}{': ' if said else ''}{'; '.join(said)}{cost}"


def _starts(answer: Solution, scene: Scene) -> str:
    """Return how many starts found the best, and what other optima there are."""
    solver, words = answer.solver, Words(scene)
    if not solver["starts_at_best"]:
        return f"Starts: {solver['starts']}, none reached an admissible design"
    text = f"Starts: {solver['starts_at_best']} of {solver['starts']} reached the best"
    others = [
        ", ".join(
            f"{name} {value / factor(words.unit(name)):.6g} {words.unit(name)}"
            for name, value in figures.items()
            if value is not None
        )
        + f" ({count})"
        for figures, count in answer.optima[1:]
    ]
    return text + (f". Other optima: {'; '.join(others)}" if others else "")


def proofs(found: "Proofs") -> list[str | Grid]:
    """Return the parts of a proof: a sentence, and what was shown of each limit."""
    missed = dict.fromkeys(proof.limit for proof in found.proofs if proof.status != "proven")
    said = f"NOT proven: {', '.join(missed)}" if missed else "every limit holds at every crank angle"
    lines = tuple(
        (
            joined(proof.text),
            proof.status,
            f"{proof.margin:.3g}",
            f"{proof.slack:.1g}",
            str(proof.boxes),
            "" if proof.angle is None else f"{math.degrees(proof.angle):.4f}",
        )
        for proof in found.proofs
    )
    head = ("limit", "status", "margin [SI]", "up to [SI]", "boxes", "fails at [deg]")
    return [f"{found.problem}, {found.target}: {said}", Grid("", head, lines, right=(2, 3, 4, 5))]
