"""What an answer becomes as JSON data."""

import math
from dataclasses import replace

import pytest

from loomopt.solving.answer.solution import Evaluated, Finding, Relaxation, Solution, certificate_dict
from loomopt.solving.certificate.records import Certificate, Level

SATISFIED, BROKEN = Finding("p", 1.0, None, 2.0, True), Finding("q", 3.0, None, 2.0, False)


def solution(**more):
    return Solution("toy", (), {"x": 1.0}, {"f": 2.0}, {"x": "1"}, (SATISFIED,), **more)


def test_other_optima_are_told_only_where_there_are_any():
    best, other = ({"f": 2.0}, 3), ({"f": math.inf}, 1)
    assert "optima" not in solution().as_dict()
    assert "optima" not in solution(optima=(best,)).as_dict()
    report = solution(optima=(best, other)).as_dict()["optima"]
    assert report == [{"figures": {"f": 2.0}, "starts": 3}, {"figures": {"f": None}, "starts": 1}]


def test_what_helps_is_told_only_where_limits_clash():
    assert "clash" not in solution(clash=("p",)).as_dict()
    relaxation = Relaxation("p", "max", 1.0, 2.0, True, "p <= 1 -> 2")
    report = solution(clash=("p <= 1",), relaxation=(relaxation,)).as_dict()
    assert (report["clash"], report["relaxation"]) == (["p <= 1"], [relaxation._asdict()])


@pytest.mark.parametrize(("limits", "admissible"), [((), True), ((SATISFIED,), True), ((SATISFIED, BROKEN), False)])
def test_a_design_is_admissible_where_every_limit_holds(limits, admissible):
    assert Evaluated("toy", (), {}, {}, {}, limits).admissible == admissible


def test_a_solution_that_says_nothing_failed():
    answer = solution()
    assert (answer.status, answer.message, answer.today, answer.point) == ("failed", "", None, None)
    assert list(answer.as_dict())[:4] == ["problem", "target", "status", "message"]


def test_figures_that_are_no_number_are_none():
    figures = {"a": math.nan, "b": -math.inf, "c": None, "d": 0.5}
    assert Evaluated("toy", (), {}, figures, {}, ()).as_dict()["figures"] == {
        "a": None,
        "b": None,
        "c": None,
        "d": 0.5,
    }


def test_a_certificate_as_data():
    level = Level("f", 1e-9, 2e-9, 3.0)
    certificate = Certificate(True, (), (level,), 1e-10, 1e-11, True, False, tie_breaks=("s",))
    certificate = replace(certificate, by="jets", whole_cycle="bounded")
    assert certificate_dict(certificate) == {
        "passed": True,
        "by": "jets",
        "reasons": [],
        "levels": [{"objective": "f", "stationarity": 1e-9, "complementarity": 2e-9}],
        "feasibility": 1e-10,
        "whole_cycle": {"violation": 1e-11, "by": "bounded"},
        "minimum": True,
        "unique": False,
        "settled": ["s"],
    }
