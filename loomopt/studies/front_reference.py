"""The front that stands for a job among the reference results: written whole; checked at its ends and between."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from loomopt.scene import provenance
from loomopt.scene.scene import Scene
from loomopt.solve.answer.words import Words, grouped
from loomopt.studies import front, front_plan, front_read, front_trade, references, runs
from loomopt.studies.plan import Task
from loomopt.studies.rows import Row

if TYPE_CHECKING:
    import pandas as pd

POINTS = 12
"""Designs of a front asked for, beside those that narrow its changes down."""
BETWEEN = 0.25, 0.5, 0.75
"""Where between its ends a front is solved again, as shares of the second axis."""


def trade(scene: Scene) -> front_trade.Trade | None:
    """Return the front that stands for a scene's job; None where the scene is not named after it, or it has none."""
    found = scene.schema.conflict
    if found is None or scene.name != scene.schema.name:
        return None
    return front.trade(scene, found.axes, found.target, maximise=found.maximise, points=POINTS)


def said(study: front_trade.Trade) -> str:
    """Return what a front is called."""
    return " against ".join(study.axes)


def file(study: front_trade.Trade) -> str:
    """Return the name of a front's file."""
    return f"{study.scene.name}.{'-against-'.join(study.axes)}.csv"


def table(study: front_trade.Trade) -> "pd.DataFrame":
    """Return the whole front as a table, a line for each of its designs in the order of the second axis; SI."""
    import pandas as pd

    found = front_read.read(study, runs.run(study))
    frame = pd.DataFrame([line(study, row) for row in found.rows if row.certified])
    more = {"target": study.target or "none", "accuracy": study.accuracy, "points": study.points}
    frame.attrs.update(provenance.provenance(study.scene, **more))
    return frame


def line(study: front_trade.Trade, row: Row) -> dict[str, object]:
    """Return a certified design of a front as a line, SI: what was asked, axes, figures, slope, what is touched."""
    words, (first, second) = Words(study.scene), study.axes
    over, under = words.si(first), words.si(second)
    slope = row.multipliers.get(study.solver.slope, "")
    found: dict[str, object] = {"status": row.status, f"asked {second} [{under}]": row.place.get(second, "")}
    axes = {name: front_plan.value(row, name) for name in study.axes}
    numbers = {**axes, **row.design, **row.figures, **axes}
    found |= {f"{name} [{words.si(name)}]": value for name, value in numbers.items() if value is not None}
    found[f"{study.solver.slope} [{over}/{grouped(under)}]"] = slope
    found["touched"] = " | ".join(dict.fromkeys(str(label) for label, *_ in row.warm["active"]))
    return found


def checked(study: front_trade.Trade, then: "pd.DataFrame") -> Iterator[tuple[str, list[str]]]:
    """Yield the status of each design that is solved again, and what of its line in a reference differs.

    Its ends and three designs between, each from the design of its line, those between also from the nearest end.
    """
    import pandas as pd

    words, second = Words(study.scene), study.axes[1]
    asked, figure = (f"{kind}{second} [{words.si(second)}]" for kind in ("asked ", ""))
    values = [float(value) for value in then[figure]]
    ends = _ends(study, values)
    rows: dict[int, Row] = {}
    for place in dict.fromkeys((*ends, *_between(values))):
        near = _start(study, {str(name): str(cell) for name, cell in then.iloc[place].items()})
        if place in ends:
            task = Task(ends.index(place), None, {}, {"end": ends.index(place), "also": near})
            parent = None
        else:
            parent = rows[min(ends, key=lambda end: abs(values[end] - values[place]))]
            ask = {"also": near, "held": rows[ends[0]].warm.get("held", []), "wide": False}
            task = Task(place, parent.point, {second: float(then[asked].iloc[place])}, ask)
        rows[place] = row = study.solved(task, parent if parent and parent.certified else None)
        spot = f"{second} {words.shown(second, values[place])}"
        if not row.certified:
            yield row.status, [f"{spot}: {row.status}, {row.reason}"]
            continue
        now = pd.DataFrame([line(study, row)])
        found = references.differing(now, then.iloc[place : place + 1], study.axes)
        yield row.status, [f"{spot}: {difference}" for difference in found]


def _ends(study: front_trade.Trade, values: list[float]) -> tuple[int, int]:
    """Return the lines where the first axis, and the second, is best: lines are in the order of the second."""
    first, last = 0, len(values) - 1
    return (last, first) if study.senses[1] == "least" else (first, last)


def _between(values: list[float]) -> list[int]:
    """Return the lines nearest to even shares of the second axis, the ends apart."""
    low, high = values[0], values[-1]
    inner = range(1, len(values) - 1)
    return [min(inner, key=lambda k: abs(values[k] - low - share * (high - low))) for share in BETWEEN if inner]


def _start(study: front_trade.Trade, told: Mapping[str, str]) -> list[dict[str, dict[str, object]]]:
    """Return the design of a line as what a solve may start from; nothing where it does not assemble."""
    job, scene = study.solver.job, study.scene
    cells = {name.split(" [")[0]: value for name, value in told.items()}
    design = {name: float(cells[scene.full(name)]) for name in job.today(scene)}
    try:
        return [{"point": {"task": "", "x": job.values(study.solver.base, design)}}]
    except (ValueError, ZeroDivisionError):
        return []
