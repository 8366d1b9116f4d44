"""Parametric NLP of a program: built once for each structure, solved for any numbers."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Floats
from loomopt.solving.nlp.expressions import Expressions, Lifted, expressions
from loomopt.solving.nlp.mapped_sums import WrittenNlp
from loomopt.solving.nlp.point import Settings, sampler_at
from loomopt.solving.nlp.rows import RowMap, Structure, structure


class Entries:
    """Entries of a sparse CasADi matrix by row, as arrays; the values are given with each call."""

    def __init__(self, sparsity: Any, rows: range, columns: range) -> None:
        row, column = np.array(sparsity.row(), dtype=np.intp), np.array(sparsity.get_col(), dtype=np.intp)
        inside = (row >= rows.start) & (row < rows.stop) & (column >= columns.start) & (column < columns.stop)
        place = np.flatnonzero(inside)
        self.place = place[np.lexsort((column[place], row[place]))]
        self.row, self.column = row[self.place] - rows.start, column[self.place] - columns.start
        self.shape = len(rows), len(columns)
        self.ends = np.searchsorted(self.row, np.arange(len(rows) + 1))

    def dense(self, values: Floats) -> Floats:
        """The dense matrix; values: of all entries, in CasADi's order."""
        matrix = np.zeros(self.shape)
        matrix[self.row, self.column] = values[self.place]
        return matrix

    def times(self, values: Floats, matrix: Floats) -> Floats:
        """Product with a dense matrix."""
        product = np.zeros((self.shape[0], *matrix.shape[1:]))
        nonempty = np.flatnonzero(np.diff(self.ends))
        if len(nonempty):
            terms = values[self.place].reshape(-1, *[1] * (matrix.ndim - 1)) * matrix[self.column]
            product[nonempty] = np.add.reduceat(terms, self.ends[nonempty])
        return product

    def transposed_times(self, values: Floats, vector: Floats) -> Floats:
        """Product of the transpose with a vector."""
        product = np.zeros(self.shape[1])
        np.add.at(product, self.column, values[self.place] * vector[self.row])
        return product


class _Local(NamedTuple):
    """An NLP at one point: values of all rows, entries of their slopes, and dz/dx of the lifted variables z."""

    full: Floats
    rows: Floats
    entries: Floats
    follow: Floats


def _choice_slopes(choices: Sequence[Lifted], x: Any) -> Any:
    """Slopes of the rows of choices, written apart because each reads many numbers."""
    import casadi as ca

    columns = {id(choice.options): choice.options for choice in choices}
    slopes = {key: ca.jacobian(options, x) for key, options in columns.items()}
    rows = [ca.mtimes(choice.selector.T, slopes[id(choice.options)]) for choice in choices]
    return ca.jacobian(ca.vertcat(*(choice.symbol for choice in choices)), x) - ca.vertcat(*rows)


class Elimination:
    """Functions of an NLP's original variables and rows, from those with lifted variables, which IPOPT solves."""

    def __init__(self, nlp: Expressions, row_map: RowMap) -> None:
        import casadi as ca

        lifted = nlp.lifts.variables
        z, formulas = ca.vertcat(*(lift.symbol for lift in lifted)), ca.vertcat(*(lift.formula for lift in lifted))
        self.full = replace(row_map, lifted=len(lifted))
        x, lam_f, lam_g = ca.vertcat(nlp.x, z), ca.SX.sym("f"), ca.SX.sym("g", self.full.size)
        g = ca.vertcat(nlp.g, z - formulas)
        start_values, _ = ca.substitute_inplace(
            [lift.symbol for lift in lifted], [lift.formula for lift in lifted], [], False
        )
        self._start = ca.Function("start", [nlp.x, nlp.p], [ca.vertcat(*start_values)])
        named = ca.vertcat(*(lift.symbol - lift.formula for lift in nlp.lifts.chained_values))
        definition_slopes = ca.vertcat(ca.jacobian(named, x), _choice_slopes(nlp.lifts.choices, x))
        slopes = ca.vertcat(ca.jacobian(nlp.g, x), definition_slopes)
        lagrangian_rows = (
            ca.dot(lam_g, g) if ca.depends_on(definition_slopes, x) else ca.dot(self.full.original_rows(lam_g), nlp.g)
        )
        written = WrittenNlp(x, nlp.p, nlp.f, g, slopes, lam_f, lam_g, lam_f * nlp.f + lagrangian_rows)
        self.nlp, self.functions = written.functions(nlp.lifts.recorder)
        all_rows, columns = range(g.numel()), range(x.numel())
        pattern = self.functions["jac_g"].sparsity_out(1)
        rows, definitions = self.full.original_rows(all_rows), self.full.definitions(all_rows)
        self._g_x = Entries(pattern, rows, self.full.original_variables(columns))
        self._g_z = Entries(pattern, rows, self.full.lifted_variables(columns))
        self._d_x = Entries(pattern, definitions, self.full.original_variables(columns))
        self._d_z = Entries(pattern, definitions, self.full.lifted_variables(columns))
        self._bends = Entries(self.functions["hess_lag"].sparsity_out(0), columns, columns)

    def start(self, x: Floats, p: Floats) -> Floats:
        """Values of the lifted variables."""
        return np.asarray(self._start(x, p), dtype=np.float64).ravel()

    def jacobian(self, x: Floats, p: Floats) -> tuple[Floats, Floats]:
        """Rows and their first derivatives."""
        local = self._at(x, p)
        return self.full.original_rows(local.rows), self._g_x.dense(local.entries) + self._g_z.times(
            local.entries, local.follow
        )

    def gradient(self, x: Floats, p: Floats) -> tuple[float, Floats]:
        """The objective and its first derivatives."""
        local = self._at(x, p)
        value, slope = self._slope(local, p)
        return value, self.full.original_variables(slope) + self.full.lifted_variables(slope) @ local.follow

    def curvature(self, x: Floats, p: Floats, weight: float, multipliers: Floats) -> Floats:
        """Second derivatives of the Lagrangian, upper triangle."""
        local = self._at(x, p)
        definition_prices = self.prices(x, p, weight, multipliers)
        matrix = self.functions["hess_lag"](local.full, p, weight, np.concatenate([multipliers, definition_prices]))
        values = np.array(matrix.nonzeros())
        directions = np.concatenate([np.eye(local.follow.shape[1]), local.follow])
        half = directions.T @ self._bends.times(values, directions)
        diagonal = self._bends.row == self._bends.column
        diagonal_values = np.zeros(len(directions))
        diagonal_values[self._bends.row[diagonal]] = values[self._bends.place[diagonal]]
        triangle: Floats = np.triu(half + half.T - directions.T @ (diagonal_values[:, None] * directions))
        return triangle

    def prices(self, x: Floats, p: Floats, weight: float, multipliers: Floats) -> Floats:
        """Multipliers of the definitions, from those of the rows: stationary in the lifted variables."""
        local = self._at(x, p)
        slope: Floats = self.full.lifted_variables(self._slope(local, p)[1])
        multiplier: Floats = -weight * slope - self._g_z.transposed_times(local.entries, multipliers)
        entries, ends = self._d_z, self._d_z.ends
        values = local.entries[entries.place]
        for k in range(self.full.lifted - 1, -1, -1):
            part = slice(ends[k], ends[k + 1] - 1)
            multiplier[entries.column[part]] -= values[part] * multiplier[k]
        return multiplier

    def _slope(self, local: _Local, p: Floats) -> tuple[float, Floats]:
        value, slope = self.functions["grad_f"](local.full, p)
        return float(value), np.asarray(slope, dtype=np.float64).ravel()

    def _at(self, x: Floats, p: Floats) -> _Local:
        full = np.concatenate([x, self.start(x, p)])
        rows, slopes = self.functions["jac_g"](full, p)
        entries = np.array(slopes.nonzeros())
        return _Local(full, np.asarray(rows, dtype=np.float64).ravel(), entries, self._follow(entries))

    def _follow(self, entries: Floats) -> Floats:
        """dz/dx, row by row: a row follows from those before it."""
        slopes = -self._d_x.dense(entries)
        column, ends, values = self._d_z.column, self._d_z.ends, entries[self._d_z.place]
        for k in range(self.full.lifted):
            # The last entry of a row is the diagonal, which is 1.
            part = slice(ends[k], ends[k + 1] - 1)
            slopes[k] -= values[part] @ slopes[column[part]]
        return slopes


def _written(nlp: Expressions) -> WrittenNlp:
    """NLP without lifted variables."""
    import casadi as ca

    lam_f, lam_g = ca.SX.sym("f"), ca.SX.sym("g", nlp.g.numel())
    lagrangian = lam_f * nlp.f + ca.dot(lam_g, nlp.g)
    return WrittenNlp(nlp.x, nlp.p, nlp.f, nlp.g, ca.jacobian(nlp.g, nlp.x), lam_f, lam_g, lagrangian)


class EliminatedSolver:
    """IPOPT on an NLP with lifted variables, called like one without them."""

    def __init__(self, solver: Any, elimination: Elimination) -> None:
        self.solver, self.elimination = solver, elimination

    def stats(self) -> Mapping[str, Any]:
        """IPOPT's statistics of its last run."""
        stats: Mapping[str, Any] = self.solver.stats()
        return stats

    def __call__(self, **arguments: Any) -> dict[str, Floats]:
        """IPOPT's result: f, and x, lam_x, lam_g of the original variables and rows."""
        elimination, x, p = self.elimination, arguments["x0"], arguments["p"]
        free, zero = np.full(elimination.full.lifted, np.inf), np.zeros(elimination.full.lifted)
        lifted_arguments = {"x0": elimination.start(x, p), "lbx": -free, "ubx": free, "lbg": zero, "ubg": zero}
        if "lam_g0" in arguments:
            lifted_arguments |= {"lam_x0": zero, "lam_g0": elimination.prices(x, p, 1.0, arguments["lam_g0"])}
        outputs = self.solver(
            **arguments | {name: np.concatenate([arguments[name], part]) for name, part in lifted_arguments.items()}
        )
        arrays = {name: np.asarray(outputs[name], dtype=np.float64).ravel() for name in ("x", "lam_x", "lam_g")}
        original = {name: elimination.full.original_variables(arrays[name]) for name in ("x", "lam_x")}
        return {
            **original,
            "lam_g": elimination.full.original_rows(arrays["lam_g"]),
            "f": np.asarray(outputs["f"], dtype=np.float64),
        }


IPOPT_TOLERANCE, IPOPT_SLOPE, IPOPT_ITERATIONS = 1e-11, 1e-9, 300
"""IPOPT's tolerances: rows and complementarity three decades below the usual accuracy, slopes three below STATIONARY;
and its iteration limit: no packaged target needs a hundred iterations from its first start."""

WARM_BARRIER, WARM_PUSH = 1e-8, 1e-10
"""First barrier parameter of a warm start, which is the distance of a row of multiplier 1 from its bound, and the push
of a start into the bounds: less than IPOPT's own distance."""

IPOPT = {
    "tol": IPOPT_TOLERANCE,
    "dual_inf_tol": IPOPT_SLOPE,
    "constr_viol_tol": IPOPT_TOLERANCE,
    "compl_inf_tol": IPOPT_TOLERANCE,
    "bound_relax_factor": 0.0,
    "acceptable_iter": 0,
    "max_iter": IPOPT_ITERATIONS,
    "mu_strategy": "adaptive",
    "nlp_scaling_method": "none",
    "mumps_permuting_scaling": 0,
    "mumps_pivot_order": 2,
    "print_level": 0,
    "sb": "yes",
}

WARM = {
    "warm_start_init_point": "yes",
    "mu_init": WARM_BARRIER,
    "warm_start_bound_push": WARM_PUSH,
    "warm_start_bound_frac": WARM_PUSH,
    "warm_start_slack_bound_push": WARM_PUSH,
    "warm_start_slack_bound_frac": WARM_PUSH,
    "warm_start_mult_bound_push": WARM_PUSH,
}


def ipopt_options(settings: Settings, warm: bool) -> dict[str, Any]:
    """IPOPT's options for the settings; warm: whether the start is a solution nearby."""
    options: dict[str, Any] = IPOPT | (WARM if warm else {})
    if settings.tolerance:
        options |= dict.fromkeys(("tol", "constr_viol_tol", "compl_inf_tol", "dual_inf_tol"), settings.tolerance)
    if settings.hessian != "exact":
        options["hessian_approximation"] = settings.hessian
    return options


def graph_size(program: Program, x: Mapping[str, float]) -> int | None:
    """Number of nodes of the expressions of objectives and rows, whole-cycle rows and sums at one crank angle.

    x: variables, SI, of a design with the cycle's pieces; None where the mechanism does not assemble.
    """
    import casadi as ca

    sampler = sampler_at(program, x)
    if sampler is None:
        return None
    nlp = expressions(structure(program, sampler, 1))
    return int(ca.n_nodes(ca.vertcat(nlp.f, nlp.g, *nlp.lifts.recorder.formulas)))


NLPS, CACHE_SIZE = "NLPs", 32
"""Name of the built NLPs in a session, and how many it keeps; no study of many scenes uses more structures at a
time."""


class Buffered:
    """A CasADi function of dense numbers, called with arrays or floats; it reuses its memory in every call.

    A call without buffers converts arrays to CasADi matrices and back, which takes longer than most evaluations.
    """

    def __init__(self, function: Any) -> None:
        self._buffer, self._run = function.buffer()
        self._inputs = [np.zeros(function.nnz_in(k)) for k in range(function.n_in())]
        self._results = [np.zeros(function.nnz_out(k)) for k in range(function.n_out())]
        for k, array in enumerate(self._inputs):
            self._buffer.set_arg(k, array.data)
        for k, array in enumerate(self._results):
            self._buffer.set_res(k, array.data)
        patterns = [function.sparsity_out(k) for k in range(function.n_out())]
        self._shapes = [pattern.shape for pattern in patterns]
        self._places = [np.array(pattern.find(), dtype=np.intp) for pattern in patterns]

    def __call__(self, *arguments: Floats | float) -> tuple[Floats, ...]:
        """Values of the function, each as a matrix."""
        for array, argument in zip(self._inputs, arguments, strict=True):
            array[:] = argument
        self._run()
        results = []
        for values, shape, places in zip(self._results, self._shapes, self._places, strict=True):
            matrix = np.zeros(shape[0] * shape[1])
            matrix[places] = values
            results.append(matrix.reshape(shape, order="F"))
        return tuple(results)


class Transcription:
    """Built NLP; its solvers and derivatives are created at their first use.

    Lifted variables appear in `nlp` only; every other member is in the original variables and rows.
    """

    def __init__(self, nlp_structure: Structure) -> None:
        self.structure, self.rows = nlp_structure, nlp_structure.rows
        written = expressions(nlp_structure)
        self.nlp = {"x": written.x, "p": written.p, "f": written.f, "g": written.g}
        self._elimination = Elimination(written, self.rows) if written.lifts.variables else None
        self._solvers: dict[Hashable, Any] = {}
        self._derivatives: dict[str, Any] = {}
        self._buffered: dict[str, Buffered] = {}
        if self._elimination:
            self.nlp, self._derivatives = self._elimination.nlp, self._elimination.functions
        elif written.lifts.recorder.column.numel():
            self.nlp, self._derivatives = _written(written).functions(written.lifts.recorder)

    def solver(self, warm: bool, settings: Settings) -> Any:
        """IPOPT for this NLP, for a cold or a warm start."""
        import casadi as ca

        callback = settings.callback
        name = (warm, callback, settings.tolerance, settings.hessian)
        if name not in self._solvers:
            options: dict[str, Any] = {
                "ipopt": ipopt_options(settings, warm),
                "print_time": False,
                "show_eval_warnings": False,
                "calc_lam_p": False,
                "no_nlp_grad": True,
                "error_on_fail": False,
            }
            if callback is not None:
                sizes = (self.nlp["x"].numel(), self.nlp["g"].numel(), self.structure.layout.size)
                options["iteration_callback"] = callback.for_size(*sizes)
            solver = ca.nlpsol("solver", "ipopt", self.nlp, options | self._derivatives)
            if not self._derivatives:
                functions = {"grad_f": "nlp_grad_f", "jac_g": "nlp_jac_g", "hess_lag": "nlp_hess_l"}
                self._derivatives = {option: solver.get_function(made) for option, made in functions.items()}
            self._solvers[name] = EliminatedSolver(solver, self._elimination) if self._elimination else solver
        return self._solvers[name]

    @property
    def jacobian(self) -> Any:
        """Rows and their derivatives, as the solver computes them: (x, p) → (g, dg/dx)."""
        return self._elimination.jacobian if self._elimination else self._called("jac_g")

    @property
    def gradient(self) -> Any:
        """The objective and its derivatives: (x, p) → (f, df/dx)."""
        return self._elimination.gradient if self._elimination else self._gradient

    @property
    def curvature(self) -> Any:
        """Second derivatives of the Lagrangian: (x, p, weight of f, multipliers) → their upper triangle."""
        return self._elimination.curvature if self._elimination else self._curvature

    def _gradient(self, x: Floats, p: Floats) -> tuple[float, Floats]:
        value, slope = self._called("grad_f")(x, p)
        return float(value[0, 0]), slope

    def _curvature(self, x: Floats, p: Floats, weight: float, multipliers: Floats) -> Floats:
        (bends,) = self._called("hess_lag")(x, p, weight, multipliers)
        return bends

    def _called(self, name: str) -> Buffered:
        if name not in self._buffered:
            self._buffered[name] = Buffered(self._derivatives[name])
        return self._buffered[name]


def transcribe(
    program: Program,
    sampler: Sampler,
    slots: int,
    elastic: bool = False,
    on_build: Callable[[], None] | None = None,
) -> tuple[Transcription, bool]:
    """NLP of a program's structure, and whether it had to be built; on_build: called before it is built."""
    nlp_structure = structure(program, sampler, slots, elastic)

    def build() -> Transcription:
        if on_build:
            on_build()
        return Transcription(nlp_structure)

    nlp = sampler.session.cached(NLPS, CACHE_SIZE, nlp_structure.key, build)
    return nlp, nlp.structure is nlp_structure
