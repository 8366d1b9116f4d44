"""The package as it is handed over: what is in the wheel, that it works elsewhere, and a tidy repository."""

import ast
import email.parser
import importlib.util
import json
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

import loomopt
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.jobs.registry import load
from loomopt.scenes import packaged

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
EXPECTED = {
    *(".ci", ".github", ".gitignore", ".pre-commit-config.yaml", "Makefile", "pyproject.toml", "requirements.lock"),
    *("CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "README.md"),
    *("benchmarks", "docs", "loomopt", "notebooks", "problems", "results", "tests"),
}

# Written apart, so that this file does not find itself.
MACHINE = re.compile(r"(?<![\w.])/" + r"(?:home|root|Users|work|tmp|private|mnt)/[\w.-]+")
HOSTS = (
    "artifact" + "ory",
    "nex" + r"us\.",
    "index-" + "url",
    "extra-" + "index",
    r"pypi\.org/" + "simple",
    "dev" + "pi",
)
REGISTRY = re.compile("|".join(HOSTS), re.IGNORECASE)

PICTURES = {
    f"docs/{path.name}": f"loomopt/pictures/{path.name}"
    for path in (ROOT / "docs").iterdir()
    if path.name.startswith("sketch-") or f"docs/{path.name}" in (ROOT / "README.md").read_text(encoding="utf-8")
    if path.suffix in (".png", ".svg")
}
"""The sketches and what the README shows, and where the wheel has them."""

wheel_needed = pytest.mark.skipif(importlib.util.find_spec("hatchling") is None, reason="hatchling builds the wheel")


def pip(command, *arguments):
    """Run pip offline."""
    words = [sys.executable, "-m", "pip", command, "-q", "--no-deps", *map(str, arguments)]
    subprocess.run(words, check=True, capture_output=True)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Return the wheel of the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    pip("wheel", "--no-build-isolation", "-w", folder, ROOT)
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """Return a folder into which the wheel is installed."""
    folder = tmp_path_factory.mktemp("installed")
    pip("install", "--no-index", "--target", folder, wheel)
    return folder


def tracked():
    """Return the files of the repository; where it is none, the test is skipped."""
    done = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-z"], capture_output=True, text=True)
    if done.returncode:
        pytest.skip("not a git checkout")
    return [ROOT / name for name in done.stdout.split("\0") if name]


def test_the_project_says_what_the_package_is():
    project = PROJECT["project"]
    assert project["version"] == loomopt.__version__
    assert project["scripts"] == {"loomopt": "loomopt.__main__:main"}
    assert project["requires-python"] == ">=3.11"
    assert {"test", "notebook", "dask"} <= set(project["optional-dependencies"])
    included = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    assert included == {"problems": "loomopt/problems", "results": "loomopt/results", **PICTURES}
    assert (ROOT / "LICENSE").is_file()


def test_the_citation_is_of_this_version():
    message = dict(re.findall(r"^([\w-]+): +(.+)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE))
    assert message["cff-version"] == "1.2.0"
    assert (message["title"], message["version"], message["license"]) == ("loomopt", loomopt.__version__, "MIT")


def test_what_is_handed_over_as_source_is_there():
    included = PROJECT["tool"]["hatch"]["build"]["targets"]["sdist"]["include"]
    assert [name for name in included if not (ROOT / name.strip("/")).exists()] == []
    left_out = {".ci", ".github", ".gitignore", ".pre-commit-config.yaml", "pyproject.toml"}
    assert {name.strip("/") for name in included} == EXPECTED - left_out


def test_the_lock_pins_every_dependency_and_nothing_but_versions():
    lines = (ROOT / "requirements.lock").read_text(encoding="utf-8").splitlines()
    pinned = dict(line.split("==") for line in lines)
    assert [line for line in lines if not re.fullmatch(r"[A-Za-z0-9._-]+==[0-9][0-9a-z.]*", line)] == []
    locked = {canonicalize_name(name): Version(version) for name, version in pinned.items()}
    extras = PROJECT["project"]["optional-dependencies"]
    wanted = [*PROJECT["project"]["dependencies"], *extras["test"], *extras["docs"]]
    for requirement in map(Requirement, wanted):
        version = locked[canonicalize_name(requirement.name)]
        assert requirement.specifier.contains(version), requirement
    assert "loomopt" not in locked


def imported(tree):
    """Yield the packages that code imports, those that it imports by name too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module
        elif isinstance(node, ast.Call):
            called = getattr(node.func, "attr", getattr(node.func, "id", ""))
            by_name = called.endswith("import_module")
            yield from (item.value for item in node.args if by_name and isinstance(item, ast.Constant))


@pytest.mark.slow
def test_every_package_the_code_imports_is_a_declared_dependency():
    declared = {re.split(r"[<>=\[; ]", entry)[0].replace("-", "_") for entry in PROJECT["project"]["dependencies"]}
    code = [ast.parse(path.read_text(encoding="utf-8")) for path in (ROOT / "loomopt").rglob("*.py")]
    used = {name.split(".")[0] for tree in code for name in imported(tree)}
    assert used >= {"casadi", "flint", "matplotlib", "pydantic"}
    outside = used - set(sys.stdlib_module_names) - {"loomopt"}
    named = {"flint": "python_flint", "PIL": "pillow"}
    # The first is asked for by `--dask` alone, which says how to install it; where a cell runs the other is there.
    extra = {"distributed", "IPython"}
    assert all(entry.split(">")[0] in extra for entry in PROJECT["project"]["optional-dependencies"]["dask"])
    assert {named.get(name, name) for name in outside} - {"pydantic_core"} - extra <= declared


@pytest.mark.slow
@wheel_needed
def test_the_wheel_holds_scenes_results_types_and_nothing_else(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    for folder in ("problems", "results"):
        assert {f"loomopt/{folder}/{path.name}" for path in (ROOT / folder).iterdir()} <= names
    assert "loomopt/py.typed" in names
    assert {f"loomopt/interface/report/{name}" for name in ("report.css", "report.js")} <= names
    assert set(PICTURES.values()) <= names
    assert {f"loomopt/jobs/{job}/template.toml" for job in registry.builtin_names()} <= names
    assert {name.split("/")[0].split("-")[0] for name in names} == {"loomopt"}
    assert not [name for name in names if "test" in name.lower() or "__pycache__" in name]


@pytest.mark.slow
@wheel_needed
def test_wheel_and_source_pass_twine(wheel, tmp_path):
    pytest.importorskip("twine", reason="twine is not installed")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (source,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(source) as archive:
        names = {name.split("/", 1)[-1] for name in archive.getnames()}
    assert {"loomopt/py.typed", "problems/beatup.toml", "docs/sketch-beatup.svg", "Makefile"} <= names
    checked = [sys.executable, "-m", "twine", "check", "--strict", str(wheel), str(source)]
    done = subprocess.run(checked, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_the_licence_of_every_dependency_is_noted():
    lines = (ROOT / "docs" / "development" / "licences.md").read_text(encoding="utf-8").splitlines()
    noted = {cells[1].strip() for cells in (line.split("|") for line in lines) if len(cells) > 3}
    extras = PROJECT["project"]["optional-dependencies"].values()
    wanted = [*PROJECT["project"]["dependencies"], *(entry for extra in extras for entry in extra)]
    assert {Requirement(entry).name for entry in wanted} <= noted


@wheel_needed
def test_the_wheel_names_its_licence_and_command(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = {name.split("/", 1)[1]: name for name in archive.namelist() if ".dist-info/" in name}
        metadata = email.parser.Parser().parsestr(archive.read(names["METADATA"]).decode())
        assert "loomopt = loomopt.__main__:main" in archive.read(names["entry_points.txt"]).decode()
    assert (metadata["Name"], metadata["Version"]) == ("loomopt", loomopt.__version__)
    assert metadata["License-Expression"] == "MIT"
    assert "licenses/LICENSE" in names


@pytest.mark.slow
@wheel_needed
def test_the_installed_command_works_from_any_folder(installed, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(installed), "COLUMNS": "300"}

    def run(*arguments):
        command = [str(installed / "bin" / "loomopt"), *arguments]
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)

    where = subprocess.run(
        [sys.executable, "-c", "import loomopt; print(loomopt.__file__)"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert Path(where.stdout.strip()).is_relative_to(installed)
    solved = run("solve", "beatup", "--json")
    assert (solved.returncode, solved.stderr) == (0, "")
    assert json.loads(solved.stdout)["status"] == "optimal"
    checked = run("check", "beatup-heavy")
    assert checked.returncode == 0, checked.stdout
    assert run("--version").stdout.startswith(f"loomopt {loomopt.__version__} (CasADi ")
    assert "not determined" in run("show", "shedding", "--sources").stdout
    assert run("solve", "betup").returncode == 2
    assert list(tmp_path.iterdir()) == []


def test_packaged_scenes_are_found_by_name_and_paths_stay_paths(tmp_path, monkeypatch):
    assert list(packaged.problems()) == sorted(path.stem for path in (ROOT / "problems").glob("*.toml"))
    assert {name: path.name for name, path in packaged.problems().items()}["beatup"] == "beatup.toml"
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beatup").mkdir()
    (tmp_path / "beatup.toml").write_text("")
    assert not packaged.is_path("beatup")
    assert packaged.is_path("beatup.toml")
    assert packaged.is_path("./beatup")
    assert packaged.is_path(tmp_path / "beatup")
    assert load("beatup").name == "beatup"
    for path, problem in (("beatup.toml", "problem"), ("./beatup", "folder"), (tmp_path / "beatup", "folder")):
        with pytest.raises(BadInput, match=problem):
            load(path)


@pytest.mark.slow
def test_no_tracked_file_speaks_of_a_machine_or_a_registry():
    results = []
    for path in tracked():
        text = path.read_bytes().decode("utf-8", errors="ignore") if path.is_file() else ""
        for number, line in enumerate(text.splitlines(), 1):
            match = MACHINE.search(line) or REGISTRY.search(line)
            results += [f"{path.relative_to(ROOT)}:{number}: {match[0]}"] if match else []
    assert results == []


@pytest.mark.parametrize("line", ["/ho" + "me/someone/loom", "cd /wo" + "rk/x", "--index-" + "url=x", "Dev" + "pi"])
def test_such_a_line_would_be_found(line):
    assert MACHINE.search(line) or REGISTRY.search(line)


def test_the_root_is_tidy():
    entries = {path.relative_to(ROOT).parts[0] for path in tracked()}
    assert entries <= EXPECTED
    assert not [path for path in tracked() if path.suffix in (".pyc", ".log", ".orig", ".rej", ".whl")]


def test_no_tracked_file_is_large():
    large = {str(path.relative_to(ROOT)): path.stat().st_size for path in tracked() if path.is_file()}
    assert {
        name: size for name, size in large.items() if size > (300_000 if name.endswith(".ipynb") else 200_000)
    } == {}


def test_test_files_have_names_of_their_own():
    names = [path.name for path in (ROOT / "tests").rglob("test_*.py")]
    assert sorted(names) == sorted(set(names))
