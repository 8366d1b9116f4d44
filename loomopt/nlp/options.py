"""How IPOPT is asked to work."""

from typing import Any

from loomopt.nlp.point import Settings

IPOPT = {
    "tol": 1e-11,
    "dual_inf_tol": 1e-9,
    "constr_viol_tol": 1e-11,
    "compl_inf_tol": 1e-11,
    "bound_relax_factor": 0.0,
    "acceptable_iter": 0,
    "max_iter": 300,
    "mu_strategy": "adaptive",
    "nlp_scaling_method": "none",
    "mumps_permuting_scaling": 0,
    "mumps_pivot_order": 2,
    "print_level": 0,
    "sb": "yes",
}
WARM = {
    "warm_start_init_point": "yes",
    "mu_init": 1e-8,
    "warm_start_bound_push": 1e-10,
    "warm_start_bound_frac": 1e-10,
    "warm_start_slack_bound_push": 1e-10,
    "warm_start_slack_bound_frac": 1e-10,
    "warm_start_mult_bound_push": 1e-10,
}


def ipopt_options(settings: Settings, warm: bool) -> dict[str, Any]:
    """Return IPOPT's options, with those that a study of methods changes; warm: from a solution nearby."""
    found: dict[str, Any] = IPOPT | (WARM if warm else {})
    if settings.tolerance:
        found |= dict.fromkeys(("tol", "constr_viol_tol", "compl_inf_tol", "dual_inf_tol"), settings.tolerance)
    if settings.hessian != "exact":
        found["hessian_approximation"] = settings.hessian
    return found
