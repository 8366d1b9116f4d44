"""A counterweight on the reed's rocker: mass m4e, kg, at radius r4e, m; what is of use is its inertia m4e r4e²."""

from collections.abc import Mapping

NAMES = ("m4e", "r4e")
AMPLE, LONG = 10.0, 3.0
"""Inertia beyond which no counterweight is of use, in those of the reed; radius beyond which none is built, in l4."""


def holding(reed: float, front: float, resistance: float) -> float:
    """Return the inertia, kg·m², that holds the resistance at front dead centre, turning as the reed does today.

    reed: today's inertia, kg·m²; front: today's reed torque there with the resistance, N·m; resistance: N·m. From
    M3 = M0 − J ψ'' ω² [Yuan24, eq 2], in proportion.
    """
    return reed * abs(resistance / (front - resistance)) if front != resistance else 0.0


def room(
    known: Mapping[str, float], bounds: Mapping[str, tuple[float, float]], inertia: float
) -> dict[str, tuple[float, float]]:
    """Return the bounds of mass, kg, and radius, m, as far as they are of use: generous ones say nothing of a machine.

    known: today's m4e, r4e and l4; inertia: of the reed or of what holds the resistance, kg·m²; 0 where there is none
    to compare with, and the bounds stay as they are.
    """
    found, ample = {name: bounds[name] for name in NAMES}, AMPLE * inertia
    if found["m4e"][1] * found["r4e"][1] ** 2 > ample > 0.0:
        low, high = found["r4e"]
        found["r4e"] = low, min(high, max(low, known["r4e"], LONG * known["l4"]))
        low, high = found["m4e"]
        found["m4e"] = low, min(high, max(low, known["m4e"], ample / found["r4e"][1] ** 2))
    return found
