"""Speed of the crank over the turn: an asynchronous motor near its rated torque, with a flywheel.

    D (ω_n − ω) = crank torque + J_f ω̇,   D = motor_torque/(slip · speed)

Steady state: the same speed at the same angle in every turn. The no-load speed ω_n is the one with which the mean
speed over time is the scene's, ∮dφ/ω = 2π/speed: the picks per minute. Straight motor line, stiff drive.
"""

from typing import TYPE_CHECKING

from pydantic import Field

from loomopt.base.quantities import PositiveInertia, PositiveTorque, Share
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, Speed
from loomopt.physics.schema import Figure, Table

if TYPE_CHECKING:
    from loomopt.physics.motion.turning import CrankTurn


class Parameters(Table):
    """Values of motor and flywheel, all as they act at the crank."""

    motor_torque: PositiveTorque = Field(description="rated torque of the motor")
    slip: Share = Field(description="decrease of the speed at rated torque, as a share of the mean speed")
    flywheel: PositiveInertia = Field(description="inertia of all that turns with the crank, J_f")


def motor(at: Inputs[object], omega: Number) -> Number:
    """D (ω_n − ω), N·m; negative where the motor brakes."""
    return at.table["motor_torque"] / (at.table["slip"] * at.values["speed"]) * (at.values["no_load_speed"] - omega)


def flywheel(at: Inputs[object]) -> Number:
    """J_f, kg·m²."""
    return at.table["flywheel"]


def fluctuation(at: Inputs[object], turning: "CrankTurn") -> float:
    """(greatest − least speed)/mean speed."""
    least, greatest = turning.range
    return (greatest - least) / float(at.values["speed"])


def no_load_speed(at: Inputs[object], turning: "CrankTurn") -> float:
    """ω_n, rad/s."""
    return turning.no_load


def motor_torque_max(at: Inputs[object], turning: "CrankTurn") -> float:
    """Motor's torque where the crank is slowest, N·m."""
    return float(motor(at, turning.range[0]))


EFFECT = Speed(
    name="speed_fluctuation",
    summary="speed of the crank over the turn, by motor line and flywheel",
    table=Parameters,
    letters={"motor_torque": "M_rated", "flywheel": "J_f"},
    rank=100,
    motor=motor,
    flywheel=flywheel,
    rows={
        "fluctuation": fluctuation,
        "no_load_speed": no_load_speed,
        "motor_torque_max": motor_torque_max,
    },
    most="motor_torque_max",
    needs=("operation.speed",),
    figures=(
        Figure("fluctuation", "number", "range of the crank speed, divided by its mean", sides=("max",)),
        Figure("no_load_speed", "angular speed", "speed at which the motor gives no torque", sides=()),
        Figure("motor_torque_max", "torque", "largest torque of the motor", sides=("max",)),
    ),
    examples=({"motor_torque": "35 N*m", "slip": "0.08", "flywheel": "2 kg*m^2"},),
)
