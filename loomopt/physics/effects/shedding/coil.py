"""The return spring as coils that can be made: rate, stresses, hooks, initial tension, surge, space [Shigley, ch. 10].

If the scene requests it, stress is corrected and the initial tension is checked as in EN 13906-2 and DIN 2089-2. The
effect does not change the balance: K1 (X + X0) is the force of all springs together. Wire, diameter and turns must give
K1, and satisfy the limits of material, winding and space.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from loomopt.base.quantities import (
    Force,
    Length,
    PositiveDensity,
    PositiveLength,
    PositiveNumber,
    PositivePressure,
    PureNumber,
    message_schema,
)
from loomopt.base.quantities import read as quantity
from loomopt.base.units import QuantityError, ShowValue, usual
from loomopt.maths.systems import FLOAT, Maths, Number
from loomopt.physics.effects.kinds import Check, Demand, FlatNumber, Inputs
from loomopt.physics.schema import Figure, Table, Values

DECAY = math.exp(-0.105)
"""How the initial stress that can be wound in falls per unit of spring index [Shigley, eq 10-41]."""

_MILLIMETRES = (
    "1.0 1.1 1.2 1.25 1.3 1.4 1.5 1.6 1.7 1.8 1.9 2.0 2.1 2.25 2.4 2.5 2.6 2.8 3.0 3.2 3.4 3.6 3.8 4.0 4.25 4.5 "
    "4.75 5.0 5.3 5.6 6.0 6.3 6.5 7.0 7.5 8.0 8.5 9.0 9.5 10 10.5 11 12 12.5 13 14 15 16"
)

WIRES: tuple[float, ...] = tuple(float(f"{size}e-3") for size in _MILLIMETRES.split())
"""Common preferred sizes of drawn spring wire, 1 … 16 mm: diameters in m, ascending, each the nearest float64."""


@dataclass(frozen=True)
class Coil:
    """Tension spring, with numbers of one number system.

    wire: wire diameter d, m; diameter: mean coil diameter D, m; turns: active turns n, hooks' share included;
    shear_modulus G and elasticity E, Pa; density, kg/m³; initial_tension: force that parts the turns, N.
    hook_factor: bend radius of the hooks over D/2; 1 for full loops turned up from the last coil.
    hook_length: m, from the body to the inside of a free hook, None for those loops; correction: of shear, by its name.
    """

    wire: Number
    diameter: Number
    turns: Number
    shear_modulus: Number
    density: Number
    initial_tension: Number
    elasticity: Number
    hook_factor: Number = 1
    hook_length: Number | None = None
    correction: Number = "Wahl"

    @property
    def index(self) -> Number:
        """Spring index C = D/d."""
        return self.diameter / self.wire

    @property
    def rate(self) -> Number:
        """Rate k = G d⁴/(8 D³ n) past the initial tension, N/m [Shigley, eq 10-9]."""
        return self.shear_modulus * self.wire**4 / (8 * self.diameter**3 * self.turns)

    @property
    def wahl(self) -> Number:
        """Wahl's factor K_W = (4C − 1)/(4C − 4) + 0.615/C: curvature and direct shear [Shigley, eq 10-4]."""
        index = self.index
        return (4 * index - 1) / (4 * index - 4) + 123 / (200 * self.index)

    @property
    def en_factor(self) -> Number:
        """Factor k = (C + 0.5)/(C − 0.75) of curvature and direct shear [EN 13906-2]."""
        return (self.index + 0.5) / (self.index - 0.75)

    @property
    def body_turns(self) -> Number:
        """Turns of the body N_b = n − G/E: loops deflect like G/E turns [Shigley, eq 10-40]; n with free hooks."""
        if self.hook_length is not None:
            return self.turns
        return self.turns - self.shear_modulus / self.elasticity

    @property
    def free_length(self) -> Number:
        """Length inside the hooks, unloaded: 2(D − d) + (N_b + 1) d, m [Shigley, eq 10-39].

        For full twisted loops at both ends; a free hook reaches its own length beyond the body [EN 13906-2].
        """
        if self.hook_length is not None:
            return 2 * self.hook_length + (self.body_turns + 1) * self.wire
        return 2 * (self.diameter - self.wire) + (self.body_turns + 1) * self.wire

    @property
    def hook_radius(self) -> Number:
        """Bend radius of the hooks in the plane of the loop, r_hook, m."""
        return self.hook_factor * self.diameter / 2

    @property
    def hook_curvature(self) -> Number:
        """K_A = (4C1² − C1 − 1)/(4C1(C1 − 1)), C1 = 2 r_hook/d: curved beam [Shigley, eq 10-35]."""
        bend = 2 * self.hook_radius / self.wire
        return (4 * bend**2 - bend - 1) / (4 * bend * (bend - 1))

    def mass(self, maths: Maths) -> Number:
        """Mass of the active turns m_s = π² d² D n ρ/4, kg [Shigley, eq 10-27]."""
        return maths.pi**2 * self.wire**2 * self.diameter * self.turns * self.density / 4

    def surge_frequency(self, maths: Maths) -> Number:
        """First natural frequency of the spring between its ends, ½ √(k/m_s), Hz [Shigley, eq 10-25]."""
        return maths.sqrt(self.rate / self.mass(maths)) / 2

    def torsion(self, maths: Maths, force: Number) -> Number:
        """Stress 8 F D/(π d³) of the wire taken as straight, Pa; force F, N."""
        return 8 * force * self.diameter / (maths.pi * self.wire**3)

    def shear_stress(self, maths: Maths, force: Number) -> Number:
        """Greatest shear stress of the body K 8 F D/(π d³), Pa; force F, N; K by the coil's correction."""
        factor = self.en_factor if self.correction == "EN 13906" else self.wahl
        return factor * self.torsion(maths, force)

    def initial_stress(self, maths: Maths) -> Number:
        """Uncorrected stress of the initial tension 8 F_i D/(π d³), Pa."""
        return self.torsion(maths, self.initial_tension)

    def initial_stress_least(self, maths: Maths) -> Number:
        """Least initial stress that winding holds to, Pa: below, it is hard to control."""
        return self._initial_stress_usual(maths) - self._initial_stress_spread()

    def initial_stress_most(self, maths: Maths) -> Number:
        """Greatest initial stress that is readily wound in, Pa: above, it is hard to attain."""
        return self._initial_stress_usual(maths) + self._initial_stress_spread()

    def _initial_stress_usual(self, maths: Maths) -> Number:
        """231 exp(−0.105 C) MPa in Pa, a power, since not every number system here has exp [eq 10-41]."""
        return 231_000_000 * maths.number(DECAY) ** self.index

    def _initial_stress_spread(self) -> Number:
        """6.9 (4 − (C − 3)/6.5) MPa in Pa, half the width of the window [eq 10-41]."""
        return 6_900_000 * (4 - 2 * (self.index - 3) / 13)

    def hook_bending(self, maths: Maths, force: Number) -> Number:
        """Tensile stress inside the hook's bend F (16 D K_A/(π d³) + 4/(π d²)), Pa [Shigley, eq 10-34]."""
        bending = 16 * self.diameter * self.hook_curvature / (maths.pi * self.wire**3)
        return force * (bending + 4 / (maths.pi * self.wire**2))


def strength(maths: Maths, d: Number, A: Number, m: Number) -> Number:
    """Tensile strength A/(d / 1 mm)^m of drawn wire, Pa [Shigley, eq 10-14].

    d: wire diameter, m; A: strength of 1 mm wire, Pa; m: exponent, a number. Needs no function of `maths`.
    """
    return A / (1000 * d) ** m


WINDINGS = {"bench": ("0.135", "0.00625"), "machine": ("0.075", "0.00375")}
"""How springs are wound → a and b of the largest initial stress (a − b C) R_m [DIN 2089-2; EN 13906-2]: on a coiling
bench, or on an automatic coiling machine."""


def initial_band(maths: Maths, table: Values) -> tuple[Number, Number]:
    """Least and greatest initial stress, Pa: by the ends that the scene gives, else by the winding it names."""
    made, winding = coil(table), WINDINGS.get(table.get("winding", ""))
    if winding is None:
        least, most = made.initial_stress_least(maths), made.initial_stress_most(maths)
    else:
        a, b = (maths.number(float(text)) for text in winding)
        least, most = 0 * made.index, (a - b * made.index) * tensile(maths, table)
    if "initial_tension_min" in table:
        least = made.torsion(maths, table["initial_tension_min"])
    if "initial_tension_max" in table:
        most = made.torsion(maths, table["initial_tension_max"])
    return least, most


INDEX = 4.0, 12.0
"""Spring indices that can be wound."""
RATE = "coils give K1"
LEAST_INITIAL, MOST_INITIAL = (
    "initial tension: no less than winding gives",
    "initial tension: no more than can be wound",
)
OPENED = "coils are drawn open at the top"


TENSION = 'a force such as "25 N", or a band { min = "20 N", max = "30 N" }'
"""What initial_tension may be, in words."""


def _schema_of_tension(force: dict[str, Any]) -> None:
    """Change the JSON Schema of a force, in place, so that it accepts a band of two forces too."""
    end = {key: value for key, value in force.items() if key not in ("description", "title")}
    band = {"type": "object", "properties": {"min": end, "max": end}, "required": ["min", "max"]}
    accepted = {"anyOf": [end, band | {"additionalProperties": False}]}
    head = {key: force[key] for key in ("description", "title") if key in force}
    force.clear()
    force.update(head | message_schema(accepted, TENSION))


class Parameters(Table):
    """Coils of a return spring, their steel, and their limits."""

    springs: PositiveNumber = Field(2.0, description="number of springs that share K1")
    wire: PositiveLength = Field(description="diameter of the wire")
    diameter: PositiveLength = Field(description="mean diameter of the coil")
    turns: PositiveNumber = Field(description="active turns")
    initial_tension: Force = Field(
        description="force at which the turns begin to separate", json_schema_extra=_schema_of_tension
    )
    shear_modulus: PositivePressure = Field(description="shear modulus of the steel")
    elasticity: PositivePressure = Field(description="modulus of elasticity of the steel")
    density: PositiveDensity = Field(description="density of the steel")
    strength: PositivePressure = Field(description="tensile strength of wire of 1 mm")
    strength_exponent: PureNumber = Field(
        description="exponent of the decrease of the strength with the diameter of the wire"
    )
    shear_share: PositiveNumber = Field(description="permitted shear stress in the body, as a share of the strength")
    bending_share: PositiveNumber = Field(
        description="permitted bending stress in the hooks, as a share of the strength"
    )
    spring_length: PositiveLength = Field(description="space inside the hooks with the shed fully open")
    surge_ratio: PositiveNumber = Field(13.0, description="least surge frequency over that of the cam")
    hook_factor: PositiveNumber = Field(1.0, description="bend radius of the hooks over half the coil's diameter")
    winding: Literal["shigley", "bench", "machine"] = Field(
        "shigley",
        description="band of the initial tension: Shigley's, or of winding on a bench or a machine (EN 13906-2)",
    )
    initial_tension_min: Force | None = Field(
        None, description="least initial tension, in place of that of the winding"
    )
    initial_tension_max: Force | None = Field(
        None, description="largest initial tension, in place of that of the winding"
    )
    factor: Literal["Wahl", "EN 13906"] = Field("Wahl", description="correction of the shear stress")
    hooks: Literal["loops", "free"] = Field(
        "loops",
        description="full loops of the last coil, whose bending is checked, or free hooks, which are not checked",
    )
    hook_length: Length | None = Field(
        None,
        description="length of a free hook, from the body to its inside; by default the inner diameter of the coil",
    )
    sizes: Literal["preferred", "any"] = Field(
        "preferred", description="sizes of a free wire: those that are sold, or any"
    )

    @field_validator("hook_length")
    @classmethod
    def _of_free_hooks(cls, length: float | None, read: ValidationInfo) -> float | None:
        """Refuse the length of hooks that are loops of the last coil."""
        if length is not None and read.data.get("hooks") == "loops":
            problem = "the length of the hooks is given, and hooks is not free"
            raise QuantityError(problem, "", 'Write hooks = "free", or take hook_length out')
        return length

    @field_validator("initial_tension_max")
    @classmethod
    def _not_below_the_least(cls, most: float | None, read: ValidationInfo) -> float | None:
        """Refuse a band of the initial tension whose ends are exchanged."""
        least = read.data.get("initial_tension_min")
        if most is not None and least is not None and most < least:
            problem = "the largest initial tension is less than the least"
            raise QuantityError(problem, "min <= max", "Exchange or correct them")
        return most

    @field_validator("initial_tension", mode="before")
    @classmethod
    def _force_or_band(cls, raw: object) -> object:
        """Refuse a table that is no band: `_band_of_initial_tension` has read the others."""
        if isinstance(raw, Mapping):
            raise QuantityError("it is no band of two forces", TENSION, "Give min and max, each a force")
        return raw

    @model_validator(mode="before")
    @classmethod
    def _band_of_initial_tension(cls, raw: object) -> object:
        """Read initial_tension = { min, max } as its band, with the middle as its value."""
        if not isinstance(raw, Mapping):
            return raw
        band = raw.get("initial_tension")
        if not isinstance(band, Mapping) or set(band) != {"min", "max"}:
            return raw
        try:
            ends = [quantity(str(band[side]), "force") for side in ("min", "max")]
        except QuantityError:
            return raw
        return {
            **raw,
            "initial_tension": f"{(ends[0] + ends[1]) / 2!r} N",
            "initial_tension_min": band["min"],
            "initial_tension_max": band["max"],
        }


def coil(table: Values) -> Coil:
    """Coil by name."""
    return Coil(
        table["wire"],
        table["diameter"],
        table["turns"],
        table["shear_modulus"],
        table["density"],
        table["initial_tension"],
        table["elasticity"],
        table["hook_factor"],
        table.get("hook_length", table["diameter"] - table["wire"]) if table.get("hooks") == "free" else None,
        str(table.get("factor", "Wahl")),
    )


def load(at: Inputs[object]) -> Number:
    """Largest force on one coil, with the shed open downward, N."""
    return at.values["K1"] * (at.values["X0"] + at.values["travel"]) / at.table["springs"]


def tensile(maths: Maths, table: Values) -> Number:
    """Tensile strength of the wire, Pa."""
    return strength(maths, table["wire"], table["strength"], table["strength_exponent"])


def _length(at: Inputs[object]) -> Number:
    """Length inside the hooks with the shed open downward, m."""
    spring = coil(at.table)
    return spring.free_length + at.values["X0"] + at.values["travel"] - spring.initial_tension / spring.rate


def _bending_share(at: Inputs[object]) -> Number:
    """Bending stress of the hooks over the strength; 0 for free hooks, whose bend is unknown."""
    share = coil(at.table).hook_bending(at.maths, load(at)) / tensile(at.maths, at.table)
    return 0 * share if at.table.get("hooks") == "free" else share


ROWS: dict[str, Callable[[Inputs[None]], Number]] = {
    "coil_index": lambda at: coil(at.table).index,
    "shear_stress": lambda at: coil(at.table).shear_stress(at.maths, load(at)),
    "shear_share": lambda at: coil(at.table).shear_stress(at.maths, load(at)) / tensile(at.maths, at.table),
    "bending_share": _bending_share,
    "surge_ratio": lambda at: 2 * at.maths.pi * coil(at.table).surge_frequency(at.maths) / at.values["speed"],
    "spring_length": _length,
    "spring_mass": lambda at: at.table["springs"] * coil(at.table).mass(at.maths),
    RATE: lambda at: at.table["springs"] * coil(at.table).rate - at.values["K1"],
    LEAST_INITIAL: lambda at: coil(at.table).initial_stress(at.maths) - initial_band(at.maths, at.table)[0],
    MOST_INITIAL: lambda at: initial_band(at.maths, at.table)[1] - coil(at.table).initial_stress(at.maths),
    OPENED: lambda at: at.values["K1"] * at.values["X0"] / at.table["springs"] - at.table["initial_tension"],
}
"""Figures of the coils, then what they keep as margins that are never negative (the rate's is zero), SI."""

MARGINS = {RATE: "stiffness", LEAST_INITIAL: "pressure", MOST_INITIAL: "pressure", OPENED: "force"}

FIGURES = (
    Figure("coil_index", "number", "spring index D/d of the coils", sides=()),
    Figure("shear_stress", "pressure", "largest shear stress of the coils", sides=("max",)),
    Figure("shear_share", "number", "shear stress over tensile strength", sides=()),
    Figure("bending_share", "number", "hook bending stress over tensile strength, 0 of free hooks", sides=()),
    Figure("surge_ratio", "number", "surge frequency over that of the cam", sides=()),
    Figure("spring_length", "length", "length inside the hooks, fully stretched", sides=()),
    Figure("spring_mass", "mass", "mass of the coils of all springs", sides=("max",)),
)


def fault(numbers: Mapping[str, Any]) -> str:
    """Reason why wire and coil, SI, make no spring: the stresses are finite for a coil around its wire only."""
    if numbers["diameter"] <= numbers["wire"]:
        return "its diameter is not larger than its wire"
    if numbers["hook_factor"] * numbers["diameter"] <= numbers["wire"]:
        return "its hooks are bent to half the wire or less: hook_factor is not larger than wire / diameter"
    return ""


def sold(parameters: Parameters) -> Mapping[str, Sequence[float]]:
    """Preferred wire diameters, m, where the wire must have one of them."""
    return {"wire": WIRES} if parameters.sizes == "preferred" else {}


def explain(
    known: Mapping[str, float],
    bounds: Mapping[str, tuple[float, float]],
    parameters: Parameters,
    clash: Collection[str],
    shown: ShowValue = usual,
) -> str:
    """Reason why coils that surge late enough are stressed too much, and a remedy; "" where these do not conflict.

    shown(value, kind, digits): a value as text in the reader's unit.
    tau >= 2 K_W (X0 + travel) f sqrt(2 G rho) follows from rate, surge frequency and shear stress [Shigley, ch. 10].
    """
    if "surge_ratio" not in clash or not {"shear_share", "bending_share"}.intersection(clash):
        return ""
    stretch = bounds["X0"][1] + known["travel"]
    thinnest = bounds.get("coil.wire", (parameters.wire, parameters.wire))[0]
    slimmest = Coil(1.0, INDEX[1], 1.0, parameters.shear_modulus, parameters.density, 0.0, parameters.elasticity)
    surge = parameters.surge_ratio * known["speed"] / (2 * math.pi)
    least = 2 * slimmest.wahl * stretch * surge * math.sqrt(2 * parameters.shear_modulus * parameters.density)
    most = parameters.shear_share * strength(FLOAT, thinnest, parameters.strength, parameters.strength_exponent)
    if least <= most:
        return ""
    return (
        f"Coils that surge at {parameters.surge_ratio:g} times the cam's speed and stretch by X0 + travel = "
        f"{shown(stretch, 'length', 4)} carry at least {shown(least, 'pressure', 4)} of shear, whatever their size "
        f"(tau >= 2 K_W (X0 + travel) f sqrt(2 G rho)); the wire allows {shown(most, 'pressure', 4)} at most. "
        "Less preload asks for a stiffer spring. A lower speed, less travel or a softer cam law (target law) helps."
    )


EFFECT: Check[object] = Check(
    name="coil",
    summary="tension springs that can be made: stresses, hooks, surge, space",
    table=Parameters,
    rank=60,
    reads=("K1", "X0", "travel"),
    needs=("operation.speed",),
    rows=ROWS,
    figures=FIGURES,
    margins=MARGINS,
    least="spring_mass",
    axes=(FlatNumber(name="initial tension", key="initial_tension"),),
    sold=sold,
    fault=fault,
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
