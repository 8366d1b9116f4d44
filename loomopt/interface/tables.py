"""Rows of answers and curves as pandas tables; column names carry their unit in ASCII, every table its provenance."""

import functools
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from loomopt.base import arguments
from loomopt.base.errors import refusal
from loomopt.base.units import SI_UNIT, factor
from loomopt.interface import answer_table
from loomopt.jobs import registry
from loomopt.model.session import working
from loomopt.physics.cycle import TURN, Floats
from loomopt.physics.effects.kinds import Event
from loomopt.physics.tolerances import ACCURACY
from loomopt.scenes import designs
from loomopt.scenes.provenance import provenance
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Evaluated, UnitFormatter

if TYPE_CHECKING:
    import pandas as pd

    from loomopt.scenes import csv_tables


def row(solution: Evaluated, scene: Scene, target: str, outcome: str, *, si: bool = False) -> "pd.DataFrame":
    """Design and figures as one row, units in the column names; si: in SI, else in the scene's own units.

    A figure the scene cannot have is left out; part of a design that is a list is a tuple in its cell, SI.
    """

    from loomopt.interface.table_frame import TableFrame

    formatter = UnitFormatter(scene)
    shown = {} if si else {row.name: row.value for row in answer_table.rows(solution, scene)}
    cells: dict[str, object] = {"problem": solution.problem, "target": target, "outcome": outcome}
    for name, value in {**solution.design, **solution.figures}.items():
        listed = name in scene.schema.lists
        unit = formatter.si(name) if si or listed else formatter.unit(name)
        if value is not None:
            cells[f"{name} [{unit}]"] = shown[name] if name in shown else value if listed else value / factor(unit)
    frame = TableFrame([cells])
    frame.attrs.update(provenance(scene, target=target))
    return frame


SHAFT = "omega"
"""Column of the shaft's speed, in the scene's unit of the speed; other angular speeds are in rad/s."""
EVALUATED = 14
"""Significant digits of what is computed of a given design: two less than float64 has."""


def to_file(frame: "pd.DataFrame", scene: Scene) -> "pd.DataFrame":
    """Curves, SI, as a file has them: in the units of the scene's tables, in digits that mean something."""
    from loomopt.model.curves import split

    shown, names = frame.copy(), {}
    for column in frame.columns:
        name, si = split(column)
        unit = scene.shown_in("angular speed") if name == SHAFT else scene.unit_for(si)
        if unit != si:
            shown[column], names[column] = frame[column] / factor(unit), f"{name} [{unit}]"
    return meaningful(shown.rename(columns=names), EVALUATED)


def meaningful(frame: "pd.DataFrame", digits: int | None = None) -> "pd.DataFrame":
    """Table with the significant digits of its numbers, and 0 in place of -0 and of rounding errors.

    digits: number of significant digits; by default two more than the accuracy that the table names.
    """
    if digits is None:
        digits = 2 + math.ceil(-math.log10(float(frame.attrs.get("accuracy", ACCURACY))))
    cleaned = frame.copy()
    for place, column in enumerate(frame.columns):
        values = frame[column]
        if values.dtype.kind == "f":
            tiny = 10.0**-digits * values.abs().max()
            rounded = [v if math.isnan(v) else 0.0 if abs(v) <= tiny else float(f"{v:.{digits}g}") for v in values]
            cleaned.isetitem(place, rounded)
    return cleaned


@working()
def curves(
    scene: Scene,
    design: designs.Design,
    accuracy: float | None = None,
    target: str | None = None,
    measured: str | os.PathLike[str] | None = None,
) -> "pd.DataFrame":
    """Curves of a design (SI; numbers that it does not name are today's) over one turn, SI.

    Every half degree; or, with an accuracy, as few rows as show each column's largest magnitude to it, relative.
    target: target of the design, if known. measured: a CSV file of measured curves, `phi [deg]` and
    columns named as the curves; they become columns NAME_measured, in rows at the measured angles.
    """
    import pandas as pd

    job = registry.of(scene)
    rows = functools.partial(job.curves, scene, {**job.today(scene), **designs.flat(design)})
    more: dict[str, object] = {"target": target} if target else {}
    if accuracy is not None and any(isinstance(effect, Event) for effect in scene.active):
        problem = "the accuracy of curves cannot be chosen for a simulated motion"
        raise refusal(problem, scene.origin, "accuracy", remedy="Leave the accuracy out, or take the effect off")
    given: dict[str, tuple[float, ...]] = {}
    if measured is not None:
        from loomopt.scenes import csv_tables

        place = Path(arguments.path(measured, "measured", "a table: .csv, .xlsx or .parquet", "Name one"))
        table = csv_tables.read_measured(place, _kinds(rows()))
        given = dict(table.columns)
        angles = [angle % TURN for angle in given.pop(PHI)]
        rows = functools.partial(rows, also=angles)
    if accuracy is None:
        columns = rows()
    else:
        from loomopt.model import curves

        columns, error = curves.sparse_curves(job.sampler(scene, designs.flat(design)), rows, accuracy)
        more |= {"accuracy": accuracy, "error_estimate": f"{error:.2g}"}
    if given:
        more |= {"measured": str(measured), **_add_measured(columns, angles, given), **_measurement_notes(table)}
    frame = pd.DataFrame(columns)
    frame.attrs.update(provenance(scene, **more))
    return frame


PHI, MEASURED, RMS = "phi", "_measured", "rms_"
"""Column of crank angles; suffix of a measured column, and prefix of its rms difference."""


def _kinds(columns: "Mapping[str, Floats]") -> dict[str, str]:
    """Kind of quantity of each column of curves that has one, by name, angles phi first."""
    from loomopt.model.curves import split

    kinds = {unit: kind for kind, unit in SI_UNIT.items()}
    named = (split(column) for column in columns)
    return {name: kinds[unit] for name, unit in named if unit in kinds}


def _add_measured(
    columns: "dict[str, Floats]", angles: Sequence[float], measured: Mapping[str, Sequence[float]]
) -> dict[str, float]:
    """Add measured columns to curves, in the rows at their angles, rad; return their rms differences, SI."""
    import numpy as np

    from loomopt.model.curves import ANGLE, split

    phi, measured_values = np.asarray(columns[ANGLE]) % TURN, {}
    apart = np.abs((phi[:, None] - np.array(angles) + math.pi) % TURN - math.pi)
    places = [_place(row, angles[:k].count(angles[k])) for k, row in enumerate(apart.T)]
    for column in [column for column in columns if split(column)[0] in measured]:
        name, unit = split(column)
        values = np.full(len(phi), math.nan)
        values[places] = measured[name]
        columns[f"{name}{MEASURED} [{unit}]"] = values
        off = np.asarray(columns[column])[places] - np.asarray(measured[name])
        measured_values[f"{RMS}{name} [{unit}]"] = float(np.sqrt(np.nanmean(off**2)))
    return measured_values


def _measurement_notes(table: "csv_tables.Table") -> dict[str, object]:
    """Precision of measured columns, SI, and the chosen reading of ambiguous values."""
    precision = {f"precision_{name}": size for name, size in table.precision.items() if size}
    return precision | ({"read": "; ".join(table.remarks)} if table.remarks else {})


SAME = 1e-9
"""rad; rows this close are both sides of a corner."""


def _place(apart: "Floats", before: int) -> int:
    """Row of curves for a measured row; apart: from each of them, rad; before: rows of the same angle."""
    import numpy as np

    near = np.flatnonzero(apart <= apart.min() + SAME)
    return int(near[min(before, len(near) - 1)])
