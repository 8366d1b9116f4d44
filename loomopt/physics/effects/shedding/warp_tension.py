"""Pull of the warp on the heald frame: output term −T, T positive downward [Qiu21, eq 4 and 8].

T is T1 with the shed open upward (X = 0) and −T2 with it open downward. Between them, by `shape`:
    linear   in proportion to the shed: T1 (1 − 2X/h) above the middle, −T2 (2X/h − 1) below; a corner where
             X = h/2, the event half_open; of a motion in segments too that moves down once and up once
    step     the cubic STEP of eq 8 over the rise and over the return
    levels   unknown: T is T1 and −T2 in the dwells, and contact is checked there only

Or T(θ) is a curve through the samples of a table over the cam angle: a measured pull of the warp, or any load of the
frame that depends on the cam angle (negative where it presses the roller on the cam).
"""

from collections.abc import Callable, Mapping
from typing import Literal

from pydantic import Field

from loomopt.base.quantities import Force
from loomopt.maths.periodic_cubic import interval_at
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, Load, LoadTable, Place
from loomopt.physics.effects.shedding import FramePose
from loomopt.physics.schema import DIGITS, Name, Table

TURN = 6.283185307179586


class Parameters(Table):
    """Values of the warp."""

    T1: Force | None = Field(None, description="pull of the warp with the shed open upward")
    T2: Force | None = Field(None, description="pull of the warp with the shed open downward")
    shape: Literal["levels", "linear", "step"] = Field("linear", description="course of the pull between T1 and T2")
    table: Name | None = Field(
        None,
        description="CSV file of T in place of T1, T2, shape: cam angle [deg], T [N] positive downward, corner",
    )
    digits: int | None = Field(None, ge=0, le=15, description=DIGITS)


def corners(at: Inputs[object]) -> tuple[Number, ...]:
    """Cam angles where the shed is half open, rad, on the rise and on the return; none where none counts.

    Of a table those where its intervals begin.
    """
    if "table" in at.table:
        return tuple(map(at.maths.number, at.table["table"].begins))
    return tuple(at.values["half_open"]) if at.table["shape"] == "linear" else ()


def past_middle(angle: float, corners: tuple[float, ...]) -> float:
    """1 between the angles where the shed is half open, 0 outside and without any; of a table the interval."""
    if len(corners) > 2:
        return interval_at(angle, corners)
    return float((angle - corners[0]) % TURN < (corners[1] - corners[0]) % TURN) if corners else 0.0


def known_in(words: Mapping[str, str]) -> tuple[Place, ...]:
    """Dwells, for a tension that is not given in the moves."""
    return (("segment", 1.0), ("segment", 3.0)) if words["shape"] == "levels" and "table" not in words else ()


def linear(at: Inputs[FramePose]) -> Number:
    """−T, N, in proportion to the shed; switch: 1 past the middle."""
    return (2 * at.pose.lowered - 1) * at.maths.choose(at.switch, (at.table["T1"], at.table["T2"]))


def step(at: Inputs[FramePose]) -> Number:
    """−T, N, by the cubic STEP of the law's argument u."""
    return (at.table["T1"] + at.table["T2"]) * at.pose.u**2 * (3 - 2 * at.pose.u) - at.table["T1"]


def levels(at: Inputs[FramePose]) -> Number:
    """−T, N, in the dwells; 0 between them, where it is unknown."""
    return at.maths.choose(at.pose.segment, (0, at.table["T2"], 0, -at.table["T1"]))


SHAPES: dict[str, Callable[[Inputs[FramePose]], Number]] = {
    "linear": linear,
    "step": step,
    "levels": levels,
}


def force(at: Inputs[FramePose]) -> Number:
    """−T, N, by the shape the scene names, or by its table."""
    if "table" in at.table:
        return -at.table["table"].at(at.maths, at.pose.phi, at.switch)
    return SHAPES[at.table["shape"]](at)


EFFECT = Load(
    name="warp_tension",
    summary="pull of the warp on the heald frame",
    table=Parameters,
    rank=20,
    acts="output",
    force=force,
    reads=("half_open",),
    corners=corners,
    cases={0.0: "for 0 <= X <= travel/2", 1.0: "for travel/2 <= X <= travel"},
    switch=past_middle,
    known_in=known_in,
    tabulated=LoadTable("T", "force", "of the cam, 0 where its motion begins", ("T1", "T2", "shape")),
    examples=(
        {"T1": "124.545 N", "T2": "83.03 N", "shape": "linear"},
        {"T1": "124.545 N", "T2": "83.03 N", "shape": "step"},
        {"T1": "124.545 N", "T2": "83.03 N", "shape": "levels"},
    ),
)
