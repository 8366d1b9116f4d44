"""What a new effect and a new job touch, tried on a copy: their own files and their reference rows, nothing else."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PRESS = ROOT / "tests" / "plugin" / "press" / "loomopt_press"
KEPT = ("loomopt", "problems", "results", "tests/reference", "tests/conftest.py")
REFERENCE = "tests/physics/effects/test_effects_reference.py"
EFFECT = '''"""Clock spring on the rocking shaft: output term T."""

from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Load
from loomopt.maths.systems import Maths; from loomopt.maths.systems import Number
from loomopt.base.quantities import Torque
from loomopt.physics.schema import Table; from loomopt.physics.schema import Values


class Own(Table):
    """T: torque of the spring, N·m."""

    T: Torque


def force(maths: Maths, pose: ReedPose, given: Values, own: Values, switch: Number) -> Number:
    """Return T, N·m."""
    return own["T"]


EFFECT = Load(
    name="clock_spring", summary="clock spring", own=Own, acts="output", force=force, examples=({"T": "3 N*m"},)
)
'''
ROWS = "beatup,clock_spring,0,today,30,term,3\nbeatup,clock_spring,0,other,200,term,3\n"


class Copy:
    """The package with its scenes, results and reference rows; what is changed in it since."""

    def __init__(self, folder):
        self.folder = folder
        for name in (*KEPT, REFERENCE):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            if (ROOT / name).is_dir():
                shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy(ROOT / name, folder / name)
        self.before = self.files()

    def files(self):
        found = (path for path in self.folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
        return {path.relative_to(self.folder).as_posix(): path.read_bytes() for path in found}

    def touched(self):
        """Return the files that are new or changed."""
        return sorted(name for name, content in self.files().items() if self.before.get(name) != content)

    def write(self, name, text):
        (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
        (self.folder / name).write_text(text, encoding="utf-8")

    def python(self, *words):
        environment = {**os.environ, "PYTHONPATH": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, *words]
        return subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True)

    def loomopt(self, *words):
        """Return what the command prints."""
        done = self.python("-c", "from loomopt.interface.cli.app import main; main()", *words)
        assert done.returncode == 0, done.stderr
        return done.stdout


@pytest.fixture
def copy(tmp_path):
    return Copy(tmp_path / "copy")


@pytest.mark.slow
def test_a_new_effect_is_its_file_and_its_reference_rows(copy):
    copy.write("loomopt/physics/effects/beatup/clock_spring.py", EFFECT)
    words = ("-m", "pytest", "-q", "-p", "no:cacheprovider", REFERENCE, "-k", "clock_spring")
    missed = copy.python(*words)
    assert missed.returncode == 1
    assert "test_every_effect_has_its_rows[beatup-clock_spring]" in missed.stdout
    copy.write("tests/reference/effects.csv", copy.before["tests/reference/effects.csv"].decode() + ROWS)
    done = copy.python(*words)
    assert done.returncode == 0, done.stdout
    assert "3 passed" in done.stdout
    found = json.loads(copy.loomopt("solve", "beatup", "--set", "effects.clock_spring.T=3 N*m", "--json"))
    assert (found["status"], "clock_spring" in found["effects"]) == ("optimal", True)
    assert "M_clock_spring = T" in copy.loomopt(
        "show", "beatup", "--set", "effects.clock_spring.T=3 N*m", "--equations"
    )
    assert copy.touched() == ["loomopt/physics/effects/beatup/clock_spring.py", "tests/reference/effects.csv"]


@pytest.mark.slow
def test_a_new_job_is_its_folders_its_scene_and_its_reference_rows(copy):
    for path in sorted(PRESS.rglob("*")):
        place = path.relative_to(PRESS).as_posix()
        if path.suffix not in (".py", ".toml", ".csv") or place == "torsion_bar.py":
            continue
        text = path.read_text(encoding="utf-8").replace("loomopt_press.effects", "loomopt.physics.effects.press")
        room = {"effects": "loomopt/physics/effects/press", "problems": "problems", "results": "results"}
        folder, _, name = ("effects/slide.py" if place == "slide.py" else place).rpartition("/")
        copy.write(
            f"{room.get(folder, 'loomopt/jobs/press')}/{name}", text.replace("loomopt_press", "loomopt.jobs.press")
        )
    assert "job press; targets torque" in copy.loomopt("list")
    assert "reproduces" in copy.loomopt("check", "press")
    copy.loomopt("new", "press", "mine.toml")
    assert json.loads(copy.loomopt("solve", "mine.toml", "--json"))["status"] == "optimal"
    copy.loomopt("export", "mine.toml", "--out", "mine.svg")
    added = {name: name not in copy.before for name in copy.touched() if not name.startswith("mine.")}
    assert all(added.values())
    assert {name.rpartition("/")[0] for name in added} == {
        *("loomopt/jobs/press", "loomopt/physics/effects/press", "problems", "results")
    }
