"""Parts of a page on a design: status first, then machine, binding limits, certificate, curves."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

from loomopt.base.records import lazy
from loomopt.interface import answer_table, forces, tables
from loomopt.interface.files import outputs, svg
from loomopt.interface.report import charts, machine, mathml
from loomopt.interface.report.markup import Block, Markup, Part
from loomopt.interface.text import answers, scenes
from loomopt.jobs import registry
from loomopt.model.program import shortfall
from loomopt.physics.tolerances import FEASIBLE, STATIONARY
from loomopt.picture.table import TextTable
from loomopt.scenes import family as family_table
from loomopt.scenes.designs import flat
from loomopt.scenes.scene import Scene, cached
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Evaluated, Solution, UnitFormatter, changed
from loomopt.solving.certificate.certificate import COMPLEMENTARY


class Status(NamedTuple):
    """Verdict on a design: level is "ok", "open" or "bad"; verdict in a few words; sentences: details.

    exit: the status that a command ends with.
    """

    level: str
    verdict: str
    sentences: tuple[str, ...] = ()
    exit: int = 0


@dataclass(frozen=True)
class Subject:
    """Design to report on, in its scene; doubts: contradictions in its file, empty for a design just computed.

    target: target whose limits are checked; task_name: target, or a summary of the task.
    """

    evaluated: Evaluated
    scene: Scene
    target: str = ""
    task_name: str = ""
    doubts: tuple[str, ...] = ()

    @property
    def heading(self) -> str:
        """Problem and objectives."""
        return ", ".join(word for word in (self.evaluated.problem, self.task_name) if word)

    @lazy
    def before(self) -> Evaluated | None:
        """Today's machine; None where the design is that."""
        if isinstance(self.evaluated, Solution):
            return self.evaluated.today
        now = registry.of(self.scene).today(self.scene)
        is_now = flat(self.evaluated.design).items() <= now.items()
        return None if is_now else report.evaluate(self.scene, None, self.target or None)


NOT_CERTIFIED = 4
EXIT = {"infeasible": 3, "interrupted": 130}
"""Status of a solve → exit status, except `NOT_CERTIFIED`."""
VERDICTS = {
    "infeasible": "NO ADMISSIBLE DESIGN EXISTS near any start",
    "uncertified": "NOT CERTIFIED",
    "failed": "FAILED: no design was found",
    "interrupted": "INTERRUPTED: not solved to its end",
}
"""Status of a solve without an optimum → first line of the page."""


def status(subject: Subject) -> Status:
    """Verdict on a design, from its checks and not from the solver's status."""
    evaluated = subject.evaluated
    broken = tuple(limit.name for limit in evaluated.limits if not limit.ok and not limit.rounding)
    violations = (f"Limits NOT held: {', '.join(broken)}.",) if broken else ()
    if subject.doubts:
        return Status(
            "bad", "NOT CONFIRMED: the file contradicts itself", (*subject.doubts, *violations), NOT_CERTIFIED
        )
    if not isinstance(evaluated, Solution):
        verdict = "NOT ADMISSIBLE" if broken else "All limits held"
        return Status("bad" if broken else "open", f"{verdict}; evaluated, nothing was optimised", violations)
    if evaluated.status != "optimal":
        sentences = (evaluated.message, UnitFormatter(subject.scene).worse(evaluated.worse), *violations)
        verdict = VERDICTS.get(evaluated.status, evaluated.status.upper())
        return Status(
            "bad",
            verdict,
            tuple(sentence for sentence in sentences if sentence),
            EXIT.get(evaluated.status, NOT_CERTIFIED),
        )
    if evaluated.certificate is None or not evaluated.certificate.passed or broken:
        reasons = evaluated.certificate.reasons if evaluated.certificate else ("there is no certificate",)
        return Status("bad", "NOT CERTIFIED", (*(f"{reason}." for reason in reasons), *violations), NOT_CERTIFIED)
    return _certified_status(evaluated, subject.scene)


def _certified_status(solution: Solution, scene: Scene) -> Status:
    """Verdict on a certified optimum, and the requested proofs that failed."""
    opened, proofs = list[str](), list[str]()
    missed = shortfall(solution.reached)
    if missed:
        opened.append(missed)
    if solution.proofs and not solution.proofs.passed:
        opened.append("NOT PROVEN at every crank angle")
    if solution.global_bound:
        opened += [] if solution.global_bound.proven else ["NOT PROVEN best of all admissible designs"]
        proofs.append(answers.global_summary(solution.global_bound, scene) + ".")
    else:
        proofs.append("No admissible design nearby is better; global optimality was not checked (--global).")
    verdict_text = (
        solution.message
        if solution.terms or not solution.target
        else registry.of(scene).say(scene, solution.target, solution.figures)
    )
    proofs += [worse] if (worse := UnitFormatter(scene).worse(solution.worse)) else []
    verdict = "; ".join(["Optimal and certified", *opened])
    unproven = solution.global_bound is not None and not solution.global_bound.proven
    return Status("open" if opened else "ok", verdict, (verdict_text, *proofs), NOT_CERTIFIED if unproven else 0)


def parts(subject: Subject) -> list[Part]:
    """Parts of a design's page, in order, without empty ones; a family has no parts of one machine."""
    made = [make for make in PARTS if make not in ONE_MACHINE] if subject.evaluated.members else PARTS
    return [part for make in made for part in make(subject)]


def members(family: Subject) -> list[tuple[str, Status, list[Part]]]:
    """Heading, status and parts of the members of a family, which the whole family does not have."""
    whole, chapters = status(family), list[tuple[str, Status, list[Part]]]()
    for place, member in enumerate(family.evaluated.members, 1):
        assert member.scene is not None
        subject = Subject(member, member.scene, family_table.of_target(family.scene))
        broken = [limit.name for limit in member.limits if not limit.ok and not limit.rounding]
        verdict = f"Limits NOT held: {', '.join(broken)}" if broken else f"Member {place}: all limits held"
        member_status = Status("bad" if broken else whole.level, verdict, (f"Of the family: {whole.verdict}.",))
        shown = [part for make in (_comparison, *ONE_MACHINE) for part in make(subject)]
        chapters.append((f"{family.heading}, member {place}: {changed(member)}", member_status, shown))
    return chapters


def _comparison(subject: Subject) -> Iterator[Part]:
    evaluated, scene, before = subject.evaluated, subject.scene, subject.before
    heading = "nearest" if isinstance(evaluated, Solution) and evaluated.relaxation else "design" if before else "today"
    blocks: list[Block] = [answer_table.text(evaluated, scene, before, heading), *answers.lists(evaluated, scene)]
    yield Part("Today against the design" if before else "Today's machine", tuple(blocks))


def _moving(subject: Subject) -> Iterator[Part]:
    moving = machine.part(subject.scene, subject.evaluated.design)
    if moving:
        yield moving


def _clash(subject: Subject) -> Iterator[Part]:
    solution = subject.evaluated
    if isinstance(solution, Solution) and solution.relaxation:
        conflict = f"No design satisfies {', '.join(solution.clash)} together."
        clash = f"{conflict} The design below is the nearest one; it is not admissible."
        yield Part("Conflicting limits", (clash, answers.relaxation(solution)))


def _binding(subject: Subject) -> Iterator[Part]:
    if isinstance(subject.evaluated, Solution) and subject.evaluated.certificate:
        caption = "A price is the change of the optimum for each unit by which a limit is loosened."
        bound = answers.binding(subject.evaluated)
        shown = (bound,) if isinstance(bound, str) else (caption, replace(bound, title=""))
        yield Part("Binding limits and their prices", shown)


def _certificate(subject: Subject) -> Iterator[Part]:
    """The certificate: each requirement with its residual."""
    certificate = subject.evaluated.certificate if isinstance(subject.evaluated, Solution) else None
    if certificate is None:
        return
    lines = [
        ("excess of the limits, relative to their scales", f"{certificate.feasibility:.1e}", f"{FEASIBLE:.0e}"),
        (
            f"excess between the points of the cycle, {certificate.whole_cycle}",
            f"{certificate.violation:.1e}",
            "the accuracy",
        ),
    ]
    for place, level in enumerate((*certificate.levels, *([certificate.change] if certificate.change else [])), 1):
        lines += [
            (
                f"{place}. {level.objective}: stationarity",
                f"{level.stationarity:.1e}",
                f"{STATIONARY:.0e}",
            ),
            (
                f"{place}. {level.objective}: complementarity",
                f"{level.complementarity:.1e}",
                f"{COMPLEMENTARY:.0e}",
            ),
        ]
    head = "Passed" if certificate.passed else "NOT PASSED"
    curved = "the curvature is that of a minimum" if certificate.minimum else "the curvature is NOT that of a minimum"
    unique = "the only optimum nearby" if certificate.unique else "not the only optimum: others are as good"
    if not certificate.prices_unique:
        unique += "; prices are not unique, because some limits bind only together"
    blocks: list[Block] = [
        f"{head}. It is computed without the solver, by {certificate.by}: {curved}, and the design is {unique}.",
        TextTable("", ("requirement", "residual", "at most"), tuple(lines), right=(1, 2)),
        *(f"Reason: {reason}." for reason in certificate.reasons),
    ]
    blocks += [f"Chosen among equals: {'; '.join(certificate.choices)}."] if certificate.choices else []
    yield Part("The certificate", tuple(blocks))


def _proofs(subject: Subject) -> Iterator[Part]:
    proofs = subject.evaluated.proofs if isinstance(subject.evaluated, Solution) else None
    if proofs:
        yield Part("Proof at every crank angle", tuple(answers.proofs(proofs)))


def _curves(subject: Subject) -> Iterator[Part]:
    scene, design = subject.scene, flat(subject.evaluated.design)
    shown = outputs.curve_charts(tables.curves(scene, design), scene, design, sparse=True)
    yield Part("Curves over the turn", tuple(charts.blocks(shown)))


def _forces(subject: Subject) -> Iterator[Part]:
    """Forces in joints, if an active effect computes them."""
    scene, design = subject.scene, flat(subject.evaluated.design)
    if forces.tells(scene):
        yield from forces.from_curves(scene, tables.curves(scene, design), design).report_parts()


def _members(subject: Subject) -> Iterator[Part]:
    if isinstance(subject.evaluated, Solution) and subject.evaluated.members:
        yield Part("Members", (replace(answers.members(subject.evaluated, subject.scene), title=""),))


def _remarks(subject: Subject) -> Iterator[Part]:
    remarks = registry.of(subject.scene).views.remarks(subject.scene, flat(subject.evaluated.design))
    if remarks:
        yield Part("Remarks", tuple(f"{remark}." for remark in remarks))


def _sketch(subject: Subject) -> Iterator[Part]:
    """Drawing of the mechanism at scale, if the scene has all numbers that it needs."""
    from loomopt.interface.text import notebook

    if not registry.of(subject.scene).views.missing(subject.scene):
        drawn = notebook.sketch(subject.scene, subject.evaluated.design, outputs.describe_design(subject.evaluated))
        picture = drawn.on_page.replace(f' xmlns="{svg.NAMESPACE}"', "")  # which a page does not need
        yield Part("Dimensions", (Markup(f'<div class="sheet">{picture}</div>'),))


def _scene(subject: Subject) -> Iterator[Part]:
    """The scene as read, the sources of its numbers, and its equations."""
    shown = scenes.parts(subject.scene)
    yield Part("The scene", tuple(shown))
    scene = subject.scene
    written = cached(scene, "equations", lambda: mathml.page(registry.of(scene).views.equations(scene)))
    yield Part("Equations of this scene", (Markup(written),))


def _search(subject: Subject) -> Iterator[Part]:
    solution = subject.evaluated
    if isinstance(solution, Solution) and solution.time:
        time = solution.time
        sentences = [answers.starts(solution, subject.scene)] if solution.solver.get("starts", 1) > 1 else []
        sentences.append(
            f"IPOPT said {solution.solver.get('status', 'nothing')}; {time.get('total_s', 0.0):.3f} s in total."
        )
        sentences.append(answers.design_text(solution, subject.scene))
        yield Part("Solution method", tuple(sentences))


PARTS: tuple[Callable[[Subject], Iterator[Part]], ...] = (
    _clash,
    _moving,
    _comparison,
    _members,
    _binding,
    _certificate,
    _proofs,
    _curves,
    _forces,
    _remarks,
    _sketch,
    _search,
    _scene,
)
"""Parts of a page on a design, in order."""
ONE_MACHINE = (_moving, _curves, _forces, _remarks, _sketch)
"""Parts on a single machine; a family has them for each of its members."""
