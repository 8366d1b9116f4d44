"""Effects of the beat-up mechanism, and the pose they read."""

from typing import Protocol

from loomopt.maths.systems import Number


class Rod(Protocol):
    """Motion of the linkage that effects read: angle of the rod, its derivatives, and the angle from rod to crank."""

    @property
    def rod_1(self) -> Number:
        """First derivative of the rod's angle with respect to φ."""

    @property
    def rod_2(self) -> Number:
        """Second derivative of the rod's angle."""

    @property
    def cos_crank_rod(self) -> Number:
        """Cosine of the angle from rod to crank."""

    @property
    def sin_crank_rod(self) -> Number:
        """Sine of the angle from rod to crank."""


class ReedPose(Protocol):
    """The reed at one instant: q = −ψ."""

    @property
    def phi(self) -> Number:
        """Crank angle φ, rad."""

    @property
    def q(self) -> Number:
        """−ψ, rad."""

    @property
    def q1(self) -> Number:
        """−ψ'."""

    @property
    def omega(self) -> Number:
        """Crank speed, rad/s."""

    @property
    def omega_dot(self) -> Number:
        """Angular acceleration of the crank, rad/s²; None at constant speed."""

    @property
    def velocity(self) -> Number:
        """q˙, rad/s."""

    @property
    def acceleration(self) -> Number:
        """q¨, rad/s²."""

    @property
    def joints(self) -> Rod:
        """The linkage."""
