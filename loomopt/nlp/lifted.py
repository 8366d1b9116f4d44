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


class Lifts:
    """Lifted variables as they are asked for while rows are written down; own: the NLP's other variables."""

    def __init__(self, own: Sequence[Any]) -> None:
        self.maths: Maths = replace(maths.casadi(), choose=self.choose)
        self._moving = list(own)
        self.named: list[tuple[Any, Any]] = []
        """Lifted values with what they are worth."""
        self._chosen: dict[Any, tuple[Any, Any]] = {}

    def symbols(self, names: Sequence[str]) -> dict[str, Any]:
        """Return a symbol for each value that is lifted; `define` says what it is worth."""
        import casadi as ca

        found = {name: ca.SX.sym(name) for name in names}
        self._moving += found.values()
        return found

    def define(self, symbol: Any, definition: Any) -> None:
        """Say what a lifted value is worth; each reads only those before it."""
        self.named.append((symbol, definition))

    def choose(self, place: Number, values: Sequence[Number]) -> Number:
        """Return the value at a place as every number system does; a variable for one of many that the design moves."""
        import casadi as ca

        if isinstance(place, float | int):
            return values[int(place)]
        if len(values) <= FEW_CHOICES:
            return maths.casadi().choose(place, values)
        options = ca.vertcat(*values)
        key = ca.SX(place).element_hash(), *(each.element_hash() for each in ca.vertsplit(ca.SX(options)))
        if key not in self._chosen:
            chosen = ca.dot(place == ca.DM(range(len(values))), options)
            moves = ca.depends_on(options, ca.vertcat(*self._moving))
            self._chosen[key] = ca.SX.sym("chosen") if moves else chosen, chosen
        return self._chosen[key][0]

    @property
    def defined(self) -> list[tuple[Any, Any]]:
        """Every lifted variable with what it is worth, in an order in which each reads only those before it."""
        return self.named + [pair for pair in self._chosen.values() if pair[0].is_symbolic()]
