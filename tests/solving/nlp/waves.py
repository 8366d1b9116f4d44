"""Programs of a few formulas in place of a mechanism: their right answers are known in closed form."""

import functools
from collections.abc import Callable, Collection

from support.toy import Still
from support.worst import objective_of

from loomopt.maths.systems import Maths, Number
from loomopt.model.kinematics import Arcs
from loomopt.model.limits import CycleLimit, DesignLimit
from loomopt.model.model import CycleQuantity, DesignRow, Instant, JobModel
from loomopt.model.objectives import Objective
from loomopt.model.program import Program, Variable
from loomopt.physics.schema import Values

Wave = Callable[[Maths, Values, Number], Number]


def at_node(wave: Wave, at: Instant) -> Number:
    return wave(at.maths, at.values, at.node.phi)


def at_design(row: Callable[[Values], Number], at: Instant) -> Number:
    return row(at.values)


ROWS = {
    "x": lambda v: v["x"],
    "y": lambda v: v["y"],
    "sum": lambda v: v["x"] + v["y"],
    "apart": lambda v: v["x"] - v["y"],
    "bowl": lambda v: (v["x"] - 3) ** 2 + (v["y"] - 2) ** 2,
    "other bowl": lambda v: (v["x"] + 1) ** 2 + v["y"] ** 2,
}
WAVES: dict[str, Wave] = {
    "wave": lambda m, v, phi: v["x"] + m.cos(phi) + m.cos(2 * phi) / 2,
    "circle": lambda m, v, phi: v["x"] * m.cos(phi) + v["y"] * m.sin(phi),
    "shifted": lambda m, v, phi: (v["x"] - 3) * m.cos(phi) + (v["y"] - 1) * m.sin(phi),
    "sharp": lambda m, v, phi: v["x"] / (1 + 400 * (1 - m.cos(phi - v["y"]))),
    "hill": lambda m, v, phi: v["x"] * m.cos(phi - v["y"]),
}


def model(arcs: tuple[Arcs, ...] = (), signed: Collection[str] = ()) -> JobModel:
    quantities = {
        name: CycleQuantity(functools.partial(at_node, wave), signed=name in signed) for name, wave in WAVES.items()
    }
    rows = {name: DesignRow(functools.partial(at_design, row)) for name, row in ROWS.items()}
    return JobModel(Still(("still", tuple(signed))), own_quantities=quantities, own_rows=rows, arcs=arcs)


def objective(row: str, form: str = "value", others: tuple[str, ...] = ()) -> Objective:
    return objective_of(form, row, (row, *others))


BOWL = (objective("bowl"),)


def program(
    limits: Collection[tuple[str, int, float]] = (),
    objectives: tuple[Objective, ...] = BOWL,
    start: tuple[float, float] = (0.5, 0.4),
    box: float = 10.0,
    physics: JobModel | None = None,
) -> Program:
    """Return a program of x and y; limits: (row, sign, value)."""
    variables = tuple(Variable(name, -box, box, 1.0, (-box, box)) for name in "xy")
    kinds = {row: CycleLimit if row in WAVES else DesignLimit for row, _, _ in limits}
    rows = tuple(kinds[row](row, s, row, v, 1.0) for row, s, v in limits)
    return Program(physics or MODEL, variables, {}, rows, objectives, (dict(zip("xy", start, strict=True)),))


MODEL = model()
