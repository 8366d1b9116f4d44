"""Solve the packaged scenes again and compare with the reference tables: optima, and one front per job."""

import functools
import io
import itertools
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
from loomopt.solving.answer.solution import Solution, UnitFormatter, grouped
from loomopt.studies.front import front, plan, trade
from loomopt.studies.run import run
from loomopt.studies.run.rows import Row, StudyTask

if TYPE_CHECKING:
    import pandas as pd

REPRODUCED_OBJECTIVE, REPRODUCED_DESIGN = 1e-8, 1e-6
"""Relative differences that `check` allows: the default accuracy for objectives, and a hundred times that for a design,
which is less accurate than its objective."""

LEAST = {"rad": 1.0, "m": 1e-3, "kg": 1.0, "N*m": 1.0}
"""Least sizes to which a difference is relative, by unit, SI."""
LARGEST = {"N*m": "peak_torque [N*m]", "N": "contact_max [N]"}
"""Columns whose size other columns of the same unit, which may be zero, are relative to."""


def read_reference(path: Path) -> "pd.DataFrame | None":
    """Reference table, its cells as texts; None without a file."""
    import pandas as pd

    if not path.is_file():
        return None
    text = "".join(line for line in path.read_text(encoding="utf-8").splitlines(True) if not line.startswith("#"))
    return pd.read_csv(io.StringIO(text), keep_default_na=False, dtype=str)


def find_differences(now: "pd.DataFrame", then: "pd.DataFrame", objectives: Collection[str]) -> Iterator[str]:
    """Yield the differences between a table of one line, SI, and its reference; objectives: compared most strictly."""
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
"""Designs of a front, without those that narrow down its changes."""
CHECKED_SHARES = 0.25, 0.5, 0.75
"""Places between the ends where a front is solved again, as shares of the second axis."""


def reference_trade(scene: Scene) -> trade.Trade | None:
    """Front that represents a scene's job; None where the scene is not the one of the job's name, or has no front."""
    conflict = scene.schema.conflict
    if conflict is None or scene.name != scene.schema.name:
        return None
    return front.trade(scene, conflict.axes, conflict.target, maximise=conflict.maximise, points=POINTS)


def trade_title(study: trade.Trade) -> str:
    """Title of a front."""
    return " against ".join(study.axes)


def front_file(study: trade.Trade) -> str:
    """File name of a front."""
    return f"{study.scene.name}.{'-against-'.join(study.axes)}.csv"


def front_table(study: trade.Trade) -> "pd.DataFrame":
    """Table of a front, one line per certified design, in the order of the second axis; SI."""
    import pandas as pd

    rows = trade.read_front(study, run.run(study)).rows
    frame = pd.DataFrame([front_line(study, row) for row in rows if row.certified])
    settings = {"target": study.target or "none", "accuracy": study.accuracy, "points": study.points}
    frame.attrs.update(provenance.provenance(study.scene, **settings))
    return frame


def front_line(study: trade.Trade, row: Row) -> dict[str, object]:
    """Line of a certified design of a front, SI: requested value, axes, figures, slope, active limits."""
    words, (first, second) = UnitFormatter(study.scene), study.axes
    over, under = words.si(first), words.si(second)
    slope = row.multipliers.get(study.solver.slope, "")
    line: dict[str, object] = {"status": row.status, f"asked {second} [{under}]": row.place.get(second, "")}
    axes = {name: plan.value(row, name) for name in study.axes}
    numbers = {**axes, **row.design, **row.figures, **axes}
    line |= {f"{name} [{words.si(name)}]": value for name, value in numbers.items() if value is not None}
    line[f"{study.solver.slope.text} [{over}/{grouped(under)}]"] = slope
    line["touched"] = " | ".join(dict.fromkeys(str(label) for label, *_ in row.warm["active"]))
    return line


def check_front(study: trade.Trade, then: "pd.DataFrame") -> Iterator[tuple[str, list[str]]]:
    """Yield the status of every design that is solved again, and the differences of its line from the reference.

    These are both ends and three designs between them. Every solve starts from the design of its line, and those
    between the ends also from the nearest end.
    """
    import pandas as pd

    formatter, second = UnitFormatter(study.scene), study.axes[1]
    request, figure = (f"{kind}{second} [{formatter.si(second)}]" for kind in ("asked ", ""))
    values = [float(value) for value in then[figure]]
    ends = _front_ends(study, values)
    rows: dict[int, Row] = {}
    for place in dict.fromkeys((*ends, *_inner_lines(values))):
        near = _front_start(study, {str(name): str(cell) for name, cell in then.iloc[place].items()})
        if place in ends:
            task = StudyTask(ends.index(place), None, {}, {"end": ends.index(place), "also": near})
            parent = None
        else:
            parent = rows[min(ends, key=lambda end: abs(values[end] - values[place]))]
            ask = {"also": near, "held": rows[ends[0]].warm.get("held", []), "wide": False}
            task = StudyTask(place, parent.point, {second: float(then[request].iloc[place])}, ask)
        rows[place] = row = study.solved(task, parent if parent and parent.certified else None)
        spot = f"{second} {formatter.shown(second, values[place])}"
        if not row.certified:
            yield row.status, [f"{spot}: {row.status}, {row.reason}"]
            continue
        now = pd.DataFrame([front_line(study, row)])
        differences = find_differences(now, then.iloc[place : place + 1], study.axes)
        yield row.status, [f"{spot}: {difference}" for difference in differences]


def _front_ends(study: trade.Trade, values: list[float]) -> tuple[int, int]:
    """Lines with the best value of the first axis, and of the second; lines are in the order of the second."""
    first, last = 0, len(values) - 1
    return (last, first) if study.senses[1] == "least" else (first, last)


def _inner_lines(values: list[float]) -> list[int]:
    """Lines nearest to the shares `CHECKED_SHARES` of the second axis, without the ends."""
    low, high = values[0], values[-1]
    inner = range(1, len(values) - 1)
    return [min(inner, key=lambda k: abs(values[k] - low - share * (high - low))) for share in CHECKED_SHARES if inner]


def _front_start(study: trade.Trade, line: Mapping[str, str]) -> list[dict[str, dict[str, object]]]:
    """Design of a line as the start of a solve; empty where it does not assemble."""
    job, scene = study.solver.job, study.scene
    cells = {split(name)[0]: value for name, value in line.items()}
    design = {name: float(cells[scene.full(name)]) for name in job.today(scene)}
    try:
        return [{"point": {"task": "", "x": job.values(study.solver.base, design)}}]
    except (ValueError, ZeroDivisionError):
        return []


OnStep = Callable[[str], None]


@dataclass(frozen=True)
class Outcome:
    """Comparison of one target or front with its reference; without differences it reproduces."""

    problem: str
    target: str
    status: str
    differences: tuple[str, ...]


def check(problems: Iterable[str] = (), folder: Path | None = None, on_step: OnStep | None = None) -> Iterable[Outcome]:
    """Yield an outcome for every target and front of the named scenes, or of all packaged ones and those of plug-ins.

    on_step(text): called before every solve. Raises BadInput for a name that is not packaged.
    """
    for name in check_names(problems):
        scene = registry.load(name)
        for target in available_targets(scene):
            answer = _solve(scene, target, on_step)
            path = (folder or registry.results(scene)) / f"{name}.{target}.csv"
            yield Outcome(name, target, answer.status, tuple(_differences(reference_table(answer, scene), path)))
        if scene.schema.conflict:
            yield from _fronts(scene, folder or registry.results(scene), on_step)


def check_names(problems: Iterable[str]) -> list[str]:
    """Names of packaged scenes, all without an argument. Raises BadInput for a name that is not packaged."""
    names, known, faults = list(problems), packaged.problems(), tuple[BadInput, ...]()
    if not names or not known.keys() >= set(names):
        others, faults = registry.external_scenes()
        known = others | known
    for name in names:
        if name not in known:
            problem = "; ".join([f"{name} is not a packaged scene", *(fault.problem for fault in faults)])
            raise BadInput(problem, value=name, allowed=", ".join(known), remedy="Name one of these.")
    return names or sorted(known)


def available_targets(scene: Scene) -> list[str]:
    """Targets for which a scene has all numbers and effects."""
    targets = []
    for target in scene.schema.targets:
        try:
            registry.of(scene).demand(scene, target)
        except BadInput:
            continue
        targets.append(target)
    return targets


def reference_table(answer: Solution, scene: Scene) -> "pd.DataFrame":
    """Reference table of an answer: status, figures, design, binding limits; SI, one row."""
    import pandas as pd

    columns: dict[str, Any] = {"status": answer.status}
    figures = {**answer.figures, **answer.design}
    lists = {
        f"{key} [{answer.units[name]}]": value
        for name in scene.schema.lists
        for key, value in designs.flat({name: answer.design.get(name, ())}).items()
    }
    if answer.status == "infeasible":
        figures = {}
        columns["clash"] = " | ".join(answer.clash)
        columns |= {f"needed {r.limit} {r.side}{' alone' if r.alone else ''} [SI]": r.needed for r in answer.relaxation}
    single = {k: value for k, value in figures.items() if value is not None and k not in scene.schema.lists}
    columns |= {f"{k} [{answer.units[k]}]": value for k, value in single.items()} | lists
    if answer.certificate:
        columns["binding"] = " | ".join(sorted(f"{price.limit} {price.side}" for price in answer.binding))
        columns["objectives"] = " | ".join(level.objective for level in answer.certificate.levels)
        columns["unique"] = answer.certificate.unique
    frame = pd.DataFrame([columns])
    frame.attrs.update(provenance.provenance(scene, target=answer.target, accuracy=ACCURACY))
    return frame


def _solve(scene: Scene, target: str, on_step: OnStep | None) -> Solution:
    """Answer of a target, after a call of on_step."""
    if on_step:
        on_step(f"solving {scene.name}, {target}")
    return engine.solve(scene, target)


def _fronts(scene: Scene, folder: Path, on_step: OnStep | None) -> Iterable[Outcome]:
    """Yield the outcome of the front that represents a scene's job, if it has one."""
    study = reference_trade(scene)
    if study is None:
        return
    title = trade_title(study)
    if on_step:
        on_step(f"solving {scene.name}, {title}")
    path = folder / front_file(study)
    then = read_reference(path)
    if then is None:
        yield Outcome(scene.name, title, "not solved", (f"no reference table {path.name}",))
        return
    designs_of_front = list(check_front(study, then))
    status = next((status for status, _ in designs_of_front if status != "optimal"), "optimal")
    differences = tuple(itertools.chain.from_iterable(differences for _, differences in designs_of_front))
    yield Outcome(scene.name, title, status, differences)


def _differences(now: "pd.DataFrame", path: Path) -> list[str]:
    """Differences between an answer and its reference table."""
    then = read_reference(path)
    if then is None:
        return [f"no reference table {path.name}"]
    objectives = str(then["objectives"].iloc[0]).split(" | ") if "objectives" in then else []
    return list(find_differences(now, then, objectives))


def write(folder: Path, problems: Iterable[str] = (), on_step: OnStep | None = None) -> list[Path]:
    """Write the reference tables of all targets and fronts of the named scenes, all by default; the paths written."""
    from loomopt.base.files import atomically

    paths = []
    for name in check_names(problems):
        scene = registry.load(name)
        for target in available_targets(scene):
            text = provenance.csv(reference_table(_solve(scene, target, on_step), scene))
            paths.append(folder / f"{name}.{target}.csv")
            atomically(paths[-1], functools.partial(_put, text))
        study = reference_trade(scene)
        if study:
            if on_step:
                on_step(f"solving {name}, {trade_title(study)}")
            paths.append(folder / front_file(study))
            atomically(paths[-1], functools.partial(_put, provenance.csv(front_table(study))))
    return paths


def _put(text: str, path: Path) -> None:
    """Write a text."""
    path.write_text(text, encoding="utf-8")
