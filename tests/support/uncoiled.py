"""Packaged shedding scenes that know no coil: with one, no design of theirs would be admissible."""

import re

import loomopt as lo
from loomopt.scenes import packaged

BOUNDS = ("wire", "diameter", "turns", "initial_tension")
"""Numbers of the coil that these scenes bound."""


def scene(given):
    """Return a scene, or the packaged one of a name, without the coil's values and bounds."""
    document = (lo.load(given) if isinstance(given, str) else given).document
    available = {name: values for name, values in document["available"].items() if name != "coil"}
    bounds = {name: values for name, values in document["bounds"].items() if name not in BOUNDS}
    return lo.scene({**document, "available": available, "bounds": bounds})


def text(name):
    """Return the packaged scene of a name as TOML, without the coil's values and bounds."""
    result = re.sub(r"(?ms)^\[available\.coil\].*?(?=^\[)", "", packaged.problems()[name].read_text(encoding="utf-8"))
    return re.sub(rf"(?m)^({'|'.join(BOUNDS)}) = .*\n", "", result)
