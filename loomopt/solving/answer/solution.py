"""Data of a solve or an evaluation, ready for JSON."""

import contextlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, Protocol

from loomopt.base.errors import BadInput, refusal
from loomopt.base.quantities import quantities_of, quantity_of
from loomopt.base.records import Shown, freeze, lazy
from loomopt.base.units import SI_UNIT, factor, show
from loomopt.model.limits import CycleLimit, Limit
from loomopt.model.program import Alias, shortfall
from loomopt.physics.effects.kinds import label
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.scenes.document import copied
from loomopt.scenes.scene import Scene
from loomopt.scenes.tables import FAMILY
from loomopt.solving.certificate.records import Binding, Certificate, GlobalBound, JointBinding, worth_of


class Proof(NamedTuple):
    """Evidence on one limit, SI.

    name: of the limit, or of the figure whose claimed peak it is. margin: distance of the refined value from
    the limit, negative if it exceeds it; slack: permitted violation; boxes: number of boxes; angle: the crank angle,
    rad, of that value if the limit fails; unit: SI, of margin and slack; open: the crank angle, rad, from which on
    an undecided one is left open.
    """

    name: str
    text: str
    status: str
    margin: float
    slack: float
    boxes: int
    angle: float | None = None
    kind: Literal["limit", "assembly", "peak"] = "limit"
    unit: str = "1"
    open: float | None = None

    @property
    def limit(self) -> str:
        """Name in JSON data."""
        return f"peak {self.name}" if self.kind == "peak" else self.name

    @property
    def summary(self) -> str:
        """Name of the limit or of the peak, for people."""
        return self.name if self.kind == "peak" else self.text

    def as_dict(self) -> dict[str, Any]:
        """The record as JSON data."""
        return {"limit": self.limit} | {
            key: value for key, value in self._asdict().items() if key not in ("name", "kind")
        }


@dataclass(frozen=True, repr=False)
class Proofs(Shown):
    """All proofs of one design, a table in Jupyter."""

    problem: str
    target: str
    proofs: tuple[Proof, ...]
    scene: Scene = field(compare=False)
    uncovered: tuple[str, ...] = ()
    """Assumptions that the proofs do not cover, each a sentence without its full stop."""

    @property
    def passed(self) -> bool:
        """Whether everything is proven."""
        return all(proof.status == "proven" for proof in self.proofs)

    @property
    def summary(self) -> str:
        """Summary in one sentence."""
        missed = dict.fromkeys(proof.limit for proof in self.proofs if proof.status != "proven")
        return f"NOT proven: {', '.join(missed)}" if missed else "every limit holds at every crank angle"

    def __repr__(self) -> str:
        return f"<Proofs {self.problem}, {self.target}: {self.summary}>"

    def as_dict(self) -> dict[str, Any]:
        """Object that `prove --json` prints."""
        proofs = [proof.as_dict() for proof in self.proofs]
        data = {"problem": self.problem, "target": self.target, "proofs": proofs}
        return data | ({"uncovered": list(self.uncovered)} if self.uncovered else {})


ADVICE = {
    "Solve_Succeeded": "IPOPT converged.",
    "Solved_To_Acceptable_Level": "IPOPT stopped at a looser tolerance; try more starts, such as 20.",
    "Infeasible_Problem_Detected": "IPOPT found no point that keeps all limits; loosen one of them.",
    "Restoration_Failed": "IPOPT could not get back to admissible designs; try more starts, such as 20.",
    "Maximum_Iterations_Exceeded": "IPOPT ran out of iterations; try more starts, such as 20.",
    "Search_Direction_Becomes_Too_Small": "IPOPT could not improve further; try more starts, such as 20.",
    "Diverging_Iterates": "The objective falls without end; bound every variable.",
    "Invalid_Number_Detected": "A design on the way did not assemble; narrow the bounds of the lengths.",
    "Not_Enough_Degrees_Of_Freedom": "More is fixed than the design can follow; free a dimension.",
    "Not_Assembled": "The start does not assemble; narrow the bounds of the lengths.",
}
"""What each of IPOPT's statuses means to a designer."""


class Finding(NamedTuple):
    """Limit with the value of its figure, SI; min or max is None if the limit does not have this side.

    rounding: whether the excess is less than the rounding of the digits in which the design was given.
    backed_off: required margin of a nominal design, SI.
    """

    name: str
    value: float
    min: float | None
    max: float | None
    ok: bool
    rounding: bool = False
    backed_off: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """The record as JSON data; rounding and back-off only if they are not zero."""
        return {
            name: value for name, value in self._asdict().items() if value or name not in ("rounding", "backed_off")
        }


class Price(NamedTuple):
    """Binding limit; worth: objective figure → its decrease per unit by which the limit is loosened, SI.

    backed_off: margin at which it binds, SI.
    """

    limit: str
    side: str
    value: float
    text: str
    worth: Mapping[str, float]
    unit: Mapping[str, str]
    reading: str
    """The worth in the designer's own units, as a phrase."""
    backed_off: float = 0.0

    def as_dict(self) -> dict[str, Any]:
        """The record as JSON data; backed_off only where it is not zero."""
        data = {k: (dict(v) if isinstance(v, Mapping) else v) for k, v in self._asdict().items() if k != "reading"}
        return {k: v for k, v in data.items() if v or k != "backed_off"}


class JointPrice(NamedTuple):
    """Limits whose joint price is more than the sum of their single prices.

    worth: objective figure → its decrease, SI, if each limit is loosened by one SI unit; alone: price of each single
    limit; reading: both in the units of the scene, as a phrase.
    """

    limits: tuple[str, ...]
    sides: tuple[str, ...]
    worth: Mapping[str, float]
    unit: Mapping[str, str]
    alone: tuple[float, ...]
    reading: str

    @property
    def figure(self) -> str:
        """Figure of the price."""
        return next(iter(self.worth))

    @property
    def text(self) -> str:
        """The price as a phrase: "left and right together: 0.2 N*m per mm; each alone: 0"."""
        return f"{named(self.limits)} together: {self.reading}"

    def as_dict(self) -> dict[str, Any]:
        """The record as JSON data."""
        alone = [{self.figure: worth} for worth in self.alone]
        data = {"limits": list(self.limits), "sides": list(self.sides), "worth": dict(self.worth)}
        return data | {"unit": dict(self.unit), "alone": alone, "text": self.text, "reading": self.reading}


def named(names: Sequence[str]) -> str:
    """Names as a list in a sentence: "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


class Relaxation(NamedTuple):
    """Amount by which a limit must be loosened to make a design possible, SI.

    alone: whether this one relaxation is sufficient; in_proportion: whether it is not much larger than the limit.
    """

    limit: str
    side: str
    value: float
    needed: float
    alone: bool
    text: str
    in_proportion: bool = True


def remedies(relaxations: Sequence[Relaxation]) -> list[tuple[Relaxation, ...]]:
    """Remedies: relaxations that are needed together, or a single one; those out of proportion come last."""
    together = tuple(relaxation for relaxation in relaxations if not relaxation.alone)
    groups = [together] if together else []
    groups += [(relaxation,) for relaxation in relaxations if relaxation.alone]
    return sorted(groups, key=lambda remedy: not all(relaxation.in_proportion for relaxation in remedy))


@dataclass(frozen=True)
class Clash:
    """Conflict of limits: the relaxations that help, and the design that they give (SI).

    limits: conflicting limits by phrase, with their names.
    """

    limits: Mapping[str, str] = field(default_factory=dict)
    relaxations: tuple[Relaxation, ...] = ()
    x: Mapping[str, float] = field(default_factory=dict)


class Terms(Protocol):
    """Limits and objectives of a design that differ from those of a target, such as those of a front."""

    @property
    def summary(self) -> str:
        """Objectives in a few words."""

    @property
    def axes(self) -> Sequence[str]:
        """Figures of the objectives."""

    def evaluation(self, design: Mapping[str, float]) -> "Evaluated":
        """Figures and limits of a design, SI."""

    def proofs(self, design: Mapping[str, float], slack: float) -> "Proofs":
        """Proofs of its limits. Raises BadInput."""


@dataclass(frozen=True)
class Evaluated:
    """Evaluated design: its figures and limits, SI and rad."""

    problem: str
    effects: tuple[str, ...]
    design: Mapping[str, Any]
    figures: Mapping[str, float | None]
    units: Mapping[str, str]
    limits: tuple[Finding, ...]
    reached: Mapping[str, bool] = field(default_factory=dict, kw_only=True)
    """Whether the design reaches each goal of the target, by figure."""
    undefined: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    """Why figures of effects that are on have no value, each a sentence without its full stop."""
    scene: "Scene | None" = field(default=None, kw_only=True, repr=False, compare=False)
    """The scene of the request, with all numbers set, and effects switched on and off."""
    terms: Terms | None = field(default=None, kw_only=True, repr=False, compare=False)
    """Terms of its judgement; None for its target alone."""
    members: tuple["Evaluated", ...] = field(default=(), kw_only=True, repr=False)
    """Machines of a family."""
    change: Mapping[str, Any] = field(default_factory=dict, kw_only=True, repr=False)
    """Changes of the scene by a member of a family: dotted key → value."""

    def __post_init__(self) -> None:
        """Freeze the mappings of the record."""
        freeze(self, "design", "figures", "units", "reached", "undefined")

    @property
    def admissible(self) -> bool:
        """Whether every limit holds."""
        return all(limit.ok for limit in self.limits)

    def as_dict(self, target: str = "") -> dict[str, Any]:
        """Object that `evaluate --json` prints; target: target whose tables are listed."""
        data = {
            "problem": self.problem,
            "effects": list(self.effects),
            "design": dict(self.design),
            "figures": {name: _finite(value) for name, value in self.figures.items()},
            "units": dict(self.units),
            "limits": [limit.as_dict() for limit in self.limits],
            "reached": dict(self.reached),
        }
        data |= {"undefined": dict(self.undefined)} if self.undefined else {}
        tables = _tables(self.scene, target) if self.scene and not self.members else []
        data |= {"tables": tables} if tables else {}
        return data | (
            {"members": [_member_dict(member, self.scene) for member in self.members]} if self.members else {}
        )


def _tables(scene: Scene, target: str) -> list[dict[str, object]]:
    """Precision and misfit of each table that was read, as JSON data; missing tables are left out."""
    from loomopt.jobs import registry

    with contextlib.suppress(BadInput):
        return [record.as_dict() for record in registry.of(scene).tables(scene, target)]
    return []


def changed(member: Evaluated) -> str:
    """Changes of the scene by a member of a family, in words: "M0 600 N*m"."""
    return ", ".join(f"{key.split('.', 1)[-1]} {value}" for key, value in member.change.items())


def demand_single(evaluation: Evaluated, data: str) -> None:
    """Raise BadInput for a family, whose members have separate results; data: the requested data."""
    if evaluation.members:
        origin = evaluation.scene.origin if evaluation.scene else ""
        remedy = "Take one member: answer.members[0], or its numbers set and its own target"
        raise refusal(f"a family has no {data}: each of its members has", origin, "target", FAMILY, remedy=remedy)


def _member_dict(member: Evaluated, whole: Scene | None) -> dict[str, Any]:
    """Member of a family as JSON data, with its changes of the scene; whole: scene of the family."""
    from loomopt.scenes import family

    target = family.of_target(whole) if whole else ""
    data = {key: value for key, value in member.as_dict(target).items() if key not in ("problem", "effects", "units")}
    return {"change": dict(member.change), **data}


class Alternative(NamedTuple):
    """Other design with more or less added mass, whose figures differ little from those of the answer.

    added: name of the mass; share: largest difference that counts as little; chosen: whether the answer has less mass.
    """

    added: str
    share: float
    chosen: bool
    other: Evaluated

    def changes(self, answer: "Solution") -> dict[str, float]:
        """Change of each objective in the other design, SI."""
        levels = answer.certificate.levels if answer.certificate else ()
        names = dict.fromkeys(level.objective for level in levels if level.objective != self.added)
        pairs = {name: (self.other.figures.get(name), answer.figures.get(name)) for name in names}
        return {name: then - now for name, (then, now) in pairs.items() if then is not None and now is not None}

    def as_dict(self, answer: "Solution") -> dict[str, Any]:
        """The record as JSON data."""
        alternative = self.other.as_dict()
        data = {"added": self.added, "share": self.share, "chosen": self.chosen, "changes": self.changes(answer)}
        return data | {"design": alternative["design"], "figures": alternative["figures"]}


class Worse(NamedTuple):
    """Figure that is not optimised and is worse than that of today's machine, SI."""

    figure: str
    today: float
    design: float

    @property
    def share(self) -> float | None:
        """Change as a share of today's value; None where that is zero."""
        return (self.design - self.today) / abs(self.today) if self.today else None

    def as_dict(self) -> dict[str, Any]:
        """The record as JSON data."""
        return {**self._asdict(), "share": self.share}


class Yield(NamedTuple):
    """Share of machines that satisfy a limit or all limits, with its standard error."""

    value: float
    se: float


class Robust(NamedTuple):
    """Back-off of limits, so that manufactured machines satisfy them.

    sigmas: standard deviations of its own figure by which each keeps clear; requested_yield: the requested yield, if
    any; linear: standard deviations for it by the joint normal distribution, with which sampling begins; yields: share
    of machines that satisfy each limit, and all; nominal, nominal_yields: the optimum without back-off, and its
    machines; exempt: equalities and goals, which nothing backs off; corners: figures that bend at the design, of whose
    two slopes in each number the steeper was taken; passes: solves until standard deviations were those of the design;
    shifted: whether bands are not even, so that back-off counts from the mean machine.
    """

    sigmas: float
    requested_yield: float | None
    linear: float | None
    yields: Mapping[str, Yield]
    nominal: Evaluated
    nominal_yields: Mapping[str, Yield]
    exempt: tuple[str, ...]
    corners: tuple[str, ...]
    passes: int
    samples: int
    seed: int
    shifted: bool = False

    def cost(self, answer: "Solution") -> dict[str, float]:
        """Rise of each objective, SI."""
        return risen(answer, self.nominal)

    def as_dict(self, answer: "Solution") -> dict[str, Any]:
        """The record as JSON data."""
        nominal = self.nominal.as_dict()
        return {
            "sigmas": self.sigmas,
            "asked": self.requested_yield,
            "linear_sigmas": self.linear,
            "cost": self.cost(answer),
            "kept": list(self.exempt),
            "corners": list(self.corners),
            "nominal": {
                "design": nominal["design"],
                "figures": nominal["figures"],
                "yield": {name: share._asdict() for name, share in self.nominal_yields.items()},
            },
            "passes": self.passes,
            "samples": self.samples,
            "seed": self.seed,
        }


class Rounded(NamedTuple):
    """Rounding of numbers to sizes that can be ordered.

    sizes: least and largest of each number's sizes, SI, and how many; points: of the lattice; admissible: those that
    keep every limit, reaching: those of them that reach the goals, where all were looked at; boxes: solves of a branch
    and bound, 0 where all were; gap: what the boxes left open may still be better by, in units of the scale of the
    first level that they differ in; nominal: the optimum without sizes; rests: what the claim that nothing on the
    lattice is better rests on.
    """

    sizes: Mapping[str, tuple[float, float, int]]
    points: int
    admissible: int | None
    reaching: int | None
    boxes: int
    gap: float
    nominal: Evaluated
    rests: str

    def cost(self, answer: "Solution") -> dict[str, float]:
        """Rise of each objective, SI."""
        return risen(answer, self.nominal)

    def as_dict(self, answer: "Solution") -> dict[str, Any]:
        """The record as JSON data."""
        nominal = self.nominal.as_dict()
        sizes = {name: {"least": low, "most": high, "count": n} for name, (low, high, n) in self.sizes.items()}
        data = {"sizes": sizes, "points": self.points, "admissible": self.admissible, "reaching": self.reaching}
        data |= {"boxes": self.boxes, "gap": _finite(self.gap), "rests": self.rests, "cost": self.cost(answer)}
        return data | {"nominal": {"design": nominal["design"], "figures": nominal["figures"]}}


def risen(answer: "Solution", nominal: Evaluated) -> dict[str, float]:
    """Increase of each objective of an answer over that of another design, SI."""
    levels = answer.certificate.levels if answer.certificate else ()
    pairs = {
        level.objective: (answer.figures.get(level.objective), nominal.figures.get(level.objective)) for level in levels
    }
    return {name: now - then for name, (now, then) in pairs.items() if now is not None and then is not None}


WORSE = 0.01
"""Share of a figure by which it may become worse than today's without a word."""

DESIGN_IS = {
    "optimal": "optimum",
    "uncertified": "best known",
    "infeasible": "least relaxation",
    "failed": "where a solve stopped",
    "interrupted": "best known",
}
"""Status of an answer → what its design is."""


class Sentences(NamedTuple):
    """Sentences of an answer, "" if there is nothing to report.

    result: the result, or the reason of a failure; limits: limits that prevent more; open: variables that are not
    unique; search: extent of the search; explanations: further sentences in order.
    """

    result: str = ""
    limits: str = ""
    open: str = ""
    search: str = ""
    explanations: tuple[str, ...] = ()


NO_SENTENCES = Sentences()


def joined(*sentences: str) -> str:
    """Sentences as one text, without empty ones."""
    return " ".join(sentence for sentence in sentences if sentence)


@dataclass(frozen=True)
class Solution(Evaluated):
    """Solved target. `status` is that of the certificate, `solver["status"]` that of IPOPT."""

    target: str = ""
    status: str = "failed"
    sentences: Sentences = NO_SENTENCES
    """Sentences, part by part: `message` joins them."""
    binding: tuple[Price, ...] = ()
    bind_together: tuple[JointPrice, ...] = ()
    """Limits that are worth more together than each alone."""
    certificate: Certificate | None = None
    relaxation: tuple[Relaxation, ...] = ()
    clash: tuple[str, ...] = ()
    """Limits that cannot all be kept, as phrases."""
    solver: Mapping[str, Any] = field(default_factory=dict)
    time: Mapping[str, float] = field(default_factory=dict)
    optima: tuple[tuple[Mapping[str, float | None], int], ...] = ()
    """Figures of the distinct optima, best first, with the number of starts that ended in each."""
    proofs: "Proofs | None" = None
    """Proofs at every crank angle, if requested."""
    global_bound: GlobalBound | None = None
    """Bound on all admissible designs, if requested."""
    named_target: str | None = None
    """The target as the call named it; None where it is the default."""
    alternative: Alternative | None = None
    """The design with, or without, what makes little difference."""
    robust: Robust | None = None
    """Back-off of the limits, if requested."""
    rounded: Rounded | None = None
    """Rounding of numbers to sizes, if requested."""
    evaluate_today: Callable[[], Evaluated] | None = None
    """Evaluates today's machine."""
    point: Any = field(default=None, repr=False)
    """Point of the solver, from which a neighbour's solve can start."""

    def __post_init__(self) -> None:
        """Freeze the mappings of the record."""
        freeze(self, "design", "figures", "units", "reached", "undefined", "solver", "time")

    @property
    def message(self) -> str:
        """Sentences of the answer."""
        sentences = self.sentences
        return joined(sentences.result, sentences.limits, sentences.open, sentences.search, *sentences.explanations)

    @property
    def explanation(self) -> str:
        """Further sentences of the answer; for a family also on the members that decide."""
        result = self.sentences.result if self.members and self.status == "optimal" else ""
        return joined(result, *self.sentences.explanations)

    @property
    def design_is(self) -> str:
        """Kind of its design: an optimum only where it is certified."""
        if self.status in ("infeasible", "failed") and not self.relaxation and self.point is not None:
            return "optimum without sizes"
        return DESIGN_IS[self.status]

    @property
    def outcome(self) -> str:
        """Outcome for people: the status, and for an optimum the goals that it misses."""
        missed = shortfall(self.reached) if self.status == "optimal" else ""
        return f"{self.status} but {missed}" if missed else self.status

    @lazy
    def today(self) -> Evaluated | None:
        """Today's machine, evaluated when it is first read."""
        return self.evaluate_today() if self.evaluate_today else None

    @lazy
    def worse(self) -> tuple[Worse, ...]:
        """Figures that are not optimised and are worse than today's by more than `WORSE`."""
        if self.scene is None or self.status not in ("optimal", "uncertified") or self.today is None:
            return ()
        goals = {level.objective for level in self.certificate.levels} if self.certificate else set[str]()
        figures, old = self.scene.schema.figures, self.today.figures
        ends = {name: item.sides[0] for name, item in figures.items() if len(item.sides) == 1 and name not in goals}
        pairs = {name: (old.get(name), self.figures.get(name)) for name in ends}
        changes = [Worse(name, a, b) for name, (a, b) in pairs.items() if a is not None and b is not None]
        units = self.units
        sizes = {
            unit: max(abs(change.today) for change in changes if units.get(change.figure) == unit)
            for unit in {units.get(change.figure) for change in changes}
        }

        def falls(change: Worse) -> bool:
            by = change.design - change.today if ends[change.figure] == "max" else change.today - change.design
            return by > max(WORSE * abs(change.today), SHOWN_AS_ZERO * sizes[units.get(change.figure)])

        return tuple(change for change in changes if falls(change))

    @property
    def task_name(self) -> str:
        """Target, or the objectives of its terms."""
        return self.terms.summary if self.terms else self.target

    def as_dict(self, target: str = "") -> dict[str, Any]:
        """Object that `solve --json` prints."""
        base = super().as_dict(self.target or target)
        head: dict[str, Any] = {
            "problem": self.problem,
            "target": self.target or None,
            "status": self.status,
            "message": self.message,
            "effects": base["effects"],
        }
        if self.scene:
            head["scene"] = _scene_dict(self.scene, self.named_target)
        head["reached"] = base["reached"]
        tail: dict[str, Any] = {
            "binding": [price.as_dict() for price in self.binding],
            "certificate": certificate_dict(self.certificate) if self.certificate else None,
            "solver": dict(self.solver),
            "global": self.global_bound.as_dict() if self.global_bound else None,
            "time": dict(self.time),
            "design_is": self.design_is,
            "bind_together": [price.as_dict() for price in self.bind_together],
        }
        if "tables" in base:
            tail["tables"] = base.pop("tables")
        if self.worse:
            tail["worse"] = [entry.as_dict() for entry in self.worse]
        if self.proofs:
            tail["proofs"] = self.proofs.as_dict()["proofs"]
        if self.robust:
            tail["yield"] = {name: entry._asdict() for name, entry in self.robust.yields.items()}
            tail["robust"] = self.robust.as_dict(self)
        if self.rounded:
            tail["rounded"] = self.rounded.as_dict(self)
        if self.alternative:
            tail["indifference"] = self.alternative.as_dict(self)
        if self.relaxation:
            tail["clash"] = list(self.clash)
            tail["relaxation"] = [relaxation._asdict() for relaxation in self.relaxation]
        if len(self.optima) > 1:
            tail["optima"] = [
                {"figures": {k: _finite(v) for k, v in figures.items()}, "starts": n} for figures, n in self.optima
            ]
        return head | base | tail


def certificate_dict(certificate: Certificate) -> dict[str, Any]:
    """Certificate as JSON data."""
    data = {
        "passed": certificate.passed,
        "by": certificate.by,
        "reasons": list(certificate.reasons),
        "levels": [
            {
                "objective": level.objective,
                "stationarity": float(level.stationarity),
                "complementarity": float(level.complementarity),
            }
            for level in (*certificate.levels, *([certificate.change] if certificate.change else []))
        ],
        "feasibility": float(certificate.feasibility),
        "whole_cycle": {"violation": float(certificate.violation), "by": certificate.whole_cycle},
        "minimum": certificate.minimum,
        "unique": certificate.unique and certificate.prices_unique,
        "settled": list(certificate.choices),
    }
    if certificate.prices_unique:
        return data
    return data | {"design_unique": certificate.unique, "prices_unique": False}


def _scene_dict(scene: "Scene", target: str | None) -> dict[str, Any]:
    """Scene and tables as JSON data, from which the scene can be rebuilt; target: as in the call."""
    from loomopt.scenes.numbers import tables

    call, files = scene.call.as_dict() | {"target": target}, tables(scene)
    data = {"hash": scene.hash, "document": copied(scene.document, scene.origin), "call": call}
    return data | ({"files": files} if files else {})


def _finite(value: float | None) -> float | None:
    """The number; None for NaN and infinity, which JSON does not have."""
    return value if value is not None and math.isfinite(value) else None


SIGNS = {-1: ">=", 0: "=", 1: "<="}
SIDES = {-1: "min", 1: "max"}
MOST_WIDTHS = 3.0
"""Widths of its bounds by which a limit may give way; beyond them a designer has another machine in mind."""
UNKNOWN = "number"
"""The kind of what no table names, such as a variable that only the target's task has."""


def outward(value: float, side: int) -> float:
    """Value rounded to six significant digits so that the admissible range does not shrink: up for a maximum."""
    if value == 0.0:
        return value
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 5)
    return float(f"{(math.ceil if side > 0 else math.floor)(value / step) * step:.6g}")


def grouped(unit: str) -> str:
    """Unit in parentheses if it contains a stroke, for use after another stroke."""
    return f"({unit})" if "/" in unit else unit


class UnitFormatter:
    """Kinds and units of the variables and figures of one scene, and texts with them."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    @lazy
    def aliases(self) -> Mapping[str, str]:
        """Names of one member's numbers, if the scene is a family's, with the names that the member uses."""
        if FAMILY not in self.scene.schema.targets:
            return {}
        from loomopt.scenes import family

        return family.called(self.scene)

    def kind(self, name: str) -> str:
        """Kind of quantity of a variable, figure or limit."""
        name = name.of if isinstance(name, Alias) else self.aliases.get(name, name)
        schema = self.scene.schema
        if name in schema.figures and name not in schema.variables:
            return schema.figures[name].kind
        for kinds in (schema.variables, schema.lists, schema.margins):
            if name in kinds:
                return kinds[name]
        for model in (schema.operation, schema.mechanism):
            quantities = quantities_of(model)
            if name in quantities:
                return quantities[name].kind
        places = [(e.table, key, label(e, key)) for e in self.scene.active for key in e.table.model_fields]
        quantity = next((quantity_of(model, key) for model, key, called in places if called == name), None)
        return quantity.kind if quantity else UNKNOWN

    def unit(self, name: str) -> str:
        """Unit in which a designer reads it."""
        return self.scene.shown_in(self.kind(name))

    def si(self, name: str) -> str:
        """SI unit."""
        return SI_UNIT[self.kind(name)]

    def shown(self, name: str, value: float, digits: int = 6) -> str:
        """An SI value with its unit, as the designer writes it."""
        return show(value, self.unit(name), digits)

    def outward(self, name: str, value: float, side: int) -> str:
        """Bound, SI, rounded outward on a side, as text with its unit."""
        unit = self.unit(name)
        return show(outward(value / factor(unit), side) * factor(unit), unit)

    def limit(self, limit: Limit) -> str:
        """A limit as a phrase: "l1 >= 30 mm"."""
        if limit.name in self.scene.schema.margins:
            return limit.name
        return f"{limit.name} {SIGNS[limit.sign]} {self.shown(limit.name, limit.value)}"

    def worse(self, records: Sequence[Worse]) -> str:
        """Line of the figures that are worse than those of today's machine; "" for none."""
        texts = []
        for record in records:
            share = 100 * (record.share or 0.0)
            change = f" ({share:+.{0 if abs(share) > 10 else 1}f} %)" if record.share is not None else ""
            then = f"{record.today / factor(self.unit(record.figure)):.4g}"
            texts.append(f"{record.figure} {then} -> {self.shown(record.figure, record.design, 4)}{change}")
        return f"Worse than today's machine: {', '.join(texts)}." if texts else ""

    def price(self, bindings: Sequence[Binding]) -> Price:
        """Price of a limit, with all its rows together."""
        first = bindings[0]
        limit, figure = first.limit, first.objective.figure
        worth = worth_of(bindings)
        return Price(
            limit=limit.name,
            side=SIDES[first.side],
            value=limit.value,
            text=self.limit(limit),
            worth={figure: worth},
            unit={figure: f"{self.si(figure)}/{grouped(self.si(limit.name))}"},
            reading=self.price_reading(figure, limit.name, worth),
        )

    def price_reading(self, figure: str, limit: str, worth: float) -> str:
        """A price, SI, in the designer's own units, as a phrase: "0.2 N*m per mm"."""
        per = self.unit(limit)
        return f"{self._amount(figure, worth * factor(per))} per {per if per != '1' else 'unit'}"

    def _amount(self, figure: str, value: float) -> str:
        """An SI value of a figure with three digits and its unit, if it has one."""
        unit = self.unit(figure)
        return f"{value / factor(unit):.3g}{f' {unit}' if unit != '1' else ''}"

    def joint_price(self, joint: JointBinding) -> JointPrice:
        """Joint price of limits."""
        first = joint.bindings[0]
        figure, names = first.objective.figure, [binding.limit.name for binding in joint.bindings]
        units = list(dict.fromkeys(map(self.unit, names)))
        worth = joint.worth([1.0] * len(names))
        if len(units) == 1:
            reading = self.price_reading(figure, names[0], worth)
            per = grouped(self.si(names[0]))
        else:
            # Of limits of several kinds the sum depends on the steps: one unit of each.
            amount = joint.worth([factor(self.unit(name)) for name in names])
            reading = f"{self._amount(figure, amount)} for {named([f'1 {unit}' for unit in units])}"
            per = f"({', '.join(dict.fromkeys(map(self.si, names)))})"
        alone = [binding.worth for binding in joint.bindings]
        prices_alone = [
            f"{name} {self.price_reading(figure, name, price) if price else 0}"
            for name, price in zip(names, alone, strict=True)
        ]
        rest = f"alone: {', '.join(prices_alone)}" if any(alone) else "each alone: 0"
        sides = tuple(SIDES[binding.side] for binding in joint.bindings)
        unit = f"{self.si(figure)}/{per}"
        return JointPrice(tuple(names), sides, {figure: worth}, {figure: unit}, tuple(alone), f"{reading}; {rest}")

    def relaxation(self, limit: Limit, need: float, alone: bool) -> Relaxation:
        """Least relaxation of a limit, SI and as a phrase."""
        side = limit.sign or (1 if need > 0 else -1)
        needed = limit.value + side * abs(need)
        if abs(needed) <= SHOWN_AS_ZERO * max(abs(limit.value), abs(need)):
            needed = 0.0
        unit, fair = self.unit(limit.name), abs(need) <= MOST_WIDTHS * self._width(limit)
        change = self.shown(limit.name, abs(need), 3) + ("" if fair else ", out of proportion")
        text = f"{self.limit(limit)} -> {show(outward(needed / factor(unit), side) * factor(unit), unit)} (by {change})"
        return Relaxation(limit.name, SIDES[side], limit.value, needed, alone, text, fair)

    def _width(self, limit: Limit) -> float:
        """Reference of a relaxation, SI: the width of its bounds, else itself, else its scale."""
        bound = self.scene.bounds.get(limit.name) if not isinstance(limit, CycleLimit) else None
        width = bound.max - bound.min if bound else 0.0
        return (width if 0.0 < width < math.inf else abs(limit.value)) or limit.scale
