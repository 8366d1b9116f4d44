"""How IPOPT is asked to work."""

from typing import Any

from loomopt.nlp.point import Settings
from loomopt.physics.tolerances import IPOPT_ITERATIONS, IPOPT_SLOPE, IPOPT_TOLERANCE, WARM_BARRIER, WARM_PUSH

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
