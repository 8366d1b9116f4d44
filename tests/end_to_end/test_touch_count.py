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
FOLDERS = ("loomopt", "problems", "results", "tests/reference", "tests/support", "tests/conftest.py")
REFERENCE = "tests/physics/effects/test_effects_reference.py"
EFFECT = '''"""Clock spring on the rocking shaft: output term T."""

from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Inputs; from loomopt.physics.effects.kinds import Load
from loomopt.maths.systems import Number
from loomopt.base.quantities import Torque
from loomopt.physics.schema import Table


class Parameters(Table):
    """T: torque of the spring, N·m."""

    T: Torque


def force(at: Inputs[ReedPose]) -> Number:
    """Return T, N·m."""
    return at.table["T"]


EFFECT = Load(
    name="clock_spring",
    summary="clock spring",
    table=Parameters,
    acts="output",
    force=force,
    examples=({"T": "3 N*m"},),
)
'''
ROWS = "beatup,clock_spring,0,today,30,term,3\nbeatup,clock_spring,0,other,200,term,3\n"


class Copy:
    """The package with its scenes, results and reference rows; what is changed in it since."""

    def __init__(self, folder):
        self.folder = folder
        for name in (*FOLDERS, REFERENCE):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            if (ROOT / name).is_dir():
                shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy(ROOT / name, folder / name)
        self.before = self.files()

    def files(self):
        result = (path for path in self.folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
        return {path.relative_to(self.folder).as_posix(): path.read_bytes() for path in result}

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
    data = json.loads(copy.loomopt("solve", "beatup", "--set", "effects.clock_spring.T=3 N*m", "--json"))
    assert (data["status"], "clock_spring" in data["effects"]) == ("optimal", True)
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


COMMAND = '''"""The command that counts the effects of a scene."""

from loomopt.interface.cli.options import NO_CHANGES, Problem, SceneOptions


def count(problem: Problem, changes: SceneOptions = NO_CHANGES) -> None:
    """Print how many effects are on."""
    print(len(changes.scene(problem).effects))
'''
FORMAT = '''"""Drawings as the number of their lines."""

from pathlib import Path

from loomopt.base.files import atomically
from loomopt.interface.files import outputs
from loomopt.scenes.designs import Design
from loomopt.scenes.scene import Scene


def write(path: Path, scene: Scene, design: Design, said: outputs.DrawnSubject | None) -> None:
    """Write how many primitives a drawing has."""
    count = len(outputs.drawing(scene, design, said).primitives)
    atomically(path, lambda part: part.write_text(f"{count}\\n", encoding="utf-8"))
'''


def put(copy, name, old, new):
    """Replace one place of a file."""
    text = copy.before[name].decode()
    assert text.count(old) == 1
    copy.write(name, text.replace(old, new))


@pytest.mark.slow
def test_a_new_command_is_its_file_and_a_row_of_the_commands(copy):
    copy.write("loomopt/interface/cli/count.py", COMMAND)
    name = "loomopt/interface/cli/app.py"
    put(copy, name, '    "check": check,\n', '    "check": check,\n    "count": count.count,\n')
    text = (copy.folder / name).read_text(encoding="utf-8")
    copy.write(
        name,
        text.replace(
            "from loomopt.interface.cli import commands",
            "from loomopt.interface.cli import commands; from loomopt.interface.cli import count",
        ),
    )
    assert copy.loomopt("count", "beatup") == "2\n"
    assert "count" in copy.loomopt("--help")
    assert copy.touched() == [name, "loomopt/interface/cli/count.py"]


@pytest.mark.slow
def test_a_new_format_of_drawings_is_its_file_and_a_row_of_the_endings(copy):
    copy.write("loomopt/interface/files/primitives_counted.py", FORMAT)
    name = "loomopt/interface/files/outputs.py"
    values = "def _counted(*of: object) -> None:\n    from loomopt.interface.files import primitives_counted\n\n"
    put(copy, name, "DRAWINGS: dict[", f"{values}    primitives_counted.write(*of)\n\n\nDRAWINGS: dict[")
    text = (copy.folder / name).read_text(encoding="utf-8")
    copy.write(name, text.replace('{".svg": _svg,', '{".count": _counted, ".svg": _svg,'))
    copy.loomopt("export", "beatup", "--out", "drawn.count")
    assert int((copy.folder / "drawn.count").read_text(encoding="utf-8")) > 10
    touched = [item for item in copy.touched() if item != "drawn.count"]
    assert touched == [name, "loomopt/interface/files/primitives_counted.py"]
