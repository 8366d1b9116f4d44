"""Free numbers that serve no level of a target: held in the search, then taken back as far as limits hold."""

import functools
from dataclasses import replace

import pytest
from support import toy

from loomopt.solving.search import inactive_variables

BOUNDS = {"x": (0.5, 9.0), "y": (0.5, 9.0), "z": (0.0, 9.0)}
TODAY = {"x": 2.0, "y": 2.0, "z": 5.0}
ROWS = {
    "f": lambda v: v["x"] + v["y"],
    "product": lambda v: v["x"] * v["y"],
    "room": lambda v: v["z"] - v["x"],
    "reach": lambda v: v["x"] + v["z"],
    "sum": lambda v: v["x"] + v["y"] + v["z"],
}
"""Least x + y with x y ≥ 4, so x = y = 2; z is in no objective."""


def program(*limits, objectives=("f",), waves=None, any_numbers=True):
    problem = toy.program(
        ("x", "y", "z"), ROWS, waves, (("product", -1, 4.0), *limits), objectives, start=TODAY, bounds=BOUNDS
    )
    return replace(problem, any_numbers=any_numbers)


def solved(values):
    answer = toy.solve(values, starts=None)
    assert answer.certificate.passed
    return answer.design, answer.certificate


CASES = {
    "no limit reads it: today's": ((), 5.0),
    "a limit has room for less of it: as near to today's as that leaves": ((("room", 1, 0.25),), 2.25),
    "a limit asks for more of it": ((("reach", -1, 8.0),), 6.0),
    "a limit has room for today's": ((("room", 1, 4.0),), 5.0),
}


@pytest.mark.parametrize(("limits", "value"), CASES.values(), ids=CASES)
def test_a_number_that_serves_no_level_ends_as_near_to_todays_as_limits_allow(limits, value):
    design, certificate = solved(program(*limits))
    assert design["x"] == pytest.approx(2, abs=1e-6)
    assert design["z"] == pytest.approx(value, abs=1e-6)
    assert "z: serves no level, least change from today" in certificate.tie_breaks
    assert not certificate.open


@pytest.mark.parametrize(
    "limits", [(("room", 1, 0.25), ("reach", -1, 3.0)), (("sum", 0, 7.0),)], ids=["both ways", "an equality"]
)
def test_where_limits_ask_both_more_and_less_of_it_it_is_sought_as_any_other(limits):
    problem = program(*limits)
    design, certificate = solved(problem)
    assert not any("serves no level" in tie_break for tie_break in certificate.tie_breaks)
    assert design["x"] + design["y"] == pytest.approx(4, abs=1e-8)
    plain, _ = solved(replace(problem, any_numbers=False))
    assert design == plain


def test_a_number_that_only_moves_where_a_wave_is_read_serves_no_level():
    """The wave's own variables do; one that nothing reads does not, though all nodes move alike."""
    waves = {"wave": lambda m, v, phi: v["x"] * (2 + m.sin(phi)) + v["y"]}
    problem = program(objectives=("peak wave",), waves=waves)
    design, certificate = solved(problem)
    assert design["z"] == pytest.approx(5, abs=1e-9)
    assert any("serves no level" in tie_break for tie_break in certificate.tie_breaks)


def test_a_program_whose_every_number_serves_stays_itself_and_so_does_one_of_a_jobs_own_numbers():
    requests: list[object] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            inactive_variables, "fix_inactive", functools.partial(_noted, requests, inactive_variables.fix_inactive)
        )
        solved(program(objectives=("sum",), any_numbers=True))
        solved(program(any_numbers=False))
    assert requests == [None]


def _noted(request, function, search, unread):
    result = function(search, unread)
    request.append(result)
    return result


def test_a_wrong_guess_costs_a_second_search_and_no_answer():
    """Held at the end where the limits ask most, the target has no answer; the whole program has."""
    problem = program(("room", 1, 0.25))

    def worst(search, unread):
        fixed = (v._replace(lower=9.0, upper=9.0, range=(9.0, 9.0)) if v.name == "z" else v for v in problem.variables)
        return replace(search.program, variables=tuple(fixed))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(inactive_variables, "fix_inactive", worst)
        design, _ = solved(problem)
    assert design["x"] + design["y"] == pytest.approx(4, abs=1e-8)
