"""Where the crank torque comes from, for people: a table in the terminal or of pandas, and the motor that it takes."""

import math
from typing import TYPE_CHECKING

from loomopt.base.units import factor
from loomopt.model.budget import TorqueShare
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.picture.table import TextTable
from loomopt.scenes.provenance import provenance
from loomopt.studies.budget import Found

if TYPE_CHECKING:
    import pandas as pd

SAID = {
    "rms_torque": ("rms torque", "torque"),
    "mean_power": ("mean power", "power"),
    "peak_power": ("peak power, driving or braking", "power"),
    "regenerated": ("given back to the motor, mean power", "power"),
    "energy_swing": ("a flywheel takes in and gives back each turn", "energy"),
    "flywheel": ("flywheel at the crank", "inertia"),
}
"""What of the motor is told: how it is called, its kind of quantity."""


def parts(found: Found) -> list[str | TextTable]:
    """Return the parts of a budget in a terminal: a line per effect, their sum, the motor, what to know beside it."""
    scene, own = found.scene, found.found
    peak = scene.show(_shown(own.total.at_peak, own.total.peak), "torque")
    first = f"{scene.name}: the crank torque is largest, {peak}, at {scene.show(own.angle, 'angle')}"
    torque, energy = scene.shown_in("torque"), scene.shown_in("energy")
    heads = (
        "effect",
        f"there\n{torque}",
        "of it\n%",
        f"rms\n{torque}",
        f"largest\n{torque}",
        f"energy a turn\n{energy}",
    )
    lines = tuple(_line(row, found) for row in (*own.rows, own.total))
    names = ("effect", "there", "of it", "rms", "largest", "energy a turn")
    grid = TextTable("", heads, lines, tuple(range(1, 6)), (0, 1, 5), names=names, more="--json")
    motor = tuple((said, _motor(found, name)) for name, (said, _) in SAID.items())
    return [first, grid, TextTable("Motor", ("", ""), motor), *(f"Remark: {text}." for text in found.remarks)]


def _line(row: TorqueShare, found: Found) -> tuple[str, ...]:
    torque, energy = (factor(found.scene.shown_in(kind)) for kind in ("torque", "energy"))
    largest = found.total.peak
    numbers = (row.at_peak / torque, row.rms / torque, row.peak / torque)
    at, rms, peak = (f"{_shown(value, largest / torque):.6g}" for value in numbers)
    share = "" if row.share is None else f"{100 * _shown(row.share, 1.0):.4g}"
    return row.effect, at, share, rms, peak, f"{row.energy / energy:.6g}"


def _shown(value: float, size: float) -> float:
    return 0.0 if abs(value) <= SHOWN_AS_ZERO * size else value


def _motor(found: Found, name: str) -> str:
    value, scene = getattr(found.motor, name), found.scene
    if value is None:
        return f"not known: {found.undefined[name]}"
    told = scene.show(value, SAID[name][1])
    return f"{told} for a fluctuation of {found.found.fluctuation:g}" if name == "flywheel" else told


def frame(found: Found, si: bool = False) -> "pd.DataFrame":
    """Return one line per effect and one for their sum; si: in SI, so that machines in other units can be compared."""
    import pandas as pd

    from loomopt.interface.table_frame import TableFrame

    torque, energy = ("N*m", "J") if si else (found.scene.shown_in(kind) for kind in ("torque", "energy"))
    rows = [*found.rows, found.total]
    cells = {
        f"at_peak [{torque}]": [row.at_peak / factor(torque) for row in rows],
        "share [%]": [math.nan if row.share is None else 100 * row.share for row in rows],
        f"rms [{torque}]": [row.rms / factor(torque) for row in rows],
        f"peak [{torque}]": [row.peak / factor(torque) for row in rows],
        f"energy [{energy}]": [row.energy / factor(energy) for row in rows],
    }
    table = TableFrame(cells, index=pd.Index([row.effect for row in rows], name="effect"))
    motor = {name: value for name, value in found.motor._asdict().items() if value is not None}
    table.attrs.update(provenance(found.scene, study="budget", **motor))
    return table
