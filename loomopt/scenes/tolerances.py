"""Tolerances of a scene's numbers, [tolerances], and bands in which a machine is accepted, [accept]."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from loomopt.base.errors import refusal
from loomopt.base.quantities import NUMBER_PATTERN, Quantity
from loomopt.scenes import iso_fits, tolerance_classes
from loomopt.scenes.cursor import Cursor
from loomopt.scenes.tables import Place, SceneSchema, label_entries, number_or_waiting

SIGMAS = 3.0
"""Standard deviations in a plus_minus by default."""
SPREADS = ("normal", "uniform")
FORMS = ("plus_minus", "plus", "class", "fit")
KEYS = ("plus_minus", "plus", "minus", "class", "fit", "sigmas", "spread", "group", "correlation")
_PERCENT = re.compile(rf"[ \t]*({NUMBER_PATTERN}) *%[ \t]*")
UNIFORM = 1 / math.sqrt(3)
"""Standard deviation of a uniform spread, of its half width."""


class Tolerance(NamedTuple):
    """Tolerance of a number.

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
        """Lower and upper deviation from the nominal, SI. Raises BadInput for a size outside its class."""
        if not self.standard:
            size = abs(nominal) if self.share else 1.0
            return -self.below * size, self.above * size
        if iso_fits.split_class(self.standard):
            deviations = iso_fits.deviations(self.standard, nominal)
        else:
            half = tolerance_classes.plus_minus(self.standard, nominal)
            deviations = -half, half
        if math.isnan(deviations[0]):
            problem = f"{self.standard} does not cover {1e3 * nominal:g} mm"
            raise refusal(problem, "", f"tolerances.{self.number}", remedy="Give plus_minus instead")
        return deviations

    def plus_minus(self, nominal: float) -> float:
        """Half width of the band, SI. Raises BadInput for a size outside its class."""
        low, high = self.band(nominal)
        return high if low == -high else (high - low) / 2

    def shift(self, nominal: float) -> float:
        """Distance of the band's middle, the mean of the machines, from the nominal, SI. Raises BadInput."""
        low, high = self.band(nominal)
        return (low + high) / 2

    def sigma(self, nominal: float) -> float:
        """Standard deviation, SI."""
        return self.plus_minus(nominal) * (UNIFORM if self.uniform else 1 / self.sigmas)


def read(cursor: Cursor, schema: SceneSchema, known: Sequence[Place]) -> tuple[Tolerance, ...]:
    """Table [tolerances]; known: places of the scene's numbers, any of which may have one.

    The tolerance of a number of an effect that is off is checked and left out.
    """
    tolerances = []
    with cursor.faults:
        labels = [*schema.variables, *(place.label for place in known)]
        for place in label_entries(cursor, labels).values():
            with cursor.faults:
                quantity, counts = number_or_waiting(place, schema, known, "number with a tolerance")
                tolerance = _tolerance(place, quantity)
                if counts:
                    tolerances.append(tolerance)
    return tuple(tolerances)


def bands(cursor: Cursor, schema: SceneSchema) -> dict[str, float]:
    """Table [accept]: half the band around an equality or a goal within which machines are accepted, SI, by figure."""
    bands: dict[str, float] = {}
    with cursor.faults:
        inner = label_entries(cursor, schema.figures)
        for name, place in inner.items():
            with cursor.faults:
                if name not in schema.figures:
                    raise place.unknown("figure", name, schema.figures, given=inner)
                bands[name] = place.number(Quantity(schema.figures[name].kind, above=0))
    return bands


def _tolerance(cursor: Cursor, quantity: Quantity) -> Tolerance:
    """Tolerance of one number. Raises BadInput."""
    given = cursor.raw if isinstance(cursor.raw, Mapping) else {"plus_minus": cursor.raw}
    cursor = cursor._replace(raw=given)
    for key in given:
        if key not in KEYS:
            raise cursor.at(key).unknown("key", key, KEYS, given=given)
    forms = [form for form in FORMS if form in given]
    if len(forms) != 1:
        problem = f"{' and '.join(forms)} define the same quantity twice" if forms else "plus_minus is missing"
        raise cursor.fault(problem, remedy=f'Give one of {", ".join(FORMS)}, such as plus_minus = "0.06 mm"')
    if ("plus" in given) != ("minus" in given):
        lacking = "minus" if "plus" in given else "plus"
        problem = f"{lacking} is missing: plus and minus together are the band"
        raise cursor.at(lacking).fault(problem, remedy=f'Give {lacking} = "0" where there is none')
    share, below, above, standard = False, 0.0, 0.0, ""
    if "class" in given:
        standard = _standard(cursor.at("class"), quantity)
    elif "fit" in given:
        standard = _fit(cursor.at("fit"), quantity)
    elif "plus" in given:
        (above_is_share, above), (below_is_share, below) = (
            _deviation(cursor.at(side), quantity) for side in ("plus", "minus")
        )
        share = above_is_share or below_is_share
        if share and not ((above_is_share or above == 0.0) and (below_is_share or below == 0.0)):
            problem = "one side is a percentage and the other is not"
            raise cursor.fault(problem, remedy="Write both in % or both in a unit")
        if above + below < 0.0:
            problem = "the upper end of the band lies below its lower end"
            raise cursor.fault(problem, remedy="Write plus and minus so that plus + minus is not negative")
    else:
        share, above = _half(cursor.at("plus_minus"), quantity)
        below = above
    spread = cursor.at("spread").word(SPREADS, "spread") if "spread" in given else SPREADS[0]
    if spread == "uniform" and "sigmas" in given:
        problem = "a uniform spread has no sigmas: all values lie in its band"
        raise cursor.at("sigmas").fault(problem, remedy="Take sigmas out")
    sigmas = cursor.at("sigmas").number(Quantity("number", above=0)) if "sigmas" in given else SIGMAS
    group = given.get("group", "")
    if not isinstance(group, str):
        raise cursor.at("group").fault("it is not a name", group, remedy='Write group = "machine"')
    if bool(group) != ("correlation" in given):
        lacking = "correlation" if group else "group"
        problem = f"{lacking} is missing: numbers of one group are correlated"
        raise cursor.at(lacking).fault(problem, remedy='Give group = "machine" and correlation = 0.5')
    place = cursor.at("correlation")
    correlation = place.number(Quantity("number", least=0)) if "correlation" in given else 0.0
    if correlation > 1.0:
        raise place.fault("it is more than 1", correlation, "0 to 1", "Correct the value")
    return Tolerance(cursor.label, below, above, share, standard, sigmas, spread == "uniform", group, correlation)


def _half(cursor: Cursor, quantity: Quantity) -> tuple[bool, float]:
    """Whether a half width is a share of the nominal, and the half width, SI or as a share."""
    percent = _PERCENT.fullmatch(cursor.raw) if isinstance(cursor.raw, str) else None
    if percent:
        return True, cursor._replace(raw=percent[1]).number(Quantity("number", least=0)) / 100
    return False, cursor.number(Quantity(quantity.kind, least=0))


def _deviation(cursor: Cursor, quantity: Quantity) -> tuple[bool, float]:
    """Whether an end of a band is a share of the nominal, and the end, SI or as a share; a bare 0 needs no unit."""
    raw = cursor.raw
    percent = _PERCENT.fullmatch(raw) if isinstance(raw, str) else None
    if percent:
        return True, cursor._replace(raw=percent[1]).number(Quantity("number")) / 100
    if raw == 0 or (isinstance(raw, str) and raw.strip() in ("0", "+0", "-0", "0.0")):
        return False, 0.0
    return False, cursor.number(Quantity(quantity.kind))


def _standard(cursor: Cursor, quantity: Quantity) -> str:
    if quantity.kind != "length":
        problem = f"a tolerance class needs a length, and this is of kind {quantity.kind}"
        raise cursor.fault(problem, cursor.raw, remedy="Give plus_minus instead")
    return cursor.word(tolerance_classes.CLASSES, "tolerance class")


def _fit(cursor: Cursor, quantity: Quantity) -> str:
    raw = cursor.raw
    if quantity.kind != "length":
        problem = f"a fit needs a length, and this is of kind {quantity.kind}"
        raise cursor.fault(problem, raw, remedy="Give plus and minus instead")
    if not isinstance(raw, str) or iso_fits.split_class(raw) is None:
        allowed = f"a letter of {' '.join(iso_fits.LETTERS)} with a grade of {iso_fits.LEAST_GRADE} to "
        allowed += f"{iso_fits.MOST_GRADE}, k m n K M N to 8"
        raise cursor.fault("unknown tolerance class", raw, allowed, 'Write fit = "H7", or plus and minus')
    return raw
