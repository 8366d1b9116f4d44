"""What IPOPT is told."""

from loomopt.solving.nlp.point import Settings
from loomopt.solving.nlp.transcribe import IPOPT, ipopt_options

TOLERANCES = ("tol", "constr_viol_tol", "compl_inf_tol", "dual_inf_tol")


def test_a_solve_ends_three_decades_below_what_is_promised():
    said = ipopt_options(Settings(), warm=False)
    assert [said[name] for name in TOLERANCES] == [1e-11, 1e-11, 1e-11, 1e-9]
    assert said["bound_relax_factor"] == 0.0, "no limit is loosened"
    assert said["acceptable_iter"] == 0, "nothing less is taken"
    assert said["nlp_scaling_method"] == "none", "rows have their scales"
    assert (said["max_iter"], said["print_level"], said["sb"]) == (300, 0, "yes")
    assert said["mumps_permuting_scaling"] == 0
    assert said["mumps_pivot_order"] == 2
    assert "mu_init" not in said


def test_a_warm_start_begins_near_its_end():
    said = ipopt_options(Settings(), warm=True)
    assert said["warm_start_init_point"] == "yes"
    assert said["mu_init"] == 1e-8
    assert {said[name] for name in said if name.startswith("warm_start_") and name != "warm_start_init_point"} == {
        1e-10
    }
    assert {name: said[name] for name in IPOPT} == IPOPT


def test_a_study_may_ask_for_other_tolerances_and_guessed_second_derivatives():
    said = ipopt_options(Settings(tolerance=1e-4, hessian="limited-memory"), warm=False)
    assert {said[name] for name in TOLERANCES} == {1e-4}
    assert said["hessian_approximation"] == "limited-memory"
    assert "hessian_approximation" not in ipopt_options(Settings(), warm=False)
    assert IPOPT["tol"] == 1e-11, "what is asked once is not kept"
