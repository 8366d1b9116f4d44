"""The figure of forces: their sizes over the turn, and for each the polar diagram that a bearing is chosen by."""

import functools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from loomopt.base.files import atomically, suffix
from loomopt.base.units import factor
from loomopt.interface.figures.figure import (
    COLOURS,
    HEAD_SIZE,
    STYLES,
    Entry,
    below,
    frame,
    head,
    own_style,
    page,
    save,
)
from loomopt.interface.files import outputs
from loomopt.interface.forces import CUBIC, ROLLER, TurnedForce
from loomopt.picture.shapes import plain
from loomopt.scenes.scene import Scene

WIDTH, WIDE, POLAR, ACROSS = 9.0, 2.2, 2.6, 3
"""Inches: of the page, of the upper axes and of a polar diagram; polar diagrams in a row."""
AROUND, HEAD = 1.0, 0.9
"""Inches: of title and crank angle; above each polar diagram."""
ROOMY = 1.08
DRAWN = {
    "in the frame": (COLOURS[0], "-"),
    "reaction": (COLOURS[2], ":"),
    "on the part it acts on": (COLOURS[1], "--"),
}
"""Label of a polar curve → colour and style."""


def plot(scene: Scene, forces: Mapping[str, TurnedForce], path: Path | None = None) -> Any:
    """Figure; path: a file to write it to as well. Raises BadInput."""
    if path:
        suffix(path, outputs.PICTURES)
    drawn = _draw(scene, forces)
    if path:
        atomically(path, functools.partial(save, drawn))
    return drawn


def _draw(scene: Scene, forces: Mapping[str, TurnedForce]) -> Any:
    title = f"{scene.name}: forces over the turn, in the frame and on what turns"
    rows = math.ceil(len(forces) / ACROSS)
    high = WIDE + rows * (POLAR + HEAD) + AROUND
    with own_style(title, *forces):
        figure = page(WIDTH, high, title)
        grid = figure.add_gridspec(1 + rows, ACROSS, height_ratios=[WIDE] + [POLAR] * rows)
        over = figure.add_subplot(grid[0, :])
        entries = _sizes(over, scene, forces)
        cells = [
            (figure.add_subplot(grid[1 + place // ACROSS, place % ACROSS], label=name), name, force)
            for place, (name, force) in enumerate(forces.items())
        ]
        polar = [_polar(axes, scene, force) for axes, _, force in cells]
        foot = below(figure, list({label: (line, label) for legend in polar for line, label in legend}.values()))
        figure.get_layout_engine().execute(figure)
        above = head(over, "", entries)
        for axes, name, _ in cells:
            head(axes, name)
        figure.finish(high + foot + above / 72)
    return figure


def _sizes(axes: Any, scene: Scene, forces: Mapping[str, TurnedForce]) -> list[Entry]:
    """Draw sizes over the crank angle; return what the legend says."""
    unit, angle = scene.shown_in("force"), scene.shown_in("angle")
    entries: list[Entry] = []
    for place, (name, force) in enumerate(forces.items()):
        style = {"color": COLOURS[place % len(COLOURS)], "linestyle": STYLES[place // len(COLOURS) % len(STYLES)]}
        (line,) = axes.plot(force.phi / factor(angle), force.size / factor(unit), linewidth=1.4, **style)
        entries.append((line, name))
    axes.set_xlim(0.0, 2 * math.pi / factor(angle))
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel(plain(f"crank angle phi [{angle}]"))
    axes.set_ylabel(plain(f"size [{unit}]"))
    frame(axes)
    return entries


def _heading_texts(force: TurnedForce) -> list[str]:
    """In what words each part stands that turns with a force."""
    return list(DRAWN)[-len(force.headings) :] if force.headings else []


def _polar(axes: Any, scene: Scene, force: TurnedForce) -> list[Entry]:
    """Draw the tip of a force over the turn, from its joint as the origin; return what the legend says."""
    size = factor(scene.shown_in("force"))
    entries: list[Entry] = []
    seen = [((force.x, force.y), "in the frame")]
    seen += [(force.on(part), label) for part, label in zip(force.headings, _heading_texts(force), strict=True)]
    for (x, y), label in seen:
        colour, style = DRAWN[label]
        (line,) = axes.plot(
            *(np.append(component, component[:1]) / size for component in (x, y)), style, color=colour, linewidth=1.2
        )
        entries.append((line, label))
    peak = int(force.size.argmax())
    (line,) = axes.plot([0.0, force.x[peak] / size], [0.0, force.y[peak] / size], color="black", linewidth=0.9)
    entries.append((line, "at its peak, in the frame"))
    axes.plot(0.0, 0.0, "+", color="black")
    most = ROOMY * force.peak / size or 1.0
    axes.set(xlim=(-most, most), ylim=(-most, most), aspect="equal")
    largest, mean, ball, roller = (
        scene.show(value, "force", 4) for value in (force.peak, *map(force.mean, (1.0, CUBIC, ROLLER)))
    )
    turning = f"on {' and '.join(force.headings)}" if force.headings else ""
    lines = turning, f"peak {largest}, mean {mean}", f"p = 3: {ball}, p = 10/3: {roller}"
    axes.set_xlabel("\n".join(map(plain, filter(None, lines))), fontsize=HEAD_SIZE)
    frame(axes)
    return entries
