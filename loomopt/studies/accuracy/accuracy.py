"""What accuracy costs in time: a work-precision study of what a designer reads, method by method.

A method is a ladder (subject.py); one more method is one more function that yields ladders in LADDERS.
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
from loomopt.solving.options import check_sought
from loomopt.studies.accuracy import optima, readings
from loomopt.studies.accuracy.subject import (
    EPSILON,
    Ladder,
    LadderRow,
    Setting,
    Subject,
    climbed,
    grouped,
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
"""From a scene, and whether the study is a full one, to ladders."""
Climb = tuple[Ladder, tuple[LadderRow, ...]]
"""A ladder and its rows."""


def _read(subject: Subject, full: bool) -> Iterator[Ladder]:
    yield from readings.ladders(subject)


def _solved(subject: Subject, full: bool) -> Iterator[Ladder]:
    yield from optima.ladders(subject, optima.FULL if full else optima.QUICK)


LADDERS: tuple[Ladders, ...] = (_solved, _read)


@dataclass(frozen=True)
class AccuracyResult:
    """The rows of a study, and what they come to.

    orders, knees: "quantity, method" → measured order, and the setting from which on the error stops falling.
    """

    problem: str
    rows: tuple[LadderRow, ...]
    orders: Mapping[str, float]
    knees: Mapping[str, Setting]
    advice: str
    provenance: Mapping[str, str]

    def as_dict(self) -> dict[str, Any]:
        """Return the object `accuracy --json` prints."""
        rows = [dict(vars(row)) for row in self.rows]
        return {"problem": self.problem, "rows": rows, "orders": dict(self.orders), "advice": self.advice}


def study(
    scene: Scene,
    full: bool = False,
    on_run: Callable[[str], None] | None = None,
    ladders: Sequence[Ladders] = LADDERS,
) -> AccuracyResult:
    """Return the study of a scene; full: more settings and repeats; on_run: called with each run's name."""
    return summarise(scene, list(climbs(scene, full, on_run, ladders)), full)


def climbs(
    scene: Scene,
    full: bool = False,
    on_run: Callable[[str], None] | None = None,
    ladders: Sequence[Ladders] = LADDERS,
) -> Iterator[Climb]:
    """Yield each ladder with its rows as soon as it is done. Raises BadInput for a scene that does not assemble."""
    check_sought(scene, "accuracy")
    subject = Subject(scene)
    for make in ladders:
        for ladder in make(subject, full):
            with working():
                rows = tuple(climbed(ladder, FULL_REPEATS if full else QUICK_REPEATS, on_run))
            yield ladder, rows


def summarise(scene: Scene, climbs: Sequence[Climb], full: bool = False) -> AccuracyResult:
    """Return what ladders and their rows come to."""
    orders: dict[str, float] = {}
    knees: dict[str, Setting] = {}
    for ladder, found in climbs:
        for name, own in grouped(found).items() if ladder.step else ():
            measured, at = order(own, ladder.step) if ladder.step else None, knee(own)
            orders |= {} if measured is None else {name: measured}
            knees |= {} if at is None else {name: at}
    rows = tuple(row for _, found in climbs for row in found)
    told = provenance.provenance(scene, study="full" if full else "quick")
    sampler = registry.of(scene).sampler(scene, {})
    left = [f" Not covered: {text}." for text in model.uncovered(sampler.model.effects, sampler.given.own)]
    return AccuracyResult(scene.name, rows, orders, knees, "".join([advice(rows), *left]), told)


def advice(rows: Sequence[LadderRow]) -> str:
    """Return one sentence on what accuracy costs, from the rows of the exchange alone.

    Costs are in positions evaluated, which are the same on every machine; the figure of the first target counts.
    """
    own = _exchange(rows)
    costs = _costs(own, {row.setting: row.evaluations for row in own})
    if not costs:
        coarse = setting_text(COARSE)
        return f"No solve was certified at an accuracy of {coarse} and a finer one, so there is no cost to compare."
    return f"{_said(costs)} here; below {setting_text(floor(own))} rounding takes over."


def in_time(rows: Sequence[LadderRow]) -> str:
    """Return the costs of the advice in time on this machine; "" where there are none."""
    own = _exchange(rows)
    costs = _costs(own, {row.setting: row.seconds or 0.0 for row in own})
    return f"In time on this machine: {_said(costs)}." if costs else ""


def _exchange(rows: Sequence[LadderRow]) -> list[LadderRow]:
    """Return the rows of the exchange for the figure of the first target that were certified."""
    found = [row for row in rows if row.method == optima.EXCHANGE]
    return [row for row in found if row.quantity == found[0].quantity and row.error is not None]


def _costs(rows: Sequence[LadderRow], spent: Mapping[Setting, float]) -> dict[Setting, float]:
    """Return how many times as much as at 1e-3 is spent at finer accuracies: the usual, and the finest there is."""
    finest = min((row.setting for row in rows if isinstance(row.setting, float)), default=COARSE)
    named = dict.fromkeys(setting for setting in (USUAL, finest) if setting in spent and setting < COARSE)
    return {setting: spent[setting] / spent[COARSE] for setting in named} if spent.get(COARSE) else {}


def _said(costs: Mapping[Setting, float]) -> str:
    """Return costs as a phrase."""
    first, *others = (f"{setting_text(setting)} costs {cost:.2g}x" for setting, cost in costs.items())
    return " and ".join([f"{first} of {setting_text(COARSE)}", *others])


def floor(rows: Sequence[LadderRow]) -> float:
    """Return the power of ten that errors stay below from the knee on."""
    at = knee(rows)
    begun = [row.setting for row in rows].index(at) if at is not None else 0
    worst = max(EPSILON, *(row.error or 0.0 for row in rows[begun:]))
    return 10.0 ** math.ceil(math.log10(worst))
