"""Parts of a page on a study: results of its points first, then charts, designs along it, table."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from loomopt.interface import study_table
from loomopt.interface.report import charts, machine
from loomopt.interface.report.answer import Status
from loomopt.interface.report.markup import Markup, Part
from loomopt.jobs import registry
from loomopt.model.session import working
from loomopt.picture.motion import MechanismMotion, crank_angles
from loomopt.studies.run.rows import Row, SceneStudy

STAGES = 12
"""Largest number of designs in the animation of a study."""


def status(study: SceneStudy, solved: Sequence[Row]) -> Status:
    """Verdict on a study: its rows are certified, shown infeasible, or neither."""
    findings = study.read(solved)
    rows = findings.rows
    counts = Counter("certified" if row.certified else row.status for row in rows)
    summary = ", ".join(f"{count} {word}" for word, count in counts.items()) or "no point"
    size = study.size
    unfinished = [f"{size - len(solved)} of {size} points are not solved yet"] if size and len(solved) < size else []
    if not rows or not counts["certified"]:
        level, verdict = "bad", f"NO POINT IS CERTIFIED: {summary}"
    elif counts["certified"] + counts["infeasible"] < len(rows):
        level, verdict = "bad", f"NOT ALL POINTS ARE CERTIFIED: {summary}"
    elif counts["infeasible"] or unfinished:
        level, verdict = "open", f"{summary} of {len(rows)} points"
    else:
        level, verdict = "ok", f"All {len(rows)} points certified"
    missed = Counter(row.shortfall for row in rows if row.shortfall)
    sentences = [f"{count} points: {text}." for text, count in missed.items()]
    message = findings.message
    all_infeasible = bool(rows) and counts["infeasible"] == len(rows)
    ends = {"bad": 3 if all_infeasible else 4}.get(level, 0)
    return Status(level, "; ".join([verdict, *unfinished]), (*([message] if message else []), *sentences), ends)


def parts(study: SceneStudy, solved: Sequence[Row]) -> list[Part]:
    """The parts of a study's page; solved: the rows of all points that were."""
    findings = study.read(solved)
    changes = [study_table.change_sentence(study, change, False) for change in findings.changes]
    above = {findings.message, *changes}
    tables = [block for block in study_table.tables(study, solved) if block not in above]
    shown = charts.blocks(study_table.charts(study, findings))
    text = "Each point is a certified design; a line breaks where there is no design."
    costs = [Part("Chart", (text, *shown, *changes))] if shown else []
    stages = _stages(study, findings.rows)
    return [*costs, *([stages] if stages else []), Part("All points", tuple(tables))]


@working()
def _stages(study: SceneStudy, rows: Sequence[Row]) -> Part | None:
    """Animate the designs along a study; a second slider selects the design."""
    motions = stages(study, rows)
    if not motions:
        return None
    view, unit = registry.of(study.scene).views, study.scene.shown_in("angle")
    drawn = machine.widget(list(motions.values()), None, view.angle, unit, 0, list(motions) if len(motions) > 1 else ())
    return Part("Designs of the study", ("The second slider selects a design.", Markup(drawn)))


def stages(study: SceneStudy, rows: Sequence[Row]) -> dict[str, MechanismMotion]:
    """Mechanisms of some certified rows along a study, by their places; none where they cannot be drawn."""
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
        motions[
            ", ".join(study_table.value_text(column, k, 5) for column in (*columns["place"], *columns["optimised"]))
        ] = motion
    return motions
