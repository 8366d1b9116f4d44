"""Records of a scene's tables, its figures and its targets."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from loomopt.maths.systems import Number


class Table(BaseModel):
    """Table of a scene: unknown keys are errors, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


Name = Annotated[str, Field(pattern=r"\S")]
"""Text of a table that names something: not empty."""


class TargetTable(Table):
    """Keys that every target's table may have."""

    expected: dict[str, Any] | None = Field(None, description="known optimum, shown only")


DIGITS = "decimals of the table's values; by default those printed"
"""Description of the key `digits` of a table: for cut zeros, or for more printed digits than are known."""

Values = Mapping[str, Number]
"""Scene numbers by name, in one number system: `l1`, `M0`, `today.l1`, …"""


class Figure(NamedTuple):
    """Number that a designer reads: kind of quantity, and the sides on which a scene may limit it."""

    name: str
    kind: str
    text: str
    sides: tuple[str, ...] = ("min", "max")


class Target(NamedTuple):
    """Target of a job; `table` models the values of its `[targets.NAME]` table.

    needs: numbers of [operation] it keeps; needs_effects: effects without which it says nothing.
    """

    name: str
    text: str
    table: type[Table]
    needs: tuple[str, ...] = ()
    needs_effects: tuple[str, ...] = ()


Sense = Literal["least", "most"]
"""Sense in which an axis is optimised."""
BOTH: tuple[Sense, ...] = ("least", "most")


class Conflict(NamedTuple):
    """Two axes of a job that conflict, the first one optimised; target: target whose demands hold, None for none.

    maximise: axes that are maximised.
    """

    axes: tuple[str, str]
    target: str | None = None
    maximise: tuple[str, ...] = ()


class Axis(NamedTuple):
    """Axis of a front: a figure or a number of the design, and how a program reads it.

    rows: rows, or one whole-cycle quantity, from which it is read; by default that of its own name. form: one smooth
    "value" (the worst of several rows), a "magnitude", or the "peak" of a quantity; "" is a peak if the model has a
    quantity of its name, else a value. senses: senses that are possible. The figure is offset + sign · value^(1/power).
    """

    name: str
    kind: str
    rows: tuple[str, ...] = ()
    form: Literal["", "value", "magnitude", "peak"] = ""
    senses: tuple[Sense, ...] = BOTH
    sign: int = 1
    offset: float = 0.0
    power: int = 1
