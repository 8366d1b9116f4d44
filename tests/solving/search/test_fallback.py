"""No answer is worse than an admissible design that is known, whatever solves end in."""

from dataclasses import replace

import numpy as np
import pytest
from support import toy

from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.search import fallback, multistart
from loomopt.solving.search.search import Candidate, Search

ROWS = {"f": lambda v: v["x"] ** 4 - 2 * v["x"] ** 2 + 0.3 * v["x"], "g": lambda v: -v["x"]}
"""Least at x = −1.035, f = −1.305; a second valley at x = 0.961, f = −0.706; between them a ridge at 0.076."""
LEAST, SECOND = np.sort(np.roots([4, 0, -4, 0.3]))[[0, 2]]
BOUNDS = {"x": (-2.0, 2.0)}


def search(today, start=1.5, limits=()):
    program = toy.program("x", ROWS, limits=limits, start={"x": start}, bounds=BOUNDS)
    return Search(toy.ToyJob(program), program, Settings(), {"x": today})


def test_a_certified_optimum_worse_than_todays_machine_is_left_for_the_one_that_today_leads_to():
    result = multistart.run_search(search(-0.8), starts=1)
    assert result.passed
    assert result.best.x["x"] == pytest.approx(LEAST, abs=1e-8)
    assert not result.substitute


def test_a_machine_of_today_that_breaks_a_limit_counts_for_nothing():
    result = multistart.run_search(search(-0.8, limits=(("g", 1, 0.5),)), starts=1)
    assert result.passed
    assert result.best.x["x"] == pytest.approx(SECOND, abs=1e-8)


@pytest.fixture
def stuck(monkeypatch):
    """Let every solve end as given, without a design or at one."""

    def ends(reached, x):
        def solve(program, start, settings, warm=None, elastic=None, known=None):
            return Point({"x": x}, "Maximum_Iterations_Exceeded", reached)

        monkeypatch.setattr(exchange, "solve", solve)

    return ends


@pytest.mark.parametrize("reached", [False, True])
def test_where_no_solve_ends_in_anything_better_the_answer_is_todays_machine_not_certified(stuck, reached):
    stuck(reached, 1.9)
    program = toy.program("x", ROWS, start={"x": -0.8}, bounds=BOUNDS)
    answer = toy.solve(program, starts=1)
    assert answer.status == "uncertified"
    assert answer.design == {"x": -0.8}
    assert answer.message.startswith("No solve ended in a better design that is certified; this is the best admissible")
    assert "today's machine" in answer.message


def test_a_best_that_breaks_a_limit_gives_way_to_the_best_admissible_design_of_all_solves(stuck):
    stuck(False, 0.0)
    begun = search(today=-2.0, limits=(("g", 1, 1.0),))
    ends = [-1.1, 1.8, 1.2]
    points = [Point({"x": x}, "Solve_Succeeded", True) for x in ends]
    candidates = tuple(Candidate(p, (ROWS["f"](p.x),), ROWS["f"](p.x)) for p in points)
    result = fallback.no_worse(replace(begun, candidates=candidates, best=candidates[0]))
    assert result.best.x == {"x": 1.2}
    assert result.substitute
    assert not result.passed
