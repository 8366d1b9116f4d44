"""Influence of effects: tables, bars of shift and regret, a sentence on the effects that may be left out."""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from loomopt.base import arguments
from loomopt.base.records import attribute
from loomopt.base.units import factor
from loomopt.interface.study_result import Presentation, row_hook, workers
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.picture.chart import Bars, Charts, both_sides
from loomopt.picture.table import Column, TextTable, call, number_text, text_table, words
from loomopt.scenes.provenance import provenance
from loomopt.solving.answer.solution import UnitFormatter
from loomopt.studies.effects.effect_impact import LIMITS, EffectImpact
from loomopt.studies.effects.study import Effects, EffectsResult, summarise
from loomopt.studies.run import run
from loomopt.studies.run.rows import Row

if TYPE_CHECKING:
    import pandas as pd

DECADES = 4
"""Powers of ten on either side of 0, at most: below them, and below a tenth of the tolerance, bars are linear."""
ROOMY = 1.3
"""Share of the longest bars that the axis is long."""


@dataclass(frozen=True, repr=False)
class EffectsStudy(Presentation):
    """Influence of each effect of a scene on a target; shares of scales inside, units in tables."""

    result: EffectsResult
    scene = attribute[Any]()
    target = attribute[str]()
    tolerance = attribute[float]()
    reference = attribute[Any]()
    rows = attribute[Any]()
    together = attribute[Any]()
    kept = attribute[tuple[str, ...]]()
    left_out = attribute[tuple[str, ...]]()
    judged = attribute[tuple[str, ...]]()
    out = attribute[Any]()
    unknown = attribute[Any]()
    largest_omission = attribute[Any]()
    command = attribute[str | None]()
    finished = attribute[bool]()
    units = attribute[dict[str, str]]()
    statuses = attribute[list[str]]()
    as_dict = attribute[Callable[[], dict[str, Any]]]()
    heading = "Influence of each effect"

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Table of one line per effect, units in the column names; si: in SI, else in the scene's own units."""
        from loomopt.interface.table_frame import frame

        result = self.result
        settings = {"reference": ", ".join(result.reference.effects), "tolerance": result.tolerance}
        attrs = provenance(result.scene, study="effects", target=result.target, **settings)
        return frame(_columns(result, result.rows, si=arguments.flag(si, "si")), attrs, "without")

    def tables(self, *, timed: bool = True) -> list[str | TextTable]:
        """Table of effects, those that may be left out, and those not measured; timed: with the times of the solves."""
        result, reference = self.result, self.result.reference
        values = ", ".join(f"{name} {_reference_value(result, name)}" for name in reference.scales)
        first = f"{result.scene.name}, {result.target}, with {list_text(reference.effects) or 'no effect'} on: "
        lines = [first + (values if reference.status == "optimal" else f"{reference.status}, {reference.why}")]
        sizes = ", ".join(
            f"{name} {UnitFormatter(result.scene).shown(name, size)}" for name, size in reference.scales.items()
        )
        lines += [f"Shares are relative to the scales: {sizes}"] if sizes else []
        table: list[str | TextTable] = []
        if result.rows:
            base = EffectImpact("nothing", {}, {}, None, True, reference.status, **reference.cost)
            columns = _columns(result, (base, *result.rows), timed)
            last = sum(column.head is not None for column in columns) - 1  # what came of the solve, if no optimum
            table = [text_table(columns, (0, last - 1, last) if any(columns[-2].cells) else (0, last - 1))]
        return [*lines, *table, *verdict(result), *_notes(result)]

    def charts(self) -> Charts:
        """Bars of shift and regret of each objective, with the tolerance, and of the excess of limits."""
        result = self.result
        shown = [_bars(result, name) for name in result.reference.scales] if result.rows else []
        excesses = [row.excess for row in result.rows]
        if shown and any(value is not None and value > SHOWN_AS_ZERO for value in excesses):
            key = [("c3", "worst excess of the design found without it")]
            shown.append(
                _bars_of(result, "limits without an effect", key, [(value,) for value in excesses], signed=False)
            )
        title = f"{result.scene.name}, {result.target}: influence of each effect"
        return Charts(title, shown, missing="no effect was measured")

    def __repr__(self) -> str:
        left = ", ".join(self.result.left_out) or "nothing"
        share = f"{100 * self.result.tolerance:g} %"
        return f"<EffectsStudy {self.result.scene.name}, {self.result.target}: at {share} {left} may be left out>"

    def _repr_html_(self) -> str:
        from loomopt.interface.text import notebook

        return notebook.page(self.tables(timed=False))


def run_effects(
    study: Effects,
    executor: Executor | run.Making | None = None,
    count: int | None = None,
    on_row: run.OnRow | None = None,
) -> EffectsStudy:
    """Run a study; count: of worker processes, where there is no executor.

    Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    with row_hook(lambda count: f"{count} solved" if count else "solving with all effects on", on_row) as hook:
        return summarise_effects(study, run.run(study, workers(executor, count), None, hook))


def summarise_effects(study: Effects, rows: Sequence[Row]) -> EffectsStudy:
    """Result of the finished rows of a study. Raises BadInput if the target has no effect to leave out."""
    return EffectsStudy(summarise(study, rows))


def _columns(result: EffectsResult, rows: Sequence[EffectImpact], timed: bool = True, si: bool = False) -> list[Column]:
    units, columns = UnitFormatter(result.scene), [words("without", [row.effect for row in rows])]
    for name, scale in result.reference.scales.items():
        unit = units.si(name) if si else units.unit(name)
        size = scale / factor(unit)
        shift = [_value_or_zero(row.shift.get(name)) for row in rows]
        regret = [_value_or_zero(row.regret.get(name)) for row in rows]
        head = f"{name}\nshift" + ("" if unit == "1" else f"\n{unit}")
        sizes = [value * size for value in shift]
        cells = ["0" if abs(value) <= SHOWN_AS_ZERO else number_text(value * size) for value in shift]
        columns += [
            Column(f"{name} shift [{unit}]", sizes, head, cells, called=f"{name} shift"),
            Column(f"{name} shift [%]", *_percent(shift, "\n\n%"), called=f"{name} shift %"),
            Column(f"{name} regret [{unit}]", [value * size for value in regret]),
            Column(f"{name} regret [%]", *_percent(regret, "\nregret\n%"), called=f"{name} regret %"),
        ]
    nodes = ["" if row.nodes is None else str(row.nodes) for row in rows]
    build, solve = [_value_or_zero(row.build_s) for row in rows], [_value_or_zero(row.solve_s) for row in rows]
    going = ["" if row.effect == "nothing" else "yes" if row.may_go else "no" for row in rows]
    return [
        *columns,
        Column("limits exceeded [%]", *_percent([_value_or_zero(row.excess) for row in rows], "limits\nexceeded\n%")),
        Column("may go", [row.may_go for row in rows]),
        Column("takes away", [", ".join(row.missing_figures) for row in rows]),
        Column("changes", [", ".join(row.changed_figures) for row in rows]),
        Column("nodes", [row.nodes for row in rows], "graph\nnodes", nodes, kind="Int64"),
        Column("build [s]", build, "build\ns" if timed else None, [_seconds(value) for value in build]),
        Column("solve [s]", solve, "solve\ns" if timed else None, [_seconds(value) for value in solve]),
        Column("", (), "may go", going, right=False),
        Column(
            "status", [row.status for row in rows], "", ["" if r.status == "optimal" else r.status for r in rows], False
        ),
        Column("why", [row.why for row in rows]),
    ]


def _value_or_zero(value: float | None) -> float:
    return math.nan if value is None else value


def _percent(shares: Sequence[float], head: str) -> tuple[list[float], str, list[str]]:
    """Shares in %, the heading of their column, and as people read them."""
    cells = ["0" if abs(share) <= SHOWN_AS_ZERO else number_text(100 * share, 3) for share in shares]
    return [100 * share for share in shares], head, cells


def _seconds(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.3f}"


def _reference_value(result: EffectsResult, name: str) -> str:
    value, scale = result.reference.figures[name], result.reference.scales[name]
    if value is None:
        return "undefined"
    return UnitFormatter(result.scene).shown(name, 0.0 if abs(value) <= SHOWN_AS_ZERO * scale else value)


def _bars(result: EffectsResult, name: str) -> Bars:
    """Bars of shift and regret of an objective's figure."""
    key = [("c0", "shift at the reference's design"), ("c1", "regret of the design found without it")]
    shares = [(row.shift.get(name), row.regret.get(name)) for row in result.rows]
    return _bars_of(result, f"{name} without an effect", key, shares)


def _bars_of(
    result: EffectsResult,
    title: str,
    key: Sequence[tuple[str, str]],
    shares: Sequence[Sequence[float | None]],
    signed: bool = True,
) -> Bars:
    """Bars of shares in %, a row for each effect; signed: to both sides of 0."""
    names = [f"{row.effect}{' (may go)' if row.effect in result.left_out else ''}" for row in result.rows]
    rows = [[_end(share, signed) for share in row] for row in shares]
    known, tolerance = [end for row in rows for end in row if end is not None], 100 * result.tolerance
    least, most = min([-tolerance * signed, *known]), max([tolerance, *known])
    linear = max(tolerance / 10, max(most, -least) / 10**DECADES)
    axis = both_sides(ROOMY * least, ROOMY * most, linear, "share of the scale [%]")
    numbers = [[_number(share) for share in row] for row in shares]
    places = [tolerance, -tolerance] if signed else [tolerance]
    lines = list(zip(names, rows, strict=True))
    return Bars(title, lines, key, axis, places, f"tolerance {tolerance:g} %", numbers)


def _end(share: float | None, signed: bool) -> float | None:
    """End of a bar, %: 0 for rounding and for limits that hold."""
    if share is None or not math.isfinite(share):
        return None
    return 0.0 if abs(share) <= SHOWN_AS_ZERO or (share < 0.0 and not signed) else 100 * share


def _number(share: float | None) -> str:
    """Share as the number at a bar."""
    if share is None:
        return "none"
    return "0" if abs(share) <= SHOWN_AS_ZERO else f"{100 * share:+.3g} %"


def list_text(names: Sequence[str]) -> str:
    """Names as a sentence has them."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def verdict(result: EffectsResult) -> list[str]:
    """Sentences on the effects that may be left out, their verification, and remarks."""
    share, solve = f"{100 * result.tolerance:g} %", call(result.command or "")
    if not result.finished:
        return ["Not finished: the effects that may be left out are not known."]
    if not result.reference.scales:
        return ["The influence of effects cannot be measured, because the reference has no design."]
    sentence = f"{list_text(result.left_out)} may be left out" if result.left_out else "no effect may be left out"
    lines = [f"At {share}, {sentence}{': ' if solve else ''}{solve}"]
    if result.together and result.largest_omission:
        largest = result.together.largest_change
        change = f"at most {_change(*largest)}" if abs(largest[2]) > SHOWN_AS_ZERO else "nothing changes"
        lines.append(f"Without these effects, evaluated with all effects: {change}.")
        if len(result.left_out) > 1 and abs(result.largest_omission.value) > SHOWN_AS_ZERO:
            by, of, value = result.largest_omission.by, result.largest_omission.of, result.largest_omission.value
            lines[-1] += f" The largest part is that of {result.largest_omission.effect}: {_change(by, of, value)}."
    lines += omission_sentences(result)
    alone = [row.effect for row in result.rows if row.may_go and row.effect not in result.left_out]
    if alone:
        lines.append(f"{list_text(alone)} may be left out alone, but not together with the others.")
    same = [row.effect for row in result.rows if _only_figures(row, result.tolerance)]
    if same:
        lines.append(f"Without {list_text(same)} the design is as good, but its figures change by more than that.")
    if result.judged:
        lines.append(f"Evaluate the design with {list_text(result.judged)}, which solve does not accept.")
    return lines


def omission_sentences(result: EffectsResult) -> list[str]:
    """Sentences on figures that are missing or changed without the omitted effects, and on those the target reads."""
    rows = [row for row in result.rows if row.effect in result.left_out]
    sentences, names = list[str](), dict[str, None]()
    for row in (*rows, *([result.together] if result.together and len(rows) > 1 else [])):
        single = row in rows
        missing, changed = row.missing_figures, row.changed_figures if single else ()
        parts = [f"{list_text(missing)} {'is' if len(missing) == 1 else 'are'} missing"] if missing else []
        parts += [f"{list_text(changed)} {'changes' if len(changed) == 1 else 'change'}"] if changed else []
        sentences += (
            [f"{f'without {row.effect}' if single else 'without all of them'} {' and '.join(parts)}"] if parts else []
        )
        names |= dict.fromkeys((*row.missing_figures, *row.changed_figures))
    if not sentences:
        return []
    read = [name for name in names if name in result.reference.reads]
    which = f"reads {list_text(read)} of them" if read else "reads none of these figures"
    return [f"Of the other figures: {'; '.join(sentences)}. Target {result.target} {which}."]


def _change(by: str, of: str, value: float) -> str:
    """A change in words: by "shift" or "regret", of a figure or of the limits."""
    share = f"{100 * value:.3g} %"
    if of == LIMITS:
        return f"a limit is exceeded by {share}"
    return f"{of} {'shifts by' if by == 'shift' else 'is worse by'} {share}"


def _only_figures(row: EffectImpact, tolerance: float) -> bool:
    """Whether the optimum without an effect is good in the reference, and only its figures are wrong."""
    numbers = (*row.regret.values(), row.excess)
    known = [value for value in row.shift.values() if value is not None]
    good = bool(known) and all(value is not None and value <= tolerance for value in numbers)
    return good and max(map(abs, known)) > tolerance


def _notes(result: EffectsResult) -> list[str]:
    """Sentences on unexpected rows and on effects that were not measured."""
    lines = [f"{row.effect}: {row.why}" for row in result.rows if row.why]
    lines += [f"{name} is not measured: {why}" for name, why in result.out.items()]
    return lines + [f"{name}: {why}" for name, why in result.unknown.items()]
