"""An NLP's objective and rows as CasADi expressions, read through the same rows as in every other number system."""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.model.model import Integral, JobModel
from loomopt.model.reading import Rows
from loomopt.physics.balance import Given, total
from loomopt.physics.cycle import Floats, Node
from loomopt.physics.schema import Values
from loomopt.solving.nlp.rows import NodeParameters, RowFamily, Structure, chain_values

FEW_CHOICES = 8
"""Numbers that a node may choose from by a switch before the chosen one becomes a variable: a row that reads more makes
slopes and curvatures dense. Named cam laws have five pieces at most."""


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


class QuantityFunctions:
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
        shared = self._shared(found.values, given.values)
        self.given, self._in_symbols = given, Given(shared, found.own, linkage=found.linkage)
        self.phi, self.switches = ca.SX.sym("phi"), {name: ca.SX.sym(name) for name in switches}
        self._traced: dict[str, _Traced] = {}

    def _shared(self, values: Values, worth: Values) -> dict[str, Number]:
        """Return numbers with a symbol for each that follows from others."""
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


class Expressions(NamedTuple):
    """x: the design's variables and the extra ones, scaled; p: parameters; f: objective; g: rows, each ≤ 0 or = 0.

    lifts: variables beside x that rows read.
    """

    x: Any
    p: Any
    f: Any
    g: Any
    lifts: Lifts


def expressions(structure: Structure) -> Expressions:
    """Return the NLP of a structure."""
    import casadi as ca

    scaled = ca.SX.sym("x", len(structure.program.variables))
    extra = ca.SX.sym("t", structure.rows.extras)
    p = ca.SX.sym("p", structure.layout.size)
    built = _Built(structure, scaled, extra, p)
    rows = structure.rows.stacked(built.limits(), built.pieces(), built.held(), built.cycle())
    return Expressions(ca.vertcat(scaled, extra), p, built.objective(), ca.vertcat(*rows), built.lifts)


class NodeRows(Rows):
    """Rows in CasADi symbols; means are taken over nodes that are parameters."""

    def __init__(
        self,
        shape: NodeParameters,
        quantities: QuantityFunctions,
        stills: Mapping[str, Values],
        rules: Mapping[str, Sequence[Any]],
    ) -> None:
        import casadi as ca

        super().__init__(quantities.model, quantities.lifts.maths, quantities.given, stills)
        self.corners = self.model.corners(self.maths, self.given)
        self.column = ca.vertcat(1, *self.corners)
        self.shape, self.rules, self.quantities = shape, rules, quantities

    def quantity(self, name: str, phi: Number, switch: Values) -> Number:
        """Return a whole-cycle quantity at a crank angle, rad, SI."""
        return self.quantities.at(name, phi, switch)

    def read(self, names: Sequence[str]) -> None:
        """Read the figures and rows of the design that will be asked for, all at once."""
        self._single |= self.model.static(self.maths, self.given, self.stills, names)

    def at(self, name: str, parameters: Any) -> Number:
        """Return a whole-cycle quantity at the node that parameters (a column) say, SI."""
        import casadi as ca

        switch = {key: parameters[self.shape.places.start + k] for k, key in enumerate(self.shape.switches)}
        return self.quantity(name, ca.dot(parameters[self.shape.angle], self.column), switch)

    def mean(self, integral: Integral) -> Number:
        """Return a mean by its rule, SI."""
        import casadi as ca

        rule = self.rules[integral.name]
        widths = [ca.dot(ca.vertcat(node[0], node[self.shape.width]), self.column) for node in rule]
        weighted = [width * self.at(integral.quantity, node) for width, node in zip(widths, rule, strict=True)]
        return total(weighted) / total(widths)


class _Built:
    """One NLP being written down; scaled, extra: its variables; column: its parameters; all of them columns."""

    def __init__(self, structure: Structure, scaled: Any, extra: Any, column: Any) -> None:
        import casadi as ca

        program, layout = structure.program, structure.layout
        vector = ca.vertsplit(layout.before(column, "nodes"))
        self.structure, self.program, self.extra = structure, program, ca.vertsplit(extra)
        self.vector, self.column = vector, column
        self.lifts = Lifts(ca.vertcat(scaled, extra))
        sizes = ca.vertcat(*layout.read(vector, "variable scale"))
        values = dict(zip(program.parameters, layout.read(vector, "values"), strict=True))
        values |= dict(zip(structure.hints, layout.read(vector, "hints"), strict=True))
        values |= dict(zip(structure.names, ca.vertsplit(scaled * sizes), strict=True))
        names, model = program.model.switches, program.model
        stills = {e: dict(zip(names, layout.read(vector, f"still {e}"), strict=True)) for e in model.events_read}
        rules = {name: layout.columns(column, f"mean {name}") for name, _ in structure.points}
        values |= self.lifts.symbols(structure.recurrent)
        self.lifts.define(chain_values(model, structure.names, self.lifts.maths, values))
        given = model.given(self.lifts.maths, values)
        quantities = QuantityFunctions(model, values, given, structure.node.switches, self.lifts)
        self.rows = NodeRows(structure.node, quantities, stills, rules)
        self.bounds, self.limit_scales = layout.read(vector, "limit"), layout.read(vector, "limit scale")
        self.scales, self.weights = layout.read(vector, "objective scale"), layout.read(vector, "objective weight")

    def objective(self) -> Any:
        """Return the weighted sum of the objectives, or of what the limits give way."""
        if self.structure.elastic:
            weights = self.structure.layout.read(self.vector, "way weight")
            return total([weight * way for weight, way in zip(weights, self.extra, strict=True)])
        pairs = zip(self.extra, self.structure.epigraphs, strict=True)
        tops = {epigraph.objective: t for t, epigraph in pairs}
        levels = [
            self.rows.single(level.row) / self.scales[k] if level.is_smooth else tops[k]
            for k, level in enumerate(self.program.objectives)
        ]
        return total([weight * level for weight, level in zip(self.weights, levels, strict=True)])

    def given_way(self, place: int) -> Any:
        """Return by how much a limit gives way, in its natural size; of an equality with its sign."""
        ways = [self.extra[way] for way in self.structure.excess_places.get(place, ())]
        return ways[0] - ways[1] if len(ways) == 2 else total(ways)

    def limits(self) -> Any:
        """Return the rows of limits that are one row each, as a column: by entry CasADi would take as long again."""
        import casadi as ca

        limits, static = self.program.single_limits, self.structure.rows.limits
        self.rows.read([limits[k].row for k in static])
        columns = [
            (limits[k].residual(self.rows, self.bounds[k]), self.limit_scales[k], self.given_way(k)) for k in static
        ]
        excess, scales, ways = (
            (ca.vertcat(*column) for column in zip(*columns, strict=True)) if columns else [ca.SX()] * 3
        )
        return excess / scales - ways

    def pieces(self) -> list[Any]:
        """Return the smooth pieces below epigraph variables: both signs of a magnitude, each value of several."""
        found = []
        for t, epigraph in zip(self.extra, self.structure.epigraphs, strict=not self.structure.elastic):
            scale, sides = self.scales[epigraph.objective], self.program.objectives[epigraph.objective].sides
            found += [sign * self.rows.single(row) / scale - t for row, sign in sides]
        return found

    def held(self) -> list[Any]:
        """Return the rows of whole-cycle quantities at the stations of each family, as a column for each."""
        import casadi as ca

        layout, found = self.structure.layout, []
        opened = [
            dict(zip(self.structure.open_switches, row, strict=True)) for row in layout.rows(self.vector, "station")
        ]
        for k, family in enumerate(self.structure.families):
            stations = [self.structure.stations[place] for place in self.structure.held[k]]
            corners = [self.rows.corners[corner] for corner, _ in stations]
            switches = [{**opened[place], **self.structure.stations[place].switch} for place in self.structure.held[k]]
            values = map(self.rows.quantity, itertools.repeat(family.square or family.row), corners, switches)
            found.append(self._rows(family, ca.vertcat(*layout.read(self.vector, f"sign {k}")), ca.vertcat(*values)))
        return found

    def cycle(self) -> list[Any]:
        """Return the rows of whole-cycle quantities, one for each slot."""
        found = []
        for k, family in enumerate(self.structure.families):
            slots = self.structure.layout.columns(self.column, f"family {k}")
            read = family.square or family.row
            found += [slot[0] * self._rows(family, slot[1], self.rows.at(read, slot[2:])) for slot in slots]
        return found

    def _rows(self, family: RowFamily, sign: Any, value: Any) -> Any:
        """Return by how much a whole-cycle quantity exceeds its bound, in its natural size.

        Of squares the difference over the bound and one size more: near the bound's own size it is as steep.
        """
        if family.epigraph >= 0:
            scale = self.scales[self.structure.epigraphs[family.epigraph].objective]
            return sign * value / scale - self.extra[family.epigraph]
        scale = self.limit_scales[family.limit]
        bound = self.bounds[family.limit] / scale + self.given_way(family.limit)
        if family.square:
            return (sign * value / scale**2 - bound**2) / (1 + bound)
        return sign * value / scale - bound


def second_derivative(
    formula: Callable[[Maths, Number, Sequence[Number]], Number], switches: int
) -> Callable[[Floats, Floats], Floats]:
    """Return the second derivative of formula(maths, phi, switches) with respect to phi.

    What is returned takes angles (n,), rad, and their switches (switches, n), and gives (n,).
    """
    import casadi as ca

    phi, data = ca.SX.sym("phi"), ca.SX.sym("switch", switches)
    slope = ca.gradient(formula(systems.casadi(), phi, ca.vertsplit(data) if switches else []), phi)
    found = ca.Function("second", [phi, data], [ca.gradient(slope, phi)])

    def at(angles: Floats, places: Floats) -> Floats:
        return np.asarray(found(angles[None, :], places.reshape(switches, len(angles))), dtype=np.float64).ravel()

    return at
