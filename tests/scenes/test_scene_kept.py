"""What is made of a scene is kept with it, but for what depends on files."""

import pickle

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.rapier.scene import MATCHED
from loomopt.scenes import csv_tables
from loomopt.scenes.scene import cached

SCENE = lo.load("beatup")
JOB = registry.of(SCENE)


def test_a_scene_is_asked_for_its_task_once():
    scene = lo.load("beatup")
    first = JOB.program(scene, "balance")
    assert JOB.program(scene, "balance") is first
    assert JOB.program(scene, "pulse") is not first
    changed = scene.set("operation.M0", "700 N*m")
    assert JOB.program(changed, "balance") is not first
    assert JOB.program(changed, "balance").parameters["M0"] == 700.0
    again = pickle.loads(pickle.dumps(scene))
    assert again == scene
    assert JOB.program(again, "balance") is not first


def test_what_fails_is_not_kept():
    scene, request = lo.load("beatup"), []

    def fails():
        request.append(1)
        raise ValueError("no")

    for _ in range(2):
        try:
            cached(scene, "what", fails)
        except ValueError:
            continue
    assert len(request) == 2


def test_what_depends_on_a_file_is_made_anew(tmp_path):
    """A table is read again with every task: whoever edits its file sees the change."""
    path = tmp_path / "travel.csv"

    def write(largest):
        rows = "\n".join(f"{30 * k},{largest if k == 6 else 0}" for k in range(12))
        path.write_text(f"{csv_tables.header(MATCHED)}\n{rows}\n", encoding="utf-8")

    scene = lo.load("rapier").set("targets.match.table", str(path))
    for largest in (700, 800):
        write(largest)
        (mean,) = registry.of(scene).program(scene, "match").model.integrals
        assert max(mean.data) == pytest.approx(largest / 1000)
