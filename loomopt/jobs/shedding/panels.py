"""What a figure of shedding curves shows: cam force, forces by effect, travel, pressure angle, curvature."""

import math
from collections.abc import Mapping, Sequence

from loomopt.designs import flat
from loomopt.jobs.shedding import design as shedding_design
from loomopt.picture.panels import Mark, Panel, split
from loomopt.scenes import Scene

FORCE = "N [N]"
NEGLIGIBLE = 1e-8
"""Share of the largest cam force that is only rounding."""


def panels(scene: Scene, design: Mapping[str, float], columns: Sequence[str]) -> tuple[Panel, ...]:
    """Return the panels of a design's curves, SI; those of the follower where there is one."""
    given = flat(design)
    figures, values = shedding_design.figures(scene, given), shedding_design.values_of(scene, given)
    angle, force = figures["contact_angle"], figures["contact_min"]
    points: tuple[Mark, ...] = ()
    if angle is not None and force is not None:
        said = 0.0 if abs(force) <= NEGLIGIBLE * abs(figures["contact_max"] or 0.0) else force
        points = (Mark(angle, force, f"least {said:.6g} N at {math.degrees(angle):.2f} deg"),)
    least = values["N_min"]
    shown = [
        Panel(
            (FORCE,),
            "cam force N",
            {f"N_min = {least:.6g} N; below, contact is lost": least},
            points,
            wide=True,
            today=True,
        ),
        Panel(tuple(name for name in columns if split(name)[1] == "N" and name != FORCE), "forces"),
        Panel(("X [m]",), "travel X"),
    ]
    if "pressure_angle [rad]" in columns:
        sharpest = {"undercut above 1/roller_radius": 1 / values["roller_radius"]}
        shown.append(Panel(("pressure_angle [rad]",), "pressure angle"))
        shown.append(Panel(("curvature [1/m]",), "pitch curvature", sharpest))
    return tuple(shown)
