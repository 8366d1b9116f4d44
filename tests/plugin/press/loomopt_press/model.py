"""The slider-crank, in line, crank at φ; q is the travel of the slide down from its highest position."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass

from loomopt.maths.systems import Maths, Number
from loomopt.model.kinematics import Group, Kinematics
from loomopt.model.model import CycleQuantity, DesignRow, Instant, JobModel
from loomopt.model.numbers import numbers, words
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node
from loomopt.physics.effects.kinds import Motion
from loomopt.physics.tolerances import ASSEMBLY_MARGIN
from loomopt.scenes.scene import Scene

TOP, BOTTOM = "top dead centre", "bottom dead centre"
LONGER = "assembly: crank < rod"


@dataclass(frozen=True)
class SlidePose(Motion):
    """The slide at crank angles φ, rad, any shape."""

    maths: Maths
    crank: Number
    rod: Number
    phi: Number
    omega: Number
    omega_dot: Number = None

    @functools.cached_property
    def _along(self) -> Number:
        """rod · cos b, where b is the rod's angle from the slide's line."""
        side = self.crank * self.maths.sin(self.phi)
        return self.maths.sqrt((self.rod - side) * (self.rod + side))

    @functools.cached_property
    def _rate(self) -> Number:
        """b'."""
        return self.crank * self.maths.cos(self.phi) / self._along

    @functools.cached_property
    def q(self) -> Number:
        """Travel, m: rod · (cos b − 1) without a difference of near numbers."""
        side, cos = self.crank * self.maths.sin(self.phi), self.maths.cos(self.phi)
        return self.crank * (1 - cos) - side * side / (self.rod + self._along)

    @functools.cached_property
    def q1(self) -> Number:
        """q', m/rad."""
        return self.crank * self.maths.sin(self.phi) * (1 - self._rate)

    @functools.cached_property
    def q2(self) -> Number:
        """q'', m/rad²."""
        side, second = self.crank * self.maths.sin(self.phi), (self._rate**2 - 1) / self._along
        return self.crank * self.maths.cos(self.phi) * (1 - self._rate) - side * side * second


@dataclass(frozen=True)
class SliderCrank(Kinematics):
    """The press's motion."""

    structure: str = "press"

    @property
    def groups(self) -> Mapping[str, Group]:
        """The rod on its way past the crank: it stands across most at φ = π/2 and 3π/2."""
        return {
            "": Group(
                {"span": lambda m, given, phi, pose: (given.values["crank"] * m.sin(phi) / given.values["rod"]) ** 2},
                {"the rod is longer than the crank": "span"},
                {LONGER: lambda m, v: v["rod"] - ASSEMBLY_MARGIN * v["crank"]},
                (LONGER,),
            )
        }

    def pose(self, maths: Maths, given: Given, node: Node) -> SlidePose:
        """Pose at a node."""
        values = given.values
        return SlidePose(maths, values["crank"], values["rod"], node.phi, values.get("speed"))

    def events(self, maths: Maths, given: Given) -> dict[str, Number]:
        """Both dead centres, rad."""
        return {TOP: 0 * maths.pi, BOTTOM: maths.pi}


def obliquity(at: Instant) -> Number:
    """Rod's largest angle from the slide's line, rad."""
    crank, rod = at.values["crank"], at.values["rod"]
    return at.maths.atan2(crank, at.maths.sqrt((rod - crank) * (rod + crank)))


QUANTITIES = {
    "peak_torque": CycleQuantity(lambda at: at.crank_torque),
    "peak_acceleration": CycleQuantity(lambda at: at.pose.q2),
}
ROWS = {
    "stroke": DesignRow(lambda at: 2 * at.values["crank"]),
    "reach": DesignRow(lambda at: at.values["crank"] + at.values["rod"]),
    "obliquity": DesignRow(obliquity),
}
"""Figures over the cycle and of the design alone, SI."""


def model(scene: Scene) -> JobModel:
    """Slider-crank with the effects the scene calls for."""
    return JobModel(SliderCrank(), scene.active, words(scene), QUANTITIES, ROWS, known=frozenset(numbers(scene)))
