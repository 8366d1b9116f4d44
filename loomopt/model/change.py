"""Change of a design from today's machine: Σ w ((x − x_today)/b)², b a number's bound width and w its weight.

Today's values, widths and weights are numbers of the program, so that one structure serves every scene.
"""

import functools
from collections.abc import Collection, Mapping

from loomopt.maths.systems import Number
from loomopt.model.model import DesignRow, Instant
from loomopt.physics import balance

CHANGE = "change"
Ends = tuple[float, float]


def today(name: str) -> str:
    """Name of today's value of a number."""
    return f"today.{name}"


def row(names: tuple[str, ...]) -> DesignRow:
    """Row of the change of these numbers, by full name."""
    return DesignRow(functools.partial(_value, names), structure=names)


def _value(names: Collection[str], at: Instant) -> Number:
    v = at.values
    return balance.total([v[f"weight.{x}"] * ((v[x] - v[today(x)]) / v[f"width.{x}"]) ** 2 for x in names])


def parameters(
    names: Collection[str], known: Mapping[str, float], limited: Mapping[str, Ends], weights: Mapping[str, float]
) -> dict[str, float]:
    """Numbers that the row reads; a number without room weighs nothing.

    known: today's, SI; limited: lower and upper bound; weights: 1 for a number without one.
    """
    values: dict[str, float] = {}
    for name in names:
        width = limited[name][1] - limited[name][0]
        values |= {today(name): known[name], f"width.{name}": width or 1.0}
        values[f"weight.{name}"] = weights.get(name, 1.0) if width else 0.0
    return values


def figure(
    names: Collection[str],
    values: Mapping[str, Number],
    known: Mapping[str, float],
    limited: Mapping[str, Ends],
    weights: Mapping[str, float],
) -> Number:
    """Change of a design; values: its numbers. Other arguments as in `parameters`."""
    widths = {name: limited[name][1] - limited[name][0] for name in names}
    return sum(weights.get(x, 1.0) * ((values[x] - known[x]) / widths[x]) ** 2 for x in names if widths[x] > 0.0)
