"""Sums of a periodic number with the cosines and sines of a turn, by halving: few operations in any number system."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

Number = Any
Pair = tuple[Number, Number]


class FourierWeights(list[list[Number]]):
    """Weights of harmonics of values at equal steps of a turn: rows of the cosines from 0 on, of the sines from 1 on.

    waves: cosines of the angles, of which there are twice as many as harmonics.
    """

    def __init__(self, rows: Iterable[list[Number]], waves: Sequence[Number]) -> None:
        super().__init__(rows)
        self.waves = waves

    def sums(self, values: Sequence[Number]) -> list[Number]:
        """Sums of each row's products with the values; few operations [Cooley and Tukey 1965]."""
        points = len(values)
        count = points // 2
        first, *others = self._transformed(values, 1)[:count]
        cosines = [cosine / count for cosine, _ in others]
        return [first[0] / points, *cosines, *(sine / count for _, sine in others)]

    def _transformed(self, values: Sequence[Number], step: int) -> list[Pair]:
        """Σ values[k] cos nθ_k and Σ values[k] sin nθ_k for n up to half of their number; θ_k: `step` angles apart."""
        points = len(values)
        if points == 1:
            return [(values[0], 0)]
        if points % 2:
            return [self._direct(values, n, step) for n in range((points + 1) // 2)]
        evens, odds = (self._transformed(values[k::2], 2 * step) for k in (0, 1))
        half = points // 2
        result: list[Pair] = [(0, 0)] * (half + 1)
        for n, ((a, b), (c, d)) in enumerate(zip(evens, odds, strict=True)):
            if n == 0:
                result[0], result[half] = (a + c, 0), (a - c, 0)
            elif 2 * n == half:
                result[n] = a, c
            else:
                cosine, sine = self._wave(n * step), self._wave(n * step - len(self.waves) // 4)
                along, across = cosine * c - sine * d, sine * c + cosine * d
                result[n], result[half - n] = (a + along, b + across), (a - along, across - b)
        return result

    def _direct(self, values: Sequence[Number], n: int, step: int) -> Pair:
        cosine, sine = values[0], 0
        for k in range(1, len(values)):
            cosine = cosine + self._wave(n * k * step) * values[k]
            sine = sine + self._wave(n * k * step - len(self.waves) // 4) * values[k]
        return cosine, sine

    def _wave(self, k: int) -> Number:
        return self.waves[k % len(self.waves)]


def written_out(
    cos: Callable[[Number], Number],
    sin: Callable[[Number], Number],
    cosines: Sequence[Number],
    sines: Sequence[Number],
    phi: Number,
) -> Number:
    """Σ cosines[n] cos nφ + sines[n] sin nφ; by sines of multiples, because a recurrence would widen balls."""
    value = cosines[0]
    for n in range(1, len(cosines)):
        angle = n * phi
        value = value + cosines[n] * cos(angle) + sines[n] * sin(angle)
    return value
