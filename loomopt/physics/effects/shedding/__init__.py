"""Effects of the heald frame on its cam, and the pose they read; the return spring is always on."""

from typing import Protocol

from loomopt.maths.systems import Number


class FramePose(Protocol):
    """The heald frame at one instant: q = X, down positive.

    segment: 0 rise, 1 far dwell, 2 return, 3 near dwell; worst: −1 where what is not determined in a dwell is taken
    for the least cam force, +1 for the largest.
    """

    @property
    def phi(self) -> Number:
        """Cam angle θ, rad."""

    @property
    def segment(self) -> Number:
        """Segment of the cam."""

    @property
    def worst(self) -> Number:
        """End of the range of a value that is not determined."""

    @property
    def direction(self) -> Number:
        """Sign of X˙; at rest which end of [−1, 1] is meant."""

    @property
    def q(self) -> Number:
        """X, m."""

    @property
    def lowered(self) -> Number:
        """X over the travel, exactly 1 and 0 in the dwells."""

    @property
    def u(self) -> Number:
        """Argument of the cam law, 1 with the shed open downward."""

    @property
    def velocity(self) -> Number:
        """X˙, m/s."""

    @property
    def acceleration(self) -> Number:
        """X¨, m/s²."""
