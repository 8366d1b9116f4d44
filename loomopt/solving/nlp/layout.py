"""Where named arrays stand one after the other in one vector."""

import math
from typing import Any

import numpy as np

from loomopt.physics.cycle import Floats


class Layout:
    """Where each array stands, in the order in which room was made for them."""

    def __init__(self) -> None:
        self.places: dict[str, tuple[int, tuple[int, ...]]] = {}
        self.size = 0

    def add(self, name: str, *shape: int) -> None:
        """Reserve room for an array."""
        self.places[name] = (self.size, shape)
        self.size += math.prod(shape)

    def part(self, vector: Any, name: str) -> Any:
        """Return the entries of an array as a part of the vector, of whatever kind that is."""
        begin, shape = self.places[name]
        return vector[begin : begin + math.prod(shape)]

    def array(self, vector: Any, name: str) -> Any:
        """Return an array in a vector of NumPy's; what is put into it stands in the vector."""
        return self.part(vector, name).reshape(self.places[name][1])

    def before(self, vector: Any, name: str) -> Any:
        """Return what stands before an array."""
        return vector[: self.places[name][0]]

    def write(self, vector: Floats, name: str, values: Any) -> None:
        """Put an array in its place."""
        self.part(vector, name)[:] = np.asarray(values, dtype=float).ravel()

    def read(self, vector: Any, name: str) -> list[Any]:
        """Return the entries of an array as a flat list."""
        begin, shape = self.places[name]
        return [vector[begin + k] for k in range(math.prod(shape))]

    def columns(self, column: Any, name: str) -> list[Any]:
        """Return the rows of a two-dimensional array in a column of CasADi's, each as a column."""
        begin, (count, width) = self.places[name]
        return [column[begin + k * width : begin + (k + 1) * width] for k in range(count)]

    def rows(self, vector: Any, name: str) -> list[list[Any]]:
        """Return the entries of a two-dimensional array, row by row."""
        flat, (count, width) = self.read(vector, name), self.places[name][1]
        return [flat[k * width : (k + 1) * width] for k in range(count)]
