"""Torsion of the rocking shaft, as that of every linkage's output: the reed is z = ψ_r − ψ away from the rocker.

Carried: reed, counterweight and the resistance of the cloth. The rocker's own inertia stays with ψ.
"""

from dataclasses import replace

from loomopt.physics.effects import shaft_torsion
from loomopt.physics.effects.kinds import EffectClash, StatePeak
from loomopt.physics.schema import Figure

EFFECT = replace(
    shaft_torsion.EFFECT,
    rank=90,
    summary="reed on a rocking shaft that twists",
    clashes=(
        EffectClash("gravity", "the weight would act on the reed, which the shaft's steady state does not carry yet"),
        EffectClash("bearing_friction", "it would act on the rocker or the reed, which no source tells"),
        *(clash for clash in shaft_torsion.EFFECT.clashes if clash.effect == "speed_fluctuation"),
    ),
    carries=("inertia", "counterweight_inertia", "resistance"),
    difference=("psi_r", "psi"),
    figures=(
        Figure("shaft_peak", "torque", "peak |reed torque| over the cycle", sides=("max",)),
        Figure("twist_peak", "angle", "peak |twist| of the reed against the rocker", sides=("max",)),
        Figure("reed_front", "angle", "least angle of the reed itself, nearest to the fell", sides=("min",)),
    ),
    peaks={
        **{name: shaft_torsion.EFFECT.peaks[name] for name in ("shaft_peak", "twist_peak")},
        "reed_front": StatePeak(lambda at: at.coordinate() - at.pose.q, least=True),
    },
    columns={
        "psi_r [rad]": lambda at: at.coordinate() - at.pose.q,
        "twist [rad]": lambda at: at.coordinate(),
    },
)
