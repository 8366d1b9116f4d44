"""What the engine counts and times, where no start assembles and where limits clash too."""

from unittest import mock

import pytest
from support import toy

from loomopt.jobs import registry
from loomopt.solving.answer.report import evaluate
from loomopt.solving.answer.solution import Clash
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Point

BOWL = {"f": lambda v: (v["x"] - 1) ** 2 + v["y"] ** 2}


def test_where_no_start_assembles_nothing_was_iterated(monkeypatch):
    monkeypatch.setattr(exchange, "starts", lambda *_: [])
    monkeypatch.setattr(exchange, "complete_start", lambda *_: None)
    monkeypatch.setattr("loomopt.solving.search.elastic.least", lambda *_: None)
    monkeypatch.setattr("loomopt.solving.search.elastic.clash", lambda *_: Clash())
    # At today's x = 0.5 the limit is exceeded: an admissible one would be solved from.
    answer = toy.solve(toy.program("xy", BOWL, limits=(("x", -1, 0.75),)))
    assert answer.status == "failed"
    expected = {"status": "Not_Assembled", "iterations": 0, "starts": 1, "starts_at_best": 0, "accuracy": 1e-8}
    assert {name: answer.solver[name] for name in expected} == expected


def test_the_time_of_the_least_relaxation_is_part_of_the_solve(monkeypatch):
    monkeypatch.setattr("loomopt.solving.search.elastic.clash", lambda *_: Clash())
    failed = Point({"x": 0.5, "y": 0.5}, "Restoration_Failed", False)
    monkeypatch.setattr(exchange, "solve", lambda *_, **__: failed)
    answer = toy.solve(toy.program("xy", BOWL))
    parts = [seconds for name, seconds in answer.time.items() if name != "total_s"]
    assert min(parts) >= 0.0
    assert sum(parts) <= answer.time["total_s"]


def test_a_figure_has_the_power_of_its_objective_undone():
    answer = toy.solve(toy.program("xy", {"f": lambda v: (v["x"] - 1) ** 2 + v["y"] ** 2 + 4}))
    assert answer.optima == (({"f": pytest.approx(4.0)}, 1),)


@pytest.mark.parametrize("given", [{"x": 2.0}, None])
def test_what_a_design_does_not_name_is_todays(given):
    job = toy.ToyJob(toy.program("xy", BOWL))
    with mock.patch.object(registry, "of", return_value=job):
        evaluation = evaluate(toy.scene_of(job), given)
    assert evaluation.design == {"x": 0.5, "y": 0.5, **(given or {})}
