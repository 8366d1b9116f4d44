"""From a program's structure to one parametric NLP: built once, solved for any numbers."""

from collections.abc import Callable, Hashable, Mapping
from typing import Any

from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.solving.nlp.elimination import EliminatedSolver, Elimination
from loomopt.solving.nlp.expressions import expressions
from loomopt.solving.nlp.point import Settings, sampler_at
from loomopt.solving.nlp.structure import Structure, structure

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
        return self._eliminated.jacobian if self._eliminated else self._derivatives["jac_g"]

    @property
    def gradient(self) -> Any:
        """The objective and its derivatives: (x, p) → (f, df/dx)."""
        return self._eliminated.gradient if self._eliminated else self._derivatives["grad_f"]

    @property
    def curvature(self) -> Any:
        """Second derivatives of the Lagrangian: (x, p, weight of f, multipliers) → their upper triangle."""
        return self._eliminated.curvature if self._eliminated else self._derivatives["hess_lag"]


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
