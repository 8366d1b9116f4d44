"""How machines spread as a figure: a histogram for each figure that judges them, with its limits and its yield."""

import functools
from pathlib import Path
from typing import Any

import numpy as np

from loomopt.base.errors import BadInput
from loomopt.base.files import atomically, suffix
from loomopt.base.units import factor
from loomopt.interface.figures.figure import COLOURS, own_style, page, save
from loomopt.interface.files import outputs
from loomopt.picture.shapes import plain
from loomopt.solving.answer.solution import Words
from loomopt.studies.tolerance.plan import Judged
from loomopt.studies.tolerance.study import BINS, REACH, Found

WIDTH, HIGH = 7.0, 1.9
"""Inches: of the page, and of a panel."""
INK, LIMIT = "#111827", COLOURS[3]


def plot(found: Found, path: Path | None = None) -> Any:
    """Return a study's histograms; path: a file to write them to as well. Raises BadInput."""
    if path:
        suffix(path, outputs.PICTURES)
    judged = {each.name: each for each in found.plan.judged if each.name in found.figures}
    levels = [level.figure for level in found.plan.program.objectives]
    names = [name for name in dict.fromkeys([*judged, *levels]) if name in found.figures and found.figures[name].sigma]
    if not names:
        raise BadInput("there is nothing to draw: no figure that judges machines spreads")
    title = f"{found.plan.scene.name}: {found.samples} machines as they are made"
    with own_style(title, *names):
        drawn = page(WIDTH, HIGH * len(names) + 0.4, title)
        for place, name in enumerate(names):
            _panel(drawn.add_subplot(len(names), 1, place + 1), found, name, judged.get(name))
    if path:
        atomically(path, functools.partial(save, drawn))
    return drawn


def _panel(axes: Any, found: Found, name: str, judged: Judged | None) -> None:
    """Draw a figure's histogram, its nominal, and the ends it is judged by."""
    each, unit = found.figures[name], Words(found.plan.scene).unit(name)
    size, reach = factor(unit), REACH * each.sigma_linear
    edges = (each.nominal + np.linspace(-reach, reach, BINS + 1)) / size
    axes.stairs(np.array(each.counts) / found.samples * 100, edges, fill=True, color=COLOURS[0], alpha=0.75)
    axes.axvline(each.nominal / size, color=INK, linewidth=0.9)
    ends = [end for end in (judged.low, judged.high) if end is not None] if judged else []
    for end in ends:
        if abs(end - each.nominal) <= reach:
            axes.axvline(end / size, color=LIMIT, linewidth=1.3, linestyle=(0, (4, 2)))
    holds = f": {100 * found.yields[name].value:.4g} % hold" if judged else ""
    axes.set_title(plain(f"{name}{holds}"), loc="left", fontsize=9)
    axes.set_xlabel(plain(unit) if unit != "1" else "")
    axes.set_ylabel("machines [%]")
    axes.spines[["top", "right"]].set_visible(False)
