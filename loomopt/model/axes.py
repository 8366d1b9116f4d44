"""Axes of a scene as objectives of a program, with their directions and limits."""

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from loomopt.base.errors import BadInput, unknown
from loomopt.maths.systems import Number
from loomopt.model.limits import Limit
from loomopt.model.model import DesignRow, Formula, Instant, JobModel
from loomopt.model.objectives import Magnitude, Objective, Peak, Value, Worst, WorstPeak, opposite
from loomopt.model.program import Program
from loomopt.physics.schema import Axis, Sense

Requested = Mapping[str, Sense]
"""Axis → its sense, least or most."""
FORMS: Mapping[str, type[Objective]] = {"value": Value, "magnitude": Magnitude, "peak": Peak}
"""Form of an axis → the kind of its objective."""


class Traded(NamedTuple):
    """Axis of a front, its sense, and the objective; figure = offset + sign · value^(1/power)."""

    axis: Axis
    sense: Sense
    objective: Objective

    @property
    def sign(self) -> int:
        """Whether the figure grows with the value."""
        return 1 if self.sense == "least" else -1

    @property
    def called(self) -> str:
        """Name; of a magnitude with the word."""
        return f"|{self.axis.name}|" if self.objective.is_magnitude else self.axis.name

    def figure(self, value: float) -> float:
        """Figure, SI, of a value."""
        root = max(value, 0.0) ** (1 / self.axis.power) if self.axis.power != 1 else value
        return self.axis.offset + self.sign * root

    def value(self, figure: float) -> float:
        """Value to minimise, from a figure, SI."""
        return float((self.sign * (figure - self.axis.offset)) ** self.axis.power)

    def slope(self, figure: float) -> float:
        """d value / d figure at a figure, SI."""
        root = self.sign * (figure - self.axis.offset)
        return float(self.sign * self.axis.power * root ** (self.axis.power - 1))

    def limits(self, name: str, value: float) -> list[Limit]:
        """Limits that bound the value by `value`, under a name; a magnitude is bounded on both sides."""
        return self.objective.limits(name, value)


def requested_of(
    axes: Mapping[str, Axis], numbers: Iterable[str], requested: Requested, origin: str
) -> dict[str, Axis]:
    """Axes by the requested names; numbers: bounded numbers of the scene, which are axes too.

    Raises BadInput for a name that is no axis, and for an end that is not offered.
    """
    known = {name: Axis(name, "") for name in numbers} | dict(axes)
    for name, sense in requested.items():
        if name not in known:
            remedy = "Name one of them, or give a number of the scene min and max in [bounds]"
            raise unknown("axis", name, known, origin, name, remedy)
        if sense not in known[name].senses:
            verb, way = ("maximised", "minimised") if sense == "most" else ("minimised", "maximised")
            problem = f"{name} cannot be {verb}, it can only be {way}"
            raise BadInput(problem, file=origin, key=name, remedy=f"Write --{way.removesuffix('d')} {name}.")
    return {name: known[name] for name in requested}


def with_axes(
    program: Program,
    axes: Mapping[str, Axis],
    requested: Requested,
    full: Callable[[str], str],
    size: Callable[[str], float],
) -> tuple[Program, tuple[Traded, ...]]:
    """Program whose last levels are the axes in the requested order, and these axes.

    program: its objectives come first and are limits then; full: name among the model's values; size: scale of a
    value, SI. Raises BadInput for an axis that nothing in the scene gives.
    """
    traded_axes = []
    for name, sense in requested.items():
        # A figure comes before a number that the designer calls the same, such as one of an effect's.
        is_in_model = program.model.has_row(name) or program.model.has_quantity(name)
        axis, rows = axes[name], axes[name].rows or (name if is_in_model else full(name),)
        _demand(program, name, rows)
        square = program.model.square(rows[0]) if program.model.has_quantity(rows[0]) else ""
        if square:
            axis, rows = axis._replace(power=2), (square,)
        form = axis.form or ("peak" if program.model.has_quantity(rows[0]) else "value")
        opposed = FORMS[form] is not Peak and axis.sign * (1 if sense == "least" else -1) < 0
        if opposed:
            program = replace(program, model=opposing(program.model, rows))
            rows = tuple(map(opposite, rows))
        scale = size(name) ** (axis.power if FORMS[form] is Peak else 1)
        objective = _objective(name, rows, FORMS[form], scale, axis.power)
        traded_axes.append(Traded(axis, sense, objective))
    levels = (*program.objectives, *(traded.objective for traded in traded_axes))
    return replace(program, objectives=levels), tuple(traded_axes)


def _objective(name: str, rows: Sequence[str], kind: type[Objective], scale: float, power: int) -> Objective:
    """Objective of an axis; of several rows the worst counts."""
    first, *others = rows
    if others and kind is Peak:
        return WorstPeak(name, first, scale, tuple(others), power=power)
    return Worst(name, first, scale, tuple(others), power=power) if others else kind(name, first, scale, power=power)


def _demand(program: Program, name: str, rows: Sequence[str]) -> None:
    model, numbers = program.model, {*program.parameters, *(v.name for v in program.variables)}
    if not all(model.has_quantity(row) or model.has_row(row) or row in numbers for row in rows):
        remedy = "Trade another axis, or add the numbers and effects that it needs."
        problem = model.undefined.get(name) or f"nothing in the scene gives {name}"
        raise BadInput(problem, key=name, remedy=remedy)


@functools.lru_cache(maxsize=64)
def opposing(model: JobModel, rows: tuple[str, ...]) -> JobModel:
    """Model with its rows and the opposites of rows or numbers."""
    return replace(model, own_rows={**model.own_rows, **{opposite(row): _opposed(model, row) for row in rows}})


def _opposed(model: JobModel, name: str) -> DesignRow:
    row = model.own_rows.get(name) or DesignRow(functools.partial(_read, name), () if model.has_row(name) else (name,))
    return row._replace(formula=functools.partial(_negative, row.formula))


def _read(name: str, at: Instant) -> Number:
    """Row that is not at an event, or a number."""
    known = at.model.static(at.maths, at.given, {}, (name,))
    return known[name] if name in known else at.values[name]


def _negative(formula: Formula, at: Instant) -> Number:
    return -formula(at)
