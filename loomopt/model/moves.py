"""Moves: directions that may leave everything unchanged, along which the silent levels settle what is left open."""

import abc
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal, NamedTuple

Numbers = Mapping[str, float]
LEAST_CHANGE = "least change from today"


class Preference(NamedTuple):
    """Where along a move the silent levels would go, and why: to today's values, to the least or to the most.

    when, above: it holds where that variable exceeds that value, SI; "" for always.
    """

    toward: Literal["today", "least", "most"]
    reason: str
    when: str = ""
    above: float = 0.0

    @property
    def is_least_change(self) -> bool:
        """Whether it is for the least change from today."""
        return self.toward == "today"


@dataclass(frozen=True)
class Move(abc.ABC):
    """A direction that may leave everything unchanged, along straight lines in the NLP's variables.

    wishes: the first that holds is followed; today, bounds: of each of `along`, SI.
    """

    name: str
    along: tuple[str, ...]
    wishes: tuple[Preference, ...]
    today: Numbers
    bounds: Mapping[str, tuple[float, float]]

    is_apart: ClassVar[bool]
    """Whether each variable changes by itself."""

    def wished(self, values: Numbers) -> Preference | None:
        """Return the first wish that holds at these values (SI)."""
        return next((wish for wish in self.wishes if not wish.when or values[wish.when] > wish.above), None)

    @abc.abstractmethod
    def goal(self, wish: Preference, x: Numbers) -> dict[str, float]:
        """Return where a wish would go from x (SI), within the bounds; nothing where there is no room."""

    @abc.abstractmethod
    def directions(self, x: Numbers) -> list[dict[str, float]]:
        """Return its directions, SI, at x (SI) that have room, but not without end."""

    @abc.abstractmethod
    def ends(self, way: Numbers, x: Numbers) -> Iterator[dict[str, float]]:
        """Yield where a direction from x (SI) ends at the bounds."""

    def _room(self) -> list[str]:
        """Return the variables that have room, but not without end."""
        widths = {name: self.bounds[name][1] - self.bounds[name][0] for name in self.along}
        return [name for name, width in widths.items() if 0.0 < width < math.inf]


class AxisMove(Move):
    """Each variable changes by itself."""

    is_apart = True

    def goal(self, wish: Preference, x: Numbers) -> dict[str, float]:
        """Return where a wish would go from x (SI), within the bounds; nothing where there is no room."""
        goal = {}
        for name in self.along:
            low, high = self.bounds[name]
            if low < high:
                ends = {"least": low, "most": high, "today": min(max(self.today[name], low), high)}
                goal[name] = ends[wish.toward]
        return goal

    def directions(self, x: Numbers) -> list[dict[str, float]]:
        """Return the axis of each variable that has room, but not without end."""
        return [{name: 1.0} for name in self._room()]

    def ends(self, way: Numbers, x: Numbers) -> Iterator[dict[str, float]]:
        """Yield the bounds of the variable."""
        yield from ({name: end} for name in way for end in self.bounds[name])


class ScaleMove(Move):
    """All variables grow in proportion."""

    is_apart = False

    def goal(self, wish: Preference, x: Numbers) -> dict[str, float]:
        """Return x scaled in common: nearest to today's, in bound widths, or as small or as large as bounds allow."""
        widths = {name: self.bounds[name][1] - self.bounds[name][0] for name in self.along}
        if min(widths.values()) <= 0.0 or not any(x[name] for name in self.along):
            return {}
        least, most = self._factors(x)
        factor = least if wish.toward == "least" else most
        if wish.toward == "today":
            pull = math.fsum(x[n] * self.today[n] / widths[n] ** 2 for n in self.along)
            factor = min(max(pull / math.fsum((x[n] / widths[n]) ** 2 for n in self.along), least), most)
        return {n: min(max(x[n] * factor, self.bounds[n][0]), self.bounds[n][1]) for n in self.along}

    def directions(self, x: Numbers) -> list[dict[str, float]]:
        """Return x itself, where every variable has room, but not without end."""
        room = self._room()
        return [{name: x[name] for name in room}] if len(room) == len(self.along) and any(x[n] for n in room) else []

    def ends(self, way: Numbers, x: Numbers) -> Iterator[dict[str, float]]:
        """Yield x at the least and the largest factor."""
        yield from ({name: factor * x[name] for name in way} for factor in self._factors(x))

    def _factors(self, x: Numbers) -> tuple[float, float]:
        """Return the least and the largest common factor that bounds allow; above the largest where they leave none."""
        scales = [sorted((self.bounds[n][0] / x[n], self.bounds[n][1] / x[n])) for n in self.along if x[n]]
        return max(low for low, _ in scales), min(high for _, high in scales)
