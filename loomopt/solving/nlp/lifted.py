"""Variables that an NLP has beside a design's own, each with a row that defines it, so that all rows read a few.

The lifted Newton method [Albersmeyer and Diehl, SIAM J. Optim. 20 (2010), 1655-1684]: values that follow one after the
other, and choices among many by a node's data, become variables z with rows z − d(x, z) = 0, where d reads only the z
before its own. IPOPT sees sparse rows.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.physics.tolerances import FEW_CHOICES


class Lifted(NamedTuple):
    """A lifted variable and what it is worth; of a choice, one of the column `options`: that where `at` is 1, not 0."""

    symbol: Any
    worth: Any
    at: Any = None
    options: Any = None


def identity(value: Number) -> object:
    """Return what two expressions share that are one, for as long as they are kept, and two numbers that are equal."""
    return value if isinstance(value, float | int) else value.element_hash()


def chosen(place: Number, values: Sequence[Number]) -> Number:
    """Return the value at a place as every number system does, of many in one product."""
    import casadi as ca

    if isinstance(place, float | int):
        return values[int(place)]
    if len(values) <= FEW_CHOICES:
        return systems.casadi().choose(place, values)
    return ca.dot(place == ca.DM(range(len(values))), ca.vertcat(*values))


class Options(Sequence[Number]):
    """What there is to choose from, as one column for all choices."""

    def __init__(self, values: Sequence[Number]) -> None:
        import casadi as ca

        self.values = list(values)
        self.column = ca.vertcat(*self.values)
        self.key = tuple(map(identity, self.values))

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.values)

    def __getitem__(self, place: Number) -> Number:
        """Return the value at a place."""
        return self.values[place]


class Lifts:
    """Lifted variables as they are asked for while rows are written down; own: the NLP's other variables, a column.

    named: values that follow one after the other; picked: choices, after all of them.
    """

    def __init__(self, own: Any) -> None:
        self.maths: Maths = replace(systems.casadi(), choose=self.choose)
        self.named: list[Lifted] = []
        self.picked: list[Lifted] = []
        self._moving = own
        self._symbols: dict[str, Any] = {}
        self._options: dict[object, tuple[Options, bool]] = {}
        self._places: dict[object, tuple[Any, Any]] = {}
        self._choices: dict[object, Any] = {}

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
        if isinstance(place, float | int) or len(values) <= FEW_CHOICES:
            return chosen(place, values)
        given = values if isinstance(values, Options) else Options(values)
        key = identity(place), given.key
        if key not in self._choices:
            self._choices[key] = self._choice(place, given)
        return self._choices[key]

    def _choice(self, place: Any, given: Options) -> Any:
        import casadi as ca

        if given.key not in self._options:
            self._options[given.key] = given, bool(ca.depends_on(given.column, self._moving))
        options, moves = self._options[given.key]
        at = identity(place), len(options)
        if at not in self._places:
            self._places[at] = place == ca.DM(range(len(options))), place
        where = self._places[at][0]
        worth = ca.dot(where, options.column)
        if not moves:
            return worth
        self.picked.append(Lifted(ca.SX.sym("chosen"), worth, where, options.column))
        return self.picked[-1].symbol

    @property
    def defined(self) -> list[Lifted]:
        """All lifted variables, in an order in which each reads only those before it."""
        return self.named + self.picked
