"""Limits, prices and relaxations in the designer's own words and units."""

import math

from loomopt.base.quantities import quantity_of
from loomopt.base.units import SI_UNIT, factor, show
from loomopt.model.limits import CycleLimit, Limit
from loomopt.physics.effects.kinds import label
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Price, Relaxation
from loomopt.solving.certificate.verdict import Binding

SIGNS = {-1: ">=", 0: "=", 1: "<="}
SIDES = {-1: "min", 1: "max"}
MOST_WIDTHS = 3.0
"""Widths of its bounds by which a limit may give way; beyond them a designer has another machine in mind."""
UNKNOWN = "number"
"""The kind of what no table names, such as a variable that only the target's task has."""


def outward(value: float, side: int) -> float:
    """Return a value rounded to six significant digits so that it gives no less room: up for a maximum."""
    if value == 0.0:
        return value
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 5)
    return float(f"{(math.ceil if side > 0 else math.floor)(value / step) * step:.6g}")


def grouped(unit: str) -> str:
    """Return a unit that may stand after a stroke."""
    return f"({unit})" if "/" in unit else unit


class Words:
    """The vocabulary of one scene: kinds and units of its variables and figures."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def kind(self, name: str) -> str:
        """Return what kind of quantity a variable, figure or limit is."""
        schema = self.scene.schema
        if name in schema.figures and name not in schema.variables:
            return schema.figures[name].kind
        for kinds in (schema.variables, schema.lists, schema.margins):
            if name in kinds:
                return kinds[name]
        places = [(model, key, key) for model in (schema.operation, schema.mechanism) for key in model.model_fields]
        places += [(e.own, key, label(e, key)) for e in self.scene.active for key in e.own.model_fields]
        found = next((quantity_of(model, key) for model, key, called in places if called == name), None)
        return found.kind if found else UNKNOWN

    def unit(self, name: str) -> str:
        """Return the unit a designer reads it in."""
        return self.scene.shown_in(self.kind(name))

    def si(self, name: str) -> str:
        """Return its SI unit."""
        return SI_UNIT[self.kind(name)]

    def shown(self, name: str, value: float, digits: int = 6) -> str:
        """Return an SI value with its unit, as the designer writes it."""
        return show(value, self.unit(name), digits)

    def outward(self, name: str, value: float, side: int) -> str:
        """Return an SI value that something never passes on a side, rounded outward, with its unit."""
        unit = self.unit(name)
        return show(outward(value / factor(unit), side) * factor(unit), unit)

    def limit(self, limit: Limit) -> str:
        """Return a limit as a phrase: "l1 >= 30 mm"."""
        if limit.name in self.scene.schema.margins:
            return limit.name
        return f"{limit.name} {SIGNS[limit.sign]} {self.shown(limit.name, limit.value)}"

    def price(self, bindings: list[Binding]) -> Price:
        """Return a limit's price: what all its rows together are worth."""
        first = bindings[0]
        limit, figure = first.limit, first.objective.figure
        worth = sum(binding.worth for binding in bindings if binding.objective == first.objective)
        figure_unit, limit_unit = self.unit(figure), self.unit(limit.name)
        amount = worth * factor(limit_unit) / factor(figure_unit)
        per = limit_unit if limit_unit != "1" else "unit"
        figure_text = f" {figure_unit}" if figure_unit != "1" else ""
        return Price(
            limit=limit.name,
            side=SIDES[first.side],
            value=limit.value,
            text=self.limit(limit),
            worth={figure: worth},
            unit={figure: f"{self.si(figure)}/{grouped(self.si(limit.name))}"},
            reading=f"{amount:.3g}{figure_text} per {per}",
        )

    def relaxation(self, limit: Limit, need: float, alone: bool) -> Relaxation:
        """Return how far a limit must give way, SI and as a phrase."""
        side = limit.sign or (1 if need > 0 else -1)
        needed = limit.value + side * abs(need)
        if abs(needed) <= SHOWN_AS_ZERO * max(abs(limit.value), abs(need)):
            needed = 0.0
        unit, fair = self.unit(limit.name), abs(need) <= MOST_WIDTHS * self._width(limit)
        change = self.shown(limit.name, abs(need), 3) + ("" if fair else ", out of proportion")
        text = f"{self.limit(limit)} -> {show(outward(needed / factor(unit), side) * factor(unit), unit)} (by {change})"
        return Relaxation(limit.name, SIDES[side], limit.value, needed, alone, text, fair)

    def _width(self, limit: Limit) -> float:
        """Return what a relaxation is measured by, SI: the width of its bounds, else itself, else its natural size."""
        bound = self.scene.bounds.get(limit.name) if not isinstance(limit, CycleLimit) else None
        width = bound.max - bound.min if bound else 0.0
        return (width if 0.0 < width < math.inf else abs(limit.value)) or limit.scale
