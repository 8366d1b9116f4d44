"""Names in the pages lead into the code: files, functions, options and commands that they speak of are there."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "loomopt"
PAGES = sorted([*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"])
QUOTED = re.compile(r"(?<!`)`([^`\n]+)`(?!`)")
FENCED = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"(?:[\w.-]+/)*[\w-]+\.py|(?:[\w-]+/)+")
TEST = re.compile(r"(tests/[\w/]+\.py)::(\w+)")
DOTTED = re.compile(r"[a-z_]\w*(?:\.\w+)+")
WORD = re.compile(r"[A-Za-z]\w*_\w+")
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
COMMAND = re.compile(r"(?:`|\$ )loomopt ([a-z]+)")
ANY = "JOB", "NAME", "JOINT"
"""Words that stand for any name."""
EXAMPLES = "loomopt_air/drag.py", "loomopt_air/tip.py", "maths.sin", "cluster.scheduler_address"
"""Names of a distribution of one's own, of files that are written, of what a number system has, of another package."""
ENDINGS = ".html", ".csv", ".json", ".db", ".toml", ".xlsx", ".png"
"""Of files that commands write or read."""
DATA = "answer", "certificate", "whole_cycle", "pins", "mass", "load", "spring"
"""First words of keys in answers and scenes that modules are called too."""
OTHERS = "--exclude-editable", "--write", "--install-completion", "--no-worst", "--version", "--help"
"""Options of other programs, of hidden commands, and those that the command line makes by itself."""


def quoted(page):
    """Return what a page quotes in its prose."""
    return QUOTED.findall(FENCED.sub("", page.read_text(encoding="utf-8")))


@cache
def files():
    """Return every file and folder of the repository that is kept, from its root."""
    subset = [folder for folder in ROOT.iterdir() if not folder.name.startswith(".") and folder.name != "build"]
    results = {path.relative_to(ROOT).as_posix() for folder in subset for path in (folder, *folder.rglob("*"))}
    return frozenset(results)


def is_file(name):
    """Say whether a path is one of the repository, from its root, from the package or from a folder of it."""
    name = name.rstrip("/")
    return any(path == name or path.endswith(f"/{name}") for path in files())


@cache
def modules():
    """Files of each module of the package, of the tests and of the benchmarks, by its last word."""
    results: dict[str, list[Path]] = {}
    for path in [*PACKAGE.rglob("*.py"), *(ROOT / "tests").rglob("*.py"), *(ROOT / "benchmarks").rglob("*.py")]:
        results.setdefault(path.parent.name if path.stem == "__init__" else path.stem, []).append(path)
    return results


@cache
def names_in(word):
    """Names that the modules of one last word define, and the modules of a package of that name."""
    scene: set[str] = set()
    for path in modules()[word]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                scene.add(node.name)
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                scene.add(node.id)
            elif isinstance(node, ast.alias):
                scene.add((node.asname or node.name).split(".")[0])
        if path.stem == "__init__" and path.is_relative_to(PACKAGE):
            scene.update(child.stem for child in path.parent.iterdir())
    return frozenset(scene)


def called(name):
    """Return what is wrong with a dotted name whose first words are modules of this package; "" for nothing."""
    *words, last = name.split(".")
    if words[0] == "loomopt":
        words = words[1:]
    if not words or words[-1] not in modules():
        return "" if set(words) <= all_words() else f"no word of {name}"
    return "" if last in names_in(words[-1]) else f"{words[-1]} has no {last}"


@cache
def all_words():
    """Return every word of the code, of scenes, tests and settings."""
    kinds = ("loomopt/**/*.py", "loomopt/**/*.toml", "problems/*.toml", "tests/**/*.py", "benchmarks/**/*.py")
    paths = {path for kind in (*kinds, "docs/*.py") for path in ROOT.glob(kind)} - {Path(__file__)}
    texts = [path.read_text(encoding="utf-8") for path in paths]
    return frozenset(word for text in texts for word in re.findall(r"\w+", text))


@cache
def command_line():
    """Return the names of all commands, and all their options."""
    import typer

    from loomopt.interface.cli.app import application

    group = typer.main.get_command(application([]))
    commands = dict(group.commands)  # type: ignore[attr-defined]
    options = {
        name
        for command in commands.values()
        for option in command.params
        for name in (*option.opts, *option.secondary_opts)
    }
    return frozenset(commands), frozenset(options)


def faults(page):
    """Return the names of a page that lead nowhere."""
    text = page.read_text(encoding="utf-8")
    names = [name for name in quoted(page) if name not in EXAMPLES and not any(word in name for word in ANY)]
    results = [f"no file {name}" for name in names if FILE.fullmatch(name) and not is_file(name)]
    for path, test in TEST.findall(text):
        if not (ROOT / path).exists() or f"def {test}(" not in (ROOT / path).read_text(encoding="utf-8"):
            results.append(f"no test {path}::{test}")
    dotted = [
        name
        for name in names
        if DOTTED.fullmatch(name) and name.split(".")[0] not in DATA and not name.endswith(ENDINGS)
    ]
    results += [report for name in dotted if not FILE.fullmatch(name) and (report := called(name))]
    results += [
        f"no word {name}"
        for name in names
        if WORD.fullmatch(name) and name not in all_words() and name not in text.replace(f"`{name}`", "")
    ]
    commands, options = command_line()
    results += [
        f"no option {name}" for name in sorted(set(OPTION.findall(text))) if name not in options and name not in OTHERS
    ]
    return results + [f"no command {name}" for name in sorted(set(COMMAND.findall(text))) if name not in commands]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_names_of_a_page_are_there(page):
    assert faults(page) == []


@pytest.mark.parametrize(
    "wrong",
    [
        *("`crank_rocker_faults.fault`", "`crank_rocker.no_such`", "`rapier_faults`", "`studies/no_such.py`"),
        *("`no/folder/`", "`--no-such-option`", "`loomopt frobnicate`", "`tests/hard/test_hard_cams.py::test_nothing`"),
    ],
)
def test_a_wrong_name_is_found(wrong, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"Cure: {wrong} does it.\n", encoding="utf-8")
    assert len(faults(page)) == 1


def test_every_study_and_every_part_key_has_its_place_in_the_pages():
    """Folders and files of studies stand in the architecture, keys of parts in the page of linkages."""
    from loomopt.jobs.linkage.parts import KEYS

    text = (ROOT / "docs" / "development" / "architecture.md").read_text(encoding="utf-8")
    names = [path.stem for path in (PACKAGE / "studies").iterdir() if not path.stem.startswith("_")]
    assert [name for name in names if name not in text] == []
    rows = (ROOT / "docs" / "reference" / "linkages.md").read_text(encoding="utf-8").splitlines()
    lines = {kind: next(line for line in rows if line.startswith(f"| `{kind}`")) for kind in KEYS}
    assert [(kind, key) for kind, keys in KEYS.items() for key in keys if f"`{key}`" not in lines[kind]] == []
