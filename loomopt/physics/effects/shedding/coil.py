"""The return spring as coils that can be made: rate, stresses, hooks, initial tension, surge, space [Shigley, ch. 10].

It takes no part in the balance: K1 (X + X0) stays the whole force of all springs together. Their wire, coil and turns
must give K1, and keep what material, winding and space allow.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Literal

from pydantic import Field

from loomopt.base.quantities import Force, PositiveDensity, PositiveLength, PositiveNumber, PositivePressure, PureNumber
from loomopt.base.units import ShowValue, usual
from loomopt.maths.systems import FLOAT, Maths, Number
from loomopt.physics.effects.kinds import Check, Demand, FlatNumber
from loomopt.physics.mechanisms.tension_spring import WIRES, Coil, strength
from loomopt.physics.schema import Figure, Table, Values

INDEX = 4.0, 12.0
"""Spring indices that can be wound."""
RATE = "coils give K1"
LEAST_INITIAL, MOST_INITIAL = (
    "initial tension: no less than winding gives",
    "initial tension: no more than can be wound",
)
OPENED = "coils are drawn open at the top"


class Own(Table):
    """The coils of one return spring, their steel, and what they must keep."""

    springs: PositiveNumber = Field(2.0, description="how many springs share K1")
    wire: PositiveLength = Field(description="diameter of the wire")
    diameter: PositiveLength = Field(description="mean diameter of the coil")
    turns: PositiveNumber = Field(description="active turns")
    initial_tension: Force = Field(description="force at which the turns begin to part")
    shear_modulus: PositivePressure = Field(description="shear modulus of the steel")
    elasticity: PositivePressure = Field(description="modulus of elasticity of the steel")
    density: PositiveDensity = Field(description="density of the steel")
    strength: PositivePressure = Field(description="tensile strength of wire of 1 mm")
    strength_exponent: PureNumber = Field(description="exponent with which the strength falls as the wire grows")
    shear_share: PositiveNumber = Field(description="share of the strength that shear in the body may take")
    bending_share: PositiveNumber = Field(description="share of the strength that bending of the hooks may take")
    spring_length: PositiveLength = Field(description="space inside the hooks with the shed fully open")
    surge_ratio: PositiveNumber = Field(13.0, description="least surge frequency over that of the cam")
    hook_factor: PositiveNumber = Field(1.0, description="bend radius of the hooks over half the coil's diameter")
    sizes: Literal["preferred", "any"] = Field("preferred", description="a free wire's: those that are sold, or any")


def coil(own: Values) -> Coil:
    """Return one of the coils."""
    return Coil(
        own["wire"],
        own["diameter"],
        own["turns"],
        own["shear_modulus"],
        own["density"],
        own["initial_tension"],
        own["elasticity"],
        own["hook_factor"],
    )


def load(given: Values, own: Values) -> Number:
    """Return the largest force on one coil, with the shed open downward, N."""
    return given["K1"] * (given["X0"] + given["travel"]) / own["springs"]


def tensile(maths: Maths, own: Values) -> Number:
    """Return the tensile strength of the wire, Pa."""
    return strength(maths, own["wire"], own["strength"], own["strength_exponent"])


def _length(maths: Maths, given: Values, own: Values) -> Number:
    """Return the length inside the hooks with the shed open downward, m."""
    own_coil = coil(own)
    return own_coil.free_length + given["X0"] + given["travel"] - own_coil.initial_tension / own_coil.rate


ROWS: dict[str, Callable[[Maths, Values, Values], Number]] = {
    "coil_index": lambda m, v, own: coil(own).index,
    "shear_stress": lambda m, v, own: coil(own).shear_stress(m, load(v, own)),
    "shear_share": lambda m, v, own: coil(own).shear_stress(m, load(v, own)) / tensile(m, own),
    "bending_share": lambda m, v, own: coil(own).hook_bending(m, load(v, own)) / tensile(m, own),
    "surge_ratio": lambda m, v, own: 2 * m.pi * coil(own).surge_frequency(m) / v["speed"],
    "spring_length": _length,
    "spring_mass": lambda m, v, own: own["springs"] * coil(own).mass(m),
    RATE: lambda m, v, own: own["springs"] * coil(own).rate - v["K1"],
    LEAST_INITIAL: lambda m, v, own: coil(own).initial_stress(m) - coil(own).initial_stress_least(m),
    MOST_INITIAL: lambda m, v, own: coil(own).initial_stress_most(m) - coil(own).initial_stress(m),
    OPENED: lambda m, v, own: v["K1"] * v["X0"] / own["springs"] - own["initial_tension"],
}
"""Figures of the coils, then what they keep as margins that are never negative (the rate's is zero), SI."""

MARGINS = {RATE: "stiffness", LEAST_INITIAL: "pressure", MOST_INITIAL: "pressure", OPENED: "force"}

FIGURES = (
    Figure("coil_index", "number", "spring index D/d of the coils", sides=()),
    Figure("shear_stress", "pressure", "largest shear stress of the coils", sides=("max",)),
    Figure("shear_share", "number", "shear stress over tensile strength", sides=()),
    Figure("bending_share", "number", "hook bending stress over tensile strength", sides=()),
    Figure("surge_ratio", "number", "surge frequency over that of the cam", sides=()),
    Figure("spring_length", "length", "length inside the hooks, fully stretched", sides=()),
    Figure("spring_mass", "mass", "mass of the coils of all springs", sides=("max",)),
)


def sold(own: Own) -> Mapping[str, Sequence[float]]:
    """Return the wire diameters that are sold, m, where the wire must be one of them."""
    return {"wire": WIRES} if own.sizes == "preferred" else {}


def explain(
    known: Mapping[str, float],
    bounds: Mapping[str, tuple[float, float]],
    own: Own,
    clash: Collection[str],
    shown: ShowValue = usual,
) -> str:
    """Say why coils that surge late enough are stressed too much, and what helps; "" where that is not what clashes.

    shown(value, kind, digits): a value as text in the reader's unit.
    tau >= 2 K_W (X0 + travel) f sqrt(2 G rho) follows from rate, surge frequency and shear stress [Shigley, ch. 10].
    """
    if "surge_ratio" not in clash or not {"shear_share", "bending_share"}.intersection(clash):
        return ""
    stretch = bounds["X0"][1] + known["travel"]
    thinnest = bounds.get("coil.wire", (own.wire, own.wire))[0]
    slimmest = Coil(1.0, INDEX[1], 1.0, own.shear_modulus, own.density, 0.0, own.elasticity)
    surge = own.surge_ratio * known["speed"] / (2 * math.pi)
    least = 2 * slimmest.wahl * stretch * surge * math.sqrt(2 * own.shear_modulus * own.density)
    most = own.shear_share * strength(FLOAT, thinnest, own.strength, own.strength_exponent)
    if least <= most:
        return ""
    return (
        f"Coils that surge at {own.surge_ratio:g} times the cam's speed and stretch by X0 + travel = "
        f"{shown(stretch, 'length', 4)} carry at least {shown(least, 'pressure', 4)} of shear, whatever their size "
        f"(tau >= 2 K_W (X0 + travel) f sqrt(2 G rho)); the wire allows {shown(most, 'pressure', 4)} at most. "
        "Less preload asks for a stiffer spring. A lower speed, less travel or a softer cam law (target law) helps."
    )


EFFECT: Check[object] = Check(
    name="coil",
    summary="tension springs that can be made: stresses, hooks, surge, space",
    own=Own,
    rank=60,
    reads=("K1", "X0", "travel"),
    needs=("operation.speed",),
    rows=ROWS,
    figures=FIGURES,
    margins=MARGINS,
    least="spring_mass",
    axes=(FlatNumber(name="initial tension", key="initial_tension"),),
    sold=sold,
    explain=explain,
    demands=(
        Demand("coil_index", -1, INDEX[0]),
        Demand("coil_index", 1, INDEX[1]),
        Demand("shear_share", 1, "shear_share"),
        Demand("bending_share", 1, "bending_share"),
        Demand("surge_ratio", -1, "surge_ratio"),
        Demand("spring_length", 1, "spring_length"),
        Demand(RATE, 0, 0.0),
        Demand(LEAST_INITIAL, -1, 0.0),
        Demand(MOST_INITIAL, -1, 0.0),
        Demand(OPENED, -1, 0.0),
    ),
    examples=(
        {
            "wire": "6 mm",
            "diameter": "45 mm",
            "turns": "8",
            "initial_tension": "100 N",
            "springs": "2",
            "shear_modulus": "77200 MPa",
            "elasticity": "203400 MPa",
            "density": "7850 kg/m^3",
            "strength": "1974 MPa",
            "strength_exponent": "0.108",
            "shear_share": "0.5",
            "bending_share": "0.75",
            "spring_length": "400 mm",
            "surge_ratio": "13",
        },
    ),
)
