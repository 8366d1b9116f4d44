"""Linkage scenes made of every kind of part that drives and every kind that hangs on it, one after the other."""

import json
from collections.abc import Mapping
from typing import Any

Parts = Mapping[str, Mapping[str, Any]]

CAM = {"kind": "cam", "law": "cycloidal", "lift": "20 deg", "begins": "60 deg"}
STROKE = {"rise": "100 deg", "far_dwell": "60 deg", "return": "100 deg"}
DRIVES: Mapping[str, Parts] = {
    "crank": {"link": {"kind": "crank", "at": "A", "pin": "V", "length": "50 mm"}},
    "cam": {"link": {**CAM, **STROKE, "at": "A", "pin": "V", "length": "100 mm"}},
    "cam without a far dwell": {
        "link": {
            **CAM,
            "law": "polynomial_345",
            "at": "A",
            "pin": "V",
            "length": "90 mm",
            "rise": "120 deg",
            "return": "80 deg",
        }
    },
    "gear": {
        "crank": {"kind": "crank", "at": "A", "pin": "B", "length": "20 mm"},
        "link": {"kind": "gear", "at": "A", "with": "crank", "ratio": -1, "pin": "V", "length": "40 mm"},
    },
    "cam on a crank": {
        "crank": {"kind": "crank", "at": "A", "pin": "B", "length": "10 mm"},
        "link": {**CAM, **STROKE, "law": "modified_sine", "at": "B", "pin": "V", "length": "80 mm"},
    },
    "cam on a cam's follower": {
        "first": {**CAM, **STROKE, "at": "A", "pin": "B", "length": "60 mm"},
        "link": {**CAM, **STROKE, "begins": "10 deg", "at": "B", "pin": "V", "length": "40 mm"},
    },
    "cam on a lever of a cam": {
        "first": {**CAM, **STROKE, "at": "A", "pin": "B", "length": "60 mm"},
        "rod": {
            "kind": "dyad",
            "joins": ["B", "E"],
            "pin": "F",
            "side": "left",
            "links": {"bar": "90 mm", "arm": "70 mm"},
        },
        "link": {**CAM, **STROKE, "begins": "10 deg", "at": "F", "pin": "V", "length": "30 mm"},
    },
    "point of a cam's follower": {
        "link": {**CAM, **STROKE, "at": "A", "pin": "B", "length": "100 mm"},
        "V": {"kind": "point", "on": "link", "radius": "90 mm", "angle": "5 deg"},
    },
    "gear on a cam's follower": {
        "first": {**CAM, **STROKE, "at": "A", "pin": "B", "length": "60 mm"},
        "link": {"kind": "gear", "at": "B", "with": "first", "ratio": -2, "pin": "V", "length": "40 mm"},
    },
}
"""What places the joint V on the link `link`."""


def dyad(name: str, joint: str, pivot: str, pin: str) -> Parts:
    """Return a rod and a rocker from a joint to a pivot."""
    links = {f"rod{name}": f"r{name}", f"lever{name}": f"s{name}"}
    return {f"push{name}": {"kind": "dyad", "joins": [joint, pivot], "pin": pin, "side": "left", "links": links}}


def slider(name: str, joint: str, pivot: str, pin: str) -> Parts:
    """Return a rod to a guide of the frame."""
    values = {"kind": "slider", "from": joint, "through": pivot, "direction": "10 deg", "offset": "5 mm"}
    return {f"push{name}": {**values, "pin": pin, "side": "ahead", "links": {f"rod{name}": f"r{name}"}}}


def slot(name: str, joint: str, pivot: str, pin: str) -> Parts:
    """Return a slotted lever about a pivot."""
    values = {"kind": "slot", "at": pivot, "through": joint, "link": f"lever{name}"}
    return {f"push{name}": {**values, "pin": pin, "length": f"r{name}"}}


def offset_slot(name: str, joint: str, pivot: str, pin: str) -> Parts:
    """Return a slotted lever whose slot passes beside its pivot."""
    return {f"push{name}": {**slot(name, joint, pivot, pin)[f"push{name}"], "offset": "15 mm"}}


NUMBERS = {"r1": "220 mm", "s1": "150 mm", "r2": "620 mm", "s2": "500 mm"}
CLOSURES = {"dyad": dyad, "slider": slider, "slot": slot, "offset slot": offset_slot}


def scene(drive: str, first: str, second: str = "") -> dict[str, Any]:
    """Return a linkage scene: what drives, what hangs on it, and what hangs on that ("" for nothing).

    Loads, springs, masses, gravity and forces in the joints are on; the output is what the last part moves.
    """
    joint, name = ("C2", "2") if second else ("C1", "1")
    last = second or first
    parts = {"A": {"kind": "pivot"}, "D": {"kind": "pivot", "x": "250 mm"}, **DRIVES[drive]}
    if "E" in str(DRIVES[drive]):
        parts["E"] = {"kind": "pivot", "x": "120 mm", "y": "30 mm"}
    parts |= CLOSURES[first]("1", "V", "D", "C1")
    if second:
        parts |= {"G": {"kind": "pivot", "x": "-150 mm", "y": "420 mm"}, **CLOSURES[second]("2", "C1", "G", "C2")}
    used = {
        text
        for part in parts.values()
        for text in (*part.values(), *part.get("links", {}).values())
        if isinstance(text, str)
    }
    slides = last == "slider"
    moved = f"rod{name}" if slides else f"lever{name}"
    return {
        "problem": {"name": "hanging", "job": "linkage", "title": f"{drive}, {first}, {second}"},
        "operation": {"speed": "120 rpm"},
        "mechanism": {name: value for name, value in NUMBERS.items() if name in used},
        "parts": parts,
        "output": {"slide": f"push{name}"} if slides else {"angle": moved, "zero": ZEROS[last, name]},
        "effects": {
            "inertia": {"mass": "2 kg"} if slides else {"J": "0.1 kg*m^2"},
            "gravity": {"down": "-90 deg"},
            "mass": {moved: {"mass": "1 kg", "along": "50 mm", "J": "0.001 kg*m^2"}},
            "load": {joint: {"x": "20 N", "y": "-10 N"}},
            "spring": {"back": {"begins": "A", "ends": joint, "stiffness": "1 N/mm", "free": "10 mm"}},
            "joint_forces": {},
        },
        "bounds": {
            f"r{name}": {"min": "215 mm", "max": "225 mm"} if not second else {"min": "610 mm", "max": "630 mm"}
        },
        "targets": {"torque": {"least": ["peak_torque"]}},
    }


ZEROS = {
    ("dyad", "1"): "90 deg",
    ("slot", "1"): "180 deg",
    ("offset slot", "1"): "180 deg",
    ("dyad", "2"): "-45 deg",
    ("slot", "2"): "-60 deg",
    ("offset slot", "2"): "-60 deg",
}
"""Directions about which the last lever swings."""


def toml(raw: object) -> str:
    """Return a value as TOML: tables in one line."""
    if isinstance(raw, Mapping):
        return "{ " + ", ".join(f"{json.dumps(str(key))} = {toml(value)}" for key, value in raw.items()) + " }"
    return f"[{', '.join(map(toml, raw))}]" if isinstance(raw, list | tuple) else json.dumps(raw)


def text(document: Mapping[str, Any]) -> str:
    """Return a scene as the text of its file."""
    return "\n".join(f"{key} = {toml(value)}" for key, value in document.items()) + "\n"
