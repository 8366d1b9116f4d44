"""Peaks of the motor's torque and power at the crank, for all jobs."""

from collections.abc import Collection, Iterable

from loomopt.maths.systems import Number
from loomopt.model.model import CycleQuantity, Instant
from loomopt.physics.effects.kinds import Effect, Load, Speed, State
from loomopt.physics.schema import Figure

TORQUE, POWER = "peak_torque", "peak_power"
FIGURES = (
    Figure(TORQUE, "torque", "peak |crank torque| over the cycle", sides=("max",)),
    Figure(
        POWER,
        "power",
        "peak |motor power| over the cycle: torque of crank and flywheel, times speed",
        sides=("max",),
    ),
)

SPEED, MOTOR = "omega", "motor_torque"
KINDS = {SPEED: "angular speed", MOTOR: "torque"}
"""Whole-cycle quantities of a crank whose speed changes: its speed and the motor's torque."""


def quantities(effects: Iterable[Effect], known: Collection[str]) -> dict[str, CycleQuantity]:
    """Torque, N·m, and power, W, of the crank as effects load it; none without a load, no power without speed.

    known: names of scene numbers that are given.
    """
    if not any(isinstance(effect, Load | State) for effect in effects):
        return {}
    crank_quantities = {TORQUE: CycleQuantity(lambda at: at.crank_torque)}
    return crank_quantities | (
        {POWER: CycleQuantity(lambda at: motor_power(at, at.crank_torque))} if "speed" in known else {}
    )


def motion() -> dict[str, CycleQuantity]:
    """Speed of a crank, rad/s, and the motor's torque, N·m, which differ from its mean and the crank's."""
    return {
        SPEED: CycleQuantity(lambda at: at.pose.omega, figure=False),
        MOTOR: CycleQuantity(lambda at: motor_torque(at, at.crank_torque), figure=False),
    }


def motor(effects: Iterable[Effect]) -> Speed | None:
    """Effect by which the crank has a speed of its own; None at constant speed."""
    return next((effect for effect in effects if isinstance(effect, Speed)), None)


def motor_torque(at: Instant, crank_torque: Number) -> Number:
    """Motor's torque, N·m, from the crank's torque; the difference accelerates the flywheel."""
    omega_dot, speed = at.pose.omega_dot, motor(at.model.effects)
    if omega_dot is None or speed is None:
        return crank_torque
    return crank_torque + speed.flywheel(at.given.inputs(at.maths, speed)) * omega_dot


def motor_power(at: Instant, crank_torque: Number) -> Number:
    """Motor's power, W: its torque times the crank's speed; negative where the mechanism drives."""
    return motor_torque(at, crank_torque) * at.pose.omega
