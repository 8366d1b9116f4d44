"""ISO 286 tolerance classes such as H7 and g6: deviations of a hole or a shaft from its nominal size, up to 500 mm.

Fundamental deviations are the values of the tables of ISO 286-1:2010 (tables 2 to 5), not of their formulas; they are
printed alike in DIN ISO 286-1 and in handbooks. Letters: shafts d e f g h js k m n p r s, holes D E F G H JS K M N P R
S; grades IT5 to IT11; for k m n and K M N the tables end at IT8.
"""

import math
import re
from bisect import bisect_left

from loomopt.scenes.tolerance_classes import AS_WRITTEN, ENDS, GRADES

LARGEST = 500
"""mm; the largest nominal size."""
ABOVE = {
    "d": (20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230),
    "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
    "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
    "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
    "h": (0,) * 13,
}
"""Letter → how far a shaft's upper deviation lies below the nominal, µm, by the sizes of ENDS up to 500 mm."""
BELOW = {
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
}
"""Letter → how far a shaft's lower deviation lies above the nominal, µm; k of IT4 to IT7, 0 else."""
FINE_ENDS = (
    3,
    6,
    10,
    14,
    18,
    24,
    30,
    40,
    50,
    65,
    80,
    100,
    120,
    140,
    160,
    180,
    200,
    225,
    250,
    280,
    315,
    355,
    400,
    450,
    500,
)
FINE = {
    "r": (10, 15, 19, 23, 23, 28, 28, 34, 34, 41, 43, 51, 54, 63, 65, 68, 77, 80, 84, 94, 98, 108, 114, 126, 132),
    "s": (
        *(14, 19, 23, 28, 28, 35, 35, 43, 43, 53, 59, 71, 79, 92, 100, 108, 122, 130, 140, 158, 170, 190, 208, 232),
        252,
    ),
}
"""The same of letters whose sizes are divided more finely."""
DELTA = {
    5: (0, 1, 2, 3, 3, 4, 5, 5, 6, 6, 7, 7, 7),
    6: (0, 3, 3, 3, 4, 5, 6, 7, 7, 9, 9, 11, 13),
    7: (0, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    8: (0, 6, 7, 9, 12, 14, 16, 19, 23, 26, 29, 32, 34),
}
"""Grade → what is added to the upper deviation of holes K M N (to IT8) and P R S (to IT7), µm."""
HOLE_M6 = {(250, 315): -9}
"""Upper deviation of M6, µm, in the one range of sizes, mm, for which the standard lists it separately."""
LEAST_GRADE, MOST_GRADE = 5, 11
SHAFTS = (*ABOVE, "js", *BELOW, *FINE)
LETTERS = (*SHAFTS, *(letter.upper() for letter in SHAFTS))
_LETTERS = "|".join(letter for letter in LETTERS if letter.lower() not in ("k", "m", "n"))
PATTERN = f"^(({_LETTERS})([5-9]|10|11)|[kmnKMN][5-8])$"
"""Regular expression of the tolerance classes."""
_CLASS = re.compile(r"([A-Za-z]{1,2})([0-9]{1,2})")


def split_class(name: str) -> tuple[str, int] | None:
    """Letter and grade of a tolerance class; None if the tables do not have it."""
    match = _CLASS.fullmatch(name)
    if match is None or match[1] not in LETTERS:
        return None
    letter, grade = match[1], int(match[2])
    most = 8 if letter.lower() in ("k", "m", "n") else MOST_GRADE
    return (letter, grade) if LEAST_GRADE <= grade <= most else None


def deviations(name: str, nominal: float) -> tuple[float, float]:
    """Lower and upper deviation of a tolerance class, m; not numbers for sizes outside the tables.

    name: such as "H7"; nominal: size, m. Raises ValueError for an unknown class.
    """
    parts = split_class(name)
    if parts is None:
        raise ValueError(f"{name} is not a known tolerance class")
    letter, grade = parts
    size = abs(nominal) * 1e3 - AS_WRITTEN
    if not 0.0 < size <= LARGEST:
        return math.nan, math.nan
    width = GRADES[f"IT{grade}"][bisect_left(ENDS, size)]
    low, high = (_hole if letter.isupper() else _shaft)(letter, grade, width, size)
    return 1e-6 * low, 1e-6 * high


def _shaft(letter: str, grade: int, width: int, size: float) -> tuple[float, float]:
    place = bisect_left(ENDS, size)
    if letter == "js":
        return -width / 2, width / 2
    if letter in ABOVE:
        return -ABOVE[letter][place] - width, -ABOVE[letter][place]
    low = _raised(letter, size)
    low = low if letter != "k" or grade <= 7 else 0
    return low, low + width


def _raised(letter: str, size: float) -> int:
    """Lower deviation of a shaft above its nominal, µm."""
    return FINE[letter][bisect_left(FINE_ENDS, size)] if letter in FINE else BELOW[letter][bisect_left(ENDS, size)]


def _hole(letter: str, grade: int, width: int, size: float) -> tuple[float, float]:
    place, small = bisect_left(ENDS, size), letter.lower()
    if small == "js":
        return -width / 2, width / 2
    if small in ABOVE:
        return ABOVE[small][place], ABOVE[small][place] + width
    raised = _raised(small, size)
    if small in ("k", "m", "n"):
        high = -raised + DELTA[grade][place]
        if (small, grade) == ("m", 6) and 250 < size <= 315:
            high = HOLE_M6[250, 315]
    else:
        high = -raised + (DELTA[grade][place] if grade <= 7 else 0)
    return high - width, high
