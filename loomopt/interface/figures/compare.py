"""Curves of several designs laid over each other: a panel per curve, a colour per design."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from loomopt.base.units import factor
from loomopt.interface import tables
from loomopt.interface.figures import figure
from loomopt.interface.figures.curves import shown_unit, turned
from loomopt.interface.figures.figure import COLOURS, STYLES, Entry
from loomopt.jobs import registry
from loomopt.model.session import working
from loomopt.picture.job_views import Marks
from loomopt.picture.panels import Panel, each, in_units
from loomopt.scenes.designs import Design, flat
from loomopt.scenes.scene import Scene

WIDTH, HIGH = 11.0, 1.7
"""Of the figure and of a row of panels with its title, inches."""


@working()
def overlaid(found: Sequence[tuple[str, Scene, Design]]) -> Any:
    """Return the figure of designs, named, in their scenes and in the units of the first one's scene."""
    from matplotlib.lines import Line2D
    from matplotlib.ticker import MultipleLocator

    scene, first = found[0][1:]
    view, unit = registry.of(scene).views, scene.shown_in("angle")
    turns = [turned(tables.curves(home, own), _marks(home, own), unit) for _, home, own in found]
    columns = dict.fromkeys(column for turn in turns for column in turn.columns.columns)
    known = view.panels(scene, flat(first), tuple(turns[0].columns.columns))
    panels = [*known, *(panel for panel in each(tuple(columns)) if panel.columns[0] not in turns[0].columns)]
    alone = [
        Panel((column,), label, unit=in_units(scene, panel).unit)
        for panel in panels
        for column, label in _curves(panel)
    ]
    rows, title = math.ceil(len(alone) / 2), f"{scene.name}: designs compared, curves over the cycle"
    with figure.own_style(title, *(name for name, *_ in found), *(panel.title for panel in alone)):
        page = figure.page(WIDTH, HIGH * rows + 1.2, title)
        grid = page.add_gridspec(rows, 2)
        shared: Any = None
        for place, panel in enumerate(alone):
            column, row = divmod(place, rows)
            shared = axes = page.add_subplot(grid[row, column], sharex=shared)
            size, last = factor(shown_unit(panel)), row == rows - 1 or place == len(alone) - 1
            for k, turn in enumerate(turns):
                if panel.columns[0] in turn.columns:
                    style = STYLES[k % len(STYLES)] if k >= len(COLOURS) else "-"
                    x = turn.angles / math.degrees(factor(unit))
                    axes.plot(
                        x,
                        turn.of(panel.columns[0]) / size,
                        color=COLOURS[k % len(COLOURS)],
                        linestyle=style,
                        linewidth=1.3,
                    )
            axes.tick_params(labelbottom=last)
            if last:
                axes.set_xlabel(f"{view.angle} phi [{unit}]", fontsize=9)
            if unit == "deg":
                axes.xaxis.set_major_locator(MultipleLocator(90 * round(turns[0].whole / 360)))
            axes.axhline(0.0, color="#9ca3af", linewidth=0.6, zorder=1) if np.prod(axes.get_ylim()) < 0 else None
            figure.frame(axes)
            called = shown_unit(panel)
            figure.head(axes, f"{panel.title}{'' if called == '1' else f' [{called}]'}")
        entries: list[Entry] = [(_line(Line2D, k), name) for k, (name, *_) in enumerate(found)]
        page.finish(HIGH * rows + 1.2 + figure.below(page, entries))
    return page


def _line(made: Any, k: int) -> Any:
    """Return what the legend shows of a design."""
    return made([], [], color=COLOURS[k % len(COLOURS)], linestyle="-" if k < len(COLOURS) else STYLES[k % len(STYLES)])


def _curves(panel: Panel) -> list[tuple[str, str]]:
    return list(zip(panel.columns, panel.labels, strict=True))


def _marks(scene: Scene, design: Design) -> Marks:
    job = registry.of(scene)
    return job.views.marks(scene, {**job.today(scene), **flat(design)})
