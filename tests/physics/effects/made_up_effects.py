"""Effects nobody has: two loads and a check for every job, and loads that call an event in."""

import math
from importlib.metadata import EntryPoint
from typing import Any

from loomopt.base.quantities import Coordinate, PositiveLength, PureNumber
from loomopt.physics.effects.kinds import Check, Demand, FlatNumber, Load, Speed
from loomopt.physics.schema import Figure, Table

BEGINS, ENDS = 1.1, 2.6
"""Corners of the made-up loads, rad, which are no job's own."""


class OutputTable(Table):
    c: PureNumber
    a: PureNumber


class DriveTable(Table):
    b: PureNumber


class CheckTable(Table):
    most: Coordinate
    high: Coordinate


class EventTable(Table):
    jump: PureNumber


def within(angle, corners):
    begins, ends = corners
    return 1.0 if begins <= angle % (2 * math.pi) < ends else 0.0


def placed(at):
    return (BEGINS, ENDS)


OUTPUT: Load[Any] = Load(
    name="made_up_output",
    summary="drag in proportion to the speed, and a step between two angles",
    table=OutputTable,
    acts="output",
    force=lambda at: at.table["c"] * at.pose.velocity + at.table["a"] * at.switch,
    needs=("operation.speed",),
    corners=placed,
    switch=within,
    examples=({"c": "0.02", "a": "0.3"},),
)
DRIVE: Load[Any] = Load(
    name="made_up_drive",
    summary="drag in the drive",
    table=DriveTable,
    acts="drive",
    force=lambda at: at.table["b"] * at.pose.omega * at.switch * at.maths.sin(at.pose.phi) ** 2,
    needs=("operation.speed",),
    corners=placed,
    switch=within,
    examples=({"b": "0.01"},),
)


def check(quantity, row, reads):
    """Return a check of a quantity and a row, both with figures and demands."""
    return Check(
        name="made_up_check",
        summary="a reading of the motion and one of the design",
        table=CheckTable,
        reads=reads,
        quantities={"made_up_peak": quantity},
        rows={"made_up_size": row},
        figures=(
            Figure("made_up_peak", "length", "peak of the reading", sides=("max",)),
            Figure("made_up_size", "length", "reading of the design"),
        ),
        demands=(Demand("made_up_peak", 1, "most"), Demand("made_up_size", 1, "high")),
        examples=({"most": "1 km", "high": "1 km"},),
    )


BEATUP = check(lambda at: at.values["l3"] * at.pose.q2, lambda at: at.values["l2"] + at.values["l3"], ())
RAPIER = check(lambda at: at.pose.q1 + 0 * at.values["l4"], lambda at: at.values["l5"] + at.values["l6"], ("l4",))
SHEDDING = check(lambda at: at.pose.q + at.values["X0"], lambda at: at.values["X0"], ("X0",))


def at_event(name, angles):
    """Return a load that jumps at the angles an event of the motion has."""

    def switch(angle, corners):
        return float(sum(corner <= angle % (2 * math.pi) for corner in sorted(c % (2 * math.pi) for c in corners)) % 2)

    return Load(
        name="made_up_event",
        summary="a jump at an event",
        table=EventTable,
        acts="output",
        force=lambda at: at.table["jump"] * at.switch,
        reads=(name,),
        corners=lambda at: angles(at.values),
        switch=switch,
        examples=({"jump": "0.5"},),
    )


class PlateTable(Table):
    thickness: PositiveLength
    spare: PositiveLength
    strong: PositiveLength


PLATE: Check[object] = Check(
    name="made_up_plate",
    summary="a plate as thin as it may be, and a number that nothing reads",
    table=PlateTable,
    rows={"plate": lambda at: at.table["thickness"]},
    figures=(Figure("plate", "length", "thickness of the plate"),),
    demands=(Demand("plate", -1, "strong"),),
    least="plate",
    axes=(FlatNumber(name="spare", key="spare"),),
    examples=({"thickness": "5 mm", "spare": "7 mm", "strong": "3 mm"},),
)


class MotorTable(Table):
    line: PureNumber
    wheel: PureNumber


MOTOR = Speed(
    name="made_up_motor",
    summary="a motor whose torque falls with the square of the speed, and a flywheel",
    table=MotorTable,
    rank=95,
    motor=lambda at, omega: at.table["line"] * (at.values["no_load_speed"] ** 2 - omega**2),
    flywheel=lambda at: at.table["wheel"],
    rows={"made_up_fastest": lambda at, turning: turning.range[1]},
    needs=("operation.speed",),
    figures=(Figure("made_up_fastest", "angular speed", "greatest speed of the shaft"),),
    examples=({"line": "0.05", "wheel": "20"},),
)
DEAD_CENTRE = at_event("front dead centre", lambda given: (given["beta"], given["beta"] + 1))
TURNS = at_event("turns", lambda given: tuple(given["turns"]))
HALF_OPEN = at_event("half_open", lambda given: (*given["half_open"], BEGINS, ENDS))

NAMES = {
    "beatup.made_up_check": "BEATUP",
    "rapier.made_up_check": "RAPIER",
    "shedding.made_up_check": "SHEDDING",
    "beatup.made_up_event": "DEAD_CENTRE",
    "rapier.made_up_event": "TURNS",
    "shedding.made_up_event": "HALF_OPEN",
}
for _job in ("beatup", "rapier", "shedding"):
    NAMES |= {f"{_job}.made_up_output": "OUTPUT", f"{_job}.made_up_drive": "DRIVE", f"{_job}.made_up_plate": "PLATE"}
    NAMES[f"{_job}.made_up_motor"] = "MOTOR"


def points(group):
    """Return the entry points by which they are found."""
    report = NAMES.items() if group == "loomopt.effects" else ()
    return tuple(EntryPoint(name, f"{__name__}:{value}", group) for name, value in report)
