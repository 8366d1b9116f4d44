"""Run the notebooks, each from a clean kernel, and write their outputs.

    python notebooks/run.py [NAME]...            (or: make notebooks)

What differs from run to run is left out: times, addresses, versions. The suite runs them too and compares what they say
with what stands there (tests/end_to_end/test_notebooks.py).
"""

import base64
import hashlib
import io
import math
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode
from PIL import Image

FOLDER = Path(__file__).parent
ROOT = FOLDER.parent
STORE = ROOT / "build" / "executed"
LONGEST = 600
"""Seconds that a cell may take."""
CLOSE, NOTHING = 1e-5, 1e-8
"""Numbers are shown with six digits: the relative difference of two that agree; below the latter all are rounding."""
PICTURES = ("image/png", "image/svg+xml")
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}
_TIME = re.compile(r"<p>Time: .*?</p>", re.DOTALL)
_SEARCH = re.compile(r"\d+ of \d+ reached|reached by \d+ solves?")
"""How far a search came, which rounding may change from machine to machine."""
_SVG = re.compile(r"<svg.*?</svg>", re.DOTALL)
_DIGITS = re.compile(r"(\.\d\d)\d+")
"""Digits of a drawing beyond a hundredth of a millimetre, which no page shows."""
_LETTERS = re.compile(r"<text[^>]*>([^<]*)<")
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?(?!\w)")


def paths() -> list[Path]:
    """Return the notebooks."""
    return sorted(FOLDER.glob("*.ipynb"))


def read(path: Path) -> NotebookNode:
    """Return a notebook as it stands there."""
    return nbformat.read(path, as_version=4)


def executed(path: Path) -> NotebookNode:
    """Return a notebook run from a clean kernel, without what differs from run to run. Raises what a cell raises."""
    notebook = read(path)
    with tempfile.TemporaryDirectory() as folder:  # no start-up files and no history of the user's
        environment = os.environ | {"PYTHONPATH": str(ROOT), "IPYTHONDIR": folder}
        client = NotebookClient(
            notebook,
            timeout=LONGEST,
            kernel_name="python3",
            record_timing=False,
            coalesce_streams=True,
            resources={"metadata": {"path": folder}},
            extra_arguments=["--log-level=ERROR"],
        )
        client.execute(env=environment)
    notebook.metadata = nbformat.from_dict(METADATA)
    for cell in notebook.cells:
        cell.metadata = {}
        if "outputs" in cell:  # progress is an empty line in the end, and there where a cell has taken a second
            cell.outputs = [output for output in cell.outputs if output.get("data") != {"text/plain": ""}]
        for output in cell.get("outputs", ()):
            if "data" in output:
                output.metadata = {}
            _clean(output.get("data", {}))
    return notebook


def program() -> str:
    """Return what all that notebooks say depends on: a digest of the program, its problems and this file."""
    state = hashlib.sha256()
    for path in sorted([*ROOT.glob("loomopt/**/*"), *ROOT.glob("problems/*"), Path(__file__)]):
        if path.is_file() and path.suffix != ".pyc":
            state.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return state.hexdigest()


def stored_run(path: Path) -> NotebookNode:
    """Return `executed`; of a notebook and a program that were run before what came of it then, from build/executed."""
    sources = "\0".join(f"{cell.cell_type} {cell.source}" for cell in read(path).cells)
    digest = hashlib.sha256(f"{program()}\0{sources}".encode()).hexdigest()[:16]
    place = STORE / f"{path.stem}-{digest}.ipynb"
    if not place.exists():
        executed_notebook = executed(path)
        place.parent.mkdir(parents=True, exist_ok=True)
        unfinished = place.with_suffix(f".{os.getpid()}")
        nbformat.write(executed_notebook, unfinished)
        unfinished.replace(place)
    return read(place)


def _clean(data: NotebookNode) -> None:
    """Leave out of one output its time, and its plain text where it shows more than that; make its pictures small."""
    for kind in data.keys() & {"text/html", "image/svg+xml"}:
        data[kind] = _SVG.sub(lambda drawn: _DIGITS.sub(r"\1", drawn[0]), _TIME.sub("", data[kind]))
    if "image/png" in data:
        data["image/png"] = _small(data["image/png"])
    if len(data) > 1:
        data.pop("text/plain", None)


def _small(picture: str) -> str:
    """Return a PNG, base64, in at most 256 colours: a diagram has no more."""
    drawn, reduced = Image.open(io.BytesIO(base64.b64decode(picture))), io.BytesIO()
    few = drawn.convert("RGB").quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    few.save(reduced, "PNG", optimize=True)
    return base64.b64encode(reduced.getvalue()).decode()


def texts(notebook: NotebookNode) -> Iterator[tuple[str, str]]:
    """Yield each code cell's id with all that its outputs say; of a picture its letters, or that it is one."""
    for cell in notebook.cells:
        if cell.cell_type == "code":
            yield cell.id, "\n".join(text for output in cell.outputs for text in _texts(output))


def _texts(output: NotebookNode) -> Iterator[str]:
    yield _SEARCH.sub("reached by #", output.get("text", output.output_type))
    for kind, value in sorted(output.get("data", {}).items()):
        yield kind
        if kind not in PICTURES:
            yield _SEARCH.sub("reached by #", _SVG.sub(lambda drawn: _letters(drawn[0]), value))
        elif "svg" in kind:
            yield _letters(value)


def _letters(drawn: str) -> str:
    """Return the texts of a drawing."""
    return "\n".join(_LETTERS.findall(drawn))


def differences(stored: NotebookNode, executed_notebook: NotebookNode) -> list[str]:
    """Return what two runs of a notebook say differently, cell by cell; numbers agree to the digits that are shown."""
    before, after = dict(texts(stored)), dict(texts(executed_notebook))
    if list(before) != list(after):
        return ["the notebook has other cells"]
    return [f"{name}: {change}" for name in before for change in _apart(before[name], after[name])]


def _apart(before: str, after: str) -> list[str]:
    """Return where two texts differ, at most one number and the words around it."""
    if _NUMBER.sub("#", before) != _NUMBER.sub("#", after):
        return [f"other words: {before!r} and {after!r}"]
    pairs = zip(_NUMBER.findall(before), _NUMBER.findall(after), strict=True)
    return [f"{first} is now {second}" for first, second in pairs if not _alike(float(first), float(second))][:1]


def _alike(first: float, second: float) -> bool:
    return math.isclose(first, second, rel_tol=CLOSE, abs_tol=NOTHING)


def main(names: list[str]) -> None:
    """Run the notebooks of these names, or all, and write them."""
    for path in paths():
        if not names or path.stem in names:
            nbformat.write(executed(path), path)


if __name__ == "__main__":
    main(sys.argv[1:])
