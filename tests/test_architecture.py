"""Imports run upward only; CasADi stays in its rooms; every effect is registered and tested."""

import ast
import importlib
import re
from pathlib import Path

import pytest

import loomopt
from loomopt import effects

PACKAGE = Path(loomopt.__file__).parent
TESTS = Path(__file__).parent

ROOMS = (
    "maths errors frozen",
    "units",
    "quantities",
    "schema store",
    "mechanisms",
    "effects",
    "scene_errors",
    "scene_document scene_tables packaged",
    "scenes balance cycle designs",
    "jobs",
    "nlp",
    "solving",
    "tables",
    "studies",
    "views",
    "api shell commands cli",
)
"""From the ground up: a room may import from its own floor and from those below."""
FLOOR = {name: floor for floor, names in enumerate(ROOMS) for name in names.split()}


def modules():
    """Return every module's name in the package with its file."""
    return {".".join(path.relative_to(PACKAGE).with_suffix("").parts): path for path in PACKAGE.rglob("*.py")}


def room(name):
    return name.split(".")[0]


def imports(source):
    """Return the loomopt modules that source imports, inside functions too, with the line of each."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno}: imports name the whole path"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Constant) and re.fullmatch(r"loomopt(\.\w+)+", str(node.value)):
            names = [node.value]
        else:
            continue
        found += [(name.removeprefix("loomopt."), node.lineno) for name in names if name.startswith("loomopt.")]
    return [(name, line) for name, line in found if room(name) in FLOOR]


def climbing(name, source):
    """Return what a module imports from above itself."""
    return [
        f"{name}:{line} imports {other}" for other, line in imports(source) if FLOOR[room(other)] > FLOOR[room(name)]
    ]


def test_every_module_has_a_room():
    assert {room(name) for name in modules()} - {"__init__"} == set(FLOOR)


def test_imports_run_upward_only():
    broken = [
        line
        for name, path in modules().items()
        if name != "__init__"
        for line in climbing(name, path.read_text(encoding="utf-8"))
    ]
    assert broken == []


@pytest.mark.parametrize(
    "source",
    [
        "from loomopt.views import svg",
        "from loomopt import tables, errors",
        "def f():\n    import loomopt.solving.engine",
        "import importlib\nimportlib.import_module('loomopt.nlp.exchange')",
    ],
)
def test_an_import_from_above_is_found(source):
    assert len(climbing("jobs.beatup", source)) == 1


def test_imports_of_a_module_below_or_beside_are_allowed():
    assert climbing("jobs.beatup", "from loomopt.jobs import sampling\nfrom loomopt.errors import BadInput") == []


def test_views_never_solve():
    for name, path in modules().items():
        if room(name) == "views":
            taken = {other for other, _ in imports(path.read_text(encoding="utf-8"))}
            assert not {other for other in taken if other.startswith(("nlp", "solving.engine"))}, name


def mentions_casadi(source):
    """Say whether code, comments and documentation apart, speaks of CasADi."""
    for node in ast.walk(ast.parse(source)):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        names += [node.attr] if isinstance(node, ast.Attribute) else [node.id] if isinstance(node, ast.Name) else []
        if any("casadi" in name for name in names):
            return True
    return False


def test_only_maths_and_the_solver_rooms_use_casadi():
    users = {room(name) for name, path in modules().items() if mentions_casadi(path.read_text(encoding="utf-8"))}
    assert users == {"maths", "nlp", "solving"}
    assert mentions_casadi("from loomopt import maths\nmaths.casadi()")
    assert mentions_casadi("def f():\n    import casadi as ca")


def test_every_effect_file_is_registered_once():
    files = {name.split(".")[1] for name in modules() if name.startswith("effects.")} - {"__init__"}
    declared = [importlib.import_module(f"loomopt.effects.{name}").EFFECT for name in sorted(files)]
    registered = [effect for table in vars(effects).values() if isinstance(table, dict) for effect in table.values()]
    for effect in declared:
        assert registered.count(effect) == 1, f"{effect.name} is not in one table of loomopt.effects"


def test_every_registered_effect_has_a_test_of_its_own():
    written = "".join(path.read_text(encoding="utf-8") for path in (TESTS / "effects").glob("test_*.py"))
    for name in effects.BEATUP:
        assert re.search(rf"\b{name}\b", written), f"no test in tests/effects speaks of {name}"


def test_files_end_naturally():
    long = {name: len(path.read_text(encoding="utf-8").splitlines()) for name, path in modules().items()}
    assert {name: lines for name, lines in long.items() if lines > 320} == {}
