"""How a scene's numbers are made, [tolerances], and by which bands machines are judged, [accept]."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from loomopt.base.errors import Faults, misread, nearest, refusal, unknown
from loomopt.base.quantities import NUMBER_PATTERN, Quantity
from loomopt.base.units import QuantityError
from loomopt.scenes import iso_fits, tolerance_classes
from loomopt.scenes.tables import Place, SceneSchema, bounded, flat, table

SIGMAS = 3.0
"""Standard deviations that a plus_minus is worth where nothing is said."""
SPREADS = ("normal", "uniform")
FORMS = ("plus_minus", "plus", "class", "fit")
KEYS = ("plus_minus", "plus", "minus", "class", "fit", "sigmas", "spread", "group", "correlation")
_PERCENT = re.compile(rf"[ \t]*({NUMBER_PATTERN}) *%[ \t]*")
UNIFORM = 1 / math.sqrt(3)
"""Standard deviation of a uniform spread, of its half width."""


class Tolerance(NamedTuple):
    """How a number is made.

    number: what a designer calls it; below, above: how far its band lies below and above the nominal, SI, or as shares
    of the nominal where `share`; one of them is negative where the whole band lies on one side; standard: its class,
    whose band follows from the nominal; sigmas: standard deviations that half the band is worth; uniform: whether all
    of it is equally likely, and nothing outside; group, correlation: with what it is made.
    """

    number: str
    below: float
    above: float
    share: bool = False
    standard: str = ""
    sigmas: float = SIGMAS
    uniform: bool = False
    group: str = ""
    correlation: float = 0.0

    def band(self, nominal: float) -> tuple[float, float]:
        """Lower and upper deviation of the number from its nominal, SI. Raises BadInput where a class tells none."""
        if not self.standard:
            size = abs(nominal) if self.share else 1.0
            return -self.below * size, self.above * size
        if iso_fits.parted(self.standard):
            found = iso_fits.deviations(self.standard, nominal)
        else:
            half = tolerance_classes.plus_minus(self.standard, nominal)
            found = -half, half
        if math.isnan(found[0]):
            problem = f"{self.standard} says nothing of {1e3 * nominal:g} mm"
            raise refusal(problem, "", f"tolerances.{self.number}", remedy="Give plus_minus instead")
        return found

    def plus_minus(self, nominal: float) -> float:
        """Half width of the band, SI. Raises BadInput where a class tells none."""
        low, high = self.band(nominal)
        return high if low == -high else (high - low) / 2

    def shift(self, nominal: float) -> float:
        """Distance of the band's middle, the mean of the machines, from the nominal, SI. Raises BadInput."""
        low, high = self.band(nominal)
        return (low + high) / 2

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
    forms = [each for each in FORMS if each in given]
    if len(forms) != 1:
        problem = f"{' and '.join(forms)} say the same twice" if forms else "plus_minus is missing"
        raise refusal(problem, origin, key, remedy=f'Give one of {", ".join(FORMS)}, such as plus_minus = "0.06 mm"')
    if ("plus" in given) != ("minus" in given):
        lacking = "minus" if "plus" in given else "plus"
        problem = f"{lacking} is missing: plus and minus together are the band"
        raise refusal(problem, origin, f"{key}.{lacking}", remedy=f'Give {lacking} = "0" where there is none')
    share, below, above, standard = False, 0.0, 0.0, ""
    if "class" in given:
        standard = _standard(given["class"], quantity, origin, f"{key}.class")
    elif "fit" in given:
        standard = _fit(given["fit"], quantity, origin, f"{key}.fit")
    elif "plus" in given:
        (of_above, above), (of_below, below) = (
            _deviation(given[side], quantity, origin, f"{key}.{side}") for side in ("plus", "minus")
        )
        share = of_above or of_below
        if (share and not (of_above or above == 0.0)) or (share and not (of_below or below == 0.0)):
            problem = "one side is a share of the nominal and the other is none"
            raise refusal(problem, origin, key, remedy="Write both in % or both in a unit")
        if above + below < 0.0:
            problem = "the upper end of the band lies below its lower end"
            raise refusal(problem, origin, key, remedy="Write plus and minus so that plus + minus is not negative")
    else:
        share, above = _half(given["plus_minus"], quantity, origin, f"{key}.plus_minus")
        below = above
    spread = _one_of(given.get("spread", SPREADS[0]), SPREADS, origin, f"{key}.spread")
    if spread == "uniform" and "sigmas" in given:
        problem = "a uniform spread has no sigmas: its band is all there is"
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
    return Tolerance(name, below, above, share, standard, sigmas, spread == "uniform", group, correlation)


def _half(raw: object, quantity: Quantity, origin: str, key: str) -> tuple[bool, float]:
    """Return whether a half width is a share of the nominal, and it, SI or as a share."""
    percent = _PERCENT.fullmatch(raw) if isinstance(raw, str) else None
    if percent:
        return True, _number(percent[1], origin, key, Quantity("number", least=0)) / 100
    return False, _number(raw, origin, key, Quantity(quantity.kind, least=0))


def _deviation(raw: object, quantity: Quantity, origin: str, key: str) -> tuple[bool, float]:
    """Return whether an end of a band is a share of the nominal, and it, SI or as a share; a bare 0 needs no unit."""
    percent = _PERCENT.fullmatch(raw) if isinstance(raw, str) else None
    if percent:
        return True, _number(percent[1], origin, key, Quantity("number")) / 100
    if raw == 0 or (isinstance(raw, str) and raw.strip() in ("0", "+0", "-0", "0.0")):
        return False, 0.0
    return False, _number(raw, origin, key, Quantity(quantity.kind))


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


def _fit(raw: object, quantity: Quantity, origin: str, key: str) -> str:
    if quantity.kind != "length":
        problem = f"fits are of lengths, and this is of kind {quantity.kind}"
        raise refusal(problem, origin, key, raw, remedy="Give plus and minus instead")
    if not isinstance(raw, str) or iso_fits.parted(raw) is None:
        allowed = f"a letter of {' '.join(iso_fits.LETTERS)} with a grade of {iso_fits.LEAST_GRADE} to "
        allowed += f"{iso_fits.MOST_GRADE}, k m n K M N to 8"
        raise refusal("unknown tolerance class", origin, key, raw, allowed, 'Write fit = "H7", or plus and minus')
    return raw
