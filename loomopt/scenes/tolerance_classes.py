"""Standard tolerance classes of lengths: ISO 286-1 grades, of which a length has half on each side, and ISO 2768-1.

Values of the standards' tables, not of their formula: i = 0.45 D^(1/3) + 0.001 D misses them by up to 13 %. Retrieved
tables agree for IT5 to IT11 up to 3150 mm, and for IT12 to IT14 up to 315 mm; above, IT12 to IT14 are the values as
commonly printed.
"""

import math
from bisect import bisect_left

ENDS = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500, 630, 800, 1000, 1250, 1600, 2000, 2500, 3150)
"""Nominal sizes, mm, up to and including which each column holds, over the one before."""
GRADES = {
    "IT5": (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27, 32, 36, 40, 47, 55, 65, 78, 96),
    "IT6": (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40, 44, 50, 56, 66, 78, 92, 110, 135),
    "IT7": (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63, 70, 80, 90, 105, 125, 150, 175, 210),
    "IT8": (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97, 110, 125, 140, 165, 195, 230, 280, 330),
    "IT9": (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155, 175, 200, 230, 260, 310, 370, 440, 540),
    "IT10": (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250, 280, 320, 360, 420, 500, 600, 700, 860),
    "IT11": (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400, 440, 500, 560, 660, 780, 920, 1100, 1350),
    "IT12": (
        *(100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630, 700, 800, 900, 1050, 1250, 1500, 1750),
        2100,
    ),
    "IT13": (
        *(140, 180, 220, 270, 330, 390, 460, 540, 630, 720, 810, 890, 970, 1100, 1250, 1400, 1650, 1950, 2300, 2800),
        3300,
    ),
    "IT14": (
        *(250, 300, 360, 430, 520, 620, 740, 870, 1000, 1150, 1300, 1400, 1550, 1750, 2000, 2300, 2600, 3100, 3700),
        4400,
        5400,
    ),
}
"""Width of the whole tolerance, µm."""
GENERAL_LEAST, GENERAL_ENDS = 0.5, (3, 6, 30, 120, 400, 1000, 2000, 4000)
GENERAL = {
    "ISO 2768-f": (0.05, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, math.nan),
    "ISO 2768-m": (0.1, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0),
    "ISO 2768-c": (0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 4.0),
    "ISO 2768-v": (math.nan, 0.5, 1.0, 1.5, 2.5, 4.0, 6.0, 8.0),
}
"""Each side, mm."""
CLASSES = (*GRADES, *GENERAL)
AS_WRITTEN = 1e-9
"""mm; what a nominal size in metres may be off the end of a range: 30 mm is up to and including 30 mm."""


def plus_minus(name: str, nominal: float) -> float:
    """Allowed deviation of a length of a nominal size, m, on each side, m; not a number outside the table."""
    size = abs(nominal) * 1e3 - AS_WRITTEN
    ends, widths, unit = (ENDS, GRADES[name], 0.5e-6) if name in GRADES else (GENERAL_ENDS, GENERAL[name], 1e-3)
    place = bisect_left(ends, size)
    least = GENERAL_LEAST if name in GENERAL else 0.0
    return unit * widths[place] if place < len(ends) and size + 2 * AS_WRITTEN >= least else math.nan
