"""What moves an optimum as a tornado: a bar for each number, by its tolerance or by 1 %, the largest on top."""

import functools
from pathlib import Path
from typing import Any

from loomopt.base.errors import BadInput
from loomopt.base.files import atomically, suffix
from loomopt.interface.figures.figure import COLOURS, own_style, page, save
from loomopt.interface.files import outputs
from loomopt.interface.text import sensitivity
from loomopt.picture.shapes import plain
from loomopt.solving.answer.solution import Words
from loomopt.studies.sensitivity.study import Found

WIDTH, BAR, ROOM, MOST = 7.0, 0.24, 0.9, 20
"""Inches: of the page, of a bar, beside the bars of a panel; bars of a panel at most."""


def plot(found: Found, path: Path | None = None) -> Any:
    """Return a study's tornado, a panel for each figure sought; path: a file to write it to. Raises BadInput."""
    if path:
        suffix(path, outputs.PICTURES)
    panels = {name: sensitivity.lines(found, name)[:MOST] for name in sensitivity.sought(found)}
    if not panels:
        raise BadInput("there is nothing to draw: no number moves what is sought")
    title = f"{found.scene.name}, {found.target}: what moves the optimum, by one sigma or 1 %"
    with own_style(title, *(name for bars in panels.values() for name, _ in bars)):
        rows = [len(bars) for bars in panels.values()]
        drawn = page(WIDTH, BAR * sum(rows) + ROOM * len(rows) + 0.3, title)
        grid = drawn.add_gridspec(len(panels), 1, height_ratios=[BAR * n + ROOM for n in rows])
        for place, (name, bars) in enumerate(panels.items()):
            axes = drawn.add_subplot(grid[place])
            ends = [value for _, value in bars]
            for sign, colour in ((1, COLOURS[0]), (-1, COLOURS[1])):
                axes.barh(range(len(bars)), [sign * value for value in ends], 0.7, color=colour, alpha=0.85)
            axes.set_yticks(range(len(bars)), [plain(called) for called, _ in bars])
            axes.set_ylim(len(bars) - 0.4, -0.6)
            axes.axvline(0.0, color="#111827", linewidth=0.8)
            unit = Words(found.scene).unit(name)
            axes.set_xlabel(plain(f"{name} [{unit}]; a number up (first colour) and down"))
            axes.spines[["top", "right", "left"]].set_visible(False)
    if path:
        atomically(path, functools.partial(save, drawn))
    return drawn
