"""From a program's structure to one parametric NLP: built once, solved for any numbers."""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Floats
from loomopt.solving.nlp.expressions import Expressions, Lifted, expressions
from loomopt.solving.nlp.point import Settings, sampler_at
from loomopt.solving.nlp.rows import RowMap, Structure, structure


class Entries:
    """The entries of a sparse matrix of CasADi's by row, as arrays; values follow with each call."""

    def __init__(self, sparsity: Any, rows: range, columns: range) -> None:
        row, column = np.array(sparsity.row(), dtype=np.intp), np.array(sparsity.get_col(), dtype=np.intp)
        kept = (row >= rows.start) & (row < rows.stop) & (column >= columns.start) & (column < columns.stop)
        place = np.flatnonzero(kept)
        self.place = place[np.lexsort((column[place], row[place]))]
        self.row, self.column = row[self.place] - rows.start, column[self.place] - columns.start
        self.shape = len(rows), len(columns)
        self.ends = np.searchsorted(self.row, np.arange(len(rows) + 1))

    def dense(self, values: Floats) -> Floats:
        """Return the matrix; values: of all entries, as CasADi orders them."""
        found = np.zeros(self.shape)
        found[self.row, self.column] = values[self.place]
        return found

    def times(self, values: Floats, matrix: Floats) -> Floats:
        """Return its product with a dense matrix."""
        found = np.zeros((self.shape[0], *matrix.shape[1:]))
        filled = np.flatnonzero(np.diff(self.ends))
        if len(filled):
            terms = values[self.place].reshape(-1, *[1] * (matrix.ndim - 1)) * matrix[self.column]
            found[filled] = np.add.reduceat(terms, self.ends[filled])
        return found

    def transposed_times(self, values: Floats, vector: Floats) -> Floats:
        """Return the product of its transpose with a vector."""
        found = np.zeros(self.shape[1])
        np.add.at(found, self.column, values[self.place] * vector[self.row])
        return found


class _Local(NamedTuple):
    """An NLP at one point: values and entries of all rows' slopes, and how the lifted variables follow, Z."""

    full: Floats
    rows: Floats
    entries: Floats
    follow: Floats


def _of(picked: Sequence[Lifted], x: Any) -> Any:
    """Return the slopes of the rows of choices, which read so many that as rows among others they would cost most."""
    import casadi as ca

    columns = {id(each.options): each.options for each in picked}
    slopes = {key: ca.jacobian(options, x) for key, options in columns.items()}
    rows = [ca.mtimes(each.at.T, slopes[id(each.options)]) for each in picked]
    return ca.jacobian(ca.vertcat(*(each.symbol for each in picked)), x) - ca.vertcat(*rows)


class Elimination:
    """An NLP's functions of its own variables and rows, from those with lifted variables, which IPOPT is given."""

    def __init__(self, written: Expressions, own: RowMap) -> None:
        import casadi as ca

        lifted = written.lifts.defined
        z, worth = ca.vertcat(*(each.symbol for each in lifted)), ca.vertcat(*(each.worth for each in lifted))
        self.full = replace(own, lifted=len(lifted))
        x, lam_f, lam_g = ca.vertcat(written.x, z), ca.SX.sym("f"), ca.SX.sym("g", self.full.size)
        g = ca.vertcat(written.g, z - worth)
        self.nlp = {"x": x, "p": written.p, "f": written.f, "g": g}
        explicit, _ = ca.substitute_inplace(
            [each.symbol for each in lifted], [each.worth for each in lifted], [], False
        )
        self._start = ca.Function("start", [written.x, written.p], [ca.vertcat(*explicit)])
        named = ca.vertcat(*(each.symbol - each.worth for each in written.lifts.named))
        defining = ca.vertcat(ca.jacobian(named, x), _of(written.lifts.picked, x))
        slopes = ca.vertcat(ca.jacobian(written.g, x), defining)
        priced = ca.dot(lam_g, g) if ca.depends_on(defining, x) else ca.dot(self.full.own_rows(lam_g), written.g)
        bend: Any = ca.triu(ca.hessian(lam_f * written.f + priced, x)[0])
        self.functions = {
            "grad_f": ca.Function("nlp_grad_f", [x, written.p], [written.f, ca.gradient(written.f, x)]),
            "jac_g": ca.Function("nlp_jac_g", [x, written.p], [g, slopes]),
            "hess_lag": ca.Function("nlp_hess_l", [x, written.p, lam_f, lam_g], [bend]),
        }
        all_rows, columns, pattern = range(g.numel()), range(x.numel()), slopes.sparsity()
        rows, definitions = self.full.own_rows(all_rows), self.full.definitions(all_rows)
        self._g_x = Entries(pattern, rows, self.full.own_variables(columns))
        self._g_z = Entries(pattern, rows, self.full.lifted_variables(columns))
        self._d_x = Entries(pattern, definitions, self.full.own_variables(columns))
        self._d_z = Entries(pattern, definitions, self.full.lifted_variables(columns))
        self._bends = Entries(bend.sparsity(), columns, columns)

    def start(self, x: Floats, p: Floats) -> Floats:
        """Return what the lifted variables are worth."""
        return np.asarray(self._start(x, p), dtype=np.float64).ravel()

    def jacobian(self, x: Floats, p: Floats) -> tuple[Floats, Floats]:
        """Return the rows and their first derivatives."""
        at = self._at(x, p)
        return self.full.own_rows(at.rows), self._g_x.dense(at.entries) + self._g_z.times(at.entries, at.follow)

    def gradient(self, x: Floats, p: Floats) -> tuple[float, Floats]:
        """Return the objective and its first derivatives."""
        at = self._at(x, p)
        value, slope = self._slope(at, p)
        return value, self.full.own_variables(slope) + self.full.lifted_variables(slope) @ at.follow

    def curvature(self, x: Floats, p: Floats, weight: float, multipliers: Floats) -> Floats:
        """Return the second derivatives of the Lagrangian, their upper triangle."""
        at = self._at(x, p)
        more = self.prices(x, p, weight, multipliers)
        said = self.functions["hess_lag"](at.full, p, weight, np.concatenate([multipliers, more]))
        values = np.array(said.nonzeros())
        along = np.concatenate([np.eye(at.follow.shape[1]), at.follow])
        half = along.T @ self._bends.times(values, along)
        diagonal = self._bends.row == self._bends.column
        on = np.zeros(len(along))
        on[self._bends.row[diagonal]] = values[self._bends.place[diagonal]]
        found: Floats = np.triu(half + half.T - along.T @ (on[:, None] * along))
        return found

    def prices(self, x: Floats, p: Floats, weight: float, multipliers: Floats) -> Floats:
        """Return the definitions' multipliers, from those of the rows: nothing is to be gained by a lifted variable."""
        at = self._at(x, p)
        slope: Floats = self.full.lifted_variables(self._slope(at, p)[1])
        left: Floats = -weight * slope - self._g_z.transposed_times(at.entries, multipliers)
        entries, ends = self._d_z, self._d_z.ends
        values = at.entries[entries.place]
        for k in range(self.full.lifted - 1, -1, -1):
            part = slice(ends[k], ends[k + 1] - 1)
            left[entries.column[part]] -= values[part] * left[k]
        return left

    def _slope(self, at: _Local, p: Floats) -> tuple[float, Floats]:
        value, slope = self.functions["grad_f"](at.full, p)
        return float(value), np.asarray(slope, dtype=np.float64).ravel()

    def _at(self, x: Floats, p: Floats) -> _Local:
        full = np.concatenate([x, self.start(x, p)])
        rows, slopes = self.functions["jac_g"](full, p)
        entries = np.array(slopes.nonzeros())
        return _Local(full, np.asarray(rows, dtype=np.float64).ravel(), entries, self._follow(entries))

    def _follow(self, entries: Floats) -> Floats:
        """Return dz/dx: each row from those before it."""
        found = -self._d_x.dense(entries)
        column, ends, values = self._d_z.column, self._d_z.ends, entries[self._d_z.place]
        for k in range(self.full.lifted):
            # The last entry of a row is its own, which is 1.
            part = slice(ends[k], ends[k + 1] - 1)
            found[k] -= values[part] @ found[column[part]]
        return found


class EliminatedSolver:
    """IPOPT on an NLP with lifted variables, called as if it had none."""

    def __init__(self, made: Any, eliminated: Elimination) -> None:
        self.made, self.eliminated = made, eliminated

    def stats(self) -> Mapping[str, Any]:
        """Return what IPOPT says of its last run."""
        found: Mapping[str, Any] = self.made.stats()
        return found

    def __call__(self, **arguments: Any) -> dict[str, Floats]:
        """Return IPOPT's answer: f, and x, lam_x, lam_g of the NLP's own variables and rows."""
        of, x, p = self.eliminated, arguments["x0"], arguments["p"]
        free, none = np.full(of.full.lifted, np.inf), np.zeros(of.full.lifted)
        more = {"x0": of.start(x, p), "lbx": -free, "ubx": free, "lbg": none, "ubg": none}
        if "lam_g0" in arguments:
            more |= {"lam_x0": none, "lam_g0": of.prices(x, p, 1.0, arguments["lam_g0"])}
        said = self.made(**arguments | {name: np.concatenate([arguments[name], part]) for name, part in more.items()})
        found = {name: np.asarray(said[name], dtype=np.float64).ravel() for name in ("x", "lam_x", "lam_g")}
        own = {name: of.full.own_variables(found[name]) for name in ("x", "lam_x")}
        return {**own, "lam_g": of.full.own_rows(found["lam_g"]), "f": np.asarray(said["f"], dtype=np.float64)}


IPOPT_TOLERANCE, IPOPT_SLOPE, IPOPT_ITERATIONS = 1e-11, 1e-9, 300
"""Where IPOPT stops: rows and complementarity three decades below the usual accuracy, slopes three below STATIONARY;
and where it gives up: no packaged target takes it a hundred iterations from its first start."""

WARM_BARRIER, WARM_PUSH = 1e-8, 1e-10
"""Barrier that a warm start begins with, which keeps a row of multiplier 1 so far from its bound, and how far a start
is pushed inside: less than what IPOPT itself left."""

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
    """Return IPOPT's options, with those that a study of methods changes; warm: from a solution nearby."""
    options: dict[str, Any] = IPOPT | (WARM if warm else {})
    if settings.tolerance:
        options |= dict.fromkeys(("tol", "constr_viol_tol", "compl_inf_tol", "dual_inf_tol"), settings.tolerance)
    if settings.hessian != "exact":
        options["hessian_approximation"] = settings.hessian
    return options


def graph_size(program: Program, x: Mapping[str, float]) -> int | None:
    """Return how many nodes objectives and rows are made of, a whole-cycle row at one crank angle.

    x: variables, SI, at which the cycle has the pieces that are meant; None where the mechanism does not assemble.
    """
    import casadi as ca

    sampler = sampler_at(program, x)
    if sampler is None:
        return None
    made = expressions(structure(program, sampler, 1))
    return int(ca.n_nodes(ca.vertcat(made.f, made.g)))


NLPS, CACHE_SIZE = "NLPs", 32
"""What a session calls built NLPs, and how many it keeps; a study of many scenes meets no more structures at a time."""


class Buffered:
    """A CasADi function of dense numbers, called with arrays or floats: it reads and writes the same memory every time.

    A call with arrays makes matrices of CasADi's own of them, and arrays of what comes out: that takes longer than most
    evaluations.
    """

    def __init__(self, function: Any) -> None:
        self._buffer, self._run = function.buffer()
        self._given = [np.zeros(function.nnz_in(k)) for k in range(function.n_in())]
        self._found = [np.zeros(function.nnz_out(k)) for k in range(function.n_out())]
        for k, own in enumerate(self._given):
            self._buffer.set_arg(k, own.data)
        for k, own in enumerate(self._found):
            self._buffer.set_res(k, own.data)
        patterns = [function.sparsity_out(k) for k in range(function.n_out())]
        self._shapes = [pattern.shape for pattern in patterns]
        self._places = [np.array(pattern.find(), dtype=np.intp) for pattern in patterns]

    def __call__(self, *arguments: Floats | float) -> tuple[Floats, ...]:
        """Return what the function does, all of it as matrices."""
        for own, given in zip(self._given, arguments, strict=True):
            own[:] = given
        self._run()
        results = []
        for values, shape, places in zip(self._found, self._shapes, self._places, strict=True):
            found = np.zeros(shape[0] * shape[1])
            found[places] = values
            results.append(found.reshape(shape, order="F"))
        return tuple(results)


class Transcription:
    """One built NLP, with its solvers and derivatives as they are first asked for.

    Where it has lifted variables, `nlp` has them, and all else does as if it had none.
    """

    def __init__(self, made_of: Structure) -> None:
        self.structure, self.rows = made_of, made_of.rows
        written = expressions(made_of)
        self.nlp = {"x": written.x, "p": written.p, "f": written.f, "g": written.g}
        self._eliminated = Elimination(written, self.rows) if written.lifts.defined else None
        self._solvers: dict[Hashable, Any] = {}
        self._derivatives: dict[str, Any] = {}
        self._buffered: dict[str, Buffered] = {}
        if self._eliminated:
            self.nlp, self._derivatives = self._eliminated.nlp, self._eliminated.functions

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
            self._solvers[name] = EliminatedSolver(solver, self._eliminated) if self._eliminated else solver
        return self._solvers[name]

    @property
    def jacobian(self) -> Any:
        """Rows and their derivatives, as the solver computes them: (x, p) → (g, dg/dx)."""
        return self._eliminated.jacobian if self._eliminated else self._called("jac_g")

    @property
    def gradient(self) -> Any:
        """The objective and its derivatives: (x, p) → (f, df/dx)."""
        return self._eliminated.gradient if self._eliminated else self._gradient

    @property
    def curvature(self) -> Any:
        """Second derivatives of the Lagrangian: (x, p, weight of f, multipliers) → their upper triangle."""
        return self._eliminated.curvature if self._eliminated else self._curvature

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
    before: Callable[[], None] | None = None,
) -> tuple[Transcription, bool]:
    """Return the NLP of a program's structure, and whether it had to be built; before: called where it has to be."""
    wanted = structure(program, sampler, slots, elastic)

    def built() -> Transcription:
        if before:
            before()
        return Transcription(wanted)

    nlp = sampler.session.kept(NLPS, CACHE_SIZE, wanted.key, built)
    return nlp, nlp.structure is wanted
