"""What a job and its effects declare about themselves, so that scenes can be read and checked without knowing them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

from pydantic import BaseModel, ConfigDict

from loomopt.maths import Maths, Number


class Table(BaseModel):
    """One table of a scene: unknown keys are errors, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


Values = Mapping[str, Number]
"""Scene numbers by name, in one number system: `l1`, `M0`, `today.l1`, …"""

Force = Callable[[Maths, Any, Values, Values, Number], Number]
"""force(maths, pose, given, own, switch): see `Load`."""


def constant_switch(angle: float, corners: tuple[float, ...]) -> float:
    """Return the switch of a load without corners: it is never read."""
    return 0.0


@dataclass(frozen=True)
class Load:
    """An algebraic effect: one term of the force the output needs, or of the crank torque inside the drive.

    name: the table in a scene that turns it on; own: model of that table's values.
    acts: "output" (times q' it reaches the crank) or "drive" (it reaches the crank only).
    force(maths, pose, given, own, switch): the term, N or N·m. `given` holds the scene's numbers, `own` its table's.
    reads: design variables it depends on beside the mechanism's lengths; needs: scene keys that must be given.
    corners(maths, given, own): crank angles in rad where the formula changes; switch(angle, corners): which formula
    holds at a crank angle inside a piece, as a number the force is handed.
    """

    name: str
    summary: str
    own: type[Table]
    acts: Literal["output", "drive"]
    force: Force
    reads: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    corners: Callable[[Maths, Values, Values], tuple[Number, ...]] | None = None
    switch: Callable[[float, tuple[float, ...]], float] = constant_switch


class Switched(Protocol):
    """What has corners in the cycle: a load, or stretches of it that a limit speaks of."""

    @property
    def switch(self) -> Callable[[float, tuple[float, ...]], float]:
        """switch(angle, corners): which formula, or stretch, holds at a crank angle inside a piece."""


@dataclass(frozen=True)
class Arcs:
    """Stretches of the cycle that limits speak of; switch: as a load's."""

    name: str
    switch: Callable[[float, tuple[float, ...]], float]


@dataclass(frozen=True)
class Demand:
    """What an effect's row must keep: a value, SI, or that of a key of its table; sign +1 at most, −1 at least, 0 ="""

    row: str
    sign: int
    value: float | str


@dataclass(frozen=True)
class Check:
    """An effect that takes no part in the balance: whole-cycle figures read from the solved motion.

    quantities: figure name → value(maths, pose, given, own) over the cycle; the figure is the largest |value|.
    rows: name → value(maths, given, own) of the design alone; demands: what rows must keep while the effect is on.
    """

    name: str
    summary: str
    own: type[Table]
    quantities: Mapping[str, Callable[[Maths, Any, Values, Values], Number]]
    reads: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    rows: Mapping[str, Callable[[Maths, Values, Values], Number]] = field(default_factory=dict)
    demands: tuple[Demand, ...] = ()


Effect = Load | Check


@dataclass(frozen=True)
class Figure:
    """One number a designer reads: its kind of quantity, and the sides on which a scene may limit it."""

    name: str
    kind: str
    text: str
    sides: tuple[str, ...] = ("min", "max")


@dataclass(frozen=True)
class Target:
    """What a job can be asked for; `own` models the values of its `[targets.NAME]` table."""

    name: str
    text: str
    own: type[Table]
    needs: tuple[str, ...] = ()
    needs_effects: tuple[str, ...] = ()


@dataclass(frozen=True)
class Job:
    """All that a scene needs to know of its job.

    operation, mechanism: models of those tables; keys that are required only by what reads them are optional there.
    variables: design variables → kind of quantity, in the order they are shown.
    check(scene): raises BadInput when today's machine is not one this job can work on.
    fault(design): why a design, SI, cannot work as this mechanism; "" when it can.
    headline(scene, target, figures): one sentence that says what an optimum of the target is worth.
    margins: limits that every design keeps → kind of quantity; their names are whole phrases.
    groups: name → bounds that --free frees together.
    lists: parts of a design that are lists of numbers → their kind of quantity; inside, NAME_0, NAME_1 ...
    """

    name: str
    title: str
    operation: type[Table]
    mechanism: type[Table]
    effects: Mapping[str, Effect]
    variables: Mapping[str, str]
    figures: Mapping[str, Figure]
    targets: Mapping[str, Target]
    default_target: str
    check: Callable[[Any], None]
    fault: Callable[[Mapping[str, float]], str]
    headline: Callable[[Any, str, Mapping[str, float | None]], str]
    template: str
    needs: tuple[str, ...] = field(default=())
    margins: Mapping[str, str] = field(default_factory=dict)
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    lists: Mapping[str, str] = field(default_factory=dict)
