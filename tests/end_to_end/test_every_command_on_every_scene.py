"""Every command over every packaged scene and every job's template, with every available effect on: no traceback, an
exit status that the command may have, JSON that parses, nothing on stdout where the input is refused.
"""

import json
import tomllib

import pytest

from loomopt.interface.cli.app import COMMANDS, run
from loomopt.jobs import registry
from loomopt.scenes import packaged

OVER = "operation.speed=290:300:10 rpm"
CHEAP = (
    ("show",),
    ("show", "--equations"),
    ("show", "--symbols"),
    ("show", "--sources"),
    ("evaluate", "--json"),
    ("simulate",),
    ("simulate", "--forces"),
    ("budget", "--json"),
)
"""Calls that take less than a second: the command, then its options."""
PICTURES = (
    ("show", "--figure", "s.svg"),
    ("show", "--animate", "s.html"),
    ("simulate", "--out", "c.csv", "--out", "c.svg"),
    ("export", "--out", "x.dxf", "--out", "x.csv", "--out", "x.svg"),
)
SINGLE_SOLVES = (
    ("solve", "--starts", "1", "--out", "found", "--json"),
    ("solve", "--starts", "1", "--prove", "--json"),
    ("prove", "--json"),
    ("report", "--out", "r.html"),
    ("sensitivity", "--json"),
    ("tolerance", "--samples", "50", "--json"),
)
STUDIES = (
    ("sweep", "--over", OVER, "--json"),
    ("effects", "--json"),
    ("accuracy", "--json"),
)
MAY_BE = {
    "prove": {0, 1, 2},
    "solve": {0, 2, 3, 4},
    "sweep": {0, 2, 3, 4},
    "pareto": {0, 2, 3, 4},
    "sensitivity": {0, 2, 3, 4},
    "effects": {0, 2, 3, 4},
    "report": {0, 2, 3, 4},
}
"""Exit statuses by command; of the others 0 and 2."""
ALWAYS = (("show",), ("show", "--equations"), ("evaluate", "--json"), ("simulate",))
"""Calls that no packaged scene and no template refuses as it stands."""


def subjects():
    """Return, as pytest parameters: a scene, of a package or a template, and the effects that are put on."""
    results = []
    for name in (*packaged.problems(), *(f"{job}.toml" for job in sorted(registry.builtin_names()))):
        template = name.endswith(".toml")
        read = registry.scene(tomllib.loads(registry.template(name[:-5]))) if template else registry.load(name)
        alone = available(read)
        sets = ["", *alone, *([" ".join(alone)] if len(alone) > 1 else [])]
        results += [pytest.param(name, on, id=f"{name} with {on}" if on else name) for on in sets]
    return results


def available(scene):
    """Return the effects that a scene has values for but not on."""
    results = []
    for name, table in scene.document.get("available", {}).items():
        results += [name] if name in scene.schema.effects else [f"{name}.{instance}" for instance in table]
    return results


SUBJECTS = subjects()


def called(words, place, on, capsys):
    """Run a command on a scene with effects put on; check what the command line promises."""
    command, *options = words
    with_ = [word for name in on.split() for word in ("--with", name)]
    status = run([command, place, *with_, *options])
    out, err = capsys.readouterr()
    assert status in MAY_BE.get(command, {0, 2}), (words, status, err)
    assert "Traceback" not in err
    if status == 2:
        assert (out, err.strip().startswith("loomopt: ")) == ("", True), (words, out, err)
    elif "--json" in words:
        assert isinstance(json.loads(out), dict)
    return status


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Return a call that gives what a command reads: a packaged name, or the path of a template's copy."""
    monkeypatch.chdir(tmp_path)

    def written(name):
        if name.endswith(".toml"):
            (tmp_path / name).write_text(registry.template(name.removesuffix(".toml")), encoding="utf-8")
        return name

    return written


@pytest.mark.few(2)
@pytest.mark.parametrize(("name", "on"), SUBJECTS)
def test_cheap_commands(name, on, place, capsys):
    where = place(name)
    for words in CHEAP:
        status = called(words, where, on, capsys)
        assert status == 0 or words not in ALWAYS or on, words


@pytest.mark.few(1, slow=10)
@pytest.mark.parametrize(("name", "on"), SUBJECTS)
def test_pictures(name, on, place, capsys):
    where = place(name)
    for words in PICTURES:
        called(words, where, on, capsys)


@pytest.mark.few(0, slow=6)
@pytest.mark.parametrize(("name", "on"), SUBJECTS)
def test_one_solve(name, on, place, capsys):
    where = place(name)
    for words in SINGLE_SOLVES:
        if called(words, where, on, capsys) == 0 and "found" in words:
            for made in (
                ("compare", "found/answer.json", "--json"),
                ("evaluate", "--json"),
                ("report", "--out", "a.html"),
                ("simulate",),
            ):
                called(made, "today" if made[0] == "compare" else "found/answer.json", "", capsys)


@pytest.mark.few(0, slow=5)
@pytest.mark.parametrize(("name", "on"), SUBJECTS)
def test_studies(name, on, place, capsys):
    where = place(name)
    axes = list(registry.load(where).schema.axes)
    front = ("pareto", "--minimise", axes[0], "--against", axes[1], "--points", "2", "--json")
    for words in (*STUDIES, front):
        called(words, where, on, capsys)


@pytest.mark.parametrize("job", sorted(registry.builtin_names()))
def test_commands_of_a_job(job, capsys, tmp_path):
    for words in (["list", "--json"], ["schema", job], ["new", job, str(tmp_path / "new.toml")]):
        assert run(words) == 0
        out = capsys.readouterr().out
        assert words[0] == "new" or json.loads(out)


def test_every_command_is_called():
    words = {words[0] for words in (*CHEAP, *PICTURES, *SINGLE_SOLVES, *STUDIES)}
    assert COMMANDS.keys() == words | {"pareto", "compare", "list", "schema", "new", "check"}
