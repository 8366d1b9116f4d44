"""Write the parts of the documents that come from the program: glossary, sketches, and outputs and tables of pages.

    python docs/write.py            (or: make outputs)

A page is run from top to bottom in an empty folder. A block after "`NAME`:" is a file; a block after "Add to `NAME`:"
is appended to it. The command of a ```console block is run and its output compared; ```sh and ```python blocks are run.

The test suite compares the result with the files (tests/end_to_end/test_documents.py).
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
from loomopt.interface.answer_table import rows
from loomopt.interface.cli.app import run
from loomopt.interface.files import outputs, svg
from loomopt.interface.text import glossary
from loomopt.jobs import registry
from loomopt.picture.table import TextTable
from loomopt.solving.answer.solution import UnitFormatter

DOCS = Path(__file__).parent
GLOSSARY = DOCS / "reference" / "glossary.md"
PAGES = (DOCS.parent / "README.md", *sorted(set(DOCS.rglob("*.md")) - {GLOSSARY}))
"""Pages that are written by hand, except outputs and tables."""
WIDTH = "100"
"""Columns of the outputs that pages show."""
BLOCK = re.compile(r"^```console\n\$ loomopt (.*)\n((?:.*\n)*?)```$", re.MULTILINE)
STEP = re.compile(r"(?:^(Add to )?`([\w.-]+)`:\n\n)?^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NOT_HERE = "# needs "
"""Start of a Python block that is only compiled."""
TABLE = re.compile(r"(<!-- (symbols|effects) of (\S+) -->\n)(?:.*\n)*?(<!-- end -->)")
SHOWN = {"linkage": "sixbar-sley"}
"""Jobs without a packaged scene of the same name → the scene that pages show."""
LEFT_OUT = "..."
CHANGES = re.compile(
    r"(?<=limits )\S+(?=, stat)|(?<=stationarity )[^,]+|(?<=cycle )[^;]+|\(\d+$|\b\d+\.\d+ s\b|Time: .*"
)
"""Texts that differ between runs or machines: times, rounding, and the progress of a search."""


def glossary_text() -> str:
    """Text of docs/reference/glossary.md."""
    parts = [
        "# Glossary\n",
        "Every symbol that a table shows. `loomopt show PROBLEM --symbols` prints it for any scene, in its own\n"
        "units; here they are those of the packaged ones. An x marks what the sketch names. Joints are the sketch's.\n",
        "This page is written by `make outputs`; its words stand in the program.\n",
    ]
    for job in registry.builtin_names():
        scene = registry.load(SHOWN.get(job, job))
        title, *grids = glossary.parts(scene)
        parts.append(
            f"## {str(title).removeprefix(f'{scene.name}: ').capitalize()}\n\n![Sketch](../sketch-{job}.svg)\n"
        )
        parts += [f"### {grid.title}\n\n{table(grid)}" for grid in grids if isinstance(grid, TextTable)]
    return "\n".join(parts)


def table(grid: TextTable) -> str:
    """A table as Markdown."""
    lines = [grid.columns, ("---",) * len(grid.columns), *grid.lines]
    return "".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |\n" for line in lines)


def sketches() -> dict[str, str]:
    """Drawings of the packaged machines as SVG, by file name."""
    drawings = {}
    for name in registry.builtin_names():
        scene = registry.load(SHOWN.get(name, name))
        drawings[f"sketch-{name}.svg"] = svg.render(
            outputs.drawing(scene, glossary.sketch_design(scene), outputs.DrawnSubject("sketch"))
        )
    return drawings


def output(words: str) -> list[str]:
    """Lines that a command prints; `> FILE` also writes them to a file."""
    printed = io.StringIO()
    command, _, file = words.partition(" > ")
    with contextlib.redirect_stdout(printed), mock.patch.dict(os.environ, COLUMNS=WIDTH):
        status = run(shlex.split(command, comments=True))
    if status:
        raise SystemExit(f"loomopt {words} ends with exit status {status}")
    if file:
        Path(file.split()[0]).write_text(printed.getvalue(), encoding="utf-8")
    return printed.getvalue().rstrip("\n").split("\n")


def run_page(text: str) -> Iterator[tuple[str, list[str]]]:
    """Run a page in the current folder; yield every command with an output, and the lines that it prints now."""
    names: dict[str, object] = {"__name__": "page"}
    for more, file, kind, body in STEP.findall(text):
        if file:
            with Path(file).open("a" if more else "w", encoding="utf-8") as opened:
                opened.write(body)
        elif kind == "console" and body.startswith("$ loomopt "):
            words = body.partition("\n")[0].removeprefix("$ loomopt ")
            yield words, output(words)
        elif kind == "sh":
            for line in body.replace("\\\n", " ").splitlines():
                output(line.removeprefix("loomopt "))
        elif kind == "python":
            code = compile(body, "page", "exec")
            if not body.startswith(NOT_HERE):
                exec(code, names)


def mask(line: str) -> str:
    """A line without the texts that differ between runs."""
    return CHANGES.sub("#", line.rstrip())


def lines_agree(lines: list[str], printed: list[str]) -> bool:
    """Whether lines of a page agree with those that a command prints; "..." stands for any lines."""
    words = [r"(?:.*\n)*?" if line.strip() == LEFT_OUT else re.escape(mask(line)) + r"\n" for line in lines]
    return re.fullmatch("".join(words), "".join(f"{mask(line)}\n" for line in printed)) is not None


def update_lines(lines: list[str], printed: list[str]) -> list[str]:
    """Lines of a page with the current output; a line is matched by its first word."""
    if lines_agree(lines, printed) or not lines:
        return lines or printed
    new_lines, rest = [], iter(printed)
    for line in lines:
        if line.strip() == LEFT_OUT or not line.strip():
            new_lines.append(line)
        else:
            new_lines.append(next((now for now in rest if now.split()[:1] == line.split()[:1]), line))
    return new_lines


def symbols(name: str) -> str:
    """Symbols of a scene's answer with their meaning, as Markdown."""
    scene = registry.load(name)
    meanings = {symbol.name: symbol.text for symbol in glossary.symbols(scene)}
    formatter = UnitFormatter(scene)
    shown = [row.name for row in rows(api.evaluate(scene).result, scene)]
    lines = tuple((f"`{name}`", formatter.unit(name).removeprefix("1"), meanings[name]) for name in shown)
    return table(TextTable("", ("symbol", "unit", "what it is"), lines))


def effects(name: str) -> str:
    """Effects of a job, as Markdown."""
    known = registry.load(SHOWN.get(name, name)).schema.effects.values()
    lines = tuple((f"`{effect.name}`", type(effect).__name__.lower(), effect.summary) for effect in known)
    return table(TextTable("", ("effect", "kind", "what it is"), lines))


def rewrite_table(match: re.Match[str]) -> str:
    """A table between its marks with its current contents."""
    write = {"symbols": symbols, "effects": effects}[match[2]]
    return f"{match[1]}{write(match[3])}{match[4]}"


def page_text(text: str) -> str:
    """A page with its current outputs and tables."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        printed = iter(list(run_page(text)) if BLOCK.search(text) else ())

    def block(match: re.Match[str]) -> str:
        lines = update_lines(match[2].rstrip("\n").split("\n") if match[2] else [], next(printed)[1])
        return "```console\n$ loomopt " + match[1] + "\n" + "\n".join(lines) + "\n```"

    return TABLE.sub(rewrite_table, BLOCK.sub(block, text))


def documents() -> Iterator[tuple[Path, str]]:
    """Yield every file with its current text."""
    yield GLOSSARY, glossary_text()
    for name, drawing in sketches().items():
        yield DOCS / name, drawing
    for page in PAGES:
        yield page, page_text(page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    for path, text in documents():
        path.write_text(text, encoding="utf-8")
