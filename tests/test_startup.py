"""From the shell to the answer: nothing is imported that the command does not use."""

import os
import subprocess
import sys
import time

import pytest

HEAVY = {"pandas", "scipy", "sympy", "matplotlib", "pint", "ezdxf", "pyarrow", "dask", "IPython"}
LISTED = """import sys
from loomopt.cli import run
code = run(sys.argv[1:])
print(*sys.modules, file=sys.stderr)
sys.exit(code)"""


@pytest.mark.parametrize(
    ("arguments", "status"),
    [
        (["solve", "beatup"], 0),
        (["solve", "beatup", "--json"], 0),
        (["evaluate", "beatup", "--set", "operation.M0=0.8 kN*m"], 0),
        (["list"], 0),
        (["show", "beatup"], 0),
        (["solve", "betup"], 2),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_command_imports_nothing_heavy(arguments, status):
    done = subprocess.run([sys.executable, "-c", LISTED, *arguments], capture_output=True, text=True)
    assert done.returncode == status
    loaded = {name.split(".")[0] for name in done.stderr.splitlines()[-1].split()}
    assert "loomopt" in loaded
    assert loaded & HEAVY == set()
    assert ("rich" in loaded) == (status == 0 and "--json" not in arguments)


def test_only_commands_that_solve_import_casadi():
    for arguments, expected in ((["evaluate", "beatup"], False), (["solve", "beatup"], True)):
        done = subprocess.run([sys.executable, "-c", LISTED, *arguments], capture_output=True, text=True)
        assert ("casadi" in done.stderr.splitlines()[-1].split()) == expected


def test_a_whole_solve_takes_at_most_four_times_the_bare_imports(tmp_path):
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(tmp_path), "PYTHONDONTWRITEBYTECODE": ""}
    solve = [sys.executable, "-c", "from loomopt.cli import main; main()", "solve", "beatup"]
    bare = [sys.executable, "-c", "import casadi, numpy"]

    def seconds(command):
        began = time.perf_counter()
        subprocess.run(command, env=environment, stdout=subprocess.DEVNULL, check=True)
        return time.perf_counter() - began

    least = {"solve": float("inf"), "bare": float("inf")}
    seconds(solve), seconds(bare)
    for rounds in range(12):
        least = {"solve": min(least["solve"], seconds(solve)), "bare": min(least["bare"], seconds(bare))}
        if rounds >= 2 and least["solve"] <= 4 * least["bare"]:
            break
    assert least["solve"] <= 4 * least["bare"]
