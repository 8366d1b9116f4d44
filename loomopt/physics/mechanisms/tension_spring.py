"""The close-wound tension spring of round wire: rate, stresses, hooks, surge, length.

[Shigley]: Budynas and Nisbett, Shigley's Mechanical Engineering Design, chapter 10.

A tension spring neither buckles nor goes solid; what bounds it is the stress in the body and in the hooks, the initial
tension that can be wound in, its surge and its length. SI throughout; formulas hold for an index D/d above 1.
"""

import math
from dataclasses import dataclass

from loomopt.maths.systems import Maths, Number

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
    """One tension spring, its numbers of one number system.

    wire: wire diameter d, m; diameter: mean coil diameter D, m; turns: active turns n, hooks' share included;
    shear_modulus G and elasticity E, Pa; density, kg/m³; initial_tension: force that parts the turns, N.
    hook_factor: bend radius of the hooks over D/2; 1 for full loops turned up from the last coil.
    """

    wire: Number
    diameter: Number
    turns: Number
    shear_modulus: Number
    density: Number
    initial_tension: Number
    elasticity: Number
    hook_factor: Number = 1

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
    def body_turns(self) -> Number:
        """Turns of the body N_b = n − G/E: the hooks give way like G/E turns [Shigley, eq 10-40]."""
        return self.turns - self.shear_modulus / self.elasticity

    @property
    def free_length(self) -> Number:
        """Length inside the hooks, unloaded: 2(D − d) + (N_b + 1) d, m [Shigley, eq 10-39].

        For full twisted loops at both ends.
        """
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
        """Return the mass of the active turns m_s = π² d² D n ρ/4, kg [Shigley, eq 10-27]."""
        return maths.pi**2 * self.wire**2 * self.diameter * self.turns * self.density / 4

    def surge_frequency(self, maths: Maths) -> Number:
        """Return the first natural frequency of the spring between its ends, ½ √(k/m_s), Hz [Shigley, eq 10-25]."""
        return maths.sqrt(self.rate / self.mass(maths)) / 2

    def torsion(self, maths: Maths, force: Number) -> Number:
        """Return the stress 8 F D/(π d³) of the wire taken as straight, Pa; force F, N."""
        return 8 * force * self.diameter / (maths.pi * self.wire**3)

    def shear_stress(self, maths: Maths, force: Number) -> Number:
        """Return the greatest shear stress of the body K_W 8 F D/(π d³), Pa; force F, N."""
        return self.wahl * self.torsion(maths, force)

    def initial_stress(self, maths: Maths) -> Number:
        """Return the uncorrected stress of the initial tension 8 F_i D/(π d³), Pa."""
        return self.torsion(maths, self.initial_tension)

    def initial_stress_least(self, maths: Maths) -> Number:
        """Return the least initial stress that winding holds to, Pa: below, it is hard to control."""
        return self._initial_stress_usual(maths) - self._initial_stress_spread()

    def initial_stress_most(self, maths: Maths) -> Number:
        """Return the greatest initial stress that is readily wound in, Pa: above, it is hard to attain."""
        return self._initial_stress_usual(maths) + self._initial_stress_spread()

    def _initial_stress_usual(self, maths: Maths) -> Number:
        """Return 231 exp(−0.105 C) MPa in Pa, a power, since no number system here is asked for exp [eq 10-41]."""
        return 231_000_000 * maths.number(DECAY) ** self.index

    def _initial_stress_spread(self) -> Number:
        """Return 6.9 (4 − (C − 3)/6.5) MPa in Pa, half the width of the window [eq 10-41]."""
        return 6_900_000 * (4 - 2 * (self.index - 3) / 13)

    def hook_bending(self, maths: Maths, force: Number) -> Number:
        """Return the tensile stress inside the hook's bend F (16 D K_A/(π d³) + 4/(π d²)), Pa [Shigley, eq 10-34]."""
        bending = 16 * self.diameter * self.hook_curvature / (maths.pi * self.wire**3)
        return force * (bending + 4 / (maths.pi * self.wire**2))


def strength(maths: Maths, d: Number, A: Number, m: Number) -> Number:
    """Return the tensile strength A/(d / 1 mm)^m of drawn wire, Pa [Shigley, eq 10-14].

    d: wire diameter, m; A: strength of 1 mm wire, Pa; m: exponent, a number. Needs no function of `maths`.
    """
    return A / (1000 * d) ** m
