"""Whole-cycle quantities as CasADi functions, each traced once, not once a node."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from loomopt import maths
from loomopt.balance import Given
from loomopt.cycle import Node
from loomopt.maths import Number
from loomopt.nlp.lifted import Lifts
from loomopt.nlp.structure import Structure
from loomopt.schema import Values
from loomopt.tolerances import FEW_CHOICES

Source = tuple[int, str]
"""Where a number comes from: a case, and its name there."""


class _Choice(NamedTuple):
    """One of many numbers by a switch: its symbol, the switch, and what there is to choose from."""

    symbol: Any
    switch: str
    options: tuple[Source | float, ...]


class _Traced(NamedTuple):
    """A quantity as a function of the numbers it reads, angle, switches and what it chooses from many by a switch."""

    function: Any
    numbers: tuple[Source, ...]
    choices: tuple[_Choice, ...]


class _Numbers(Sequence[Number]):
    """Numbers by their sources, each read when it is asked for."""

    def __init__(self, cases: Sequence[Given], sources: Sequence[Source | float]) -> None:
        self.cases, self.sources = cases, sources

    def __len__(self) -> int:
        return len(self.sources)

    def __getitem__(self, place: Any) -> Any:
        source = self.sources[place]
        return source if isinstance(source, float) else self.cases[source[0]].values[source[1]]


class Quantities:
    """The quantities of one NLP; numbers that follow from others at once are inputs too: all nodes share them.

    So is what a formula chooses from many numbers by a switch: a node whose switch is known reads a few.
    """

    def __init__(self, structure: Structure, lifts: Lifts) -> None:
        import casadi as ca

        program, self.model, self.lifts = structure.program, structure.program.model, lifts
        names = [*program.parameters, *structure.hints, *(v.name for v in program.variables), *structure.recurrent]
        symbols = {name: ca.SX.sym(name) for name in names}
        given = self.model.given(maths.casadi(), symbols)
        self.sources: dict[int, Source] = {}
        cases = [self._symbols(place, case, symbols) for place, case in enumerate((given, *given.cases))]
        self.given = Given(cases[0], given.own, tuple(map(Given, cases[1:], (case.own for case in given.cases))))
        self.phi, self.switches = ca.SX.sym("phi"), {name: ca.SX.sym(name) for name in structure.node.switches}
        self._traced: dict[str, _Traced] = {}

    def _symbols(self, place: int, case: Given, symbols: Mapping[str, Any]) -> dict[str, Any]:
        """Return a case's numbers with a symbol for each that is one or follows from them, and note their sources."""
        import casadi as ca

        found = dict(case.values)
        for key, value in case.values.items():
            if key in symbols and place == 0:
                found[key] = symbols[key]
            elif isinstance(value, ca.SX) and not value.is_symbolic():
                found[key] = ca.SX.sym(key)
            if isinstance(found[key], ca.SX) and found[key].is_symbolic():
                self.sources.setdefault(found[key].element_hash(), (place, key))
        return found

    def at(self, name: str, given: Given, phi: Number, switch: Values) -> Number:
        """Return a quantity at a crank angle, rad."""
        import casadi as ca

        if name not in self._traced:
            self._traced[name] = self._trace(name)
        traced, cases = self._traced[name], (given, *given.cases)
        chosen = [self.lifts.choose(switch[c.switch], _Numbers(cases, c.options)) for c in traced.choices]
        numbers, places = _Numbers(cases, traced.numbers), [switch[key] for key in self.switches]
        return traced.function(ca.vertcat(*numbers), phi, ca.vertcat(*places), ca.vertcat(*chosen))

    def _trace(self, name: str) -> _Traced:
        import casadi as ca

        found: dict[Any, _Choice] = {}
        switches = {symbol.element_hash(): key for key, symbol in self.switches.items()}

        def source(value: Number) -> Source | float | None:
            return value if isinstance(value, float) else self.sources.get(ca.SX(value).element_hash())

        def choose(place: Number, values: Sequence[Number]) -> Number:
            switch = switches.get(place.element_hash()) if isinstance(place, ca.SX) else None
            options = [source(value) for value in values] if len(values) > FEW_CHOICES else []
            known = tuple(option for option in options if option is not None)
            if switch is None or not known or len(known) < len(options):
                return maths.casadi().choose(place, values)
            return found.setdefault((switch, known), _Choice(ca.SX.sym("chosen"), switch, known)).symbol

        node = Node(self.phi, self.switches)
        value = self.model.quantity(replace(maths.casadi(), choose=choose), self.given, name, node)
        read = [each for each in ca.symvar(ca.SX(value)) if each.element_hash() in self.sources]
        inputs = ca.vertcat(*read), self.phi, ca.vertcat(*self.switches.values())
        chosen = ca.vertcat(*(choice.symbol for choice in found.values()))
        numbers = tuple(self.sources[each.element_hash()] for each in read)
        return _Traced(ca.Function("quantity", [*inputs, chosen], [value]), numbers, tuple(found.values()))
