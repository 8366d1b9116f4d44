"""Sleys on conjugate cams for tests, with the reference figures of `tests/reference/cams.csv`."""

import csv
import math
from pathlib import Path

from loomopt.jobs import registry
from support.linkage_scenes import changed

INERTIA, TORQUE, SWING, PULSE = 0.62, 745.0, math.radians(23.088), math.radians(29.8)
OMEGA = 600 * 2 * math.pi / 60
BALANCE = TORQUE / (INERTIA * OMEGA**2)
"""Second derivative of the sley's angle, towards the rear, with which its couple at the front is 0."""
PRINTED = 2e-9
"""Relative error of figures that are printed with ten digits."""

CAM_SLEY = {
    "problem": {"name": "cams", "job": "linkage", "title": "A sley on conjugate cams"},
    "operation": {"speed": "600 rpm"},
    "mechanism": {
        "a": "167 mm",
        "arm1": "95 mm",
        "arm2": "92 mm",
        "b0": "-139 deg",
        "gamma": "121.5 deg",
        "r": "40 mm",
    },
    "parts": {
        "O": {"kind": "pivot"},
        "D": {"kind": "pivot", "y": "a"},
        "sley": {"kind": "cam", "at": "D", "pin": "P1", "length": "arm1", "start": "b0", "shaft": "O", "moves": []},
        "P2": {"kind": "point", "on": "sley", "radius": "arm2", "angle": "gamma"},
        "R1": {"kind": "roller", "at": "P1", "cam": "sley", "radius": "r"},
        "R2": {"kind": "roller", "at": "P2", "cam": "sley", "radius": "r"},
    },
    "output": {"angle": "sley", "sense": "backward"},
    "events": {"front": {"extreme": "max"}},
    "effects": {
        "inertia": {"J": "0.62 kg*m^2"},
        "resistance": {"torque": "745 N*m", "pulse": "29.8 deg", "at": "front"},
        "contact": {"width": "60 mm"},
    },
    "targets": {"torque": {"least": ["peak_torque"]}, "pressure": {"least": ["hertz"]}},
}


def septic(forward, back, torque=TORQUE):
    """Return two moves in degrees, balanced at the front for a torque of the cloth."""
    bend = torque / (INERTIA * OMEGA**2)
    return [{"angle": f"{forward} deg", "to": "-23.088 deg", "bend": bend}, {"angle": f"{back} deg", "to": "0 deg"}]


def free(intervals):
    """Return two moves of 70 deg with free laws, balanced at the front."""
    return [{**move, "knots": intervals} for move in septic(70, 70)]


def named(law):
    """Return two moves of 70 deg with a named law."""
    return [{"angle": "70 deg", "to": "-23.088 deg", "law": law}, {"angle": "70 deg", "to": "0 deg", "law": law}]


def pulse():
    """Return four moves in which the couple is 0 over the whole pulse."""
    short = BALANCE / (math.pi / PULSE) ** 2
    near = f"{short - SWING!r} rad"
    return [
        {"angle": "65.1 deg", "to": near},
        {"angle": "14.9 deg", "to": "-23.088 deg", "law": "quarter_sine"},
        {"angle": "14.9 deg", "to": near, "law": "quarter_sine"},
        {"angle": "65.1 deg", "to": "0 deg"},
    ]


CASES = {
    "S1": (septic(70, 70), {}),
    "S2": (named("modified_sine"), {}),
    "S3": (
        septic(65, 75, 600),
        {"parts": {"sley": {"sense": "clockwise"}}, "effects": {"resistance": {"torque": "600 N*m"}}},
    ),
    "S4": (pulse(), {}),
    "S5": (septic(70, 70), {"effects": {"contact": {"preload": "300 N*m"}}}),
    "S7": (septic(180, 180), {}),
}
"""Moves of each case of the reference, and what else differs."""


def document(moves, **changes):
    """Return the tables of a scene with moves."""
    return changed(changed(CAM_SLEY, {"parts": {"sley": {"moves": moves}}}), changes)


def scene(moves, **changes):
    """Return a scene with moves."""
    return registry.scene(document(moves, **changes))


def reference(case):
    """Return the reference figures of a case by name."""
    path = Path(__file__).parents[1] / "reference" / "cams.csv"
    with path.open(newline="", encoding="utf-8") as file:
        return {row["figure"]: float(row["value"]) for row in csv.DictReader(file) if row["case"] == case}
