"""Poses of the beat-up mechanism: q = −ψ, so that Q is the reed torque M3."""

import functools
from dataclasses import dataclass

from loomopt import balance
from loomopt.maths import Number
from loomopt.mechanisms import crank_rocker
from loomopt.schema import Values


@dataclass(frozen=True)
class ReedPose(balance.Motion):
    """The pose at crank angles φ, rad, any shape: q = −ψ; what no load reads is not computed."""

    phi: Number
    omega: Number
    joints: crank_rocker.Pose
    omega_dot: Number = None

    @property
    def q(self) -> Number:
        """−ψ, rad."""
        return -self.joints.psi

    @functools.cached_property
    def q1(self) -> Number:
        """−ψ'."""
        return -self.joints.psi_1

    @functools.cached_property
    def q2(self) -> Number:
        """−ψ''."""
        return -self.joints.psi_2


@dataclass(frozen=True)
class FrontPose(balance.Motion):
    """The pose at front dead centre, exact: ψ' = 0, and ψ'' in closed form."""

    values: Values
    joints: None = None
    omega_dot: None = None
    q1: int = 0

    @property
    def phi(self) -> Number:
        """β, rad."""
        return self.values["beta"]

    @property
    def omega(self) -> Number:
        """Crank speed, rad/s."""
        return self.values.get("speed")

    @property
    def q(self) -> Number:
        """−ψ, rad."""
        return -self.values["centres"].psi_front

    @property
    def q2(self) -> Number:
        """−ψ''."""
        return -self.values["centres"].psi_2_front
