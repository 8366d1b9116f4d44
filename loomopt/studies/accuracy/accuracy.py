"""Accuracy study: work-precision rows of a designer's quantities, method by method.

A method is a ladder (subject.py). A function in LADDERS that yields ladders adds methods.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from loomopt.jobs import registry
from loomopt.model import model
from loomopt.model.session import working
from loomopt.scenes import provenance
from loomopt.scenes.scene import Scene
from loomopt.solving.options import check_effects
from loomopt.studies.accuracy import optima, readings
from loomopt.studies.accuracy.subject import (
    EPSILON,
    Ladder,
    LadderRow,
    Setting,
    Subject,
    climb,
    group_rows,
    knee,
    order,
    setting_text,
)

if TYPE_CHECKING:
    pass

QUICK_REPEATS, FULL_REPEATS = 3, 7
COARSE, USUAL = 1e-3, 1e-6
"""Accuracies whose costs the advice compares."""

Ladders = Callable[[Subject, bool], Iterator[Ladder]]
"""Function of a subject, and of whether the study is a full one, that yields ladders."""
Climb = tuple[Ladder, tuple[LadderRow, ...]]
"""A ladder and its rows."""


def _reading_ladders(subject: Subject, full: bool) -> Iterator[Ladder]:
    """Ladders of readings of a given design."""
    yield from readings.ladders(subject)


def _solve_ladders(subject: Subject, full: bool) -> Iterator[Ladder]:
    """Ladders of solves."""
    yield from optima.ladders(subject, optima.FULL if full else optima.QUICK)


LADDERS: tuple[Ladders, ...] = (_solve_ladders, _reading_ladders)


@dataclass(frozen=True)
class AccuracyResult:
    """Rows of an accuracy study, and their summary.

    orders, knees: by "quantity, method": measured order, and first setting from which the error no longer falls.
    """

    problem: str
    rows: tuple[LadderRow, ...]
    orders: Mapping[str, float]
    knees: Mapping[str, Setting]
    advice: str
    provenance: Mapping[str, str]

    def as_dict(self) -> dict[str, Any]:
        """The object that `accuracy --json` prints."""
        rows = [dict(vars(row)) for row in self.rows]
        return {"problem": self.problem, "rows": rows, "orders": dict(self.orders), "advice": self.advice}


def study(
    scene: Scene,
    full: bool = False,
    on_run: Callable[[str], None] | None = None,
    ladders: Sequence[Ladders] = LADDERS,
) -> AccuracyResult:
    """Accuracy study of a scene; full: more settings and repeats; on_run(name): called before every run."""
    return summarise(scene, list(climbs(scene, full, on_run, ladders)), full)


def climbs(
    scene: Scene,
    full: bool = False,
    on_run: Callable[[str], None] | None = None,
    ladders: Sequence[Ladders] = LADDERS,
) -> Iterator[Climb]:
    """Yield every ladder with its rows as soon as it is done. Raises BadInput for a scene that does not assemble."""
    check_effects(scene, "accuracy")
    subject = Subject(scene)
    for make in ladders:
        for ladder in make(subject, full):
            with working():
                rows = tuple(climb(ladder, FULL_REPEATS if full else QUICK_REPEATS, on_run))
            yield ladder, rows


def summarise(scene: Scene, climbs: Sequence[Climb], full: bool = False) -> AccuracyResult:
    """Result of a study from ladders and their rows."""
    orders: dict[str, float] = {}
    knees: dict[str, Setting] = {}
    for ladder, ladder_rows in climbs:
        for name, group in group_rows(ladder_rows).items() if ladder.step else ():
            measured, setting = order(group, ladder.step) if ladder.step else None, knee(group)
            orders |= {} if measured is None else {name: measured}
            knees |= {} if setting is None else {name: setting}
    rows = tuple(row for _, ladder_rows in climbs for row in ladder_rows)
    attributes = provenance.provenance(scene, study="full" if full else "quick")
    sampler = registry.of(scene).sampler(scene, {})
    uncovered = [f" Not covered: {text}." for text in model.uncovered(sampler.model.effects, sampler.given.tables)]
    return AccuracyResult(scene.name, rows, orders, knees, "".join([advice(rows), *uncovered]), attributes)


def advice(rows: Sequence[LadderRow]) -> str:
    """Sentence on the cost of accuracy, from the rows of the exchange.

    Costs are numbers of positions evaluated, which are the same on every machine, for the figure of the first target.
    """
    exchange = _exchange_rows(rows)
    costs = _relative_costs(exchange, {row.setting: row.evaluations for row in exchange})
    if not costs:
        coarse = setting_text(COARSE)
        return f"No solve was certified at an accuracy of {coarse} and a finer one, so there is no cost to compare."
    return f"{_cost_phrase(costs)} here; below {setting_text(floor(exchange))} rounding takes over."


def in_time(rows: Sequence[LadderRow]) -> str:
    """Sentence with the costs of the advice in time on this machine; "" without any."""
    exchange = _exchange_rows(rows)
    costs = _relative_costs(exchange, {row.setting: row.seconds or 0.0 for row in exchange})
    return f"In time on this machine: {_cost_phrase(costs)}." if costs else ""


def _exchange_rows(rows: Sequence[LadderRow]) -> list[LadderRow]:
    """Certified rows of the exchange for the figure of the first target."""
    exchange = [row for row in rows if row.method == optima.EXCHANGE]
    return [row for row in exchange if row.quantity == exchange[0].quantity and row.error is not None]


def _relative_costs(rows: Sequence[LadderRow], spent: Mapping[Setting, float]) -> dict[Setting, float]:
    """Costs relative to an accuracy of 1e-3, at the usual and at the finest accuracy."""
    finest = min((row.setting for row in rows if isinstance(row.setting, float)), default=COARSE)
    settings = dict.fromkeys(setting for setting in (USUAL, finest) if setting in spent and setting < COARSE)
    return {setting: spent[setting] / spent[COARSE] for setting in settings} if spent.get(COARSE) else {}


def _cost_phrase(costs: Mapping[Setting, float]) -> str:
    """Phrase on costs."""
    first, *rest = (f"{setting_text(setting)} costs {cost:.2g}x" for setting, cost in costs.items())
    return " and ".join([f"{first} of {setting_text(COARSE)}", *rest])


def floor(rows: Sequence[LadderRow]) -> float:
    """Power of ten above all errors from the knee on."""
    setting = knee(rows)
    first = [row.setting for row in rows].index(setting) if setting is not None else 0
    worst = max(EPSILON, *(row.error or 0.0 for row in rows[first:]))
    return 10.0 ** math.ceil(math.log10(worst))
