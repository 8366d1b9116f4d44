"""Mutants of the solver's rooms: would the tests notice a wrong number, comparison or sign?

    python benchmarks/adversarial/mutants.py [--count 150] [--seed 0] [--workers 2] [--only FILE] [--list]

A fixed random choice of small changes in loomopt/solving and loomopt/physics/tolerances.py is made one
at a time, in a copy of the package, and the tests that mirror the changed file are run against it:
tests/FOLDER/test_FILE*.py (for a tolerance, those of every file that reads it). A mutant that no test notices survives,
and is printed. Tests that fail without any mutant would notice everything, so each is run on the files as they are
first."""

import argparse
import ast
import concurrent.futures
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
ROOMS = ("solving",)
TOLERANCES = "loomopt/physics/tolerances.py"
SECONDS = 600
"""After which a mutant has been noticed: it does not end."""
COMPARED = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}
SIGNS = {"+": "-", "-": "+"}
OPERATORS = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.Add: "+",
    ast.Sub: "-",
}


@dataclass(frozen=True)
class Mutant:
    """One change: file from the top, line and column where it begins and ends, what stands there and what shall."""

    file: str
    line: int
    begin: int
    end: int
    old: str
    new: str

    def __str__(self) -> str:
        """Return where it is and what it changes."""
        return f"{self.file}:{self.line}: {self.old} -> {self.new}"

    def applied(self, source: str) -> str:
        """Source with the change; columns count bytes, as the syntax tree does."""
        lines = source.splitlines(keepends=True)
        raw = lines[self.line - 1].encode()
        lines[self.line - 1] = (raw[: self.begin] + self.new.encode() + raw[self.end :]).decode()
        return "".join(lines)


def mutants(file: str) -> Iterator[Mutant]:
    """Yield every change of a file that is looked at."""
    source = (TOP / file).read_text(encoding="utf-8")
    lines = [line.encode() for line in source.splitlines()]

    def operator_mutants(left: ast.expr, right: ast.expr, old: str, new: str) -> Iterator[Mutant]:
        if left.end_lineno != right.lineno or left.end_col_offset is None:
            return
        at = lines[right.lineno - 1].find(old.encode(), left.end_col_offset, right.col_offset)
        if at >= 0:
            yield Mutant(file, right.lineno, at, at + len(old.encode()), old, new)

    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and type(node.value) is not bool:
            for new in _numbers(node.value):
                old = lines[node.lineno - 1][node.col_offset : node.end_col_offset].decode()
                yield Mutant(file, node.lineno, node.col_offset, node.end_col_offset, old, new)
        elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in OPERATORS:
            old = OPERATORS[type(node.ops[0])]
            yield from operator_mutants(node.left, node.comparators[0], f" {old} ", f" {COMPARED[old]} ")
        elif isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            old = OPERATORS[type(node.op)]
            yield from operator_mutants(node.left, node.right, f" {old} ", f" {SIGNS[old]} ")
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            yield Mutant(file, node.lineno, node.col_offset, node.col_offset + 1, "-", "+")


def _numbers(value: float) -> tuple[str, ...]:
    """Return what a number becomes: a whole one the next, another a thousand times itself."""
    return (repr(value + 1),) if isinstance(value, int) else (repr(value * 1000 if value else 1.0),)


def files() -> list[str]:
    """Files that are changed, in order."""
    results = [str(path.relative_to(TOP)) for room in ROOMS for path in sorted((TOP / "loomopt" / room).rglob("*.py"))]
    return [TOLERANCES, *(name for name in results if not name.endswith("__init__.py"))]


def chosen(count: int, seed: int, only: str) -> list[Mutant]:
    """Fixed random choice, spread over the files by how much there is to change in each."""
    every = [mutant for file in files() if only in file for mutant in mutants(file)]
    return sorted(random.Random(seed).sample(every, min(count, len(every))), key=str)


def tests(mutant: Mutant) -> list[str]:
    """Tests that mirror a mutant's file."""
    if mutant.file == TOLERANCES:
        name = _assigned(mutant)
        readers = [
            file for file in files()[1:] if name and name in (TOP / file).read_text(encoding="utf-8").split("def ")[0]
        ]
    else:
        readers = [mutant.file]
    results = []
    for file in readers:
        folder = TOP / "tests" / Path(file).relative_to("loomopt").parent
        results += sorted(folder.glob(f"test_{Path(file).stem}*.py"))
    return [str(path.relative_to(TOP)) for path in dict.fromkeys(results)]


def _assigned(mutant: Mutant) -> str:
    """Name of the tolerance that a mutant changes."""
    for node in ast.parse((TOP / mutant.file).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and node.lineno <= mutant.line <= (node.end_lineno or node.lineno):
            targets = [n.id for n in ast.walk(node.targets[0]) if isinstance(n, ast.Name)]
            values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
            places = [k for k, v in enumerate(values) if v.col_offset <= mutant.begin <= (v.end_col_offset or 0)]
            return targets[places[0] if places and len(targets) == len(values) else 0]
    return ""


def noticed(mutant: Mutant) -> tuple[bool, str]:
    """Whether the tests notice a mutant, and in which words."""
    mirrored = tests(mutant)
    return failed(mirrored, mutant) if mirrored else (False, "no test mirrors the file")


def failed(mirrored: Sequence[str], mutant: Mutant | None = None) -> tuple[bool, str]:
    """Whether tests fail on a copy of the package with a mutant, or with none, and in which words."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(TOP / "loomopt", Path(folder) / "loomopt", ignore=shutil.ignore_patterns("__pycache__"))
        for neighbour in ("problems", "results", "docs", "benchmarks", "tests", "pyproject.toml"):
            (Path(folder) / neighbour).symlink_to(TOP / neighbour)
        if mutant:
            place = Path(folder) / mutant.file
            place.write_text(mutant.applied(place.read_text(encoding="utf-8")), encoding="utf-8")
        threads = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
        environment = {**os.environ, **threads, "PYTHONPATH": folder, "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *mirrored]
        try:
            done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=SECONDS)
        except subprocess.TimeoutExpired:
            return True, "it does not end"
    last = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return done.returncode != 0, last[0] if last else f"exit {done.returncode}"


def main() -> None:
    """Run the chosen mutants and print those that survive."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=150)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", default="", help="a part of the names of the files to look at")
    parser.add_argument("--list", action="store_true", help="name the mutants and their tests, run nothing")
    options = parser.parse_args()
    picked = chosen(options.count, options.seed, options.only)
    if options.list:
        for mutant in picked:
            print(mutant, "|", " ".join(tests(mutant)) or "no test mirrors the file")
        return
    survivors = 0
    with concurrent.futures.ThreadPoolExecutor(options.workers) as pool:
        alone = list(dict.fromkeys(test for mutant in picked for test in tests(mutant)))
        broken = [words for result, words in pool.map(lambda test: failed([test]), alone) if result]
        if broken:
            sys.exit("\n".join(["Without any mutant:", *broken]))
        for mutant, (result, words) in zip(picked, pool.map(noticed, picked), strict=True):
            survivors += not result
            print("noticed " if result else "SURVIVES", mutant, "|", words, flush=True)
    print(f"{survivors} of {len(picked)} survive")


if __name__ == "__main__":
    main()
