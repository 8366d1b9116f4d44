"""The parts of a page on a study: what came of its points first, then charts, the designs along it, the table."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from loomopt.interface import study_table
from loomopt.interface.report import machine
from loomopt.interface.report.answer import Status
from loomopt.interface.report.charts import COLOURS, Chart, Series, figure, fitted
from loomopt.interface.report.markup import Markup, Part
from loomopt.interface.study_table import Column
from loomopt.interface.text import studies
from loomopt.jobs import registry
from loomopt.model.session import working
from loomopt.physics.cycle import Floats
from loomopt.picture.motion import MechanismMotion, crank_angles
from loomopt.studies.run.rows import Findings, Row, SceneStudy

STAGES = 12
"""Designs along a study that its moving picture goes through at most."""
LINES = 7
"""Lines of a chart at most: of more every second, third, ..."""


def status(study: SceneStudy, solved: Sequence[Row]) -> Status:
    """Return what a study's rows truly are: certified, shown infeasible, or neither."""
    findings = study.read(solved)
    rows = findings.rows
    counts = Counter("certified" if row.certified else row.status for row in rows)
    told = ", ".join(f"{count} {word}" for word, count in counts.items()) or "no point"
    size = study.size
    unfinished = [f"{size - len(solved)} of {size} points are not solved yet"] if size and len(solved) < size else []
    if not rows or not counts["certified"]:
        level, verdict = "bad", f"NO POINT IS CERTIFIED: {told}"
    elif counts["certified"] + counts["infeasible"] < len(rows):
        level, verdict = "bad", f"NOT ALL POINTS ARE CERTIFIED: {told}"
    elif counts["infeasible"] or unfinished:
        level, verdict = "open", f"{told} of {len(rows)} points"
    else:
        level, verdict = "ok", f"All {len(rows)} points certified"
    missed = Counter(row.shortfall for row in rows if row.shortfall)
    sentences = [f"{count} points: {text}." for text, count in missed.items()]
    message = findings.message
    all_infeasible = bool(rows) and counts["infeasible"] == len(rows)
    ends = {"bad": 3 if all_infeasible else 4}.get(level, 0)
    return Status(level, "; ".join([verdict, *unfinished]), (*([message] if message else []), *sentences), ends)


def parts(study: SceneStudy, solved: Sequence[Row]) -> list[Part]:
    """Return the parts of a study's page; solved: the rows of all points that were."""
    findings = study.read(solved)
    told = {findings.message, *(studies.change_said(study, change, False) for change in findings.changes)}
    tables = [each for each in studies.parts(study, solved) if not isinstance(each, str) or each not in told]
    shown = [_charts(study, findings), _stages(study, findings.rows)]
    return [part for part in shown if part] + [Part("All points", tuple(tables))]


def _charts(study: SceneStudy, findings: Findings) -> Part | None:
    """Draw what a study is about over the first number that varies; a point's ring is hollow where a goal is missed."""
    rows = findings.rows
    columns = study_table.columns(study, rows)
    places = columns["place"]
    panels = columns["sought"] or studies.shown_columns(study, rows)
    panels = [*panels, *(each for each in studies.shown_columns(study, rows) if each not in panels)]
    certified = np.array([row.certified for row in rows])
    if not places or not certified.any():
        return None
    drawn = [_chart(panel, places, certified, findings) for panel in panels]
    said = [studies.change_said(study, change, False) for change in findings.changes]
    told = "Each point is a certified design; where the line breaks there is none."
    return Part("What costs what", (told, Markup(f'<div class="charts">{"".join(map(figure, drawn))}</div>'), *said))


def _chart(panel: Column, places: Sequence[Column], certified: Floats, findings: Findings) -> Chart:
    first, others = places[0], places[1:]
    x, y = _numbers(first), np.where(certified, _numbers(panel), np.nan)
    keys: dict[tuple[float | None, ...], list[int]] = {}
    for k in np.argsort(x, kind="stable"):
        keys.setdefault(tuple(column.shown[k] for column in others), []).append(int(k))
    step = max(1, -(-len(keys) // LINES))
    series, key = [], []
    for place, (values, own) in enumerate(list(keys.items())[::step]):
        kind = f"c{place % COLOURS}"
        label = ", ".join(
            f"{c.name} {v:.6g} {'' if c.unit == '1' else c.unit}"
            for c, v in zip(others, values, strict=True)
            if v is not None
        )
        line = _broken(x[own], y[own], findings, first)
        series += [Series(*line, kind, label), Series(x[own], y[own], kind, points=True)]
        key += [(kind, label)] if label else []
    if step > 1:
        key.append(("", f"one line in {step} is drawn; the table has all"))
    changes = [change.at / first.size for change in findings.changes if change.at is not None]
    title = f"{panel.heading} over {first.heading}"
    return Chart(title, fitted([x]), series, places=changes, key=key)


def _broken(x: Floats, y: Floats, findings: Findings, first: Column) -> tuple[Floats, Floats]:
    """Return a line with a gap where there is no design between two points."""
    gaps = [(low / first.size, high / first.size) for low, high in findings.gaps]
    places = [k for k in range(1, len(x)) if any(x[k - 1] <= low and high <= x[k] and low < high for low, high in gaps)]
    return np.insert(x, places, np.nan), np.insert(y, places, np.nan)


def _numbers(column: Column) -> Floats:
    return np.array([np.nan if value is None else value for value in column.shown], dtype=float)


@working()
def _stages(study: SceneStudy, rows: Sequence[Row]) -> Part | None:
    """Show the designs along a study as one moving picture, whose second slider goes from one to the next."""
    motions = stages(study, rows)
    if not motions:
        return None
    view, unit = registry.of(study.scene).views, study.scene.shown_in("angle")
    drawn = machine.widget(list(motions.values()), None, view.angle, unit, 0, list(motions) if len(motions) > 1 else ())
    return Part("The designs along it", ("The second slider goes along the study.", Markup(drawn)))


def stages(study: SceneStudy, rows: Sequence[Row]) -> dict[str, MechanismMotion]:
    """Return the mechanisms of some certified rows along a study, by their places; none where they cannot be drawn."""
    certified = [row for row in rows if row.certified]
    picked = sorted({round(k) for k in np.linspace(0, len(certified) - 1, min(STAGES, len(certified)))})
    angles, motions = crank_angles(), dict[str, MechanismMotion]()
    columns = study_table.columns(study, certified)
    for k in picked:
        scene = study.scene_at(certified[k].point)
        full = {**registry.of(scene).today(scene), **certified[k].design}
        motion = registry.of(scene).views.motion(scene, full, angles)
        if motion is None:
            return {}
        motions[", ".join(_valued(column, k) for column in (*columns["place"], *columns["sought"]))] = motion
    return motions


def _valued(column: Column, at: int) -> str:
    return f"{column.name} {column.shown[at] or 0.0:.5g}{'' if column.unit == '1' else ' ' + column.unit}"
