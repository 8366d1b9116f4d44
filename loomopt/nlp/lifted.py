"""Variables that an NLP has beside a design's own, each with a row that defines it, so that all rows read a few.

The lifted Newton method [Albersmeyer and Diehl, SIAM J. Optim. 20 (2010), 1655-1684]: values that follow one after the
other, and choices among many by a node's data, become variables z with rows z − d(x, z) = 0, where d reads only the z
before its own. IPOPT sees sparse rows.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from loomopt import maths
from loomopt.maths import Maths, Number
from loomopt.tolerances import FEW_CHOICES

Defined = tuple[Any, Any]
"""A lifted variable and what it is worth."""


def identity(value: Number) -> object:
    """Return what two expressions share that are one, while they live, and two numbers that are equal."""
    constant = isinstance(value, float | int) or value.is_constant()
    return float(value) if constant else value.element_hash()


def chosen(place: Number, values: Sequence[Number]) -> Number:
    """Return the value at a place as every number system does, of many in one product."""
    import casadi as ca

    if isinstance(place, float | int) or len(values) <= FEW_CHOICES:
        return maths.casadi().choose(place, values)
    return ca.dot(place == ca.DM(range(len(values))), ca.vertcat(*values))


class Lifts:
    """Lifted variables as they are asked for while rows are written down; own: the NLP's other variables.

    named: values that follow one after the other; chosen: choices, after all of them.
    """

    def __init__(self, own: Sequence[Any]) -> None:
        self.maths: Maths = replace(maths.casadi(), choose=self.choose)
        self.named: list[Defined] = []
        self.chosen: list[Defined] = []
        self._moving = list(own)
        self._choices: dict[tuple[Any, ...], Defined] = {}

    def symbols(self, names: Sequence[str]) -> dict[str, Any]:
        """Return a symbol for each value that is lifted; `define` says what it is worth."""
        import casadi as ca

        found = {name: ca.SX.sym(name) for name in names}
        self._moving += found.values()
        return found

    def define(self, symbol: Any, worth: Any) -> None:
        """Say what a lifted value is worth; each reads only those before it."""
        self.named.append((symbol, worth))

    def choose(self, place: Number, values: Sequence[Number]) -> Number:
        """Return the value at a place as every number system does; a variable for one of many that the design moves."""
        import casadi as ca

        if isinstance(place, float | int) or len(values) <= FEW_CHOICES:
            return chosen(place, values)
        key = place.element_hash(), *map(identity, values)
        if key not in self._choices:
            worth = chosen(place, values)
            moves = ca.depends_on(worth, ca.vertcat(*self._moving))
            self._choices[key] = ca.SX.sym("chosen") if moves else worth, worth
            self.chosen += [self._choices[key]] if moves else []
        return self._choices[key][0]

    @property
    def defined(self) -> list[Defined]:
        """All lifted variables, in an order in which each reads only those before it."""
        return self.named + self.chosen
