"""Points between two neighbours' optima: the same rows alone, in any batch and with any number of workers."""

from dataclasses import replace

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.solving.search import neighbour_newton
from loomopt.studies import sweep
from loomopt.studies.front.trade import Trade
from loomopt.studies.run import run
from loomopt.studies.run.rows import FEWEST, Row, StudyTask, digest, enough_together

CLOSE = 1e-12


def resistances(count):
    values = [f"{740 + 60 * k / (count - 1)!r} N*m" for k in range(count)]
    return sweep.plan_sweep(lo.load("beatup"), {"operation.M0": values})


def front():
    return Trade(registry.load("beatup"), ("peak_torque", "m4e"), ("least", "least"), "balance", (), 26)


def last_round(study):
    """First batch of a study that is solved together, and all rows before it by point."""
    rows: list[Row] = []
    while batch := study.batch(rows):
        known = {row.point: row for row in rows}
        if any(task.neighbours for task in batch):
            return batch, known
        rows += [study.solved(task, None if task.parent is None else known[task.parent]) for task in batch]
    raise AssertionError("nothing is solved together")


def place_key(row):
    """Place of a row without its rounding; of an end its number."""
    return tuple(f"{value:.9g}" for value in row.place.values()) or row.point


def untimed(row):
    return replace(row, seconds=0.0)


@pytest.mark.parametrize(
    ("study", "count"),
    [
        pytest.param(study, count, id=f"{name}-{count}", marks=[pytest.mark.slow] * ((name, count) != ("sweep", 11)))
        for name, study in {"sweep": resistances(49), "front": front()}.items()
        for count in (11, 200)
    ],
)
def test_rows_are_the_same_bits_in_batches_of_any_size(study, count):
    batch, rows = last_round(study)
    tasks = [task for task in batch if task.neighbours][:9]
    whole = [untimed(row) for row in study.solved_together((tasks * count)[:count])]
    assert None not in whole
    for size in (1, 8):
        parts = [study.solved_together(tasks[begin : begin + size]) for begin in range(0, len(tasks), size)]
        assert [untimed(row) for part in parts for row in part] == whole[: len(tasks)]
    assert untimed(study.solved(tasks[0], rows[tasks[0].parent])) == whole[0]


@pytest.mark.slow
@pytest.mark.parametrize("study", [resistances(33), front()], ids=["sweep", "front"])
def test_rows_are_the_same_bits_from_one_worker_and_from_two_and_of_separate_solves(study, monkeypatch):
    together = run.run(study)
    assert digest(run.run(study, run.workers(2))) == digest(together)
    monkeypatch.setattr(neighbour_newton, "solve_neighbours", lambda starts: [None] * len(starts))
    # Rounding decides which of two equal gaps is halved last.
    known = {place_key(row): row for row in together if row.certified}
    pairs = [(row, known[place_key(row)]) for row in run.run(study) if row.certified and place_key(row) in known]
    assert len(pairs) >= len(known) - 3
    for row, separate in pairs:
        for name, value in row.design.items():
            assert separate.design[name] == pytest.approx(value, rel=CLOSE, abs=CLOSE), (row.place, name)
        assert separate.multipliers.keys() == row.multipliers.keys()


def test_few_tasks_are_solved_alone():
    tasks = [StudyTask(k, 0, {}, neighbours=[{}, {}, 0.5]) for k in range(FEWEST)]
    assert enough_together(tasks) == tasks
    assert not any(task.neighbours for task in enough_together(tasks[1:]))


@pytest.mark.slow
def test_an_invalid_scene_does_not_change_the_other_rows():
    """A task with an invalid scene is left to its solve, which reports the error."""
    study = resistances(49)
    batch, _ = last_round(study)
    tasks = [task for task in batch if task.neighbours][:3]
    invalid = replace(tasks[1], neighbours=[{**tasks[1].neighbours[0], "x": {"l1": 0.03}}, *tasks[1].neighbours[1:]])
    first, none, last = study.solved_together([tasks[0], invalid, tasks[2]])
    assert none is None
    assert [untimed(row) for row in (first, last)] == [
        untimed(row) for row in study.solved_together([tasks[0], tasks[2]])
    ]
