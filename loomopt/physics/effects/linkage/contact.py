"""Forces between rollers and cams, and their Hertz pressure: figures only.

The couple m that the follower of a cam needs comes from all loads and masses that hang on it. Without preload the
rollers that push its way carry it alone: F = m/(w·n), w the way of the roller's centre per rad of the follower, n the
normal, where that is positive. With a preload couple M_p of two opposed rollers of equal stiffness each carries
M_p/|w·n| + m/(2 w·n) while both touch [equilibrium of the follower; equal stiffness]. Pressure of two cylinders
[Hertz 1881]: p² = F E*/(π b r (1 − κ r)), κ the curvature of the pitch curve, E* = E/(2(1 − ν²)) of equal materials.
"""

import functools
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pydantic import Field

from loomopt.base.quantities import PositiveLength, PositivePressure, PureNumber, Torque
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Check, Inputs, Loading
from loomopt.physics.effects.linkage import LinkagePose
from loomopt.physics.effects.linkage.joint_forces import LinkageForces
from loomopt.physics.mechanisms.dyad import dot
from loomopt.physics.schema import Figure, Table

if TYPE_CHECKING:
    from loomopt.physics.mechanisms.chain import Chain, Part


class Parameters(Table):
    """Values of the contacts."""

    width: PositiveLength | None = Field(None, description="face width of all cams of one roller together")
    elasticity: PositivePressure = Field(206e9, description="modulus of elasticity of cams and rollers")
    poisson: PureNumber = Field(0.3, description="Poisson's ratio of cams and rollers")
    preload: Torque | None = Field(None, description="couple by which two opposed rollers are pressed on their cams")


class RollerForces(LinkageForces):
    """Forces of the rollers at one instant."""

    def alone(self, roller: "Part") -> Number:
        """Force, N, of the cam on a roller that carries the whole couple; negative where it pushes the other way."""
        return self._couple(roller) / self._lever(roller)

    def shared(self, roller: "Part") -> Number:
        """Force, N, of the cam on a roller while the opposed one touches too."""
        lever = self._lever(roller)
        return self.at.table["preload"] / self.at.maths.sqrt(lever**2) + self._couple(roller) / (2 * lever)

    def pressure_square(self, roller: "Part", force: Number) -> Number:
        """Square of the Hertz pressure, Pa²: of a force that presses; negative like the force."""
        maths, table, contact = self.at.maths, self.at.table, self.at.pose.contact(roller)
        modulus = table["elasticity"] / (2 * (1 - table["poisson"] ** 2))
        return force * modulus / (maths.pi * table["width"] * contact.radius * (1 - contact.undercut))

    def _couple(self, roller: "Part") -> Number:
        return self.walk.couples[roller.word("cam")]

    def _lever(self, roller: "Part") -> Number:
        contact = self.at.pose.contact(roller)
        return dot(contact.way, contact.normal)


@functools.lru_cache(maxsize=64)
def fitted(linked: "Chain") -> Check[LinkagePose]:
    """Check of a linkage, with the figures of its rollers."""
    names = [roller.name for roller in linked.rollers]
    figures = [
        *(
            Figure(f"force.{name}", "force", f"largest force of the cam on roller {name}", sides=("max",))
            for name in names
        ),
        *(
            Figure(f"hertz.{name}", "pressure", f"largest Hertz pressure of roller {name}", sides=("max",))
            for name in names
        ),
        Figure("hertz", "pressure", "largest Hertz pressure of all rollers", sides=("max",)),
    ]
    return replace(EFFECT, joints=functools.partial(RollerForces, linked), figures=tuple(figures), fitted=None)


def without_rollers(at: Inputs[Any], loading: Loading) -> RollerForces:
    """Raise LookupError: a linkage without rollers has no contacts."""
    raise LookupError("the linkage has no roller")


EFFECT: Check[LinkagePose] = Check(
    name="contact",
    summary="forces and Hertz pressure between rollers and cams",
    table=Parameters,
    rank=91,
    joints=without_rollers,
    fitted=fitted,
    sentence="of each roller F = m/(w.n), p^2 = F E*/(pi b r (1 - kappa r))",
    examples=({"width": "60 mm"},),
)
