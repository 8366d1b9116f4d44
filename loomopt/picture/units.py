"""The units a drawing tells its quantities in; its lengths in mm, or in inches where the scene's are."""

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

from loomopt.base import units

if TYPE_CHECKING:
    from loomopt.scene.scene import Scene

Unit = Literal["mm", "in"]
"""What a workshop measures in."""


class Units(NamedTuple):
    """Units of a drawing's lengths, whose numbers stand without it, and of its other quantities."""

    length: Unit = "mm"
    mass: str = "kg"
    force: str = "N"
    stiffness: str = "N/m"

    @property
    def said(self) -> str:
        """What a legend says of lengths."""
        return "lengths in inches" if self.length == "in" else "lengths in mm"

    def size(self, metres: float, digits: int = 6) -> str:
        """Return a length as its number in the drawing's unit."""
        return f"{metres / units.factor(self.length) + 0.0:.{digits}g}"

    def within(self, metres: float) -> str:
        """Return a tolerance, m, with its unit: one digit, rounded up, so that it is promised and kept."""
        value = metres / units.factor(self.length)
        if not value:
            return f"0 {self.length}"
        digit = 10.0 ** math.floor(math.log10(value))
        up = math.ceil(round(value / digit, 6)) * digit
        return f"{up:.{max(0, -math.floor(math.log10(up)))}f} {self.length}"


METRIC = Units()


def told(scene: "Scene") -> Units:
    """Return the units a scene is drawn in: inches where its lengths are in whole inches, as feet are; else mm."""
    inches = units.parse_unit(scene.shown_in("length")).factor / units.parse_unit("in").factor
    kinds = {kind: scene.shown_in(kind) for kind in ("mass", "force", "stiffness")}
    return Units("in" if inches.denominator == 1 else "mm", **kinds)
