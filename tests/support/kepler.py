"""A design whose event no formula gives: e where e + 0.5 sin e = x, found from a hint, and rows that read it or not."""

import functools
from collections.abc import Callable, Collection
from dataclasses import dataclass

from loomopt.maths import turning_points
from loomopt.maths.systems import FLOAT, Maths, Number
from loomopt.model.model import CycleQuantity, DesignRow, Instant, JobModel
from loomopt.physics.balance import Given
from loomopt.physics.schema import Values
from support.toy import Still


@dataclass(frozen=True)
class Kepler(Still):
    """An event e where e + 0.5 sin e = x: one step from a hint far away does not reach it."""

    structure: str = "Kepler"

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> Values:
        if "hint" not in given.values:
            return {}
        x = given.values["x"]

        def rates(e: Number) -> tuple[Number, Number, Number]:
            return e + 0.5 * maths.sin(e) - x, 1 + 0.5 * maths.cos(e), -0.5 * maths.sin(e)

        return {"e": turning_points.followed(rates, given.values["hint"])}

    def hints(self, given: Given, called: Collection[str]) -> dict[str, float]:
        x = given.values["x"]
        return {"hint": turning_points.crossing(lambda e: e + 0.5 * FLOAT.sin(e) - x, x - 1.0, x + 1.0)}


def _wave(at: Instant) -> Number:
    return at.maths.cos(at.node.phi - at.values["e"]) + at.values["y"] * at.maths.sin(at.node.phi)


def _row(row: Callable[[Values], Number], at: Instant) -> Number:
    return row(at.values)


ROWS: dict[str, Callable[[Values], Number]] = {
    "x": lambda v: v["x"],
    "event": lambda v: v["e"],
    "bowl": lambda v: (v["e"] - 2) ** 2 + (v["y"] - v["e"]) ** 2,
    "other": lambda v: (v["x"] - 3) ** 2 + v["y"] ** 2,
}
MODEL = JobModel(
    Kepler(),
    own_quantities={"wave": CycleQuantity(_wave)},
    own_rows={name: DesignRow(functools.partial(_row, row)) for name, row in ROWS.items()},
)
