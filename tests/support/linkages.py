"""Chains of parts written as tables: words as text, numbers as SI floats or names."""

from loomopt.physics.mechanisms.chain import Chain, Part, Ref

NUMBERS = (
    *("x", "y", "length", "start", "zero", "radius", "angle", "along", "across", "direction", "offset"),
    *("lift", "begins", "rise", "far_dwell", "return"),
)


def ref(value):
    """Return a number of a part: a name, "-name" or a float."""
    if isinstance(value, str):
        return Ref(value.removeprefix("-"), -1 if value.startswith("-") else 1)
    return Ref("", 1, value)


def part(name, kind, links=(), **keys):
    """Return a part; links: of a group, length by name."""
    words = [(key, tuple(value) if isinstance(value, list) else value) for key, value in keys.items()]
    words = [(key, value) for key, value in words if key not in NUMBERS]
    refs = [(key, ref(value)) for key, value in keys.items() if key in NUMBERS]
    if links:
        words.append(("links", tuple(links)))
        refs += [(link, ref(value)) for link, value in dict(links).items()]
    return Part(kind, name, tuple(words), tuple(refs))


def chain(parts):
    """Return a chain from tables by name."""
    return Chain(tuple(part(name, **keys) for name, keys in parts.items()))


def four_bar(l1, l2, l3, l4, side="left", start=0.0):
    """Return the crank-rocker A B C D."""
    return chain(
        {
            "A": {"kind": "pivot"},
            "D": {"kind": "pivot", "x": l4},
            "crank": {"kind": "crank", "at": "A", "pin": "B", "length": l1, "start": start},
            "drive": {
                "kind": "dyad",
                "joins": ["B", "D"],
                "pin": "C",
                "side": side,
                "links": {"rod": l2, "rocker": l3},
            },
        }
    )
