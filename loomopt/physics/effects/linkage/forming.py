"""Constant resistance at the output between two events: output term M, or F of one that slides, else 0."""

from dataclasses import replace
from typing import TYPE_CHECKING

from pydantic import Field

from loomopt.base.quantities import Force, Torque
from loomopt.maths.systems import Number, within_turn
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.effects.linkage import LinkagePose, event_angle, window_switch
from loomopt.physics.schema import Name, Table

if TYPE_CHECKING:
    from loomopt.physics.effects.kinds import SteadyOscillator

BEGINS, ENDS = "event at which it begins", "event at which it ends"


class Parameters(Table):
    """Values of the resistance, of an output that turns."""

    torque: Torque = Field(description="torque")
    begins: Name = Field(description=BEGINS)
    ends: Name = Field(description=ENDS)


class Sliding(Table):
    """Values of the resistance, of an output that slides."""

    force: Force = Field(description="force")
    begins: Name = Field(description=BEGINS)
    ends: Name = Field(description=ENDS)


def corners(at: Inputs[object]) -> tuple[Number, ...]:
    """Angles where the force begins and ends, rad."""
    return event_angle(at.values, at.table["begins"]), event_angle(at.values, at.table["ends"])


def force(at: Inputs[LinkagePose]) -> Number:
    """Resistance, N·m or N, against q."""
    return at.switch * at.table["torque" if "torque" in at.table else "force"]


def response(at: Inputs[LinkagePose], oscillator: "SteadyOscillator") -> tuple[Number, Number]:
    """z, rad, and z˙ of an oscillator that carries the load: at rest under it, and the vibrations of both corners."""
    begin, end = corners(at)
    length = within_turn(at.maths, end - begin, 0)
    since = within_turn(at.maths, at.pose.phi - begin - length / 2, at.switch / 2)
    still = oscillator.steady_cubic((force(at._replace(switch=1)), 0, 0, 0))[0]
    kick, before = oscillator.repeated(still, 0), (since + length / 2) / at.pose.omega
    after = (since - length / 2) / at.pose.omega + at.switch * oscillator.turn
    first, second = oscillator.ringing(kick, before), oscillator.ringing(kick, after)
    return at.switch * still - first[0] + second[0], second[1] - first[1]


EFFECT = Load(
    name="forming",
    summary="constant resistance at the output between two events",
    table=Parameters,
    rank=21,
    acts="output",
    force=force,
    corners=corners,
    response=response,
    switch=window_switch,
    cases={1.0: "from where it begins to where it ends", 0.0: "elsewhere"},
    examples=({"torque": "50 N*m", "begins": "rear", "ends": "front"},),
)
SLIDING = replace(EFFECT, table=Sliding, examples=({"force": "500 kN", "begins": "touch", "ends": "bottom"},))
