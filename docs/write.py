"""Write what the documents take from the program: glossary, sketches, and the outputs and words of all pages.

    python docs/write.py            (or: make outputs)

A page is carried out from top to bottom in a folder of its own. A block after "`NAME`:" is a file, after "Add to
`NAME`:" its end; of ```console the command is run and its output compared, ```sh and ```python are run.

The suite compares all of it with what stands there (tests/end_to_end/test_documents.py).
"""

import contextlib
import io
import os
import re
import shlex
import tempfile
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

from loomopt.interface import api
from loomopt.interface.cli.app import run
from loomopt.interface.files import outputs, svg
from loomopt.interface.tables import rows
from loomopt.interface.text import glossary
from loomopt.jobs import registry
from loomopt.picture.table import TextTable
from loomopt.solving.answer.solution import Words

DOCS = Path(__file__).parent
GLOSSARY = DOCS / "reference" / "glossary.md"
PAGES = (DOCS.parent / "README.md", *sorted(set(DOCS.rglob("*.md")) - {GLOSSARY}))
"""What is written by hand, but for outputs and tables."""
WIDTH = "100"
"""Columns of the outputs that pages show."""
BLOCK = re.compile(r"^```console\n\$ loomopt (.*)\n((?:.*\n)*?)```$", re.MULTILINE)
STEP = re.compile(r"(?:^(Add to )?`([\w.-]+)`:\n\n)?^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NOT_HERE = "# needs "
"""Begins Python that is only compiled."""
TABLE = re.compile(r"(<!-- (symbols|effects) of (\S+) -->\n)(?:.*\n)*?(<!-- end -->)")
SHOWN = {"linkage": "sixbar-sley"}
"""Jobs without a packaged scene of their own name → the one that pages show."""
LEFT_OUT = "..."
CHANGES = re.compile(
    r"(?<=limits )\S+(?=, stat)|(?<=stationarity )[^,]+|(?<=cycle )[^;]+|\(\d+$|\b\d+\.\d+ s\b|Time: .*"
)
"""What differs from run to run or from machine to machine: times, rounding, and how far a search came."""


def glossary_text() -> str:
    """Return docs/glossary.md."""
    parts = [
        "# Glossary\n",
        "Every symbol that a table shows. `loomopt show PROBLEM --symbols` prints it for any scene, in its own\n"
        "units; here they are those of the packaged ones. An x marks what the sketch names. Joints are the sketch's.\n",
        "This page is written by `make outputs`; its words stand in the program.\n",
    ]
    for job in registry.own_names():
        scene = registry.load(SHOWN.get(job, job))
        title, *grids = glossary.parts(scene)
        parts.append(
            f"## {str(title).removeprefix(f'{scene.name}: ').capitalize()}\n\n![Sketch](../sketch-{job}.svg)\n"
        )
        parts += [f"### {grid.title}\n\n{table(grid)}" for grid in grids if isinstance(grid, TextTable)]
    return "\n".join(parts)


def table(grid: TextTable) -> str:
    """Return a table as Markdown."""
    lines = [grid.columns, ("---",) * len(grid.columns), *grid.lines]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines)


def sketches() -> dict[str, str]:
    """Return the drawing of each job's packaged machine, by file name, as SVG."""
    found = {}
    for name in registry.own_names():
        scene = registry.load(SHOWN.get(name, name))
        found[f"sketch-{name}.svg"] = svg.render(
            outputs.drawing(scene, glossary.sketch_design(scene), outputs.DrawnSubject("sketch"))
        )
    return found


def output(words: str) -> list[str]:
    """Return what a command prints, line by line; `> FILE` writes it there too."""
    printed = io.StringIO()
    command, _, file = words.partition(" > ")
    with contextlib.redirect_stdout(printed), mock.patch.dict(os.environ, COLUMNS=WIDTH):
        status = run(shlex.split(command, comments=True))
    if status:
        raise SystemExit(f"loomopt {words} ends with exit status {status}")
    if file:
        Path(file.split()[0]).write_text(printed.getvalue(), encoding="utf-8")
    return printed.getvalue().rstrip("\n").split("\n")


def carried_out(text: str) -> Iterator[tuple[str, list[str]]]:
    """Carry out a page in the folder at hand; yield each command whose output it tells, with what it prints now."""
    names: dict[str, object] = {"__name__": "page"}
    for more, file, kind, body in STEP.findall(text):
        if file:
            with Path(file).open("a" if more else "w", encoding="utf-8") as opened:
                opened.write(body)
        elif kind == "console" and body.startswith("$ loomopt "):
            words = body.partition("\n")[0].removeprefix("$ loomopt ")
            yield words, output(words)
        elif kind == "sh":
            for line in body.splitlines():
                output(line.removeprefix("loomopt "))
        elif kind == "python":
            code = compile(body, "page", "exec")
            if not body.startswith(NOT_HERE):
                exec(code, names)


def masked(line: str) -> str:
    """Return a line without what differs from run to run."""
    return CHANGES.sub("#", line.rstrip())


def holds(told: list[str], printed: list[str]) -> bool:
    """Say whether lines of a page are those that a command prints; "..." stands for any."""
    words = [r"(?:.*\n)*?" if line.strip() == LEFT_OUT else re.escape(masked(line)) + r"\n" for line in told]
    return re.fullmatch("".join(words), "".join(f"{masked(line)}\n" for line in printed)) is not None


def updated(told: list[str], printed: list[str]) -> list[str]:
    """Return lines of a page as a command prints them now: each by the word that it begins with."""
    if holds(told, printed) or not told:
        return told or printed
    found, rest = [], iter(printed)
    for line in told:
        if line.strip() == LEFT_OUT or not line.strip():
            found.append(line)
        else:
            found.append(next((now for now in rest if now.split()[:1] == line.split()[:1]), line))
    return found


def symbols(name: str) -> str:
    """Return the symbols of a scene's answer in words, as Markdown."""
    scene = registry.load(name)
    said = {symbol.name: symbol.text for symbol in glossary.symbols(scene)}
    words = Words(scene)
    shown = [row["name"] for row in rows(api.evaluate(scene).result, scene)]
    lines = tuple((f"`{each}`", words.unit(each).removeprefix("1"), said[each]) for each in shown)
    return table(TextTable("", ("symbol", "unit", "what it is"), lines))


def effects(name: str) -> str:
    """Return the effects that scenes of a job may call for, as Markdown."""
    known = registry.load(SHOWN.get(name, name)).schema.effects.values()
    lines = tuple((f"`{each.name}`", type(each).__name__.lower(), each.summary) for each in known)
    return table(TextTable("", ("effect", "kind", "what it is"), lines))


def rewritten(match: re.Match[str]) -> str:
    """Return a table between its marks as it is now."""
    made = {"symbols": symbols, "effects": effects}[match[2]]
    return f"{match[1]}{made(match[3])}{match[4]}"


def page_text(text: str) -> str:
    """Return a page with its outputs and tables as they are now."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        printed = iter(list(carried_out(text)) if BLOCK.search(text) else ())

    def block(match: re.Match[str]) -> str:
        lines = updated(match[2].rstrip("\n").split("\n") if match[2] else [], next(printed)[1])
        return "```console\n$ loomopt " + match[1] + "\n" + "\n".join(lines) + "\n```"

    return TABLE.sub(rewritten, BLOCK.sub(block, text))


def documents() -> Iterator[tuple[Path, str]]:
    """Yield each file with what should stand in it."""
    yield GLOSSARY, glossary_text()
    for name, drawing in sketches().items():
        yield DOCS / name, drawing
    for page in PAGES:
        yield page, page_text(page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    for path, text in documents():
        path.write_text(text, encoding="utf-8")
