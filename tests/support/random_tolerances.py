"""Random linkages with tolerances, whose resistance acts about an extreme of the output."""

import random

from loomopt.base.errors import BadInput
from loomopt.jobs import registry


def scenes(count, seed=1):
    """Yield random linkages that turn all round: four-bars, slider-cranks, and six-bars of two dyads.

    Lengths are good to 0.02 to 0.1 mm; every other event is said by the extreme alone, the others by where it is near.
    """
    draw, made = random.Random(seed), 0
    while made < count:
        document = [four_bar, slider_crank, six_bar][made % 3](draw)
        if made % 2:
            document["events"] = {"front": {"extreme": "max"}, "rear": {"extreme": "min"}}
        try:
            scene = registry.scene(document)
        except BadInput:
            continue
        made += 1
        yield scene


def document(numbers, parts, output, load, draw):
    """Return a scene of those parts."""
    slides = "slide" in output
    inertia = {"mass": "3 kg"} if slides else {"J": "0.2 kg*m^2"}
    return {
        "problem": {"name": "random", "job": "linkage", "title": "a random linkage"},
        "operation": {"speed": f"{draw.randint(100, 500)} rpm"},
        "mechanism": {name: f"{size:.2f} mm" for name, size in numbers.items()},
        "parts": {"A": {"kind": "pivot"}, "crank": {"kind": "crank", "at": "A", "pin": "B", "length": "l1"}, **parts},
        "output": output,
        "events": {"front": {"extreme": "max"}},
        "effects": {
            "inertia": inertia,
            "resistance": {**load, "pulse": f"{draw.uniform(20, 60):.1f} deg", "at": "front"},
        },
        "tolerances": {name: f"{draw.choice([0.02, 0.05, 0.1])} mm" for name in numbers},
        "bounds": {"l1": {"min": f"{numbers['l1'] * 0.9:.2f} mm", "max": f"{numbers['l1'] * 1.1:.2f} mm"}},
        "limits": {"force.front": {"max": "100 kN"}} if slides else {"moment.front": {"max": "10 kN*m"}},
        "targets": {"torque": {"least": ["peak_torque"]}},
    }


def rocker(draw):
    """Return lengths of a crank-rocker."""
    l1, l3, l4 = draw.uniform(20, 50), draw.uniform(100, 200), draw.uniform(130, 260)
    return {"l1": l1, "l2": draw.uniform(max(abs(l4 - l3) + l1, 60) * 1.1, (l3 + l4 - l1) * 0.9), "l3": l3, "l4": l4}


def beat():
    """Return the parts of a crank-rocker beside its crank."""
    links = {"rod": "l2", "rocker": "l3"}
    dyad = {"kind": "dyad", "joins": ["B", "D"], "pin": "C", "side": "left", "links": links}
    return {"D": {"kind": "pivot", "x": "l4"}, "beat": dyad}


def four_bar(draw):
    """Return a crank-rocker."""
    return document(rocker(draw), beat(), {"angle": "rocker"}, {"torque": "200 N*m"}, draw)


def slider_crank(draw):
    """Return a slider-crank, its guide beside the crank's axis."""
    l1 = draw.uniform(20, 60)
    numbers = {"l1": l1, "l2": draw.uniform(2.2, 4.5) * l1, "e": draw.uniform(0.05, 0.5) * l1}
    values = {"kind": "slider", "from": "B", "through": "A", "direction": "0 deg", "offset": "e", "side": "ahead"}
    parts = {"push": {**values, "pin": "C", "links": {"rod": "l2"}}}
    return document(numbers, parts, {"slide": "push"}, {"force": "2 kN"}, draw)


def six_bar(draw):
    """Return a crank-rocker that drives a second rocker by a rod."""
    numbers = rocker(draw) | {"l5": draw.uniform(180, 300), "l6": draw.uniform(150, 260), "l7": draw.uniform(380, 520)}
    links = {"pull": "l5", "sley": "l6"}
    second = {"kind": "dyad", "joins": ["C", "G"], "pin": "E", "side": "left", "links": links}
    parts = {**beat(), "G": {"kind": "pivot", "x": "l7"}, "second": second}
    return document(numbers, parts, {"angle": "sley"}, {"torque": "150 N*m"}, draw)
