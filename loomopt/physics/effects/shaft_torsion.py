"""Torsion of the output's shaft: the driven parts are on a spring and a damper, z = q − q_r behind the link.

    J z¨ + c z˙ + k z = J q¨ + M_R        in the periodic steady state, at constant speed; linear
    output term k z + c z˙ instead of the terms of what the shaft carries, whose inertia is J

Carried: what turns with the output, its counterweight, their weight and the resistances, M_R(φ), none of which sees the
twist. Masses of links, and their weight, stay with q.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from pydantic import Field

from loomopt.base.quantities import PositiveRotaryDamping, PositiveRotaryStiffness
from loomopt.maths.systems import FLOAT, Number
from loomopt.physics.effects.kinds import EffectClash, Inputs, State, StatePeak
from loomopt.physics.schema import Figure, Table, Values

if TYPE_CHECKING:
    from loomopt.physics.effects.kinds import Carried, Motion, SteadyOscillator, Written
    from loomopt.physics.motion import harmonic

NAME = "shaft_torsion"
TWIST, TORQUE = f"{NAME}.twist", f"{NAME}.torque"
QUICKEST = 200
"""Natural frequency over the crank's speed from which on the shaft is as good as rigid, and ever more samples of a turn
would show no more than the ringing of a pulse whose corners are assumed."""
SAMPLES = 24
"""Samples of one swing of the shaft's own: extremes are refined from them to rounding."""

MOST_DECAYS = 2000
"""Decays in the time of a radian of the crank beyond which no more samples are taken: what is left of the corners of a
pulse has faded within 0.1 degrees there."""


class Parameters(Table):
    """Values of the shaft between the output's link and the parts on it."""

    stiffness: PositiveRotaryStiffness = Field(
        description="torque per radian of twist between the output's link and the parts on the shaft"
    )
    damping: PositiveRotaryDamping = Field(
        description="damping torque per speed of the twist; without damping there is no steady state"
    )


def fixed(at: Inputs[object], carried: "Carried") -> Mapping[str, str]:
    """Damping of the shaft and the number of harmonics of its motion. Raises UnsteadyError."""
    from loomopt.physics.effects.kinds import UnsteadyError
    from loomopt.physics.motion import harmonic

    natural = (at.table["stiffness"] / carried.inertia) ** 0.5
    if natural > QUICKEST * at.values["speed"]:
        raise UnsteadyError(
            f"the natural frequency of the shaft is {natural / at.values['speed']:.4g} times the speed, more than "
            f"{QUICKEST}: it is practically rigid",
            "Use the rigid model: take the table out",
        )
    try:
        count = harmonic.enough(carried.weigh, FLOAT, int(at.table.get("harmonics", harmonic.FEWEST)))
    except ArithmeticError:
        raise UnsteadyError(
            f"the output's acceleration is too sharp for {harmonic.MOST} harmonics",
            "Keep the mechanism farther from its singular positions, or use the rigid model",
        ) from None
    damped = harmonic.regime(carried.inertia, at.table["damping"], at.table["stiffness"])
    return {"regime": damped, "harmonics": str(count)}


def derived(at: Inputs[object], carried: "Carried") -> dict[str, Number]:
    """Oscillator's constants, and the harmonics of z, rad, and of k z + c z˙, N·m."""
    from loomopt.physics.motion import harmonic

    regime, count = at.table["regime"], int(at.table["harmonics"])
    constants = harmonic.constants(
        at.maths, regime, carried.inertia, at.table["damping"], at.table["stiffness"], at.values["speed"]
    )
    force = harmonic.harmonics(at.maths, count, carried.weigh)
    twist, torque = harmonic.response(harmonic.Oscillator(at.maths, regime, constants), force)
    return harmonic.named(NAME, constants) | harmonic.named(TWIST, twist) | harmonic.named(TORQUE, torque)


def oscillator(at: Inputs[object]) -> "SteadyOscillator":
    """Shaft with the parts on it."""
    from loomopt.physics.motion import harmonic

    return harmonic.Oscillator(at.maths, at.table["regime"], harmonic.read_constants(NAME, at.values))


def _series(name: str, at: "Inputs[Motion]") -> "harmonic.FourierSeries":
    from loomopt.physics.motion import harmonic

    return harmonic.read_series(name, at.values, int(at.table["harmonics"]))


def force(at: "Inputs[Motion]", reply: tuple[Number, Number]) -> Number:
    """k z + c z˙, N·m."""
    return (
        _series(TORQUE, at).at(at.maths, at.pose.phi)
        + at.table["stiffness"] * reply[0]
        + at.table["damping"] * reply[1]
    )


def coordinate(at: "Inputs[Motion]", reply: tuple[Number, Number]) -> Number:
    """z, rad."""
    return _series(TWIST, at).at(at.maths, at.pose.phi) + reply[0]


class CarriedMotion(NamedTuple):
    """Motion of the parts on the shaft: q_r, rad, with speed and acceleration."""

    phi: Number
    q: Number
    velocity: Number
    acceleration: Number


def moved(at: "Inputs[Motion]", coordinate: Number, force: Number, acceleration: Number) -> CarriedMotion:
    """Motion of the parts on the shaft: z˙ follows from k z + c z˙."""
    rate = (force - at.table["stiffness"] * coordinate) / at.table["damping"]
    return CarriedMotion(at.pose.phi, at.pose.q - coordinate, at.pose.velocity - rate, acceleration)


def samples(at: Inputs[object]) -> float:
    """Number of samples per turn that resolve every oscillation of the shaft, or a decay that is faster."""
    square = at.values[f"{NAME}.stiffness"] / at.values[f"{NAME}.inertia"]
    half = at.values[f"{NAME}.damping"] / at.values[f"{NAME}.inertia"] / 2
    rate = half + (half**2 - square) ** 0.5 if half**2 > square else square**0.5
    return float(SAMPLES * min(rate / at.values["speed"], MOST_DECAYS))


def motion(written: "Written", table: Values) -> tuple[Number, Number]:
    """Both sides of J z¨ + c z˙ + k z = F."""
    z, z1, z2 = written.coordinate
    omega = written.omega
    return written.inertia * omega**2 * z2 + table["damping"] * omega * z1 + table["stiffness"] * z, written.force


def term(written: "Written", table: Values) -> Number:
    """k z + c z˙."""
    return table["stiffness"] * written.coordinate[0] + table["damping"] * written.omega * written.coordinate[1]


def rests(table: Values) -> str:
    """Remark on the sum that gives the steady state."""
    from loomopt.physics.motion import harmonic

    return (
        f"the steady state of {NAME} is the sum of {table['harmonics']} harmonics of the output's motion; higher "
        f"harmonics are below {harmonic.TAIL:g} of the largest, which is measured at this design, not proven"
    )


EFFECT = State(
    name=NAME,
    summary="twisting shaft between the output and the parts it drives",
    table=Parameters,
    letters={"stiffness": "k", "damping": "c"},
    rank=85,
    needs=("operation.speed",),
    companions=("inertia",),
    clashes=(
        EffectClash("bearing_friction", "no source says whether it acts on the link or on the parts on the shaft"),
        EffectClash("speed_fluctuation", "the steady state of the shaft is that of a constant speed"),
    ),
    carries=("inertia", "counterweight", "resistance", "forming", "gravity"),
    derived=derived,
    oscillator=oscillator,
    fixed=fixed,
    samples=samples,
    moved=moved,
    force=force,
    coordinate=coordinate,
    motion=motion,
    term=term,
    difference=("q", "q_r"),
    rests=rests,
    figures=(
        Figure("shaft_peak", "torque", "peak |torque of the shaft| over the cycle", sides=("max",)),
        Figure("twist_peak", "angle", "peak |twist| of the shaft over the cycle", sides=("max",)),
        Figure("carried_max", "angle", "largest angle of the parts on the shaft", sides=("max",)),
    ),
    peaks={
        "shaft_peak": StatePeak(lambda at: at.force()),
        "twist_peak": StatePeak(lambda at: at.coordinate()),
        "carried_max": StatePeak(lambda at: at.pose.q - at.coordinate(), signed=True),
    },
    columns={
        "q_r [rad]": lambda at: at.pose.q - at.coordinate(),
        "twist [rad]": lambda at: at.coordinate(),
    },
    examples=({"stiffness": "2 MN*m/rad", "damping": "45 N*m*s/rad"},),
)
