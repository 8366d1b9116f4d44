"""What tables of a scene are made of, and what a designer reads and asks: figures and targets."""

from collections.abc import Mapping
from typing import NamedTuple

from pydantic import BaseModel, ConfigDict

from loomopt.maths import Number


class Table(BaseModel):
    """One table of a scene: unknown keys are errors, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


Values = Mapping[str, Number]
"""Scene numbers by name, in one number system: `l1`, `M0`, `today.l1`, …"""


class Figure(NamedTuple):
    """One number a designer reads: its kind of quantity, and the sides on which a scene may limit it."""

    name: str
    kind: str
    text: str
    sides: tuple[str, ...] = ("min", "max")


class Target(NamedTuple):
    """What a job can be asked for; `own` models the values of its `[targets.NAME]` table.

    needs: numbers of [operation] it keeps; needs_effects: effects without which it says nothing.
    """

    name: str
    text: str
    own: type[Table]
    needs: tuple[str, ...] = ()
    needs_effects: tuple[str, ...] = ()
