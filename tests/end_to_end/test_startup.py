"""From the shell to the answer: nothing is imported that the command does not use, counted in modules."""

import functools
import json
import os
import subprocess
import sys

import pytest
from support.jobs import scene_of

from loomopt.jobs import registry

WORDS = {"annotated_types", "loomopt", "pydantic", "pydantic_core", "typer", "typing_extensions"}
HELPERS = {"annotated_doc", "click", "shellingham", "typing_inspection"}
"""What Typer and pydantic bring themselves, by version."""
SOLVER = {"casadi", "mpmath", "gmpy2"}
MODULES = 530
"""Most modules that any command imports."""
LISTED = """import json, sys
from loomopt.interface.cli.app import run
code = max(run(words) for words in json.loads(sys.argv[1]))
print(*sys.modules, file=sys.stderr)
sys.exit(code)"""


def imported(*arguments):
    """Return the exit status of a command and the names of all modules it imported."""
    return imported_together(arguments)


@functools.cache
def imported_together(*commands):
    """Return the largest exit status of commands one after the other, and the names of all modules they imported."""
    piped = {name: value for name, value in os.environ.items() if name != "COLUMNS"}
    done = subprocess.run(
        [sys.executable, "-c", LISTED, json.dumps(commands)], capture_output=True, text=True, env=piped
    )
    return done.returncode, frozenset(done.stderr.splitlines()[-1].split())


def packages(modules):
    """Return the packages that modules belong to, those of Python itself apart."""
    tops = {name.split(".")[0] for name in modules if not name.startswith("_")}
    return {top for top in tops if top not in sys.stdlib_module_names and not top.startswith(("swig", "cython"))}


@pytest.mark.few(4)
@pytest.mark.parametrize(
    ("arguments", "status", "more"),
    [
        (("solve", "beatup"), 0, SOLVER),
        (("solve", "beatup", "--json"), 0, SOLVER),
        (("evaluate", "beatup", "--set", "operation.M0=0.8 kN*m"), 0, set()),
        (("evaluate", "rapier"), 0, set()),
        (("evaluate", "shedding", "--json"), 0, set()),
        (("show", "beatup"), 0, set()),
        (("simulate", "beatup"), 0, set()),
        (("export", "beatup", "--out", "/dev/null/a.svg"), 2, set()),
        (("new", "beatup", "/dev/null/a.toml"), 2, set()),
        (("solve", "betup"), 2, set()),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_a_command_imports_only_what_it_uses(arguments, status, more):
    code, modules = imported(*arguments)
    assert code == status
    assert packages(modules) <= WORDS | HELPERS | {"numpy"} | more
    assert len(modules) <= MODULES


@pytest.mark.parametrize("arguments", [("--version",), ("--help",), ("solve", "--help"), ("slove",)])
def test_what_reads_no_scene_imports_nothing_but_words(arguments):
    _, modules = imported(*arguments)
    assert packages(modules) <= WORDS | HELPERS
    assert len(modules) <= 290


def test_the_list_reads_heads_of_scenes_and_computes_nothing():
    code, modules = imported("list")
    assert code == 0
    assert packages(modules) <= WORDS | HELPERS
    assert not {
        name for name in modules if name.startswith(("loomopt.jobs", "loomopt.scenes.scene", "loomopt.physics"))
    }


def test_only_commands_that_solve_import_casadi():
    for arguments, expected in ((("evaluate", "beatup"), False), (("solve", "beatup"), True)):
        assert ("casadi" in imported(*arguments)[1]) == expected


@pytest.mark.parametrize("with_it", [False, True], ids=["algebraic", "with a state"])
def test_motions_that_follow_from_forces_are_imported_by_scenes_that_have_them_only(with_it):
    more = ("--with", "shaft_torsion") if with_it else ()
    commands = (("evaluate", "beatup"), ("solve", "beatup", "--starts", "1"), ("show", "beatup", "--equations"))
    code, modules = imported_together(*((*command, *more) for command in commands))
    assert code == 0
    motions = {module for module in modules if module.startswith("loomopt.physics.motion")}
    assert motions == ({"loomopt.physics.motion", "loomopt.physics.motion.harmonic"} if with_it else set())


@pytest.mark.few(2)
@pytest.mark.parametrize("name", registry.builtin_names())
def test_a_job_imports_no_module_of_another(name):
    others = set(registry.builtin_names()) - {name}
    scene = scene_of(name)
    code, modules = imported_together(("evaluate", scene), ("show", scene, "--equations"), ("simulate", scene))
    assert code == 0
    values = {module for module in modules if module.startswith("loomopt.")}
    assert f"loomopt.jobs.{name}.job" in values
    assert not {module for module in values if set(module.split(".")) & others}


def test_solving_the_beatup_imports_no_module_of_another_job_no_study_and_no_picture_of_it():
    code, modules = imported("solve", "beatup")
    assert code == 0
    foreign = (
        "rapier",
        "shedding",
        "linkage",
        "mechanisms.chain",
        "cam_",
        "tension_spring",
        "loomopt.studies",
        "loomopt.picture.shapes",
    )
    values = {module for module in modules if module.startswith("loomopt")}
    assert not {module for module in values if any(word in module for word in foreign)}


@pytest.mark.parametrize(("given", "expected"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")])
def test_the_command_runs_its_linear_algebra_in_one_thread_unless_it_is_told_otherwise(given, expected):
    """Before NumPy is imported: afterwards it would not listen."""
    threads = "os.environ['OPENBLAS_NUM_THREADS'], os.environ['MKL_NUM_THREADS']"
    script = f"import os, loomopt.interface.cli.app; print({threads})"
    values = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env={**values, **given})
    assert done.stdout.split() == [expected, "1"]


def test_a_motion_of_its_own_is_imported_only_by_the_scenes_that_need_it():
    values = {"loomopt.physics.motion.turning", "loomopt.model.crank_motion"}
    for arguments, needed in (
        (("evaluate", "beatup"), set()),
        (("evaluate", "beatup", "--with", "speed_fluctuation"), values),
    ):
        code, modules = imported(*arguments)
        assert code == 0
        assert values & modules == needed
    _, solving = imported("solve", "beatup")
    assert not {name for name in solving if name.startswith("loomopt.physics.motion")}
