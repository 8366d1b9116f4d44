"""Variables that an NLP has beside a design's own, each with a row that defines it, so that all rows read a few.

The lifted Newton method [Albersmeyer and Diehl, SIAM J. Optim. 20 (2010), 1655-1684]: values that follow one after the
other, and choices among many by a node's data, become variables z with rows z − d(x, z) = 0, where d reads only the z
before its own. IPOPT sees sparse rows.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from loomopt import maths
from loomopt.maths import Maths, Number
from loomopt.tolerances import FEW_CHOICES


class Lifted(NamedTuple):
    """A lifted variable and what it is worth."""

    symbol: Any
    worth: Any


def identity(value: Number) -> object:
    """Return what two expressions share that are one, for as long as they are kept, and two numbers that are equal."""
    return value if isinstance(value, float | int) else value.element_hash()


def chosen(place: Number, values: Sequence[Number]) -> Number:
    """Return the value at a place as every number system does, of many in one product."""
    import casadi as ca

    if isinstance(place, float | int):
        return values[int(place)]
    if len(values) <= FEW_CHOICES:
        return maths.casadi().choose(place, values)
    return ca.dot(place == ca.DM(range(len(values))), ca.vertcat(*values))


class Lifts:
    """Lifted variables as they are asked for while rows are written down; own: the NLP's other variables.

    named: values that follow one after the other; picked: choices, after all of them.
    """

    def __init__(self, own: Any) -> None:
        self.maths: Maths = replace(maths.casadi(), choose=self.choose)
        self.named: list[Lifted] = []
        self.picked: list[Lifted] = []
        self._moving = own
        self._symbols: dict[str, Any] = {}
        self._choices: dict[tuple[object, ...], tuple[Any, list[Any]]] = {}

    def symbols(self, names: Sequence[str]) -> dict[str, Any]:
        """Return a symbol for each value that is lifted; `define` says what it is worth."""
        import casadi as ca

        self._symbols = {name: ca.SX.sym(name) for name in names}
        self._moving = ca.vertcat(self._moving, *self._symbols.values())
        return self._symbols

    def define(self, worth: Mapping[str, Any]) -> None:
        """Say what each lifted value is worth; each reads only those before it."""
        self.named = [Lifted(symbol, worth[name]) for name, symbol in self._symbols.items()]

    def choose(self, place: Number, values: Sequence[Number]) -> Number:
        """Return the value at a place as every number system does; a variable for one of many that the design moves."""
        import casadi as ca

        if isinstance(place, float | int) or len(values) <= FEW_CHOICES:
            return chosen(place, values)
        kept = [place, *values]
        key = tuple(map(identity, kept))
        if key not in self._choices:
            found = chosen(place, kept[1:])
            if ca.depends_on(found, self._moving):
                self.picked.append(Lifted(ca.SX.sym("chosen"), found))
                found = self.picked[-1].symbol
            self._choices[key] = found, kept
        return self._choices[key][0]

    @property
    def defined(self) -> list[Lifted]:
        """All lifted variables, in an order in which each reads only those before it."""
        return self.named + self.picked
