"""Numerical tolerances that several files share, with their origin and use.

Tolerances that only one file uses are in that file, those of a job in the job's folder.
"""

ASSEMBLY_MARGIN = 1.001
"""Factor to spare by which every dyad's triangle must close at both ends (assembly margins of all jobs)."""

NO_MASS = 1e-9
"""Share of the largest counterweight below which it counts as none: IPOPT stops this far inside its bounds (beatup)."""


# Sampling and reading
#
# Rows are relative to their own largest magnitude; u is the share of a piece, 0 to 1.

SAMPLES, LEAST_SHARE = 720, 8
"""Samples of one turn from which extremes are refined at the usual accuracy, and the part of them that the narrowest
piece gets. `loomopt accuracy` (refined points) is exact from 180 on today's machines; fourfold for sharper peaks."""

SAME_ANGLE = 1e-12
"""rad: a piece that ends this close before an angle ends at it, a thousand roundings."""

START_ROOM = 0.01
"""Share of a bound's width that a start keeps from its ends: IPOPT would push it there."""

# NLP
#
# Variables, rows and objectives divided by their scales. The experiment: benchmarks/measure/tolerances.py solves every
# target of three packaged scenes, and two neighbours of each, with one number at a time a tenth and ten times as large
# (counts: half and double). A number without a remark below changes no objective by 4e-11, nor IPOPT's iterations by a
# tenth.

NEAR, ROUNDING = 1e-8, 1e-12
"""Largest excess between nodes that ends the exchange whatever the accuracy: Newton's method must start near. And the
smallest accuracy: a sum of rounded terms is not known better."""

BINDING = 1e-6
"""Multiplier above which a row binds where a solve ends: IPOPT leaves TOLERANCE/distance, so what is farther than 1e-5
from its bound is below it. The certificate finds a row that is active by mistake."""

TOUCHING, CONVERGED = 1e-8, 1e-8
"""Distance from its bound at which an extreme is polished onto it; move, in u or scaled, below which nothing moves:
both the root of rounding, for a maximum's place is known no better."""

POLISH_STEPS, POLISH_FARTHEST, POLISH_FARTHER, POLISH_RANK = 3, 1e-6, 2e-5, 1e-10
"""Newton steps of polishing; the farthest they may lead, and where that is not certified, twice what IPOPT leaves of
what just binds, IPOPT_TOLERANCE/BINDING; the singular value below which rows depend."""

POLISH_EXCESS, POLISH_DONE = 1e-12, 1e-13
"""Excess of a polished row that is rounding of its terms, and the step after which there is none left to take."""

SAME_NODE = 1e-3
"""Nodes of one piece this close in u stand for one extreme: less than a sample apart, they are no two maxima."""


# Certificate and search
#
# Sizes are relative: a row, a variable or an objective divided by its `scale`. Rows are read to 1e-15 of them
# in floats and differenced at 40 digits, so that everything below is far above rounding.

ACCURACY, TIGHTEST, COARSEST = 1e-8, 1e-11, 0.1
"""Relative accuracy of whole-cycle values: usual, tightest (a sampled extreme is right to 1e-12), coarsest allowed."""

FEASIBLE = 1e-9
"""Excess of a limit that is still satisfied. Two decades above IPOPT's constr_viol_tol; certificate, findings."""

STATIONARY = 1e-6
"""Slope that KKT multipliers may leave: an objective that curves by 1 is then within 1e-12 of its least."""

ACTIVE = 1e-7
"""Distance from its bound at which a row takes part in the KKT system: ten times the tolerance of complementarity."""

POSITIVE = 1e-8
"""Multiplier above which a limit binds: below it, a relaxation by the whole scale gains less than the accuracy."""

RANK = 1e-7
"""Singular value, relative to the largest, below which slopes of binding rows depend on each other.

Slopes are differenced one-sided with a step of 1e-20 and come out right to 1e-16; 1e-7 is the root of what floats
resolve, where curvature of size 1 within the distance ACTIVE makes dependent slopes look apart.
"""

FLAT = 1e-7
"""Curvature, and slope of a touching row, that counts as none: ACTIVE's effect on a slope, where curvature is 1."""

JET_ERROR, DOUBT = 1e-10, 10.0
"""Error of jets, relative to the largest derivative of a row where that exceeds 1: eighty times the largest one seen.
1500 certificates of adversaries and hard cases show 2e-13, rapier drives beside their optimum 1.2e-12, where an extreme
is read 6e-13 beside its place (see test_derivatives_jets.py). And the factor from its threshold within which a decisive
number is computed again in 40 digits."""

CORRECTIONS, PRECISE = 4, 1e-9
"""Newton's steps after a solve, each of which doubles the digits (1e-6 needs two), and the residual that ends them."""

THIRD_STEP, THIRD_STEPS = "1e-8", (4e-3, 2e-3, 1e-3)
"""Steps of third derivatives. At 40 digits central: rounding 1e-40/1e-24 = 1e-16, truncation 1e-16. In floats by
differences of the curvatures, extrapolated: their rounding of 1e-16/1e-3 = 1e-13, truncation (1e-3)⁶ beside 1."""

NEWTON_SHIFT = "1e-3"
"""How far, in u, one Newton step may move a sampled extreme: it is right to 1e-8, what moves farther is no extreme."""

GIVES_WAY, MOVED = 1e-12, 1e-9
"""Amount by which a tie-break may exceed a limit, and the least move of a variable that is reported as a choice."""

INDIFFERENT = 1e-3
"""Share of a figure that no part is added for: a tenth of what machining and measuring leave of a torque."""

SAME_OBJECTIVE = 1e-7
"""Objectives that agree to this are one optimum: ten times the usual accuracy."""

PRICED, NEEDED, CHEAP, SCREENED = 1e-6, 1e-9, 1e-9, 1e-5
"""Least relaxation: multiplier above which a limit belongs to the clash; excess that is none; cost of the excess of a
limit that is tried alone, beside 1 of all others; their sum from which it does not suffice."""

SLACK, LEAST_SLACK, MOST_SLACK = 1e-8, 1e-13, 0.1
"""Slack of a proof, relative to a quantity's largest magnitude: default, least that balls resolve, largest allowed."""

ROUNDED = 1e-15
"""Least error that an answer claims, relative to the scale: nothing is known better."""

# Pictures
#
# How closely a curve is drawn, and what is shown of a number.

SHOWN_AS_ZERO = 1e-8
"""Share of the largest number of its kind below which one is shown as 0: the default accuracy."""
