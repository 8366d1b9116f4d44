"""Tolerance study: spread of figures, yield of limits, tolerances to tighten first."""

import contextlib
import math
import os
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from loomopt.base import arguments
from loomopt.base.records import attribute
from loomopt.base.units import factor
from loomopt.interface.progress import cell_progress
from loomopt.interface.study_result import Presentation, check_resume, opened_store, workers
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.picture.chart import Axis, Chart, Charts, Series, heading, ticks
from loomopt.picture.table import Column, TextTable, number_text, text_table, words
from loomopt.scenes.provenance import provenance
from loomopt.solving.answer.solution import UnitFormatter
from loomopt.studies.run import run
from loomopt.studies.tolerance import study
from loomopt.studies.tolerance.plan import SCRAMBLES, Plan
from loomopt.studies.tolerance.study import ALL, BINS, REACH, Spread, ToleranceResult

if TYPE_CHECKING:
    import pandas as pd

LEAST_SHARE = 0.005
"""Share of a figure's variance below which a terminal omits a number."""
MOST_NAMED = 3
"""Number of shares that a terminal shows."""


@dataclass(frozen=True, repr=False)
class ToleranceStudy(Presentation):
    """Scatter of manufactured machines: how figures spread, how often limits hold; SI inside."""

    result: ToleranceResult
    plan = attribute[Any]()
    figures = attribute[Any]()
    yields = attribute[Any]()
    tighten = attribute[tuple[tuple[str, float], ...]]()
    samples = attribute[int]()
    bad = attribute[int]()
    worst = attribute[Any]()
    as_dict = attribute[Callable[[], dict[str, Any]]]()
    heading = "Scatter of manufactured machines"

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Table of one line per figure with its spread and shares; si: in SI, else in the scene's own units."""
        from loomopt.interface.table_frame import frame

        plan = self.result.plan
        attrs = provenance(plan.scene, samples=self.result.samples, seed=plan.seed)
        return frame(_spreads(self.result, arguments.flag(si, "si")), attrs)

    def tables(self) -> list[str | TextTable]:
        """Spreads, yields, worst cases, and the tolerances to tighten first."""
        result, plan = self.result, self.result.plan
        numbers = ", ".join(tolerance.number for tolerance in plan.tolerances.values())
        head = f"{plan.scene.name}, limits of {plan.target}: {result.samples} machines with tolerances of {numbers}"
        lost = f"{result.bad} of them cannot be assembled or lack a figure" if result.bad else "all of them assemble"
        worst: list[str | TextTable] = [_worst(result)] if result.worst else []
        spreads = text_table(_spreads(result), first=(0, 1, 3, 4, 2))
        return [f"{head}; {lost}", spreads, _yields(result), *worst, *_advice(result)]

    def charts(self) -> Charts:
        """Histograms of the criteria and of the objectives."""
        plan = self.result.plan
        names = dict.fromkeys(
            [
                *(criterion.name for criterion in plan.criteria),
                *(objective.figure for objective in plan.program.objectives),
            ]
        )
        spreads = ((name, self.result.figures.get(name)) for name in names)
        shown = [
            _histogram(self.result, name, spread)
            for name, spread in spreads
            if spread and spread.sigma and spread.sigma_linear
        ]
        title = f"{plan.scene.name}: {self.result.samples} manufactured machines"
        return Charts(title, shown, missing="no figure that can reject machines varies")

    def __repr__(self) -> str:
        share, plan = self.result.yields[ALL].value, self.result.plan
        return f"<ToleranceStudy {plan.scene.name}, {plan.target}: all limits hold on {100 * share:.4g} %>"


def run_tolerance(
    plan: Plan,
    executor: Executor | run.Making | None = None,
    count: int | None = None,
    on_step: Callable[[str], None] | None = None,
    worst: bool = True,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
) -> ToleranceStudy:
    """Draw the machines of a plan and judge them; count: of worker processes, without an executor.

    worst: whether the worst cases are proven too; store, resume: as in `run_study`, a scramble a row.
    Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    computer = workers(executor, count)
    with cell_progress() as cell, contextlib.ExitStack() as opened:
        say = on_step or cell or (lambda text: None)
        rows = None
        if store is None:
            check_resume(resume)
        else:
            drawing = study.SampleStudy(plan, {})
            known = "{} of the {} scrambles".format
            rows = opened.enter_context(
                opened_store(store, drawing.key, drawing.settings, resume, lambda count: known(count, SCRAMBLES))
            )
        pool = computer if isinstance(computer, Executor) or computer is None else opened.enter_context(computer())
        return ToleranceStudy(study.run(plan, pool, say, worst, rows))


def _spreads(result: ToleranceResult, si: bool = False) -> list[Column]:
    units, figures = UnitFormatter(result.plan.scene), result.figures
    shown = [units.si(name) if si else units.unit(name) for name in figures]
    pairs = [(spread, factor(unit)) for spread, unit in zip(figures.values(), shown, strict=True)]
    nominal, linear, sigma = (
        [getattr(spread, part) / size for spread, size in pairs] for part in ("nominal", "sigma_linear", "sigma")
    )
    centres = [
        number_text(0.0 if abs(spread.nominal) <= SHOWN_AS_ZERO * spread.sigma else spread.nominal / size)
        for spread, size in pairs
    ]
    columns = [
        words("figure", list(figures)),
        Column("unit", shown),
        Column("nominal", nominal, "nominal", centres),
        Column("sigma_linear", linear, "sigma\nlinear", [_size(value) for value in linear]),
        Column("sigma", sigma, "sigma\nsampled", [_size(value) for value in sigma]),
        Column("", (), "unit", ["" if unit == "1" else unit for unit in shown], right=False),
        Column("", (), "shares", [_shares(spread) for spread in figures.values()], right=False),
    ]
    for place, side in enumerate(("min", "max")) if result.worst else ():
        worst = [result.worst.get(name) for name in figures]
        ends = [(bounds.min, bounds.max)[place] if bounds else None for bounds in worst]
        values = [math.nan if end is None else end / size for end, (_, size) in zip(ends, pairs, strict=True)]
        columns.append(Column(f"worst {side}", values))
    shared = dict.fromkeys(number for spread in figures.values() for number in spread.shares)
    columns += [Column(f"share {n}", [spread.shares.get(n, math.nan) for spread in figures.values()]) for n in shared]
    return columns


def _size(value: float) -> str:
    return "0" if value == 0.0 else f"{value:.4g}"


def _shares(spread: Spread) -> str:
    largest = sorted(spread.shares.items(), key=lambda pair: -pair[1])[:MOST_NAMED]
    text = ", ".join(f"{name} {100 * share:.3g} %" for name, share in largest if share >= LEAST_SHARE)
    return f"{text} (a corner)" if spread.corner and text else text


def _yields(result: ToleranceResult) -> TextTable:
    names = ["all together" if name == ALL else name for name in result.yields]
    shares = [f"{100 * share.value:.4g}" for share in result.yields.values()]
    errors = [f"{100 * share.se:.2g}" for share in result.yields.values()]
    columns = [
        words("", names, "limit satisfied"),
        Column("", (), "machines\n%", shares),
        Column("", (), "standard error\n%", errors),
    ]
    return text_table(columns)


def _histogram(result: ToleranceResult, name: str, spread: Spread) -> Chart:
    """Histogram of one figure, with the rejected range shaded."""
    units = UnitFormatter(result.plan.scene)
    criterion = next((criterion for criterion in result.plan.criteria if criterion.name == name), None)
    unit = units.unit(name)
    size = factor(unit)
    edges = (spread.nominal + REACH * spread.sigma_linear * np.linspace(-1, 1, BINS + 1)) / size
    low, high = float(edges[0]), float(edges[-1])
    shares = np.array(spread.counts) / result.samples * 100
    steps = np.concatenate([[0.0], np.repeat(shares, 2), [0.0]])
    least, most = (
        None if end is None else min(max(end / size, low), high)
        for end in ((criterion.low, criterion.high) if criterion else (None, None))
    )
    outside = [(low, least)] if least is not None and least > low else []
    outside += [(most, high)] if most is not None and most < high else []
    nominal = 0.0 if abs(spread.nominal) <= SHOWN_AS_ZERO * spread.sigma else spread.nominal
    key = [("k-place", f"nominal {units.shown(name, nominal)}")]
    key += [("k-span", f"rejected; {100 * result.yields[name].value:.4g} % accepted")] if outside else []
    axis = Axis(low, high, ticks(low, high, 4), heading(name, unit))
    curve = Series(np.repeat(edges, 2), steps, "c0", filled=True)
    return Chart("machines [%]", axis, [curve], spans=outside, places=[nominal / size], key=key)


def _worst(result: ToleranceResult) -> TextTable:
    """Worst cases: the least and the most of each figure within the tolerances, and whether it is proven."""
    formatter, lines = UnitFormatter(result.plan.scene), []
    for name, bounds in result.worst.items():
        unit = formatter.unit(name)
        size = factor(unit)
        sides = zip((bounds.min, bounds.max), bounds.farthest, (-1.0, 1.0), ("or less", "or more"), strict=True)
        shown = [_end(end, beyond, size, sign, more) for end, beyond, sign, more in sides]
        lines.append((name, *shown, "" if unit == "1" else unit, "proven" if bounds.proven else bounds.why))
    heads = ("range within all tolerances", "at least", "at most", "unit", "")
    return TextTable("", heads, tuple(lines), (1, 2), first=(0, 1, 2, 4, 3), more="--json")


def _end(end: float | None, value: float, size: float, sign: float, more: str) -> str:
    """A proven end, outward of itself; of one that is undecided the farthest machine."""
    if end is not None:
        return _outward(end / size, sign)
    return f"{value / size:.{DIGITS}g} {more}" if math.isfinite(value) else ""


DIGITS = 7
"""Digits of a worst case: more than its gap has."""


def _outward(value: float, sign: float) -> str:
    """Value rounded up, or down, to a number of digits."""
    if value == 0.0:
        return "0"
    step = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - DIGITS)
    return f"{(math.ceil if sign > 0 else math.floor)(value / step) * step:.{DIGITS}g}"


def _advice(result: ToleranceResult) -> list[str]:
    first = [f"{name} ({100 * share:.3g} %)" for name, share in result.tighten[:MOST_NAMED] if share >= LEAST_SHARE]
    lost = any(result.yields[criterion.name].value < 1.0 for criterion in result.plan.criteria)
    of = "the rejected machines" if lost else "the scatter of the objective; no machine is rejected"
    sentences = [f"Tighten first: {', '.join(first)} of {of}."] if first else []
    names = result.plan.goals_without_band
    if names:
        sentences.append(f"{', '.join(names)} rejects no machine, as an equality or a goal without a band in [accept].")
    return sentences
