"""Numbers to be swept as text: exact decimal steps from one end to the other, each with its unit as written."""

import re
from decimal import Decimal, localcontext

from loomopt.base.errors import BadInput
from loomopt.base.quantities import plain_number
from loomopt.base.refusals import refusal

MOST_VALUES = 20_000
"""Points of a study."""
_RANGE = re.compile(r"([^:\s]+) *: *([^:\s]+) *: *([^:\s]+)(?: +(\S.*))?")
_ENDS = re.compile(r"([^:\s]+) *: *([^:\s]+)(?: +(\S.*))?")
FORM, EXAMPLE = "LO:HI:STEP UNIT", "600:900:25 N*m"
_ALLOWED = f"{FORM}, such as {EXAMPLE}"


def values(text: str, key: str) -> list[str]:
    """Return LO, LO + STEP, … and HI of "LO:HI:STEP UNIT", each as text with the unit; digits are exact.

    Where the steps do not meet HI the last one is shorter. Raises BadInput.
    """
    found = _RANGE.fullmatch(text.strip())
    numbers = [number for number in (found.groups()[:3] if found else ()) if plain_number(number) is not None]
    if found is None or len(numbers) < 3:
        raise _refused("it is no range of numbers", key, text)
    low, high, step = map(Decimal, numbers)
    if step <= 0 or high < low:
        raise _refused("the range has no step forward", key, text, "Write the smaller end first, and a step above 0")
    with localcontext(prec=200):
        if (high - low) / step > MOST_VALUES:
            raise _refused(f"the range has more than {MOST_VALUES} values", key, text, "Write a larger step")
        steps = [low + k * step for k in range(int((high - low) / step) + 1)]
        steps += [high] if steps[-1] < high else []
        told = [f"{value.normalize():f}" for value in steps]
    return [f"{number} {found[4]}" if found[4] else number for number in told]


def ends(text: str, key: str) -> tuple[str, str]:
    """Return LO and HI of "LO:HI UNIT", each as text with the unit. Raises BadInput."""
    found = _ENDS.fullmatch(text.strip())
    if found is None or None in map(plain_number, found.groups()[:2]):
        raise _refused("it is no range of numbers", key, text, allowed="LO:HI UNIT, such as 0:5 kg")
    low, high = (f"{number} {found[3]}" if found[3] else number for number in found.groups()[:2])
    return low, high


def _refused(problem: str, key: str, text: str, remedy: str = "Correct the range", allowed: str = _ALLOWED) -> BadInput:
    return refusal(problem, "", key, text, allowed, remedy)
