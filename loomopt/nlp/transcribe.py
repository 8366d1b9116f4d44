"""From a program's structure to one parametric NLP: built once, solved for any numbers.

Variables are scaled; every scene number, limit, natural size, weight and cycle node is a parameter. The cycle enters
through a few slots, each a node that the exchange fills; an unused slot weighs nothing.
"""

from collections import OrderedDict
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from loomopt import maths
from loomopt.balance import Given, total
from loomopt.cycle import Floats, node_angle
from loomopt.nlp.layout import Layout
from loomopt.nlp.options import ipopt_options
from loomopt.nlp.point import Settings
from loomopt.program.program import Integral, Program
from loomopt.program.sampling import Extreme, Sampler

CACHE_SIZE = 32


@dataclass(frozen=True)
class Family:
    """The whole-cycle rows of one quantity: below an objective's epigraph variable, or below a limit."""

    row: str
    objective: int = -1
    limit: int = -1
    where: tuple[int, float] | None = None


class Transcription:
    """One built NLP.

    elastic: instead of the objectives, the least weighted excess of the relaxable limits is sought.
    """

    def __init__(self, program: Program, sampler: Sampler, slots: int, elastic: bool) -> None:
        import casadi as ca

        self.program, self.slots, self.elastic = program, slots, elastic
        self.corners = sampler.corner_count
        self.loads = len(program.model.switched)
        self.hints = tuple(sampler.hints)
        self.families = families(program, elastic)
        self.static = [limit for limit in program.limits if self._is_row(limit)]
        self.soft = program.soft if elastic else {}
        self.groups = len(set(self.soft.values()))
        self.epigraphs = [] if elastic else [k for k, o in enumerate(program.objectives) if o.form != "value"]
        self.integrals = _wanted_integrals(program, elastic)
        self.quadrature = {i.name: _nodes(sampler, i) for i in self.integrals}
        self.layout = self._layout()
        self._quantities: dict[str, tuple[Any, list[str]]] = {}
        scaled = ca.SX.sym("x", len(program.variables))
        extra = ca.SX.sym("t", 2 * self.groups if elastic else len(self.epigraphs))
        self.parameters = ca.SX.sym("p", self.layout.size)
        objective, rows = self._expressions(ca.vertsplit(scaled), ca.vertsplit(extra), ca.vertsplit(self.parameters))
        self.nlp = {
            "x": ca.vertcat(scaled, extra),
            "p": self.parameters,
            "f": objective,
            "g": ca.vertcat(*rows),
        }
        self.extras = extra.numel()
        self._solvers: dict[Hashable, Any] = {}
        self._derivatives: dict[str, Any] = {}

    def solver(self, warm: bool, settings: Settings) -> Any:
        """Return IPOPT for this NLP, from scratch or from a solution nearby."""
        import casadi as ca

        callback = settings.callback
        name = (warm, callback, settings.tolerance, settings.hessian)
        if name not in self._solvers:
            options: dict[str, Any] = {
                "ipopt": ipopt_options(settings, warm),
                "print_time": False,
                "show_eval_warnings": False,
                "calc_lam_p": False,
            }
            options["error_on_fail"] = False
            if callback is not None:
                sizes = (self.nlp["x"].numel(), self.nlp["g"].numel(), self.layout.size)
                options["iteration_callback"] = callback.for_size(*sizes)
            if self._derivatives:
                options |= self._derivatives
            solver = ca.nlpsol("solver", "ipopt", self.nlp, options)
            if not self._derivatives:
                functions = {"grad_f": "nlp_grad_f", "jac_g": "nlp_jac_g", "hess_lag": "nlp_hess_l"}
                self._derivatives = {option: solver.get_function(made) for option, made in functions.items()}
            self._solvers[name] = solver
        return self._solvers[name]

    @property
    def jacobian(self) -> Any:
        """Rows and their derivatives, as the solver computes them: (x, p) → (g, dg/dx)."""
        return self._derivatives["jac_g"]

    @property
    def gradient(self) -> Any:
        """The objective and its derivatives: (x, p) → (f, df/dx)."""
        return self._derivatives["grad_f"]

    @property
    def curvature(self) -> Any:
        """Second derivatives of the Lagrangian: (x, p, weight of f, multipliers) → their upper triangle."""
        return self._derivatives["hess_lag"]

    def _is_row(self, limit: Any) -> bool:
        return limit.family == "static" or (self.elastic and limit.family == "variable")

    def _layout(self) -> Layout:
        program, layout = self.program, Layout()
        layout.add("values", len(program.parameters))
        layout.add("hints", len(self.hints))
        layout.add("variable scale", len(program.variables))
        layout.add("limit", len(program.limits))
        layout.add("limit scale", len(program.limits))
        layout.add("objective weight", len(program.objectives))
        layout.add("objective scale", len(program.objectives))
        layout.add("front", self.loads)
        for integral in self.integrals:
            layout.add(f"{integral.name} nodes", self.quadrature[integral.name], self._node_size)
        for k in range(len(self.families)):
            layout.add(f"family {k}", self.slots, 2 + self._node_size)
        return layout

    @property
    def _node_size(self) -> int:
        """weight of the corners' distance, offset, corner coefficients, switches."""
        return 2 + 2 * self.corners + self.loads

    def _expressions(self, scaled: list[Any], extra: list[Any], vector: list[Any]) -> tuple[Any, list[Any]]:
        """Return the objective and all rows, each ≤ 0 (or = 0) and of natural size."""
        program, read = self.program, self.layout.read
        m, model = maths.casadi(), program.model
        sizes = read(vector, "variable scale")
        values = dict(zip(program.parameters, read(vector, "values"), strict=True))
        values |= dict(zip(self.hints, read(vector, "hints"), strict=True))
        values |= {v.name: x * size for v, x, size in zip(program.variables, scaled, sizes, strict=True)}
        given = model.given(m, values)
        corners = [angle for of_load in model.corners(m, given) for angle in of_load]
        static = model.static(m, given, read(vector, "front"))
        for integral in self.integrals:
            static[integral.name] = self._mean(given, corners, integral, vector)
            static[integral.root] = m.sqrt(static[integral.name])
        reading = {"variable": values, "static": {**values, **static}}
        static = reading["static"]
        limit_values, limit_scales = read(vector, "limit"), read(vector, "limit scale")
        excess = dict.fromkeys(range(len(program.limits)), 0)
        for k, place in self.soft.items():
            excess[k] = extra[2 * place] - extra[2 * place + 1] if program.limits[k].sign == 0 else extra[2 * place]
        rows = [
            limit.residual(reading[limit.family], limit_values[k]) / limit_scales[k] - excess[k]
            for k, limit in enumerate(program.limits)
            if self._is_row(limit)
        ]
        epigraph = dict(zip(self.epigraphs, extra, strict=False)) if not self.elastic else {}
        weights, scales = read(vector, "objective weight"), read(vector, "objective scale")
        terms = [extra[k] for k in range(2 * self.groups)]
        for k, objective in enumerate(program.objectives if not self.elastic else ()):
            reached = epigraph[k] if k in epigraph else static[objective.row] / scales[k]
            terms.append(weights[k] * reached)
            if objective.form == "magnitude":
                rows += [sign * static[objective.row] / scales[k] - epigraph[k] for sign in (1, -1)]
        for k, family in enumerate(self.families):
            own = family.objective
            scale = scales[own] if own >= 0 else limit_scales[family.limit]
            bound = epigraph[own] if own >= 0 else limit_values[family.limit] / scale + excess[family.limit]
            for weight, sign, _, *node in self.layout.rows(vector, f"family {k}"):
                value = self._at(given, corners, family.row, node)
                rows.append(weight * (sign * value / scale - bound))
        return total(terms), rows

    def _at(self, given: Given, corners: list[Any], name: str, node: Sequence[Any]) -> Any:
        """Return a whole-cycle quantity at a node of parameters."""
        import casadi as ca

        if name not in self._quantities:
            self._quantities[name] = self._quantity(name)
        function, inputs = self._quantities[name]
        angle = node_angle(node[0], node[1 : 1 + self.corners], corners)
        arguments = [given.values[key] for key in inputs]
        return function(ca.vertcat(*arguments), angle, ca.vertcat(*node[1 + 2 * self.corners :]))

    def _quantity(self, name: str) -> tuple[Any, list[str]]:
        """Return a quantity as a function of the scene's numbers, angle and switches: traced once, not per node.

        Numbers that follow from others at once (the corners' angles among them) are inputs too, so that each node
        shares them.
        """
        import casadi as ca

        names = [*self.program.parameters, *self.hints, *(v.name for v in self.program.variables)]
        symbols = {key: ca.SX.sym(key) for key in names}
        given = self.program.model.given(maths.casadi(), symbols)
        derived = {key: ca.SX.sym(key) for key, value in given.values.items() if isinstance(value, ca.SX)}
        inputs = {**derived, **symbols}
        angle, switches = ca.SX.sym("phi"), ca.SX.sym("switch", self.loads)
        values = Given({**given.values, **inputs}, given.own)
        value = self.program.model.quantity(maths.casadi(), values, name, angle, ca.vertsplit(switches))
        return ca.Function(name, [ca.vertcat(*inputs.values()), angle, switches], [value]), list(inputs)

    def _mean(self, given: Given, corners: list[Any], integral: Any, vector: list[Any]) -> Any:
        """Return an integral's mean by its Gauss rule."""
        weighted, widths = [], []
        for offset_width, *node in self.layout.rows(vector, f"{integral.name} nodes"):
            width = node_angle(offset_width, node[1 + self.corners : 1 + 2 * self.corners], corners)
            weighted.append(width * self._at(given, corners, integral.quantity, node))
            widths.append(width)
        return total(weighted) / total(widths)

    def node(self, sampler: Sampler, piece: int, u: float, weight: float = 0.0) -> list[float]:
        """Return a node's parameters: offset of its width, angle offset, corner coefficients, switches."""
        offset, coefficients = sampler.cycle.coefficients(piece, u, self.corners)
        width = [0.0] * (1 + self.corners)
        if weight:
            start, at_start = sampler.cycle.coefficients(piece, 0.0, self.corners)
            end, at_end = sampler.cycle.coefficients(piece, 1.0, self.corners)
            width = [weight * (end - start), *(weight * (at_end - at_start))]
        return [width[0], offset, *coefficients, *width[1:], *sampler.cycle.switches[piece]]

    def _rule(self, sampler: Sampler, integral: Integral) -> list[list[float]]:
        """Return the parameters of a mean's nodes."""
        if not integral.angles:
            return [self.node(sampler, int(i), u, w) for i, u, w in zip(*sampler.quadrature(integral), strict=True)]
        idle = [0.0] * self.corners
        fixed = zip(integral.angles, integral.data, strict=True)
        return [[1.0, angle, *idle, *idle, *[0.0] * (self.loads - 1), datum] for angle, datum in fixed]

    def vector(
        self, program: Program, sampler: Sampler, weights: Sequence[float], nodes: Sequence[Sequence[Extreme]]
    ) -> Floats:
        """Return the parameter vector for a program's numbers and the nodes of each family."""
        p, write = np.zeros(self.layout.size), self.layout.write
        write(p, "values", list(program.parameters.values()))
        write(p, "hints", list(sampler.hints.values()))
        write(p, "variable scale", [variable.scale for variable in program.variables])
        write(p, "limit", [x.bound if x.family == "cycle" else x.value for x in program.limits])
        write(p, "limit scale", [limit.scale for limit in program.limits])
        write(p, "objective weight", weights)
        write(p, "objective scale", [objective.scale for objective in program.objectives])
        write(p, "front", sampler.front)
        for integral in _wanted_integrals(program, self.elastic):
            write(p, f"{integral.name} nodes", self._rule(sampler, integral))
        for k, chosen in enumerate(nodes):
            used = [[1.0, e.sign, *self.node(sampler, e.piece, e.u)] for e in chosen]
            idle = [[0.0, 1.0, *self.node(sampler, 0, 0.5)]] * (self.slots - len(used))
            write(p, f"family {k}", used + idle)
        return p


def families(program: Program, elastic: bool = False) -> list[Family]:
    """Return the whole-cycle rows a program needs; an elastic one has no objectives."""
    peaks = [Family(o.row, objective=k) for k, o in enumerate(program.objectives) if o.form == "peak"]
    limits = [
        Family(limit.row, limit=k, where=limit.where)
        for k, limit in enumerate(program.limits)
        if limit.family == "cycle"
    ]
    return limits if elastic else peaks + limits


def _nodes(sampler: Sampler, integral: Integral) -> int:
    """Return how many nodes a mean has."""
    return len(integral.angles) or len(sampler.quadrature(integral)[0])


def _wanted_integrals(program: Program, elastic: bool) -> list[Any]:
    """Return the model's integrals that a limit reads, or an objective; an elastic program has no objectives."""
    read = {limit.row for limit in program.limits}
    read |= set() if elastic else {o.row for o in program.objectives}
    return [integral for integral in program.model.integrals if {integral.name, integral.root} & read]


_cache: OrderedDict[Hashable, Transcription] = OrderedDict()


def transcribe(program: Program, sampler: Sampler, slots: int, elastic: bool = False) -> tuple[Transcription, bool]:
    """Return the NLP of a program's structure, and whether it had to be built."""
    nodes = tuple(_nodes(sampler, integral) for integral in _wanted_integrals(program, elastic))
    key = (program.structure, slots, elastic, nodes, sampler.corner_count)
    if key in _cache:
        _cache.move_to_end(key)
        return _cache[key], False
    _cache[key] = Transcription(program, sampler, slots, elastic)
    if len(_cache) > CACHE_SIZE:
        _cache.popitem(last=False)
    return _cache[key], True
