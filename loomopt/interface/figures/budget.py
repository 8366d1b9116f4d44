"""The figure of a torque budget: each effect's share over the turn, one upon the other, and their sum."""

import functools
from pathlib import Path
from typing import Any

import numpy as np

from loomopt.base.files import atomically, suffix
from loomopt.base.units import factor
from loomopt.interface.figures.figure import COLOURS, Entry, frame, head, own_style, page, save
from loomopt.interface.files import outputs
from loomopt.picture.shapes import plain
from loomopt.studies.budget import Found

WIDTH, HIGH, AROUND = 7.0, 3.4, 0.9
"""Inches: of the figure, of its axes, of title and crank angle."""
PALER = 0.55
"""Of the colours of effects beyond the first seven."""


def plot(found: Found, path: Path | None = None) -> Any:
    """Return a budget's figure; path: a file to write it to as well. Raises BadInput."""
    if path:
        suffix(path, outputs.PICTURES)
    drawn = _drawn(found)
    if path:
        atomically(path, functools.partial(save, drawn))
    return drawn


def _drawn(found: Found) -> Any:
    scene, own = found.scene, found.found
    torque, angle = scene.shown_in("torque"), scene.shown_in("angle")
    title = f"{scene.name}: where the crank torque comes from"
    phi = own.phi / factor(angle)
    shares = {name: values / factor(torque) for name, values in own.curves.items()}
    total = np.sum(list(shares.values()), axis=0)
    with own_style(title, *shares):
        figure = page(WIDTH, HIGH + AROUND, title)
        axes = figure.add_subplot()
        entries: list[Entry] = []
        ends = {sign: np.zeros_like(phi) for sign in (1, -1)}
        for place, (name, values) in enumerate(shares.items()):
            style = {"color": COLOURS[place % len(COLOURS)], "alpha": PALER ** (place // len(COLOURS)), "linewidth": 0}
            for sign, base in ends.items():
                top = base + np.where(sign * values > 0, values, 0.0)
                filled = axes.fill_between(phi, base, top, **style)
                ends[sign] = top
            entries.append((filled, name))
        (line,) = axes.plot(phi, total, color="black", linewidth=1.4)
        peak = axes.plot(own.angle / factor(angle), own.total.at_peak / factor(torque), "o", color="black")[0]
        entries += [(line, "crank torque"), (peak, f"its peak, {scene.show(own.total.at_peak, 'torque')}")]
        axes.axhline(0.0, color="#111827", linewidth=0.8)
        axes.set_xlim(phi.min(), phi.max())
        axes.set_xlabel(plain(f"crank angle phi [{angle}]"))
        axes.set_ylabel(plain(f"torque [{torque}]"))
        frame(axes)
        figure.get_layout_engine().execute(figure)
        high = head(axes, "", entries)
        figure.finish(HIGH + AROUND + high / 72)
    return figure
