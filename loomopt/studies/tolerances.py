"""Numbers that decide what a study says of an error, and when answers count as the references'."""

REFERENCE_DIGITS, CLOSED_DIGITS = 40, 60
"""Digits of references, and of those that readings in 40 digits are compared with: 20 more than any of them has."""

REFERENCE_STEP, REFERENCE_SLOPE = 12, 20
"""Decimals of the step of central differences in u, whose second one then has 16 digits of 40, enough for Newton's
method; and of one-sided slopes in the design, which are right to 20 digits."""

EXTREME_STEPS, EXTREME_FAR, EXTREME_TIED = 4, 1e-3, 1e-9
"""Newton steps toward an extreme in many digits: from the 8 digits of u in float64 three are enough; the largest step
that still leads there; share by which float64 may order two extremes wrongly."""

MET_ROUNDS, MET = 6, 1e-28
"""Steps onto what binds with slopes in float64, each worth at least 8 digits, and where they have arrived: references
must be 100 times tighter than errors of 1e-25 (tests/studies/test_accuracy_references.py)."""

OPEN_RANK, OPEN_TURNS, OPEN_FLAT = 1e-9, 3, 1e-7
"""Directions that what binds moves by less than this share are open; Newton steps along them; curvature below which
nothing changes along one: prices are known in float64 only, and their rounding must not count as one."""

REFERENCE_ACCURACY = 1e-11
"""Accuracy of the answers that references start from: the finest that can be asked."""

TIGHTER, NO_ORDER, STILL, ONE_ORDER, LEAST_ORDER = 100.0, 100 * 2.0**-52, 2.0, 1.25, 0.25
"""Work-precision rows: how many times better a reference is known than the error it judges; errors that are rounding;
factor of the least error within which errors have stopped falling; factor of the middle slope within which slopes are
one order; the least order that is convergence. Orders 1, 2 and 4 of made-up errors are told to 1 %
(test_accuracy_ladders)."""

REPRODUCED_OBJECTIVE, REPRODUCED_DESIGN = 1e-8, 1e-6
"""Differences that `check` allows, relative: the accuracy asked by default, and a hundred times that for a design,
which moves more than its objective does."""
