"""The list of packaged scenes: read from their heads, and the same as the scenes say themselves."""

import pytest

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.scenes import packaged

RESULTS = [path.stem.rpartition(".") for path in packaged.results_path().glob("*.csv")]


@pytest.mark.parametrize("name", packaged.problems())
def test_a_head_is_what_the_whole_scene_says_and_its_targets_have_results(name):
    head, scene = packaged.head(packaged.problems()[name]), lo.load(name)
    assert (head.name, head.title, head.job, head.source) == (scene.name, scene.title, scene.job, scene.source)
    assert set(head.targets) <= set(scene.schema.targets)
    values = {target for problem, _, target in RESULTS if problem == name and "-against-" not in target}
    assert set(head.targets) == values


def test_the_list_names_every_scene_with_its_targets_and_source(capsys, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert run(["list"]) == 0
    out = capsys.readouterr().out
    for name, path in packaged.problems().items():
        head = packaged.head(path)
        assert f"{name} " in out
        assert f"job {head.job}; targets {', '.join(head.targets)}" in out
        assert head.source in out
