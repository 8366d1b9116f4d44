"""Numbers of a table that are rounding errors relative to the largest one of their unit: they are shown as 0."""

from collections.abc import Iterable
from typing import overload

from loomopt.physics.tolerances import SHOWN_AS_ZERO


class Rounding:
    """Least magnitude of each unit that is more than rounding; numbers: pairs of unit and number, or None."""

    def __init__(self, numbers: Iterable[tuple[str, float | None]]) -> None:
        largest: dict[str, float] = {}
        for unit, number in numbers:
            largest[unit] = max(largest.get(unit, 0.0), abs(number or 0.0))
        self.least = {unit: SHOWN_AS_ZERO * size for unit, size in largest.items()}

    @overload
    def shown(self, unit: str, number: float) -> float: ...

    @overload
    def shown(self, unit: str, number: float | None) -> float | None: ...

    def shown(self, unit: str, number: float | None) -> float | None:
        """Number, or 0 where it is rounding; None and NaN stay."""
        return 0.0 if number is not None and abs(number) <= self.least.get(unit, 0.0) else number
