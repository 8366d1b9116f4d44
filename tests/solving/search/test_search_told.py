"""What a search says of itself claims no more than was done."""

from dataclasses import replace

import pytest
from searches import candidate, empty

from loomopt.solving.answer import report
from loomopt.solving.nlp.point import Point
from loomopt.solving.search.search import Candidate

BEST = candidate(1, 2, x=1.0)._replace(value=1002.0)


def search(*candidates, **more):
    return replace(empty(candidates=(BEST, *candidates)), best=BEST, **more)


def left(value):
    return Candidate(Point({"x": 9.0, "y": 0.0}, "Beaten", False, value=value), (), value)


@pytest.mark.parametrize(
    ("made", "sentence"),
    [
        (search(), "The only optimum reached by 1 solve."),
        (search(left(1002.0), screened=512), "The only optimum reached by 2 solves, 512 designs sampled."),
        (search(candidate(1, 3, x=2.0), left(7.0)), "Best of 2 optima reached by 3 solves."),
        (search(stayed=True), "Solved again near the given answer; other basins were not searched."),
    ],
)
def test_what_was_done_is_told(made, sentence):
    assert report._search_extent(made) == sentence


def test_why_no_other_basin_was_looked_for():
    made = search()
    made = replace(made, program=replace(made.program, uniqueness_reason="it is linear"))
    assert report._search_extent(made) == "Other basins were not searched: it is linear."


def test_solves_that_ended_in_the_best_are_those_there_and_those_left_at_its_value():
    far, near = left(1003.0), left(1002.0 + 1e-8)
    counts = report._counts(search(far, near, candidate(1, 2, x=1.0), candidate(1, 5, x=3.0)))
    assert (counts["starts"], counts["starts_at_best"], counts["basins"]) == (5, 3, 2)


def test_without_an_optimum_there_is_none_to_count():
    counts = report._counts(empty(candidates=(left(3.0),)))
    assert (counts["starts"], counts["starts_at_best"], counts["basins"]) == (1, 0, 0)
