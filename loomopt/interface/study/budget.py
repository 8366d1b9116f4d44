"""Torque budget of a design: tables, chart, and the required motor."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from loomopt.base import arguments
from loomopt.base.records import attribute
from loomopt.base.units import factor
from loomopt.interface.study_result import Presentation
from loomopt.physics.cycle import TURN
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.picture.chart import COLOURS, TICKS, Axis, Chart, Charts, Series, heading, thin_rows
from loomopt.picture.table import Column, TextTable, number_text, text_table, words
from loomopt.scenes.designs import Design
from loomopt.scenes.provenance import provenance
from loomopt.scenes.scene import Scene
from loomopt.studies import budget
from loomopt.studies.budget import BudgetResult

if TYPE_CHECKING:
    import pandas as pd

MOTOR = {
    "rms_torque": ("rms torque", "torque"),
    "mean_power": ("mean power", "power"),
    "peak_power": ("peak power, driving or braking", "power"),
    "regenerated": ("mean power returned to the motor", "power"),
    "energy_swing": ("energy exchanged with a flywheel per turn", "energy"),
    "flywheel": ("flywheel at the crank", "inertia"),
}
"""Number of the motor → its name for people and its kind of quantity."""


@dataclass(frozen=True, repr=False)
class Budget(Presentation):
    """Shares of the effects in the crank torque of a design, motor and flywheel; SI and rad."""

    result: BudgetResult
    scene = attribute[Any]()
    torque = attribute[Any]()
    remarks = attribute[tuple[str, ...]]()
    undefined = attribute[Any]()
    rows = attribute[Any]()
    total = attribute[Any]()
    motor = attribute[Any]()
    as_dict = attribute[Callable[[], dict[str, Any]]]()
    heading = "Shares of the crank torque"

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Table of a line per effect and one for their sum; si: in SI, else in the scene's own units."""
        from loomopt.interface.table_frame import frame

        motor = {name: value for name, value in self.result.motor._asdict().items() if value is not None}
        attrs = provenance(self.result.scene, study="budget", **motor)
        return frame(_columns(self.result, arguments.flag(si, "si")), attrs, "effect")

    def tables(self) -> list[str | TextTable]:
        """A line per effect, their sum, the motor, and remarks."""
        result, scene = self.result, self.result.scene
        peak = scene.show(_round(result.total.at_peak, result.total.peak), "torque")
        first = f"{scene.name}: peak crank torque {peak} at {scene.show(result.torque.angle, 'angle')}"
        motor = tuple((label, _motor(result, name)) for name, (label, _) in MOTOR.items())
        shares = text_table(_columns(result), first=(0, 1, 5))
        return [first, shares, TextTable("Motor", ("", ""), motor), *(f"Remark: {text}." for text in result.remarks)]

    def charts(self) -> Charts:
        """Shares of the effects over the turn, and their sum."""
        scene, record = self.result.scene, self.result.torque
        unit, shown = scene.shown_in("torque"), scene.shown_in("angle")
        size, angle = factor(unit), factor(shown)
        rows = thin_rows(np.degrees(record.phi))
        phi = record.phi[rows] / angle
        shares = {name: curve[rows] / size for name, curve in record.curves.items()}
        total = Series(phi, np.sum(list(shares.values()), axis=0), "c0", "crank torque")
        series = [Series(phi, y, f"c{(k + 1) % COLOURS}", name) for k, (name, y) in enumerate(shares.items())]
        step = math.radians(TICKS)
        numbered = [step * k / angle for k in range(round(TURN / step) + 1)]
        chart = Chart(
            heading("torque", unit),
            Axis(float(phi.min()), float(phi.max()), numbered, f"crank angle phi [{shown}]"),
            [*series, total],
            dots=[(record.angle / angle, record.total.at_peak / size, "c0")],
            key=[
                *((curve.kind, curve.label) for curve in (total, *series)),
                ("dot c0", f"peak {scene.show(record.total.at_peak, 'torque')}"),
            ],
            cursor=True,
        )
        return Charts(f"{scene.name}: shares of the crank torque", [chart])

    def __repr__(self) -> str:
        scene = self.result.scene
        size = scene.show(self.result.total.at_peak, "torque")
        return f"<Budget {scene.name}: crank torque {size} at its peak, of {len(self.result.rows)} effects>"


def compute(scene: Scene, design: Design, fluctuation: float | None = None) -> Budget:
    """Torque budget of a checked design (SI; numbers that it does not name are today's). Raises BadInput."""
    return Budget(budget.compute(scene, design, fluctuation))


def _columns(result: BudgetResult, si: bool = False) -> list[Column]:
    torque, energy = ("N*m", "J") if si else (result.scene.shown_in(kind) for kind in ("torque", "energy"))
    rows, size, joule = [*result.rows, result.total], factor(torque), factor(energy)
    shares = [math.nan if row.share is None else 100 * row.share for row in rows]
    energies = [row.energy / joule for row in rows]
    columns = [words("effect", [row.effect for row in rows])]
    for name, head in (("at_peak", "there"), ("rms", "rms"), ("peak", "largest")):
        values = [getattr(row, name) / size for row in rows]
        cells = [number_text(_round(value, result.total.peak / size)) for value in values]
        columns.append(Column(f"{name} [{torque}]", values, f"{head}\n{torque}", cells, called=head))
    cells = ["" if math.isnan(share) else f"{_round(share, 100.0):.4g}" for share in shares]
    columns.insert(2, Column("share [%]", shares, "of it\n%", cells, called="of it"))
    head = f"energy per turn\n{energy}"
    return [
        *columns,
        Column(f"energy [{energy}]", energies, head, list(map(number_text, energies)), called="energy per turn"),
    ]


def _round(value: float, size: float) -> float:
    return 0.0 if abs(value) <= SHOWN_AS_ZERO * size else value


def _motor(result: BudgetResult, name: str) -> str:
    value, scene = getattr(result.motor, name), result.scene
    if value is None:
        return f"not known: {result.undefined[name]}"
    text = scene.show(value, MOTOR[name][1])
    return f"{text} for a fluctuation of {result.torque.fluctuation:g}" if name == "flywheel" else text
