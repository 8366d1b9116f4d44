"""What IPOPT is told."""

from loomopt.solving.nlp.point import Settings
from loomopt.solving.nlp.transcribe import IPOPT, ipopt_options

TOLERANCES = ("tol", "constr_viol_tol", "compl_inf_tol", "dual_inf_tol")


def test_a_solve_ends_three_decades_below_what_is_promised():
    message = ipopt_options(Settings(), warm=False)
    assert [message[name] for name in TOLERANCES] == [1e-11, 1e-11, 1e-11, 1e-9]
    assert message["bound_relax_factor"] == 0.0, "no limit is loosened"
    assert message["acceptable_iter"] == 0, "nothing less is taken"
    assert message["nlp_scaling_method"] == "none", "rows have their scales"
    assert (message["max_iter"], message["print_level"], message["sb"]) == (300, 0, "yes")
    assert message["mumps_permuting_scaling"] == 0
    assert message["mumps_pivot_order"] == 2
    assert "mu_init" not in message


def test_a_warm_start_begins_near_its_end():
    message = ipopt_options(Settings(), warm=True)
    assert message["warm_start_init_point"] == "yes"
    assert message["mu_init"] == 1e-8
    assert {
        message[name] for name in message if name.startswith("warm_start_") and name != "warm_start_init_point"
    } == {1e-10}
    assert {name: message[name] for name in IPOPT} == IPOPT


def test_a_study_may_ask_for_other_tolerances_and_guessed_second_derivatives():
    message = ipopt_options(Settings(tolerance=1e-4, hessian="limited-memory"), warm=False)
    assert {message[name] for name in TOLERANCES} == {1e-4}
    assert message["hessian_approximation"] == "limited-memory"
    assert "hessian_approximation" not in ipopt_options(Settings(), warm=False)
    assert IPOPT["tol"] == 1e-11, "what is asked once is not kept"
