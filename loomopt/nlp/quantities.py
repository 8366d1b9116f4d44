"""Whole-cycle quantities as CasADi functions, each traced once, not once a node."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from loomopt.maths import systems
from loomopt.maths.systems import Number
from loomopt.model.model import JobModel
from loomopt.nlp.lifted import Lifts, Options, chosen, identity
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node
from loomopt.physics.schema import Values
from loomopt.physics.tolerances import FEW_CHOICES


class _Choice(NamedTuple):
    """One of many numbers by a switch: its symbol, the switch, and what there is to choose from."""

    symbol: Any
    switch: str
    options: Options


class _Traced(NamedTuple):
    """A quantity as a function of the numbers it reads, angle, switches and what it chooses from many by a switch."""

    function: Any
    numbers: Any
    choices: tuple[_Choice, ...]


class Quantities:
    """The quantities of one NLP; numbers that follow from others at once are inputs too: all nodes share them.

    So is what a formula chooses from many numbers by a switch: a node whose switch is known reads one of them. values:
    the scene's numbers, given: what follows too, of the rows; switches: names of a node's.
    """

    def __init__(self, model: JobModel, values: Values, given: Given, switches: Sequence[str], lifts: Lifts) -> None:
        import casadi as ca

        self.model, self.lifts = model, lifts
        symbols = {name: ca.SX.sym(name) for name in values}
        self._symbols = list(symbols.values())
        """Kept: what identifies a symbol is another's once it is gone."""
        self._worth: dict[object, Any] = {identity(symbol): values[name] for name, symbol in symbols.items()}
        found = model.given(replace(systems.casadi(), choose=chosen), symbols)
        pairs = zip((found, *found.cases), (given, *given.cases), strict=True)
        first, *others = [Given(self._shared(one.values, worth.values), one.own) for one, worth in pairs]
        self.given, self._in_symbols = given, first._replace(cases=tuple(others))
        self.phi, self.switches = ca.SX.sym("phi"), {name: ca.SX.sym(name) for name in switches}
        self._traced: dict[str, _Traced] = {}

    def _shared(self, values: Values, worth: Values) -> dict[str, Number]:
        """Return a case's numbers with a symbol for each that follows from others."""
        import casadi as ca

        found = dict(values)
        for key, value in values.items():
            if isinstance(value, ca.SX) and not value.is_constant() and identity(value) not in self._worth:
                found[key] = ca.SX.sym(key)
                self._symbols.append(found[key])
                self._worth[identity(found[key])] = worth[key]
        return found

    def at(self, name: str, phi: Number, switch: Values) -> Number:
        """Return a quantity at a crank angle, rad."""
        if name not in self._traced:
            self._traced[name] = self._trace(name)
        traced = self._traced[name]
        picked = [self.lifts.choose(switch[choice.switch], choice.options) for choice in traced.choices]
        return traced.function(traced.numbers, phi, *(switch[key] for key in self.switches), *picked)

    def _trace(self, name: str) -> _Traced:
        import casadi as ca

        choices = _Choices(self.switches, self._worth)
        system = replace(systems.casadi(), choose=choices.choose)
        value = self.model.quantity(system, self._in_symbols, name, Node(self.phi, self.switches))
        read = [each for each in ca.symvar(ca.SX(value)) if identity(each) in self._worth]
        inputs = ca.vertcat(*read), self.phi, *self.switches.values(), *choices.symbols
        worth = ca.vertcat(*(self._worth[identity(each)] for each in read))
        return _Traced(ca.Function("quantity", list(inputs), [value]), worth, tuple(choices))


class _Choices:
    """What a formula chooses from many numbers by a switch; worth: what each symbol stands for."""

    def __init__(self, switches: Values, worth: dict[object, Any]) -> None:
        self.switches = {identity(symbol): name for name, symbol in switches.items()}
        self.worth = worth
        self._found: dict[Any, _Choice] = {}

    def __iter__(self) -> Iterator[_Choice]:
        """Return them in the order in which they were met."""
        return iter(self._found.values())

    @property
    def symbols(self) -> list[Any]:
        """The symbol of each."""
        return [choice.symbol for choice in self]

    def choose(self, place: Number, values: Sequence[Number]) -> Number:
        """Return the value at a place; of many numbers by a switch a symbol."""
        import casadi as ca

        switch = self.switches.get(identity(place))
        if not switch or len(values) <= FEW_CHOICES or not all(map(self._known, values)):
            return chosen(place, values)
        keys = list(map(identity, values))
        if (switch, *keys) not in self._found:
            options = Options([self.worth.get(key, value) for key, value in zip(keys, values, strict=True)])
            self._found[switch, *keys] = _Choice(ca.SX.sym("chosen"), switch, options)
        return self._found[switch, *keys].symbol

    def _known(self, value: Number) -> bool:
        return isinstance(value, float | int) or identity(value) in self.worth or bool(value.is_constant())
