"""The pipeline of a solve: applied from the first reduction to the last, and inverted in reverse."""

import operator
from dataclasses import dataclass, replace
from typing import Any

import pytest

from loomopt.jobs import registry
from loomopt.solving import engine
from loomopt.solving.nlp.point import Settings
from loomopt.solving.optimum import Task
from loomopt.solving.reductions.reduction import solve_reduced

SEED: Any = operator.attrgetter("seed")
"""Stands in for the solve: the answer to a task is its seed."""
TASK = Task(registry.load("beatup"), "balance", Settings())


@dataclass(frozen=True)
class Seeds:
    """Reduction that adds to a task's seed, and solves further tasks."""

    name: str
    calls: list[str]
    further: int = 0

    def apply(self, task):
        self.calls.append(f"apply {self.name}")
        return replace(task, seed=task.seed + 1)

    def invert(self, task, answer, solve):
        self.calls.append(f"invert {self.name} of {task.seed}")
        return [answer, *(solve(replace(task, seed=10 * (k + 1))) for k in range(self.further))]


def test_reductions_are_applied_in_order_and_inverted_in_reverse():
    calls: list[str] = []
    result: Any = solve_reduced(TASK, [Seeds("outer", calls), Seeds("inner", calls)], SEED)
    assert calls == ["apply outer", "apply inner", "invert inner of 1", "invert outer of 0"]
    assert result == [[2]]


def test_a_further_task_of_an_outer_reduction_passes_the_inner_ones():
    result: Any = solve_reduced(TASK, [Seeds("outer", [], 2), Seeds("inner", [])], SEED)
    assert result == [[1 + 1], [10 + 1], [20 + 1]]


def test_a_task_without_reductions_is_solved_as_it_is():
    result: Any = solve_reduced(TASK, [], SEED)
    assert result == 0


class Twice:
    """Reduction that solves its task a second time."""

    def apply(self, task):
        return task

    def invert(self, task, answer, solve):
        self.answers = answer, solve(task)
        return self.answers[1]


def test_the_seconds_of_a_solve_are_those_of_all_its_tasks():
    reduction: Any = Twice()
    second_answer = engine.solve(TASK.scene, reductions=[reduction])
    for part in ("build_s", "solve_s", "certify_s"):
        assert second_answer.time[part] == pytest.approx(
            sum(answer.time[part] for answer in reduction.answers), rel=1e-12
        )
    assert second_answer.time["total_s"] >= sum(answer.time["total_s"] for answer in reduction.answers)


def test_steps_of_a_step_are_reported_below_it():
    steps: list[str] = []
    task = replace(TASK, settings=Settings(on_step=steps.append)).at("outer").at("inner")
    task.settings.at("building")
    assert steps == ["outer", "outer: inner", "outer: inner: building"]
