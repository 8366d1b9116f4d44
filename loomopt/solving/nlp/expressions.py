"""An NLP's objective and rows as CasADi expressions, from the same formulas as every other number system."""

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
from loomopt.solving.nlp.mapped_sums import HarmonicSum, SumRecorder, with_recorder
from loomopt.solving.nlp.rows import NodeParameters, RowFamily, Structure, chain_values

FEW_CHOICES = 8
"""Most numbers from which a switch selects one by formula; with more the selected number becomes a variable, because
such rows make derivatives dense. Named cam laws have five pieces at most."""


class Lifted(NamedTuple):
    """A lifted variable and its formula; of a choice also the column `options` and `at`, 1 at the chosen one, else
    0.
    """

    symbol: Any
    formula: Any
    selector: Any = None
    options: Any = None


def identity(value: Number) -> object:
    """Key that is equal for one expression, as long as it exists, and for equal numbers."""
    return value if isinstance(value, float | int) else value.element_hash()


def value_at(place: Number, values: Sequence[Number]) -> Number:
    """The value at a place, as in every number system; among many values in one product."""
    import casadi as ca

    if isinstance(place, float | int):
        return values[int(place)]
    if len(values) <= FEW_CHOICES:
        return systems.casadi().choose(place, values)
    return ca.dot(place == ca.DM(range(len(values))), ca.vertcat(*values))


class Options(Sequence[Number]):
    """The values of a choice, as one column for all choices among them."""

    def __init__(self, values: Sequence[Number]) -> None:
        import casadi as ca

        self.values = list(values)
        self.column = ca.vertcat(*self.values)
        self.key = tuple(map(identity, self.values))

    def __len__(self) -> int:
        """Number of values."""
        return len(self.values)

    def __getitem__(self, place: Number) -> Number:
        """The value at a place."""
        return self.values[place]


class Lifts:
    """Lifted variables, created while rows are written; variables: the NLP's other variables, a column.

    chained_values: chained values; choices: choices, after all chained values; recorder: sums over angles, which are
    symbols of the rows but no variables.
    """

    def __init__(self, variables: Any) -> None:
        self.recorder = SumRecorder()
        self.maths: Maths = with_recorder(replace(systems.casadi(), choose=self.choose), self.recorder)
        self.chained_values: list[Lifted] = []
        self.choices: list[Lifted] = []
        self._variables = variables
        self._symbols: dict[str, Any] = {}
        self._options: dict[object, tuple[Options, bool]] = {}
        self._places: dict[object, tuple[Any, Any]] = {}
        self._choices: dict[object, Any] = {}

    def symbols(self, names: Sequence[str]) -> dict[str, Any]:
        """Symbols of the lifted values, by name; `define` sets their formulas."""
        import casadi as ca

        self._symbols = {name: ca.SX.sym(name) for name in names}
        self._variables = ca.vertcat(self._variables, *self._symbols.values())
        return self._symbols

    def define(self, worth: Mapping[str, Any]) -> None:
        """Set the formula of every lifted value; a formula reads only values before it."""
        self.chained_values = [Lifted(symbol, worth[name]) for name, symbol in self._symbols.items()]

    def choose(self, place: Number, values: Sequence[Number]) -> Number:
        """The value at a place, as in every number system; a variable where one of many varies with the design."""
        if isinstance(place, float | int) or len(values) <= FEW_CHOICES:
            return value_at(place, values)
        options = values if isinstance(values, Options) else Options(values)
        key = identity(place), options.key
        if key not in self._choices:
            self._choices[key] = self._choice(place, options)
        return self._choices[key]

    def _choice(self, place: Any, choice_options: Options) -> Any:
        import casadi as ca

        if choice_options.key not in self._options:
            column = choice_options.column
            varies = ca.depends_on(column, self._variables) and not ca.depends_on(column, self.recorder.column)
            self._options[choice_options.key] = choice_options, bool(varies)
        options, varies = self._options[choice_options.key]
        place_key = identity(place), len(options)
        if place_key not in self._places:
            self._places[place_key] = place == ca.DM(range(len(options))), place
        selector = self._places[place_key][0]
        formula = ca.dot(selector, options.column)
        if not varies:
            return formula
        self.choices.append(Lifted(ca.SX.sym("chosen"), formula, selector, options.column))
        return self.choices[-1].symbol

    @property
    def variables(self) -> list[Lifted]:
        """All lifted variables; each reads only those before it."""
        return self.chained_values + self.choices


class _Choice(NamedTuple):
    """A choice of one of many numbers by a switch: its symbol, the switch and the numbers."""

    symbol: Any
    switch: str
    options: Options


class _Traced(NamedTuple):
    """A quantity as a function of numbers, crank angle, switches, choices and sums of harmonics there.

    harmonics: their coefficients, of cosines and of sines.
    """

    function: Any
    numbers: Any
    choices: tuple[_Choice, ...]
    harmonics: tuple[tuple[list[Number], list[Number]], ...]


class QuantityFunctions:
    """The quantities of one NLP; numbers that follow directly from others are inputs, shared by all nodes.

    Choices of a formula are inputs too: a node with a known switch reads one number only. values: the scene's numbers;
    given: these and the numbers that follow from them, of the rows; switches: names of a node's switches.
    """

    def __init__(self, model: JobModel, values: Values, given: Given, switches: Sequence[str], lifts: Lifts) -> None:
        import casadi as ca

        self.model, self.lifts = model, lifts
        symbols = {name: ca.SX.sym(name) for name in values}
        self._symbols = list(symbols.values())
        """All symbols stay alive: CasADi reuses the identity of a deleted one."""
        self._worth: dict[object, Any] = {identity(symbol): values[name] for name, symbol in symbols.items()}
        # The sums are inputs of every node, whatever their formulas: only which numbers follow from others is read.
        symbolic = model.given(with_recorder(replace(systems.casadi(), choose=value_at), SumRecorder()), symbols)
        shared = self._shared(symbolic.values, given.values)
        self.given, self._in_symbols = given, Given(shared, symbolic.tables, linkage=symbolic.linkage)
        self.phi, self.switches = ca.SX.sym("phi"), {name: ca.SX.sym(name) for name in switches}
        self._traced: dict[str, _Traced] = {}

    def _shared(self, values: Values, formulas: Values) -> dict[str, Number]:
        """The numbers, with a symbol for each one that follows from others."""
        import casadi as ca

        shared = dict(values)
        for key, value in values.items():
            if isinstance(value, ca.SX) and not value.is_constant() and identity(value) not in self._worth:
                shared[key] = ca.SX.sym(key)
                self._symbols.append(shared[key])
                self._worth[identity(shared[key])] = formulas[key]
        return shared

    def at(self, name: str, phi: Number, switch: Values) -> Number:
        """A quantity at a crank angle, rad."""
        if name not in self._traced:
            self._traced[name] = self._trace(name)
        traced = self._traced[name]
        picked = [self.lifts.choose(switch[choice.switch], choice.options) for choice in traced.choices]
        summed = [self.lifts.recorder.harmonics(*coefficients, phi) for coefficients in traced.harmonics]
        return traced.function(traced.numbers, phi, *(switch[key] for key in self.switches), *picked, *summed)

    def _trace(self, name: str) -> _Traced:
        import casadi as ca

        choices, recorder = _Choices(self.switches, self._worth), SumRecorder()

        def harmonics(cosines: Sequence[Number], sines: Sequence[Number], phi: Number) -> Number:
            there = identity(phi) == identity(self.phi)
            return (recorder if there else systems.casadi()).harmonics(cosines, sines, phi)

        system = replace(systems.casadi(), choose=choices.choose, summed=harmonics)
        value = self.model.quantity(system, self._in_symbols, name, Node(self.phi, self.switches))
        symbols = [symbol for symbol in ca.symvar(ca.SX(value)) if identity(symbol) in self._worth]
        sums = [(harmonic, symbol) for harmonic in recorder.harmonic_sums for symbol in harmonic.symbols]
        more = *choices.symbols, *(symbol for _, symbol in sums)
        inputs = ca.vertcat(*symbols), self.phi, *self.switches.values(), *more
        formulas = ca.vertcat(*(self._worth[identity(symbol)] for symbol in symbols))
        function = ca.Function("quantity", list(inputs), [value])
        return _Traced(function, formulas, tuple(choices), tuple(self._coefficients(harmonic) for harmonic, _ in sums))

    def _coefficients(self, harmonic: HarmonicSum) -> tuple[list[Number], list[Number]]:
        """Formulas of the coefficients of harmonics."""
        cosines, sines = (
            [self._worth.get(identity(value), value) for value in values]
            for values in (harmonic.cosines, harmonic.sines)
        )
        return cosines, sines


class _Choices:
    """Choices of a formula among many numbers by a switch; worth: the formula of each symbol."""

    def __init__(self, switches: Values, worth: dict[object, Any]) -> None:
        self.switches = {identity(symbol): name for name, symbol in switches.items()}
        self.worth = worth
        self._choices: dict[Any, _Choice] = {}

    def __iter__(self) -> Iterator[_Choice]:
        """The choices, in the order in which the formula makes them."""
        return iter(self._choices.values())

    @property
    def symbols(self) -> list[Any]:
        """Symbols of the choices."""
        return [choice.symbol for choice in self]

    def choose(self, place: Number, values: Sequence[Number]) -> Number:
        """The value at a place; a symbol where a switch selects one of many numbers."""
        import casadi as ca

        switch = self.switches.get(identity(place))
        if not switch or len(values) <= FEW_CHOICES or not all(map(self._known, values)):
            return value_at(place, values)
        keys = list(map(identity, values))
        if (switch, *keys) not in self._choices:
            options = Options([self.worth.get(key, value) for key, value in zip(keys, values, strict=True)])
            self._choices[switch, *keys] = _Choice(ca.SX.sym("chosen"), switch, options)
        return self._choices[switch, *keys].symbol

    def _known(self, value: Number) -> bool:
        return isinstance(value, float | int) or identity(value) in self.worth or bool(value.is_constant())


class Expressions(NamedTuple):
    """x: variables of design and extra ones, scaled; p: parameters; f: objective; g: rows, each ≤ 0 or = 0.

    lifts: the lifted variables, which rows read in addition to x.
    """

    x: Any
    p: Any
    f: Any
    g: Any
    lifts: Lifts


def expressions(structure: Structure) -> Expressions:
    """The NLP of a structure as expressions."""
    import casadi as ca

    scaled = ca.SX.sym("x", len(structure.program.variables))
    extra = ca.SX.sym("t", structure.rows.extras)
    p = ca.SX.sym("p", structure.layout.size)
    writer = _NlpWriter(structure, scaled, extra, p)
    rows = structure.rows.stack(writer.limits(), writer.pieces(), writer.station_rows(), writer.node_rows())
    return Expressions(ca.vertcat(scaled, extra), p, writer.objective(), ca.vertcat(*rows), writer.lifts)


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
        """A whole-cycle quantity at a crank angle, rad, SI."""
        return self.quantities.at(name, phi, switch)

    def read(self, names: Sequence[str]) -> None:
        """Read figures and rows of the design in one evaluation."""
        self._single |= self.model.static(self.maths, self.given, self.stills, names)

    def at(self, name: str, parameters: Any) -> Number:
        """A whole-cycle quantity at the node of parameters (a column), SI."""
        import casadi as ca

        switch = {key: parameters[self.shape.places.start + k] for k, key in enumerate(self.shape.switches)}
        return self.quantity(name, ca.dot(parameters[self.shape.angle], self.column), switch)

    def mean(self, integral: Integral) -> Number:
        """A mean by its quadrature rule, SI."""
        import casadi as ca

        rule = self.rules[integral.name]
        widths = [ca.dot(ca.vertcat(node[0], node[self.shape.width]), self.column) for node in rule]
        weighted = [width * self.at(integral.quantity, node) for width, node in zip(widths, rule, strict=True)]
        return total(weighted) / total(widths)


class _NlpWriter:
    """Writer of one NLP; scaled, extra: its variables; column: its parameters; all of them columns."""

    def __init__(self, structure: Structure, scaled: Any, extra: Any, column: Any) -> None:
        import casadi as ca

        program, layout = structure.program, structure.layout
        vector = ca.vertsplit(layout.prefix(column, "nodes"))
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
        values |= self.lifts.symbols(structure.chained_values)
        self.lifts.define(chain_values(model, structure.names, self.lifts.maths, values))
        given = model.given(self.lifts.maths, values)
        quantities = QuantityFunctions(model, values, given, structure.node.switches, self.lifts)
        self.rows = NodeRows(structure.node, quantities, stills, rules)
        self.bounds, self.limit_scales = layout.read(vector, "limit"), layout.read(vector, "limit scale")
        self.scales, self.weights = layout.read(vector, "objective scale"), layout.read(vector, "objective weight")

    def objective(self) -> Any:
        """Weighted sum of the objectives, or of the excesses of an elastic NLP."""
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

    def relaxation(self, place: int) -> Any:
        """Excess by which a limit is relaxed, in its scale; signed for an equality."""
        ways = [self.extra[way] for way in self.structure.excess_places.get(place, ())]
        return ways[0] - ways[1] if len(ways) == 2 else total(ways)

    def limits(self) -> Any:
        """Rows of limits with one row each, as one column: entry by entry CasADi takes twice as long."""
        import casadi as ca

        limits, static = self.program.single_limits, self.structure.rows.limits
        self.rows.read([limits[k].row for k in static])
        columns = [
            (limits[k].residual(self.rows, self.bounds[k]), self.limit_scales[k], self.relaxation(k)) for k in static
        ]
        excess, scales, ways = (
            (ca.vertcat(*column) for column in zip(*columns, strict=True)) if columns else [ca.SX()] * 3
        )
        return excess / scales - ways

    def pieces(self) -> list[Any]:
        """Smooth pieces below epigraph variables: both signs of a magnitude, each value of several."""
        pieces = []
        for t, epigraph in zip(self.extra, self.structure.epigraphs, strict=not self.structure.elastic):
            scale, sides = self.scales[epigraph.objective], self.program.objectives[epigraph.objective].sides
            pieces += [sign * self.rows.single(row) / scale - t for row, sign in sides]
        return pieces

    def station_rows(self) -> list[Any]:
        """Rows of whole-cycle quantities at stations, one column for each family."""
        import casadi as ca

        layout, columns = self.structure.layout, []
        open_switches = [
            dict(zip(self.structure.open_switches, row, strict=True)) for row in layout.rows(self.vector, "station")
        ]
        for k, family in enumerate(self.structure.families):
            stations = [self.structure.stations[place] for place in self.structure.station_rows[k]]
            corners = [self.rows.corners[corner] for corner, _ in stations]
            switches = [
                {**open_switches[place], **self.structure.stations[place].switch}
                for place in self.structure.station_rows[k]
            ]
            values = map(self.rows.quantity, itertools.repeat(family.square or family.row), corners, switches)
            columns.append(self._rows(family, ca.vertcat(*layout.read(self.vector, f"sign {k}")), ca.vertcat(*values)))
        return columns

    def node_rows(self) -> list[Any]:
        """Rows of whole-cycle quantities at nodes, one for each slot."""
        rows = []
        for k, family in enumerate(self.structure.families):
            slots = self.structure.layout.columns(self.column, f"family {k}")
            quantity = family.square or family.row
            rows += [slot[0] * self._rows(family, slot[1], self.rows.at(quantity, slot[2:])) for slot in slots]
        return rows

    def _rows(self, family: RowFamily, sign: Any, value: Any) -> Any:
        """Excess of a whole-cycle quantity over its bound, in its scale.

        For squares the difference is divided by bound + 1, so that its slope near the bound is the same.
        """
        if family.epigraph >= 0:
            scale = self.scales[self.structure.epigraphs[family.epigraph].objective]
            return sign * value / scale - self.extra[family.epigraph]
        scale = self.limit_scales[family.limit]
        bound = self.bounds[family.limit] / scale + self.relaxation(family.limit)
        if family.square:
            return (sign * value / scale**2 - bound**2) / (1 + bound)
        return sign * value / scale - bound


def second_derivative(
    formula: Callable[[Maths, Number, Sequence[Number]], Number], switches: int
) -> Callable[[Floats, Floats], Floats]:
    """Second derivative of formula(maths, phi, switches) with respect to phi.

    Returns a function of angles (n,), rad, and their switches (switches, n); its values are (n,).
    """
    import casadi as ca

    phi, data = ca.SX.sym("phi"), ca.SX.sym("switch", switches)
    slope = ca.gradient(formula(systems.casadi(), phi, ca.vertsplit(data) if switches else []), phi)
    function = ca.Function("second", [phi, data], [ca.gradient(slope, phi)])

    def evaluate(angles: Floats, switch_values: Floats) -> Floats:
        return np.asarray(
            function(angles[None, :], switch_values.reshape(switches, len(angles))), dtype=np.float64
        ).ravel()

    return evaluate
