"""A return spring beside a machine, with what it pulls in both its positions.

A model that knows a spring by its stiffness and elongation alone says nothing of its place and coils: these are
schematic. Its elongation and the travel are drawn at full scale.
"""

import math
from dataclasses import dataclass

from loomopt.base.units import show
from loomopt.picture.drawing import Label, along
from loomopt.picture.shapes import Line, Point, Primitive
from loomopt.picture.symbols import dimension, ground, spring
from loomopt.picture.units import Units

LAYER = "schematic"
LENGTH, COIL, BAR = 20.0, 4.0, 9.0
"""Length of the slack spring, width of its coils and of half of what it pulls, in text heights."""


@dataclass(frozen=True)
class ReturnSpring:
    """A spring that pulls upward; K1: stiffness, N/m; X0: elongation, m, with the load on top; travel: downward, m.

    top: the middle of the load on top; h: text height, m. upper, lower: what the load's positions are called.
    """

    K1: float
    X0: float
    travel: float
    top: Point
    h: float
    upper: str
    lower: str

    @property
    def levels(self) -> tuple[Point, Point, Point]:
        """Where the load would be with the spring slack, where it is on top, and below."""
        return Point(self.top.x, self.top.y + self.X0), self.top, Point(self.top.x, self.top.y - self.travel)

    @property
    def hung(self) -> Point:
        """Where the spring hangs."""
        return self.levels[0].towards(math.pi / 2, LENGTH * self.h)

    def strokes(self) -> list[Primitive]:
        """Return the spring, its load in both positions, preload and travel."""
        h, (slack, top, bottom) = self.h, self.levels
        loads = [Line(LAYER, (at.towards(0.0, -COIL * h), at.towards(0.0, BAR * h))) for at in (top, bottom)]
        return [
            *ground(LAYER, self.hung, math.pi / 2, h),
            spring(LAYER, self.hung, top, COIL * h),
            *loads,
            Line(LAYER, (slack.towards(0.0, 0.75 * COIL * h), slack.towards(0.0, BAR * h))),
            *dimension(slack.towards(0.0, 5 * h), top.towards(0.0, 5 * h), h),
            *dimension(top.towards(0.0, 8 * h), bottom.towards(0.0, 8 * h), h),
        ]

    def labels(self, units: Units) -> list[Label]:
        """Name stiffness, preload, travel and both positions of the load."""
        h, (slack, top, bottom) = self.h, self.levels
        beside = self.hung.part(top).towards(0.0, -COIL / 2 * h)
        first, last = top.towards(0.0, 8 * h), bottom.towards(0.0, 8 * h)
        return [
            Label(LAYER, beside, math.pi, f"K1 = {show(self.K1, units.stiffness)}"),
            along("dimensions", slack.towards(0.0, 5 * h), top.towards(0.0, 5 * h), 0.0, f"X0 = {units.size(self.X0)}"),
            along("dimensions", first, last, 0.0, f"travel = {units.size(self.travel)}"),
            *(
                Label(LAYER, at.towards(0.0, BAR * h), side, text, (at.towards(0.0, -COIL * h),))
                for at, side, text in ((top, math.pi / 8, self.upper), (bottom, -math.pi / 8, self.lower))
            ),
        ]

    def legend(self, units: Units) -> tuple[tuple[str, str], ...]:
        """Return what to say of it below a drawing, each line with its layer."""
        preload = show(self.K1 * self.X0, units.force)
        return (
            (LAYER, f"return spring, K1 of all springs together: stretched by X0 on top, which takes {preload}"),
            (LAYER, "its place and its coils are schematic; X0 and travel are at scale"),
        )

    def notes(self, units: Units) -> dict[str, str]:
        """Return what a table's head says of it."""
        return {
            "K1": f"{show(self.K1, units.stiffness, 9)}, all return springs together",
            "X0": f"{show(self.X0, units.length, 9)} of preload",
            "preload": f"{show(self.K1 * self.X0, units.force, 9)} = K1 X0",
        }
