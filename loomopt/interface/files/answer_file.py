"""Reader of an answer's JSON file: figures and limits are recomputed, the rest is taken from the file.

What the file says of its status is believed only as far as its design bears it out.
"""

import functools
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from loomopt.base.errors import refusal
from loomopt.interface import results
from loomopt.interface.results import Answer, Evaluation
from loomopt.jobs import registry
from loomopt.model.objectives import ObjectiveSense
from loomopt.physics.tolerances import FEASIBLE, STATIONARY
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import (
    JointPrice,
    Price,
    Proof,
    Proofs,
    Relaxation,
    Sentences,
    Solution,
    UnitFormatter,
)
from loomopt.solving.certificate.records import Certificate, GlobalBound, GlobalLevel, Level

AGREES = 1e-6
"""Relative; a figure computed anew that differs by less is the one in the file: another machine may have made that."""
MOST_DIFFERENCES = 3
"""Contradictions between a file and its design that are listed one by one."""
STATUSES = ("optimal", "infeasible", "uncertified", "failed", "interrupted")
NUMBER = re.compile(r"[-+]?[\d.]+(?:e[-+]?\d+)?")
Read = TypeVar("Read")


class StoredAnswer(NamedTuple):
    """An answer of a file in its own scene; doubts: why its status is not to be believed, a sentence each."""

    evaluation: Evaluation
    doubts: tuple[str, ...] = ()


def read_answer(path: Path) -> StoredAnswer:
    """Answer in a JSON file, evaluated in its own scene. Raises BadInput."""
    scene, handed = registry.answered(path)
    evaluation = results.evaluate_design(scene, designs.checked(handed.design, scene, scene.origin), None)
    document = designs.loaded(path)
    if not isinstance(document, Mapping) or document.get("status") not in STATUSES:
        return StoredAnswer(evaluation)
    try:
        answer = _answer(document, evaluation, scene)
    except (AttributeError, KeyError, TypeError, ValueError, ArithmeticError):
        remedy = "Give the answer as it was printed, or its design object alone"
        raise refusal("it is not an answer that `loomopt solve --json` printed", str(path), remedy=remedy) from None
    return StoredAnswer(answer, tuple(_doubts(document, answer)))


def _answer(document: Mapping[str, Any], evaluation: Evaluation, scene: Scene) -> Answer:
    """Answer of a file, with figures computed anew. A damaged file raises KeyError, TypeError or ValueError."""
    target, limits = document.get("target"), evaluation.limits
    if target is None or not _of_target(document, evaluation, scene):  # a point of a front; its message names the axes
        target = None
        named = {str(limit["name"]) for limit in document["limits"]}
        limits = tuple(limit for limit in limits if limit.name in named)
    certificate = _certificate(document["certificate"]) if document.get("certificate") else None
    bound = _global_bound(document["global"], document["figures"]) if document.get("global") else None
    fields = {name: getattr(evaluation, name) for name in ("problem", "effects", "design", "figures", "units")}
    record = Solution(
        **fields,
        limits=limits,
        reached=evaluation.reached,
        scene=scene,
        target="" if target is None else evaluation.target,
        status=str(document["status"]),
        sentences=Sentences(str(document.get("message", ""))),
        binding=tuple(_price(price, UnitFormatter(scene)) for price in document.get("binding", ())),
        bind_together=tuple(map(_joint_price, document.get("bind_together", ()))),
        certificate=certificate,
        relaxation=tuple(_record(Relaxation, relaxation) for relaxation in document.get("relaxation", ())),
        clash=tuple(map(str, document.get("clash", ()))),
        solver={str(name): value for name, value in document.get("solver", {}).items()},
        time={str(name): float(value) for name, value in document.get("time", {}).items()},
        proofs=_proofs(document["proofs"], evaluation) if document.get("proofs") else None,
        global_bound=bound,
        evaluate_today=functools.partial(report.evaluate, scene, None, evaluation.target or None),
    )
    return Answer(record, record.target)


def _of_target(document: Mapping[str, Any], evaluation: Evaluation, scene: Scene) -> bool:
    """Whether an optimum's message is that of its target, except for numbers; that of a point of a front differs."""
    if document["status"] != "optimal":
        return True
    message = registry.of(scene).say(scene, evaluation.target, evaluation.figures)
    return NUMBER.sub("", str(document["message"])).startswith(NUMBER.sub("", message))


def _record(kind: Callable[..., Read], entries: Mapping[str, Any]) -> Read:
    return kind(**{str(name): value for name, value in entries.items()})


def _price(record: Mapping[str, Any], formatter: UnitFormatter) -> Price:
    """A limit's price with its reading in the scene's units."""
    (figure, worth), *_ = record["worth"].items()
    limit, side = str(record["limit"]), str(record["side"])
    reading = formatter.price_reading(figure, limit, float(worth))
    return Price(
        limit, side, float(record["value"]), str(record["text"]), {figure: float(worth)}, dict(record["unit"]), reading
    )


def _joint_price(record: Mapping[str, Any]) -> JointPrice:
    """Price of limits that only move together, from its record."""
    worth = {str(figure): float(value) for figure, value in record["worth"].items()}
    alone = tuple(float(next(iter(price.values()))) for price in record["alone"])
    names, sides = (tuple(map(str, record[key])) for key in ("limits", "sides"))
    return JointPrice(names, sides, worth, dict(record["unit"]), alone, str(record["reading"]))


def _certificate(record: Mapping[str, Any]) -> Certificate:
    levels = tuple(
        Level(str(level["objective"]), float(level["stationarity"]), float(level["complementarity"]), 0.0)
        for level in record["levels"]
    )
    return Certificate(
        bool(record["passed"]),
        tuple(map(str, record["reasons"])),
        levels,
        float(record["feasibility"]),
        float(record["whole_cycle"]["violation"]),
        bool(record["minimum"]),
        bool(record.get("design_unique", record["unique"])),
        by=str(record["by"]),
        whole_cycle=str(record["whole_cycle"]["by"]),
        tie_breaks=tuple(map(str, record.get("settled", ()))),
        prices_unique=bool(record.get("prices_unique", True)),
    )


def _global_bound(record: Mapping[str, Any], figures: Mapping[str, Any]) -> GlobalBound:
    """Global bound from its record; the sign of bound − best gives the side."""
    gap = math.inf if record["gap"] is None else float(record["gap"])
    levels = []
    for name, bound in record["bound"].items():
        best = float(figures[name])
        sense: ObjectiveSense = "most" if bound > best else "least"
        levels.append(
            GlobalLevel(
                name,
                sense,
                best,
                float(bound),
                gap,
                float(record.get("band", {}).get(name, 0.0)),
                bool(record["proven"]),
            )
        )
    return GlobalBound(tuple(levels), int(record["boxes"]), float(record["seconds"]), str(record["why"] or ""))


def _proofs(records: Sequence[Mapping[str, Any]], evaluation: Evaluation) -> Proofs:
    proofs = []
    for entry in records:
        name, kind = str(entry["limit"]), "peak" if str(entry["limit"]).startswith("peak ") else "limit"
        entries = {key: value for key, value in entry.items() if key != "limit"}
        proofs.append(Proof(name=name.removeprefix("peak "), kind=kind, **entries))  # type: ignore[arg-type]
    return Proofs(evaluation.problem, evaluation.target, tuple(proofs), evaluation.scene)


def _doubts(document: Mapping[str, Any], answer: Answer) -> Iterator[str]:
    """Yield contradictions to the status in a file: figures, limits, thresholds."""
    sizes: dict[str, float] = {}
    for name, value in answer.figures.items():
        unit = answer.units.get(name, "1")
        sizes[unit] = max(sizes.get(unit, 0.0), abs(value or 0.0))
    differing = 0
    for name, value in answer.figures.items():
        printed = document.get("figures", {}).get(name)
        if value is None or not isinstance(printed, int | float):
            continue
        if not abs(printed - value) <= AGREES * max(abs(value), 1e-3 * sizes[answer.units.get(name, "1")]):
            differing += 1
            if differing <= MOST_DIFFERENCES:
                now, then = (UnitFormatter(answer.scene).shown(name, number, 9) for number in (value, float(printed)))
                yield f"{name} is {now} for its design, the file says {then}."
    if differing > MOST_DIFFERENCES:
        yield f"{differing - MOST_DIFFERENCES} more of its figures differ too."
    if answer.status != "optimal":
        return
    yield from (f"It says optimal, and limit {limit.name} does not hold." for limit in answer.limits if not limit.ok)
    certificate = answer.certificate
    if certificate is None or not certificate.passed:
        yield "Its status is optimal, but its certificate has not passed."
    elif certificate.reasons or not (certificate.feasibility <= FEASIBLE and certificate.residual <= STATIONARY):
        yield "Its status is optimal, but numbers of its certificate exceed their thresholds."
