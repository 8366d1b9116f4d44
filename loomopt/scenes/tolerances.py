"""How a scene's numbers are made, [tolerances], and by which bands machines are judged, [accept]."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from loomopt.base.errors import Faults, misread, nearest, refusal, unknown
from loomopt.base.quantities import NUMBER_PATTERN, Quantity
from loomopt.base.units import QuantityError
from loomopt.scenes import tolerance_classes
from loomopt.scenes.tables import Place, SceneSchema, bounded, flat, table

SIGMAS = 3.0
"""Standard deviations that a plus_minus is worth where nothing is said."""
SPREADS = ("normal", "uniform")
KEYS = ("plus_minus", "class", "sigmas", "spread", "group", "correlation")
_PERCENT = re.compile(rf"[ \t]*({NUMBER_PATTERN}) *%[ \t]*")
UNIFORM = 1 / math.sqrt(3)
"""Standard deviation of a uniform spread, of its half width."""


class Tolerance(NamedTuple):
    """How a number is made.

    number: what a designer calls it; half: to each side, SI, or as a share of the nominal where `share`; standard:
    its class, whose half width follows from the nominal; sigmas: standard deviations that the half width is worth;
    uniform: whether all of it is equally likely, and nothing outside; group, correlation: with what it is made.
    """

    number: str
    half: float
    share: bool = False
    standard: str = ""
    sigmas: float = SIGMAS
    uniform: bool = False
    group: str = ""
    correlation: float = 0.0

    def plus_minus(self, nominal: float) -> float:
        """Return how far the number may be off on each side, SI. Raises BadInput where a class does not tell."""
        if not self.standard:
            return self.half * abs(nominal) if self.share else self.half
        found = tolerance_classes.plus_minus(self.standard, nominal)
        if math.isnan(found):
            problem = f"{self.standard} says nothing of {1e3 * nominal:g} mm"
            raise refusal(problem, "", f"tolerances.{self.number}", remedy="Give plus_minus instead")
        return found

    def sigma(self, nominal: float) -> float:
        """Return the standard deviation, SI."""
        return self.plus_minus(nominal) * (UNIFORM if self.uniform else 1 / self.sigmas)


def read(
    raw: object, schema: SceneSchema, known: Sequence[Place], origin: str, faults: Faults
) -> tuple[Tolerance, ...]:
    """Return [tolerances]; known: places of the scene's numbers, any of which may have one.

    That of a number of an effect that is off waits for it: it is checked and left out.
    """
    found = []
    with faults:
        given = flat(table(raw, origin, "tolerances"), [*schema.variables, *(place.label for place in known)])
        for name, each in given.items():
            with faults:
                key = f"tolerances.{name}"
                waiting = [place for place in known if place.label == name and place.waits]
                there = any(place.label == name and place.given for place in known)
                what = "number with a tolerance"
                quantity = (
                    waiting[0].quantity
                    if waiting and not there
                    else bounded(name, schema, list(known), origin, key, what)
                )
                made = _tolerance(name, each, quantity, origin, key)
                if there or not waiting:
                    found.append(made)
    return tuple(found)


def accepted(raw: object, schema: SceneSchema, origin: str, faults: Faults) -> dict[str, float]:
    """Return [accept]: half the band around an equality or a goal by which machines are judged, SI, by figure."""
    found: dict[str, float] = {}
    with faults:
        given = flat(table(raw, origin, "accept"), schema.figures)
        for name, each in given.items():
            with faults:
                if name not in schema.figures:
                    raise unknown("figure", name, schema.figures, origin, f"accept.{name}", given=given)
                quantity = Quantity(schema.figures[name].kind, above=0)
                found[name] = _number(each, origin, f"accept.{name}", quantity)
    return found


def _tolerance(name: str, raw: object, quantity: Quantity, origin: str, key: str) -> Tolerance:
    """Return the tolerance of one number. Raises BadInput."""
    given = raw if isinstance(raw, Mapping) else {"plus_minus": raw}
    for each in given:
        if each not in KEYS:
            raise unknown("key", each, KEYS, origin, f"{key}.{each}", given=given)
    if ("plus_minus" in given) == ("class" in given):
        problem = "plus_minus and class say the same twice" if "class" in given else "plus_minus is missing"
        raise refusal(problem, origin, key, remedy='Give one of them, such as plus_minus = "0.06 mm"')
    share, half, standard = False, 0.0, ""
    if "class" in given:
        standard = _standard(given["class"], quantity, origin, f"{key}.class")
    else:
        share, half = _half(given["plus_minus"], quantity, origin, f"{key}.plus_minus")
    spread = _one_of(given.get("spread", SPREADS[0]), SPREADS, origin, f"{key}.spread")
    if spread == "uniform" and "sigmas" in given:
        problem = "a uniform spread has no sigmas: plus_minus is its half width"
        raise refusal(problem, origin, f"{key}.sigmas", remedy="Take sigmas out")
    sigmas = _number(given.get("sigmas", SIGMAS), origin, f"{key}.sigmas", Quantity("number", above=0))
    group = given.get("group", "")
    if not isinstance(group, str):
        raise refusal("it is no name", origin, f"{key}.group", group, remedy='Write group = "machine"')
    if bool(group) != ("correlation" in given):
        lacking = "correlation" if group else "group"
        problem = f"{lacking} is missing: numbers of one group are correlated"
        raise refusal(problem, origin, f"{key}.{lacking}", remedy='Give group = "machine" and correlation = 0.5')
    ends = Quantity("number", least=0)
    correlation = _number(given.get("correlation", 0.0), origin, f"{key}.correlation", ends)
    if correlation > 1.0:
        raise refusal("it is more than 1", origin, f"{key}.correlation", correlation, "0 to 1", "Correct the value")
    return Tolerance(name, half, share, standard, sigmas, spread == "uniform", group, correlation)


def _half(raw: object, quantity: Quantity, origin: str, key: str) -> tuple[bool, float]:
    """Return whether a half width is a share of the nominal, and it, SI or as a share."""
    percent = _PERCENT.fullmatch(raw) if isinstance(raw, str) else None
    if percent:
        return True, _number(percent[1], origin, key, Quantity("number", least=0)) / 100
    return False, _number(raw, origin, key, Quantity(quantity.kind, least=0))


def _number(raw: object, origin: str, key: str, quantity: Quantity) -> float:
    try:
        return quantity.validate(raw)
    except QuantityError as error:
        raise misread(error, origin, key, raw) from None


def _one_of(raw: object, known: tuple[str, ...], origin: str, key: str) -> str:
    if raw in known:
        return str(raw)
    near = nearest(raw, known) if isinstance(raw, str) else ""
    remedy = f'Perhaps "{near}" is meant' if near else "Choose one of them"
    raise refusal("there is no such word here", origin, key, raw, ", ".join(known), remedy)


def _standard(raw: object, quantity: Quantity, origin: str, key: str) -> str:
    if quantity.kind != "length":
        problem = f"classes are of lengths, and this is of kind {quantity.kind}"
        raise refusal(problem, origin, key, raw, remedy="Give plus_minus instead")
    return _one_of(raw, tolerance_classes.CLASSES, origin, key)
