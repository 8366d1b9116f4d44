"""The engine on toys: what its answer says of the solver, of starts, of other optima and of what stands in the way."""

from dataclasses import replace

import pytest
from support import toy

from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Clash
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.search import multistart
from loomopt.solving.search.search import Search

BOWL = {"f": lambda v: (v["x"] - 1) ** 2 + v["y"] ** 2}
VALLEYS = {"f": lambda v: (v["x"] ** 2 - 1) ** 2 + v["x"] / 4 + v["y"] ** 2}
"""Least at x = −1.03, another valley at x = 0.97."""


def test_a_solved_toy_says_how():
    answer = toy.solve(toy.program("xy", BOWL), starts=None)
    assert (answer.status, answer.target) == ("optimal", "least")
    assert answer.message == "Least. No limit binds. The only optimum reached by 7 solves, 512 designs sampled."
    assert answer.design == pytest.approx({"x": 1.0, "y": 0.0}, abs=1e-12)
    assert list(answer.solver) == [
        "status", "iterations", "starts", "starts_at_best", "basins", "designs", "accuracy", "evaluations",
        "error_estimate",
    ]  # fmt: skip
    assert answer.solver["status"] == "Solve_Succeeded"
    assert (answer.solver["starts"], answer.solver["starts_at_best"], answer.solver["accuracy"]) == (7, 7, 1e-8)
    assert (answer.solver["basins"], answer.solver["designs"]) == (1, 512)
    assert answer.solver["iterations"] >= 1
    assert answer.solver["error_estimate"] == answer.certificate.error
    assert list(answer.time) == [
        "import_s", "build_s", "solve_s", "settle_s", "certify_s", "report_s", "total_s",
    ]  # fmt: skip
    assert all(seconds >= 0.0 for seconds in answer.time.values())
    assert answer.time["total_s"] >= sum(seconds for name, seconds in answer.time.items() if name != "total_s")
    assert answer.today.design == {"x": 0.5, "y": 0.5}
    assert answer.optima == (({"f": pytest.approx(0.0, abs=1e-12)}, 1),)


def test_every_optimum_that_starts_end_in_is_told_best_first():
    answer = toy.solve(toy.program("xy", VALLEYS), starts=12)
    assert answer.solver["starts"] == 12
    best, other = answer.optima
    assert best[0]["f"] == pytest.approx(answer.figures["f"], abs=1e-9)
    assert best[0]["f"] < other[0]["f"] - 0.4
    assert best[1] + other[1] == 12
    assert best[1] == answer.solver["starts_at_best"]
    assert answer.design["x"] < -1.0


def test_starts_are_told_as_they_come():
    texts = []
    toy.solve(toy.program("xy", BOWL), starts=3, on_start=lambda number, count: texts.append((number, count)))
    assert texts == [(1, 3), (2, 3), (3, 3)]


def test_an_answer_may_start_its_neighbour():
    program = toy.program("xy", BOWL)
    first = toy.solve(program)
    again = toy.solve(program, near=[first.point])
    assert again.design == pytest.approx(first.design, abs=1e-12)
    assert again.solver["starts"] == 1
    other = toy.program("xy", VALLEYS)
    away = toy.solve(other, near=[first.point], starts=1)
    assert away.design["x"] == pytest.approx(0.97, abs=0.02), "of another structure: no help"


CLASH = (("x", -1, 2.0), ("x", 1, 1.0))


def test_limits_that_clash_are_told_with_what_helps():
    answer = toy.solve(toy.program("xy", BOWL, limits=CLASH), starts=None)
    assert answer.status == "infeasible"
    assert answer.clash == ("x >= 2", "x <= 1")
    assert answer.certificate is None
    assert answer.point is None
    assert answer.solver["starts"] == 1 + 6, "its own start, then that, four of those looked at, and today's machine"
    assert answer.solver["starts_at_best"] == 0
    assert {relaxation.limit for relaxation in answer.relaxation} == {"x"}


def test_a_design_that_only_the_elastic_solve_finds_is_taken(monkeypatch):
    """Every start fails, the relaxation needs nothing: its design is solved from, and judged."""
    genuine, tried = exchange.solve, []

    def solve(program, start, settings, warm=None, elastic=None, known=None):
        if elastic:
            return Point({"x": 0.25, "y": 0.0}, "Solve_Succeeded", True)
        tried.append(dict(start))
        if start.get("x") == 0.25:
            return genuine(program, start, settings, warm)
        return Point(dict(start), "Restoration_Failed", False, iterations=7)

    monkeypatch.setattr(exchange, "solve", solve)
    answer = toy.solve(toy.program("xy", BOWL), starts=1)
    assert (answer.status, answer.solver["starts_at_best"]) == ("optimal", 1)
    assert tried == [{"x": 0.5, "y": 0.5}, {"x": 0.25, "y": 0.0}]


def test_where_nothing_helps_the_solvers_own_word_is_passed_on(monkeypatch):
    failed = Point({"x": 0.5, "y": 0.5}, "Restoration_Failed", False, iterations=7)
    monkeypatch.setattr(exchange, "solve", lambda *_, **__: failed)
    monkeypatch.setattr("loomopt.solving.search.elastic.clash", lambda *_: Clash())
    answer = toy.solve(toy.program("xy", BOWL, limits=(("x", -1, 3.0),)))
    assert (answer.status, answer.solver["status"]) == ("failed", "Restoration_Failed")
    assert answer.design_is == "where a solve stopped"
    assert answer.solver["iterations"] % 7 == 0
    assert answer.solver["iterations"] >= 8 * 7
    assert answer.message.startswith("The solver failed (Restoration_Failed): IPOPT could not get back")
    assert answer.design == {"x": 0.5, "y": 0.5}


def test_a_point_that_is_not_certified_is_told_with_the_reason():
    hs13 = {"f": lambda v: (v["x"] - 2) ** 2 + v["y"] ** 2, "g": lambda v: (1 - v["x"]) ** 3 - v["y"]}
    answer = toy.solve(toy.program("xy", hs13, limits=(("g", -1, 0.0), ("y", -1, 0.0))))
    assert answer.status == "uncertified"
    assert answer.message.startswith("A design was reached but not certified: ")
    assert answer.solver["starts"] >= 8


def test_the_callback_counts_iterations():
    seen: list[int] = []
    toy.solve(toy.program("xy", VALLEYS), on_iteration=seen.append)
    assert seen[:3] == [0, 1, 2]


def test_a_program_is_solved_without_its_scene():
    program = toy.program("xy", BOWL)
    search = Search(toy.ToyJob(program), program, Settings())
    result = multistart.run_search(search)
    assert result.passed
    assert result.best.x == pytest.approx({"x": 1.0, "y": 0.0}, abs=1e-12)
    again = multistart.run_search(search, near=[result.candidates[0].point])
    assert (again.passed, len(again.candidates)) == (True, 1)
    other = replace(result.candidates[0].point, structure="another")
    assert multistart.run_search(search, near=[other]).candidates[0].point.iterations > 0


def test_todays_machine_is_evaluated_when_it_is_asked_for(monkeypatch):
    answer = toy.solve(toy.program("xy", BOWL))
    requests = []
    monkeypatch.setattr(report, "evaluation", lambda *_: requests.append(1))
    assert requests == []
    assert answer.today is None
    assert answer.today is None
    assert requests == [1]
