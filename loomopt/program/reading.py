"""What a program's rows are worth at one design, in any number system: the one place that says how each is read."""

import abc
import functools

import numpy as np

from loomopt.base.records import lazy
from loomopt.maths.systems import Maths, Number
from loomopt.physics.balance import Given, total
from loomopt.physics.cycle import Cycle, Floats, Node, Pieces
from loomopt.physics.schema import Values
from loomopt.physics.tolerances import GAUSS_NODES
from loomopt.program.model import Integral, JobModel, Stills
from loomopt.program.program import Limit
from loomopt.program.traced import Quantities

DATUM = "datum"
"""The switch that hands a quantity the number that an integral has at each of its own angles."""


@functools.cache
def gauss() -> tuple[Floats, Floats]:
    """Return nodes and weights of the Gauss-Legendre rule on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_NODES)
    return (nodes + 1) / 2, weights / 2


def quadrature(cycle: Cycle, integral: Integral) -> tuple[Pieces, Floats, Floats]:
    """Return nodes (pieces, u) and weights in u of a mean over pieces of the cycle."""
    active = np.flatnonzero(cycle.on(integral.where))
    nodes, weights = gauss()
    if integral.parts > 1:
        nodes = np.add.outer(np.arange(integral.parts), nodes).ravel() / integral.parts
        weights = np.tile(weights, integral.parts) / integral.parts
    return np.repeat(active, len(nodes)), np.tile(nodes, len(active)), np.tile(weights, len(active))


class Rows(abc.ABC):
    """Rows of one design in one number system; a subclass says how a mean over the cycle is taken.

    given: the scene's numbers in that system; stills: the switches just before each event that a row stands at.
    """

    def __init__(self, model: JobModel, maths: Maths, given: Given, stills: Stills) -> None:
        self.model, self.maths, self.given, self.stills = model, maths, given, stills
        self._single: dict[str, Number] = {}
        self._quantities = Quantities(model, (maths, maths), given)

    @abc.abstractmethod
    def mean(self, integral: Integral) -> Number:
        """Return a mean over the cycle, SI."""

    def quantity(self, name: str, phi: Number, switch: Values) -> Number:
        """Return a whole-cycle quantity at a crank angle, rad, SI."""
        return self._quantities((name,), Node(phi, switch))[0]

    def single(self, name: str) -> Number:
        """Return a figure or row of the design, a mean over the cycle or its root, or a number of the scene, SI."""
        if name not in self._single:
            self._single[name] = self._value(name)
        return self._single[name]

    def _value(self, name: str) -> Number:
        for integral in self.model.integrals:
            if name == integral.name:
                return self.mean(integral)
            if name == integral.root:
                return self.maths.sqrt(self.single(integral.name))
        known = self.model.static(self.maths, self.given, self.stills, (name,))
        return known[name] if name in known else self.given.values[name]

    def excess(self, limit: Limit, value: Number = None) -> Number:
        """Return by how much a variable's or a single value's limit is exceeded, SI; of an equality the difference.

        value: of the limit in this number system, its own without one.
        """
        names = [name for name in (limit.row, limit.weight) if name]
        of_variables = limit.family == "variable"
        known = {name: self.given.values[name] if of_variables else self.single(name) for name in names}
        return limit.residual(known, self.maths.number(limit.value) if value is None else value)


class Reading(Rows):
    """Rows and whole-cycle quantities of one design in one number system; cycle: its pieces, found in floats."""

    def __init__(self, model: JobModel, maths: Maths, given: Given, cycle: Cycle, stills: Stills) -> None:
        super().__init__(model, maths, given, stills)
        self.cycle = cycle

    @lazy
    def starts(self) -> list[Number]:
        """Crank angles, rad, where the pieces begin, the last one turn after the first."""
        return self.cycle.begins(self.model.corners(self.maths, self.given), self.maths.pi)

    def at(self, name: str, piece: int, u: Number) -> Number:
        """Return a whole-cycle quantity at a node, SI."""
        begin, end = self.starts[piece], self.starts[piece + 1]
        return self.quantity(name, begin + u * (end - begin), self.cycle.switch(piece))

    def mean(self, integral: Integral) -> Number:
        """Return a mean by its rule, node by node, SI."""
        if integral.angles:
            number = self.maths.number
            fixed = zip(integral.angles, integral.data, strict=True)
            values = [self.quantity(integral.quantity, number(a), {DATUM: number(d)}) for a, d in fixed]
            return total(values) / len(values)
        weighted, widths = [], []
        for piece, u, weight in zip(*quadrature(self.cycle, integral), strict=True):
            width = float(weight) * (self.starts[piece + 1] - self.starts[piece])
            weighted.append(width * self.at(integral.quantity, int(piece), float(u)))
            widths.append(width)
        return total(weighted) / total(widths)
