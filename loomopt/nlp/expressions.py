"""An NLP's objective and rows as CasADi expressions, read through the same rows as in every other number system."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from loomopt import maths
from loomopt.balance import Given, total
from loomopt.cycle import Node
from loomopt.maths import Number
from loomopt.nlp.structure import Structure
from loomopt.program.model import Integral
from loomopt.program.reading import Rows
from loomopt.schema import Values


class Expressions(NamedTuple):
    """x: the design's variables and the extra ones, scaled; p: parameters; f: objective; g: rows, each ≤ 0 or = 0."""

    x: Any
    p: Any
    f: Any
    g: Any


def expressions(structure: Structure) -> Expressions:
    """Return the NLP of a structure."""
    import casadi as ca

    scaled = ca.SX.sym("x", len(structure.program.variables))
    extra = ca.SX.sym("t", structure.extras)
    p = ca.SX.sym("p", structure.layout.size)
    built = _Built(structure, ca.vertsplit(scaled), ca.vertsplit(extra), ca.vertsplit(p))
    rows = [*built.limits(), *built.pieces(), *built.cycle()]
    return Expressions(ca.vertcat(scaled, extra), p, built.objective(), ca.vertcat(*rows))


class Quantities:
    """Whole-cycle quantities, each traced once as a CasADi function of numbers, angle and switches, not once a node.

    Numbers that follow from others at once (the corners' angles among them) are inputs too: all nodes share them.
    """

    def __init__(self, structure: Structure) -> None:
        import casadi as ca

        program, self.model = structure.program, structure.program.model
        names = [*program.parameters, *structure.hints, *(v.name for v in program.variables)]
        self.symbols = {name: ca.SX.sym(name) for name in names}
        given = self.model.given(maths.casadi(), self.symbols)
        self.derived = [_following(case) for case in (given, *given.cases)]
        first, *others = (
            Given({**case.values, **own}, case.own)
            for case, own in zip((given, *given.cases), self.derived, strict=True)
        )
        self.given = Given(first.values, first.own, tuple(others))
        self.phi, self.switch = ca.SX.sym("phi"), ca.SX.sym("switch", len(structure.node.switches))
        self.switches = structure.node.switches
        self._traced: dict[str, Any] = {}

    def at(self, name: str, given: Given, phi: Number, switch: Values) -> Number:
        """Return a quantity at a crank angle, rad."""
        import casadi as ca

        if name not in self._traced:
            self._traced[name] = self._trace(name)
        numbers = [given.values[key] for key in self.symbols]
        for case, own in zip((given, *given.cases), self.derived, strict=True):
            numbers += [case.values[key] for key in own]
        return self._traced[name](ca.vertcat(*numbers), phi, ca.vertcat(*(switch[key] for key in self.switches)))

    def _trace(self, name: str) -> Any:
        import casadi as ca

        switch = dict(zip(self.switches, ca.vertsplit(self.switch), strict=True))
        value = self.model.quantity(maths.casadi(), self.given, name, Node(self.phi, switch))
        numbers = [*self.symbols.values(), *(symbol for own in self.derived for symbol in own.values())]
        return ca.Function("quantity", [ca.vertcat(*numbers), self.phi, self.switch], [value])


def _following(case: Given) -> dict[str, Any]:
    """Return a symbol for every number of a case that follows from others."""
    import casadi as ca

    known = case.values.items()
    return {key: ca.SX.sym(key) for key, value in known if isinstance(value, ca.SX) and not value.is_symbolic()}


class NodeRows(Rows):
    """Rows in CasADi symbols; means are taken over nodes that are parameters."""

    def __init__(
        self, structure: Structure, given: Given, stills: Mapping[str, Values], rules: Mapping[str, Sequence[Any]]
    ) -> None:
        super().__init__(structure.program.model, maths.casadi(), given, stills)
        self.corners = self.model.corners(self.maths, given)
        self.shape, self.rules, self.quantities = structure.node, rules, Quantities(structure)

    def quantity(self, name: str, phi: Number, switch: Values) -> Number:
        """Return a whole-cycle quantity at a crank angle, rad, SI."""
        return self.quantities.at(name, self.given, phi, switch)

    def at(self, name: str, parameters: Sequence[Number]) -> Number:
        """Return a whole-cycle quantity at the node that parameters say, SI."""
        return self.quantity(name, *self.shape.read(parameters, self.corners))

    def mean(self, integral: Integral) -> Number:
        """Return a mean by its rule, SI."""
        rule = self.rules[integral.name]
        widths = [self.shape.read_width(parameters, self.corners) for parameters in rule]
        weighted = [width * self.at(integral.quantity, node) for width, node in zip(widths, rule, strict=True)]
        return total(weighted) / total(widths)


class _Built:
    """One NLP being written down; scaled, extra: its variables; vector: its parameters."""

    def __init__(self, structure: Structure, scaled: list[Any], extra: list[Any], vector: list[Any]) -> None:
        program, layout = structure.program, structure.layout
        self.structure, self.program, self.extra, self.vector = structure, program, extra, vector
        sizes = layout.read(vector, "variable scale")
        values = dict(zip(program.parameters, layout.read(vector, "values"), strict=True))
        values |= dict(zip(structure.hints, layout.read(vector, "hints"), strict=True))
        values |= {v.name: x * size for v, x, size in zip(program.variables, scaled, sizes, strict=True)}
        names, model = program.model.switches, program.model
        stills = {e: dict(zip(names, layout.read(vector, f"still {e}"), strict=True)) for e in model.events_read}
        rules = {name: layout.rows(vector, f"mean {name}") for name, _ in structure.points}
        self.rows = NodeRows(structure, model.given(maths.casadi(), values), stills, rules)
        self.bounds, self.limit_scales = layout.read(vector, "limit"), layout.read(vector, "limit scale")
        self.scales, self.weights = layout.read(vector, "objective scale"), layout.read(vector, "objective weight")

    def objective(self) -> Any:
        """Return the weighted sum of the objectives, or of what the limits give way."""
        if self.structure.elastic:
            return total(self.extra)
        levels: list[list[Any]] = [[] for _ in self.program.objectives]
        for t, epigraph in zip(self.extra, self.structure.epigraphs, strict=True):
            levels[epigraph.objective].append(t)
        for k, level in enumerate(self.program.objectives):
            if level.is_smooth:
                levels[k] = [self.rows.single(row) / self.scales[k] for row in level.rows]
        return total([weight * total(level) for weight, level in zip(self.weights, levels, strict=True)])

    def given_way(self, place: int) -> Any:
        """Return by how much a limit gives way, in its natural size; of an equality with its sign."""
        if place not in self.structure.soft:
            return 0
        group = 2 * self.structure.soft[place]
        more, less = self.extra[group : group + 2]
        return more - less if self.program.limits[place].sign == 0 else more

    def limits(self) -> list[Any]:
        """Return the rows of limits that are one row each."""
        limits = self.program.limits
        return [
            self.rows.excess(limits[k], self.bounds[k]) / self.limit_scales[k] - self.given_way(k)
            for k in self.structure.static
        ]

    def pieces(self) -> list[Any]:
        """Return the smooth pieces below epigraph variables: both signs of a magnitude, each value of several."""
        found = []
        for t, epigraph in zip(self.extra, self.structure.epigraphs, strict=not self.structure.elastic):
            form = self.program.objectives[epigraph.objective].form
            signs = {"magnitude": (1, -1), "value": (1,), "peak": ()}[form]
            scale = self.scales[epigraph.objective]
            found += [sign * self.rows.single(row) / scale - t for row in epigraph.rows for sign in signs]
        return found

    def cycle(self) -> list[Any]:
        """Return the rows of whole-cycle quantities, one for each slot."""
        found = []
        for k, family in enumerate(self.structure.families):
            if family.epigraph >= 0:
                bound = self.extra[family.epigraph]
                scale = self.scales[self.structure.epigraphs[family.epigraph].objective]
            else:
                scale = self.limit_scales[family.limit]
                bound = self.bounds[family.limit] / scale + self.given_way(family.limit)
            for weight, sign, *parameters in self.structure.layout.rows(self.vector, f"family {k}"):
                found.append(weight * (sign * self.rows.at(family.row, parameters) / scale - bound))
        return found
