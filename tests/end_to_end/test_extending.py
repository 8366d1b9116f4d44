"""extending.md: its distribution installs, its commands end well, its excerpts are the press, its code runs."""

import importlib.util
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "development" / "extending.md").read_text(encoding="utf-8")
SECTIONS = {part.split("\n", 1)[0]: part for part in TEXT.split("\n## ")[1:]}
PRESS = ROOT / "tests" / "plugin" / "press"
FILE = re.compile(r"^`([\w./]+)`( of the press)?:\n\n```\w+\n(.*?)^```", re.MULTILINE | re.DOTALL)
COMMANDS = re.compile(r"^```console\n(.*?)^```", re.MULTILINE | re.DOTALL)


def commands(section):
    """Return the words of each command of a section."""
    (result,) = COMMANDS.findall(SECTIONS[section])
    return [shlex.split(line) for line in result.splitlines()]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Return a call of a command where both distributions, the chapter's and the press, are installed."""
    if importlib.util.find_spec("hatchling") is None:
        pytest.skip("hatchling builds a distribution")
    source, folder = tmp_path_factory.mktemp("air"), tmp_path_factory.mktemp("installed")
    for name, press, text in FILE.findall(SECTIONS["An effect"]):
        assert not press
        (source / name).parent.mkdir(exist_ok=True)
        (source / name).write_text(text, encoding="utf-8")
    words = ["install", "-q", "--no-build-isolation", "--no-deps", "--no-index", "--target", str(folder)]
    subprocess.run([sys.executable, "-m", "pip", *words, str(source), str(PRESS)], check=True, capture_output=True)

    def call(words):
        path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
        command = [sys.executable, "-c", "from loomopt.interface.cli.app import main; main()", *words[1:]]
        environment = {**os.environ, "PYTHONPATH": path}
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return call


@pytest.mark.slow
def test_the_chapters_effects_are_served(run):
    solve, show, prove = commands("An effect")
    data = json.loads(run([*solve, "--json"]))
    assert data["effects"] == ["inertia", "resistance", "air_drag", "tip"]
    assert data["figures"]["tip_acceleration"] == pytest.approx(168, rel=1e-8)
    assert "tip_acceleration" in {price["limit"] for price in data["binding"]}
    assert "M_air_drag" in run(show)
    assert "tip_acceleration <= 200" in run(prove)


@pytest.mark.slow
def test_the_commands_of_the_job_end_well_one_after_the_other(run):
    report = commands("A job")
    assert len(report) > 1
    for words in report:
        assert words[0] == "loomopt"
        run(words)
    run(["loomopt", "show", "mine.toml"])


@pytest.mark.parametrize(("name", "press", "text"), FILE.findall(SECTIONS["A job"]))
def test_excerpts_stand_in_the_press(name, press, text):
    assert press
    (path,) = PRESS.rglob(name)
    assert text in path.read_text(encoding="utf-8")


def test_the_files_that_are_told_are_the_press():
    report = set(re.findall(r"^\| `([\w./]+)`", SECTIONS["A job"], re.MULTILINE)) | {"results/"}
    package = PRESS / "loomopt_press"
    here = {path.name + "/" * path.is_dir() for path in package.iterdir() if path.name not in ("__pycache__",)}
    assert report <= here
    assert here - report == {"__init__.py", "slide.py", "torsion_bar.py"}


@pytest.mark.parametrize("code", re.findall(r"^```python\n(.*?)^```", SECTIONS["A study"], re.MULTILINE | re.DOTALL))
def test_the_code_of_a_study_runs(code):
    assert "assert" in code
    exec(compile(code, "docs/development/extending.md", "exec"), {"__name__": "chapter"})


def test_every_section_stands_in_the_table():
    assert set(re.findall(r"\]\(#(.*?)\)", TEXT)) == {title.lower().replace(" ", "-") for title in SECTIONS}
