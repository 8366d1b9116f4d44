"""What the motor must give at the crank, the same for every job: the peaks of its torque and of its power."""

from collections.abc import Collection, Iterable

from loomopt.effects.kinds import Effect, Load, State
from loomopt.program.instant import Quantity
from loomopt.schema import Figure

TORQUE, POWER = "peak_torque", "peak_power"
FIGURES = (
    Figure(TORQUE, "torque", "peak |crank torque| over the cycle", sides=("max",)),
    Figure(
        POWER,
        "power",
        "peak |motor power| over the cycle, driving or braking: crank torque times speed",
        sides=("max",),
    ),
)


def quantities(effects: Iterable[Effect], known: Collection[str]) -> dict[str, Quantity]:
    """Return torque, N·m, and power, W, of the crank as effects load it; none without a load, no power without speed.

    known: names of scene numbers that are given.
    """
    if not any(isinstance(effect, Load | State) for effect in effects):
        return {}
    found = {TORQUE: Quantity(lambda at: at.crank_torque)}
    return found | ({POWER: Quantity(lambda at: at.power)} if "speed" in known else {})
