"""An NLP whose lifted variables are eliminated: its own variables x and rows alone, with exact derivatives.

Of rows g(x, z) and definitions d(x, z) = 0, z = z(x): dg/dx = g_x + g_z Z, Z = dz/dx = −d_z⁻¹ d_x, where d_z is unit
lower triangular, so that Z is a forward substitution; and the Lagrangian's second derivatives in x are those in (x, z),
taken on both sides along (I, Z), with the definitions' own multipliers −d_z⁻ᵀ (f_z + g_zᵀ λ) [Nocedal and Wright,
Numerical Optimization, 2nd ed., section 15.3].
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from loomopt.physics.cycle import Floats
from loomopt.solving.nlp.expressions import Expressions, Lifted
from loomopt.solving.nlp.rows import RowMap


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


@dataclass(frozen=True)
class _Local:
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
        self._last: tuple[Any, Any, _Local] | None = None

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
        if self._last is None or not (np.array_equal(self._last[0], x) and np.array_equal(self._last[1], p)):
            full = np.concatenate([x, self.start(x, p)])
            rows, slopes = self.functions["jac_g"](full, p)
            entries = np.array(slopes.nonzeros())
            local = _Local(full, np.asarray(rows, dtype=np.float64).ravel(), entries, self._follow(entries))
            self._last = np.array(x), np.array(p), local
        return self._last[2]

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
