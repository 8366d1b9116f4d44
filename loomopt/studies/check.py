"""Solve the packaged scenes again and compare with the reference tables: verified optima, and a front for each job."""

import functools
import io
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.model.curves import split
from loomopt.physics.tolerances import ACCURACY
from loomopt.scenes import designs, packaged, provenance
from loomopt.scenes.scene import Scene
from loomopt.solving import engine
from loomopt.solving.answer.solution import Solution, Words, grouped
from loomopt.studies.front import front, plan, trade
from loomopt.studies.run import run
from loomopt.studies.run.rows import Row, StudyTask

if TYPE_CHECKING:
    import pandas as pd

REPRODUCED_OBJECTIVE, REPRODUCED_DESIGN = 1e-8, 1e-6
"""Differences that `check` allows, relative: the accuracy asked by default, and a hundred times that for a design,
which moves more than its objective does."""

LEAST = {"rad": 1.0, "m": 1e-3, "kg": 1.0, "N*m": 1.0}
"""Sizes below which a difference is measured against the size instead, by unit, SI."""
LARGEST = {"N*m": "peak_torque [N*m]", "N": "contact_max [N]"}
"""Figures that another of the same unit, which may be zero, is measured against."""


def read_reference(path: Path) -> "pd.DataFrame | None":
    """Return a reference table, its cells as they stand there; None where there is none."""
    import pandas as pd

    if not path.is_file():
        return None
    text = "".join(line for line in path.read_text(encoding="utf-8").splitlines(True) if not line.startswith("#"))
    return pd.read_csv(io.StringIO(text), keep_default_na=False, dtype=str)


def differing(now: "pd.DataFrame", then: "pd.DataFrame", objectives: Collection[str]) -> Iterator[str]:
    """Yield every difference between a table of one line, SI, and its reference; objectives: figures held closest."""
    yield from (f"column {name} is new" for name in now.columns.difference(then.columns))
    yield from (f"column {name} is gone" for name in then.columns.difference(now.columns))
    least = LEAST | {of: float(then[column].iloc[0]) for of, column in LARGEST.items() if column in then}
    for name in now.columns.intersection(then.columns):
        new, old = now[name].iloc[0], then[name].iloc[0]
        if isinstance(new, str) or name == "unique":
            if str(new) != str(old):
                yield f"{name}: {new}, reference {old}"
            continue
        figure, unit = split(name)
        allowed = REPRODUCED_OBJECTIVE if figure in objectives else REPRODUCED_DESIGN
        size = max(abs(float(old)), least.get(unit, 1e-3))
        if not abs(float(new) - float(old)) <= allowed * size:
            yield f"{name}: {float(new)!r}, reference {float(old)!r}"


POINTS = 12
"""Designs of a front asked for, beside those that narrow its changes down."""
BETWEEN = 0.25, 0.5, 0.75
"""Where between its ends a front is solved again, as shares of the second axis."""


def reference_trade(scene: Scene) -> trade.Trade | None:
    """Return the front that stands for a scene's job; None where the scene is not named after it, or it has none."""
    found = scene.schema.conflict
    if found is None or scene.name != scene.schema.name:
        return None
    return front.trade(scene, found.axes, found.target, maximise=found.maximise, points=POINTS)


def trade_said(study: trade.Trade) -> str:
    """Return what a front is called."""
    return " against ".join(study.axes)


def front_file(study: trade.Trade) -> str:
    """Return the name of a front's file."""
    return f"{study.scene.name}.{'-against-'.join(study.axes)}.csv"


def front_table(study: trade.Trade) -> "pd.DataFrame":
    """Return the whole front as a table, a line for each of its designs in the order of the second axis; SI."""
    import pandas as pd

    found = trade.read_front(study, run.run(study))
    frame = pd.DataFrame([front_line(study, row) for row in found.rows if row.certified])
    more = {"target": study.target or "none", "accuracy": study.accuracy, "points": study.points}
    frame.attrs.update(provenance.provenance(study.scene, **more))
    return frame


def front_line(study: trade.Trade, row: Row) -> dict[str, object]:
    """Return a certified design of a front as a line, SI: what was asked, axes, figures, slope, what is touched."""
    words, (first, second) = Words(study.scene), study.axes
    over, under = words.si(first), words.si(second)
    slope = row.multipliers.get(study.solver.slope, "")
    found: dict[str, object] = {"status": row.status, f"asked {second} [{under}]": row.place.get(second, "")}
    axes = {name: plan.value(row, name) for name in study.axes}
    numbers = {**axes, **row.design, **row.figures, **axes}
    found |= {f"{name} [{words.si(name)}]": value for name, value in numbers.items() if value is not None}
    found[f"{study.solver.slope.text} [{over}/{grouped(under)}]"] = slope
    found["touched"] = " | ".join(dict.fromkeys(str(label) for label, *_ in row.warm["active"]))
    return found


def checked_front(study: trade.Trade, then: "pd.DataFrame") -> Iterator[tuple[str, list[str]]]:
    """Yield the status of each design that is solved again, and what of its line in a reference differs.

    Its ends and three designs between, each from the design of its line, those between also from the nearest end.
    """
    import pandas as pd

    words, second = Words(study.scene), study.axes[1]
    asked, figure = (f"{kind}{second} [{words.si(second)}]" for kind in ("asked ", ""))
    values = [float(value) for value in then[figure]]
    ends = _front_ends(study, values)
    rows: dict[int, Row] = {}
    for place in dict.fromkeys((*ends, *_front_between(values))):
        near = _front_start(study, {str(name): str(cell) for name, cell in then.iloc[place].items()})
        if place in ends:
            task = StudyTask(ends.index(place), None, {}, {"end": ends.index(place), "also": near})
            parent = None
        else:
            parent = rows[min(ends, key=lambda end: abs(values[end] - values[place]))]
            ask = {"also": near, "held": rows[ends[0]].warm.get("held", []), "wide": False}
            task = StudyTask(place, parent.point, {second: float(then[asked].iloc[place])}, ask)
        rows[place] = row = study.solved(task, parent if parent and parent.certified else None)
        spot = f"{second} {words.shown(second, values[place])}"
        if not row.certified:
            yield row.status, [f"{spot}: {row.status}, {row.reason}"]
            continue
        now = pd.DataFrame([front_line(study, row)])
        found = differing(now, then.iloc[place : place + 1], study.axes)
        yield row.status, [f"{spot}: {difference}" for difference in found]


def _front_ends(study: trade.Trade, values: list[float]) -> tuple[int, int]:
    """Return the lines where the first axis, and the second, is best: lines are in the order of the second."""
    first, last = 0, len(values) - 1
    return (last, first) if study.senses[1] == "least" else (first, last)


def _front_between(values: list[float]) -> list[int]:
    """Return the lines nearest to even shares of the second axis, the ends apart."""
    low, high = values[0], values[-1]
    inner = range(1, len(values) - 1)
    return [min(inner, key=lambda k: abs(values[k] - low - share * (high - low))) for share in BETWEEN if inner]


def _front_start(study: trade.Trade, told: Mapping[str, str]) -> list[dict[str, dict[str, object]]]:
    """Return the design of a line as what a solve may start from; nothing where it does not assemble."""
    job, scene = study.solver.job, study.scene
    cells = {split(name)[0]: value for name, value in told.items()}
    design = {name: float(cells[scene.full(name)]) for name in job.today(scene)}
    try:
        return [{"point": {"task": "", "x": job.values(study.solver.base, design)}}]
    except (ValueError, ZeroDivisionError):
        return []


OnStep = Callable[[str], None]


@dataclass(frozen=True)
class Outcome:
    """One scene and target, or front, beside its reference; differences are named, none means it reproduces."""

    problem: str
    target: str
    status: str
    differences: tuple[str, ...]


def check(problems: Iterable[str] = (), folder: Path | None = None, on_step: OnStep | None = None) -> Iterable[Outcome]:
    """Yield an outcome for every target and front of the named scenes (all packaged ones, and plug-ins', without one).

    on_step: called with what is being done, before it is. Raises BadInput for a name that is not packaged.
    """
    for name in named(problems):
        scene = registry.load(name)
        for target in served(scene):
            found = _solved(scene, target, on_step)
            path = (folder or registry.results(scene)) / f"{name}.{target}.csv"
            yield Outcome(name, target, found.status, tuple(_differences(reference(found, scene), path)))
        if scene.schema.conflict:
            yield from _fronts(scene, folder or registry.results(scene), on_step)


def named(problems: Iterable[str]) -> list[str]:
    """Return the names of packaged scenes, of all without one. Raises BadInput for a name that is not packaged."""
    names, known, faults = list(problems), packaged.problems(), tuple[BadInput, ...]()
    if not names or not known.keys() >= set(names):
        others, faults = registry.brought()
        known = others | known
    for name in names:
        if name not in known:
            problem = "; ".join([f"{name} is not a packaged scene", *(fault.problem for fault in faults)])
            raise BadInput(problem, value=name, allowed=", ".join(known), remedy="Name one.")
    return names or sorted(known)


def served(scene: Scene) -> list[str]:
    """Return the targets that a scene has what they need for."""
    found = []
    for target in scene.schema.targets:
        try:
            registry.of(scene).demand(scene, target)
        except BadInput:
            continue
        found.append(target)
    return found


def reference(found: Solution, scene: Scene) -> "pd.DataFrame":
    """Return the table that stands for an answer: status, figures, design, what binds; SI, one row."""
    import pandas as pd

    columns: dict[str, Any] = {"status": found.status}
    figures = {**found.figures, **found.design}
    lists = {
        f"{key} [{found.units[name]}]": value
        for name in scene.schema.lists
        for key, value in designs.flat({name: found.design.get(name, ())}).items()
    }
    if found.status == "infeasible":
        figures = {}
        columns["clash"] = " | ".join(found.clash)
        columns |= {f"needed {r.limit} {r.side}{' alone' if r.alone else ''} [SI]": r.needed for r in found.relaxation}
    single = {k: value for k, value in figures.items() if value is not None and k not in scene.schema.lists}
    columns |= {f"{k} [{found.units[k]}]": value for k, value in single.items()} | lists
    if found.certificate:
        columns["binding"] = " | ".join(sorted(f"{price.limit} {price.side}" for price in found.binding))
        columns["objectives"] = " | ".join(level.objective for level in found.certificate.levels)
        columns["unique"] = found.certificate.unique
    frame = pd.DataFrame([columns])
    frame.attrs.update(provenance.provenance(scene, target=found.target, accuracy=ACCURACY))
    return frame


def _solved(scene: Scene, target: str, on_step: OnStep | None) -> Solution:
    """Return the answer of a target, after telling which it is."""
    if on_step:
        on_step(f"solving {scene.name}, {target}")
    return engine.solve(scene, target)


def _fronts(scene: Scene, folder: Path, on_step: OnStep | None) -> Iterable[Outcome]:
    """Yield the outcome of the front that stands for a scene's job, where there is one."""

    study = reference_trade(scene)
    if study is None:
        return
    called = trade_said(study)
    if on_step:
        on_step(f"solving {scene.name}, {called}")
    path = folder / front_file(study)
    then = read_reference(path)
    if then is None:
        yield Outcome(scene.name, called, "not solved", (f"no reference table {path.name}",))
        return
    found = list(checked_front(study, then))
    status = next((status for status, _ in found if status != "optimal"), "optimal")
    yield Outcome(scene.name, called, status, tuple(each for _, differences in found for each in differences))


def _differences(now: "pd.DataFrame", path: Path) -> list[str]:
    """Name every difference between an answer and its reference table."""
    then = read_reference(path)
    if then is None:
        return [f"no reference table {path.name}"]
    objectives = str(then["objectives"].iloc[0]).split(" | ") if "objectives" in then else []
    return list(differing(now, then, objectives))


def write(folder: Path, problems: Iterable[str] = (), on_step: OnStep | None = None) -> list[Path]:
    """Write the reference table of every target and front of the named scenes (all without one); returns the files."""
    from loomopt.base.files import atomically

    written = []
    for name in named(problems):
        scene = registry.load(name)
        for target in served(scene):
            text = provenance.csv(reference(_solved(scene, target, on_step), scene))
            written.append(folder / f"{name}.{target}.csv")
            atomically(written[-1], functools.partial(_put, text))
        study = reference_trade(scene)
        if study:
            if on_step:
                on_step(f"solving {name}, {trade_said(study)}")
            written.append(folder / front_file(study))
            atomically(written[-1], functools.partial(_put, provenance.csv(front_table(study))))
    return written


def _put(text: str, path: Path) -> None:
    path.write_text(text, encoding="utf-8")
