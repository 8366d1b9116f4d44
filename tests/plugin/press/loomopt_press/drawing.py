"""The press drawn at full scale: the crank above, the slide below."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from loomopt.picture.drawing import Label, Skeleton, along
from loomopt.picture.mechanism_drawing import MechanismDrawing
from loomopt.picture.shapes import Floats, Point, Units
from loomopt_press.model import BOTTOM, TOP

HALF = "half way"


@dataclass(frozen=True)
class PressDrawing(MechanismDrawing):
    """Press in both dead centres and half way; crank, rod: m."""

    crank: float
    rod: float

    @property
    def base(self) -> Skeleton:
        """Shaft, links and the crank's circle."""
        return Skeleton({"A": Point(0.0, 0.0)}, {}, (("A", "B"), ("B", "C")), (("A", self.crank),))

    @property
    def events(self) -> Mapping[str, float]:
        """Crank angles of the positions that are drawn."""
        return {TOP: 0.0, HALF: math.pi / 2, BOTTOM: math.pi}

    @property
    def height(self) -> float:
        """Text height."""
        return 0.02 * (self.crank + self.rod)

    def places(self, angles: Floats) -> Mapping[str, Floats]:
        """Crank pin and slide at crank angles."""
        x, y = self.crank * np.sin(angles), self.crank * np.cos(angles)
        return {"B": np.column_stack((x, y)), "C": np.column_stack((0.0 * x, y - np.sqrt(self.rod**2 - x**2)))}

    def labels(self, units: Units) -> list[Label]:
        """Names of the joints and of both links with their lengths."""
        at = self.skeleton.at(HALF)
        return [
            Label("frame", at["A"], math.pi, "A"),
            Label(HALF, at["B"], 0.0, "B"),
            Label(HALF, at["C"], 0.0, "C"),
            along(HALF, at["A"], at["B"], math.pi / 2, f"crank = {units.size(self.crank)}"),
            along(HALF, at["B"], at["C"], 0.0, f"rod = {units.size(self.rod)}"),
        ]

    def legend(self, units: Units) -> tuple[tuple[str, str], ...]:
        """Lines on the positions."""
        return (*((event, event) for event in self.events), ("notes", units.summary))
