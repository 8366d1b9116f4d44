"""Text of an answer: a sentence, short tables, the certificate in one line."""

import math
import re
from typing import TYPE_CHECKING

from loomopt.base.quantities import shortest_text
from loomopt.base.units import factor
from loomopt.interface import answer_table
from loomopt.jobs import registry
from loomopt.physics.tolerances import SHOWN_AS_ZERO, SLACK
from loomopt.picture.table import TextTable, unbroken
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Evaluated, Solution, UnitFormatter, changed, named, remedies
from loomopt.solving.certificate.records import GlobalBound

if TYPE_CHECKING:
    from loomopt.solving.answer.solution import Proofs


HEADINGS = {"infeasible": "relaxed", "failed": "stopped"}
"""Status of an answer → what the column of its design is called, where it is no answer's."""


def solution(answer: Solution, scene: Scene) -> list[str | TextTable]:
    """Parts of a solved target: sentence, table, binding limits, certificate, time."""
    heading = HEADINGS.get(answer.status, "design")
    parts: list[str | TextTable] = [f"{answer.problem}, {answer.task_name}: {answer.outcome}"]
    explanation = answer.explanation
    if answer.relaxation:
        clash = ", ".join(unbroken(limit) for limit in answer.clash)
        parts += [f"No admissible design exists near any start. Conflicting limits: {clash}.", relaxation(answer)]
    elif answer.status == "optimal" and not answer.terms:
        parts += [] if answer.members else [registry.of(scene).say(scene, answer.target, answer.figures)]
    else:
        parts.append(answer.message)
        explanation = ""  # the message ends with it
    parts += [text for text in (explanation, UnitFormatter(scene).worse(answer.worse)) if text]
    parts += [answer_table.text(answer, scene, answer.today, heading)] if answer.design else []
    parts += lists(answer, scene)
    parts += [members(answer, scene)] if answer.members else []
    if answer.certificate:
        parts += [*([] if answer.members else [design_text(answer, scene)]), binding(answer)]
        parts += certificate(answer)
    parts += proof_summary(answer.proofs) if answer.proofs else []
    if answer.global_bound:
        parts.append(global_summary(answer.global_bound, scene))
    if answer.solver.get("starts", 1) > 1:
        parts.append(starts(answer, scene))
    time = answer.time
    parts.append(
        f"Time: {time['total_s']:.3f} s (import {time['import_s']:.3f}, build {time['build_s']:.3f}, "
        f"solve {time['solve_s']:.3f}, certify {time['certify_s']:.3f})"
    )
    return parts


def evaluation(evaluated: Evaluated, scene: Scene, before: Evaluated | None) -> list[str | TextTable]:
    """Parts of an evaluated design; before: today's machine, where the design is another."""
    broken = ", ".join(limit.name for limit in evaluated.limits if not limit.ok and not limit.rounding)
    rounded = ", ".join(limit.name for limit in evaluated.limits if limit.rounding)
    verdict = f"NOT admissible: {broken}" if broken else "all limits held"
    if rounded:
        verdict += f"{';' if broken else ','} but for the rounding of the digits given: {rounded}"
    table = answer_table.text(evaluated, scene, before, "design" if before else "today")
    return [f"{evaluated.problem}: {verdict}", table, *lists(evaluated, scene)]


def lists(evaluated: Evaluated, scene: Scene) -> list[str]:
    """A line for each part of a design that is a list of numbers."""
    formats = registry.of(scene).views.lists
    return [
        f"{name}: {formats[name].format(count=len(values))}, {min(values):.6g} ... {max(values):.6g}; all in design"
        for name, values in evaluated.design.items()
        if name in formats and values
    ]


def members(solution: Solution, scene: Scene) -> TextTable:
    """Members of a family: the scene numbers that each one changes, and its objectives."""
    formatter, levels = UnitFormatter(scene), solution.certificate.levels if solution.certificate else ()
    variables = [name for name in solution.members[0].design if name not in solution.design]
    # A sum of what members reach is named after their figure.
    objective_names = {word.strip("|") for level in levels for word in level.objective.split()}
    names = [*variables, *(name for name in solution.members[0].figures if name in objective_names)]
    sizes = {name: factor(formatter.unit(name)) for name in names}
    values = [{name: {**member.design, **member.figures}[name] or 0.0 for name in names} for member in solution.members]
    least = {
        name: SHOWN_AS_ZERO * max(abs(row[other]) for row in values for other in names if sizes[other] == sizes[name])
        for name in names
    }
    lines = []
    for place, (member, row) in enumerate(zip(solution.members, values, strict=True)):
        cells = [f"{row[name] / sizes[name] if abs(row[name]) > least[name] else 0.0:.6g}" for name in names]
        missed = ", ".join(name for name, reached in member.reached.items() if not reached)
        lines.append((str(place + 1), unbroken(changed(member)), *cells, f"{missed} not" if missed else ""))
    units = ["" if formatter.unit(name) == "1" else f" [{formatter.unit(name)}]" for name in names]
    head = ("member", "change", *(f"{name}{unit}" for name, unit in zip(names, units, strict=True)), "reached")
    return TextTable("Members", head, tuple(lines), right=tuple(range(2, 2 + len(names))))


def design_text(evaluated: Evaluated, scene: Scene) -> str:
    """A design to type again, with the digits it takes to be the same: a JSON object, text with units."""
    formatter, texts = UnitFormatter(scene), []
    for name, value in evaluated.design.items():
        if name not in scene.schema.lists:
            text, unit = shortest_text(value, formatter.unit(name), formatter.kind(name)), formatter.unit(name)
            texts.append(unbroken(f'"{name}": {text}' if unit == "1" else f'"{name}": "{text}"'))
    return f"to retype: {{{', '.join(texts)}}}"


def relaxation(answer: Solution) -> TextTable:
    """Least relaxations of limits for which an admissible design exists."""
    lines: list[tuple[str, str]] = []
    for remedy in remedies(answer.relaxation):
        label = "this alone" if remedy[0].alone else "all of these" if len(remedy) > 1 else "this"
        heads = [f"or {label}" if lines else label, *([""] * (len(remedy) - 1))]
        lines += [(head, unbroken(step.text)) for head, step in zip(heads, remedy, strict=True)]
    return TextTable("The least relaxation that helps", ("loosen", "limit"), tuple(lines))


def binding(answer: Solution) -> str | TextTable:
    """Limits that bind, each with its price, then those that are worth more together."""
    if not answer.binding:
        return "No limit binds except the sizes." if answer.rounded else "No limit binds."
    lines = tuple((price.text, next(iter(price.worth)), price.reading) for price in answer.binding)
    lines += tuple((f"{named(price.limits)} together", price.figure, price.reading) for price in answer.bind_together)
    return TextTable("Binding limits and their prices", ("limit", "moves", "by"), lines)


def certificate(answer: Solution) -> list[str]:
    """Certificate in one line; a second line for the choice among equally good designs."""
    record = answer.certificate
    assert record is not None
    if not record.passed:
        return ["Certificate NOT passed: " + "; ".join(record.reasons)]
    worst = max((level.stationarity for level in record.levels), default=0.0)
    limits, cycle = (f"{value:.0e}" if value > 0 else "0" for value in (record.feasibility, record.violation))
    unique = "unique" if record.unique else "not unique"
    if not record.prices_unique:
        unique = "prices not unique" if record.unique else "neither design nor prices unique"
    line = f"Certificate passed: limits {limits}, stationarity {worst:.0e}, whole cycle {cycle}; {unique}"
    return [
        line,
        *([f"Chosen among equals: {'; '.join(record.choices)}"] if record.choices else []),
    ]


COMPARED = re.compile("[<>=]")
"""Pattern of a limit that is a comparison and not a sentence."""
BEYOND = {-1: "below", 1: "above"}


def global_summary(bound: GlobalBound, scene: Scene) -> str:
    """Global bound of all admissible designs, in one line."""
    formatter = UnitFormatter(scene)
    sentences: list[str] = []
    remarks: list[str] = []
    for level in bound.levels:
        name = f"|{level.objective}|" if level.sense == "least magnitude" else level.objective
        side = 1 if level.sense == "most" else -1
        among = f"of those with {' and '.join(remarks)}, none" if remarks else "no admissible design in these bounds"
        if level.bound == 0.0 and level.proven:
            sentences.append(f"{name} is 0, and no magnitude is less")
        elif math.isfinite(level.bound):
            sentences.append(
                f"{among} has {name} {BEYOND[side]} {formatter.outward(level.objective, level.bound, side)}"
            )
        remarks.append(f"{name} at most {formatter.shown(level.objective, level.band, 2)} {BEYOND[-side]} the best")
    head = f"Proven best, gap {100 * bound.gap:.2g} %" if bound.proven else f"NOT proven best: {bound.why}"
    cost = f" ({bound.boxes} boxes, {bound.seconds:.1f} s)" if bound.boxes else ""
    return f"{head}{': ' if sentences else ''}{'; '.join(sentences)}{cost}"


def starts(answer: Solution, scene: Scene) -> str:
    """Number of starts that reached the best optimum, and the other optima."""
    solver, words = answer.solver, UnitFormatter(scene)
    if not solver["starts_at_best"]:
        return f"Starts: {solver['starts']}, none reached an admissible design"
    text = f"Starts: {solver['starts_at_best']} of {solver['starts']} reached the best"
    others = [
        ", ".join(f"{name} {words.shown(name, value)}" for name, value in figures.items() if value is not None)
        + f" ({count})"
        for figures, count in answer.optima[1:]
    ]
    return text + (f". Other optima: {'; '.join(others)}" if others else "")


def proof_summary(proofs: "Proofs") -> list[str]:
    """Proven limits and unproven limits, in a few lines."""
    groups = {"limit": "limits", "assembly": "assembly", "peak": "peaks as claimed"}
    shown = {
        label: [unbroken(proof.summary) for proof in proofs.proofs if proof.kind == kind and proof.status == "proven"]
        for kind, label in groups.items()
    }
    missed = [unbroken(f"{proof.text} ({proof.status})") for proof in proofs.proofs if proof.status != "proven"]
    boxes = sum(proof.boxes for proof in proofs.proofs)
    head = f"Proven at every crank angle, up to {SLACK:.0e} of each quantity's largest magnitude, in {boxes} boxes:"
    lines = [f"    {kind}: {', '.join(texts)}" for kind, texts in shown.items() if texts]
    summary = ["\n".join([head, *lines])] * bool(lines) + ([f"NOT proven: {', '.join(missed)}"] if missed else [])
    return summary + [f"Not covered: {text}." for text in proofs.uncovered]


def proofs(proofs: "Proofs") -> list[str | TextTable]:
    """Parts of a proof: a sentence, and the results by limit."""
    formatter, angle, lines = UnitFormatter(proofs.scene), proofs.scene.shown_in("angle"), []
    for proof in proofs.proofs:
        unit = formatter.unit(proof.name)
        sizes = (f"{proof.margin / factor(unit) + 0.0:.3g}", f"{proof.slack / factor(unit):.1g}")
        place = "" if proof.angle is None else f"{proof.angle / factor(angle):.4f}"
        text = unbroken(proof.text) if COMPARED.search(proof.text) else proof.text
        lines.append((text, proof.status, *sizes, unit, str(proof.boxes), place))
    head = ("limit", "status", "margin", "up to", "unit", "boxes", f"fails at [{angle}]")
    table = TextTable("", head, tuple(lines), right=(2, 3, 5, 6), first=(0, 1, 2, 4, 6), more="--json")
    open_ = [
        f"{unbroken(proof.summary)} is left open from crank angle {proof.open / factor(angle):.4g} {angle} on, "
        f"after {proof.boxes} boxes."
        for proof in proofs.proofs
        if proof.open is not None
    ]
    uncovered = (f"Not covered: {text}." for text in proofs.uncovered)
    return [f"{proofs.problem}, {proofs.target}: {proofs.summary}", table, *open_, *uncovered]
