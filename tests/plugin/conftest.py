"""The press, installed as anybody's plug-in is, and the command run where it is found; broken plug-ins beside it."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

PRESS = Path(__file__).parent / "press"
COMMAND = [sys.executable, "-c", "from loomopt.interface.cli.app import main; main()"]


@pytest.fixture(scope="session")
def installed(tmp_path_factory):
    """Return a folder into which the press is installed."""
    if importlib.util.find_spec("hatchling") is None:
        pytest.skip("hatchling builds the plug-in")
    folder = tmp_path_factory.mktemp("installed")
    words = ["install", "-q", "--no-build-isolation", "--no-deps", "--no-index", "--target", str(folder), str(PRESS)]
    subprocess.run([sys.executable, "-m", "pip", *words], check=True, capture_output=True)
    return folder


@pytest.fixture
def loomopt(tmp_path, installed):
    """Return a call of the command with the press, and whatever other folders, on the path.

    status: 0 unless told, any for None.
    """

    def run(*words, status=0, folders=()):
        path = os.pathsep.join(map(str, [*folders, installed, *filter(None, [os.environ.get("PYTHONPATH")])]))
        environment = {**os.environ, "PYTHONPATH": path, "COLUMNS": "200"}
        done = subprocess.run([*COMMAND, *words], cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert status in (None, done.returncode), done.stdout + done.stderr
        return done

    return run


@pytest.fixture
def distribution(tmp_path):
    """Return a call that makes a distribution of one module and its entry points, and returns its folder."""

    def make(name, points, code="", group="loomopt.jobs"):
        folder = tmp_path / f"folder of {name}"
        described = folder / f"{name.replace('-', '_')}-1.0.dist-info"
        described.mkdir(parents=True)
        (described / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        lines = [f"[{group}]", *(f"{point} = {value}" for point, value in points.items())]
        (described / "entry_points.txt").write_text("\n".join(lines) + "\n")
        (folder / f"{name.replace('-', '_')}.py").write_text(code)
        return folder

    return make
