"""Files for people and other programs: answers, curves and drawings, each written whole or not at all."""

import functools
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from loomopt import tables
from loomopt.errors import BadInput
from loomopt.jobs.tasks import TASKS
from loomopt.solving.solution import Solution
from loomopt.store import atomically, suffix

PICTURES = (".png", ".svg", ".pdf")
CURVES = (".csv", ".parquet", *PICTURES)
DRAWINGS = (".svg", ".dxf", ".csv")


def text(path: Path, content: str) -> None:
    """Write text. Raises BadInput where it cannot be written."""
    atomically(path, lambda place: _put(content, place))


def _put(content: str, place: Path) -> None:
    place.write_text(content, encoding="utf-8")


def answer(folder: Path, solution: Solution, scene: Any) -> list[Path]:
    """Write an answer into a folder: answer.json, table.csv, curves.csv, linkage.svg; returns the files."""
    from loomopt.views import drawing, svg

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"the folder cannot be made: {error.strerror}", file=str(folder), key="--out") from None
    contents = {
        "answer.json": json.dumps(solution.as_dict(), indent=1) + "\n",
        "table.csv": tables.csv(tables.answer(solution, scene)),
        "curves.csv": tables.csv(tables.curves(scene, solution.design)),
        "linkage.svg": svg.render(drawing.linkage(solution.design, scene.name)),
    }
    for name, content in contents.items():
        text(folder / name, content)
    return [folder / name for name in contents]


def curves(path: Path, scene: Any, design: Mapping[str, float]) -> None:
    """Write a design's curves as CSV, Parquet or a figure, by the file's ending."""
    ending = suffix(path, CURVES)
    frame = tables.curves(scene, design)
    if ending == ".csv":
        text(path, tables.csv(frame))
    elif ending == ".parquet":
        atomically(path, frame.to_parquet)
    else:
        from loomopt.views import figure

        marks = TASKS[scene.job.name].marks(scene, {**TASKS[scene.job.name].today(scene), **design})
        atomically(path, functools.partial(_figure, figure, frame, scene.title, marks))


def _figure(figure: Any, frame: Any, title: str, marks: Mapping[str, float], place: Path) -> None:
    figure.curves(frame, place, title, marks)


def linkage(path: Path, scene: Any, design: Mapping[str, float]) -> None:
    """Write a design's linkage in both dead centres: SVG or DXF at true scale, or its joints as CSV."""
    from loomopt.views import drawing, dxf, svg

    ending = suffix(path, DRAWINGS)
    full = {**TASKS[scene.job.name].today(scene), **design}
    if ending == ".csv":
        text(path, drawing.joints_csv(full))
    elif ending == ".svg":
        text(path, svg.render(drawing.linkage(full, scene.name)))
    else:
        atomically(path, functools.partial(dxf.write, drawing.linkage(full, scene.name)))


def picture(path: Path, scene: Any, design: Mapping[str, float]) -> None:
    """Draw a design's linkage in both dead centres as a picture."""
    from loomopt.views import drawing, figure

    suffix(path, PICTURES)
    full = {**TASKS[scene.job.name].today(scene), **design}
    atomically(path, functools.partial(figure.draw, drawing.linkage(full, scene.name)))
