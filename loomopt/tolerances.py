"""Every number that decides a verdict, a stop or a step: where it comes from, and what depends on it."""

ASSEMBLY_MARGIN = 1.001
"""Factor to spare by which every dyad's triangle must close at both ends (assembly margins of all jobs)."""

NEARLY_SINGULAR = 5e-4
"""Share by which a dyad's triangle closes, below which peaks stand so close that even samples miss them."""

NO_MASS = 1e-9
"""Share of the largest counterweight below which there is none: IPOPT stops this far inside its bounds (beatup)."""

BALANCED = 1e-8
"""|M3| at front dead centre below this share of the peak torque is called zero (words of the beat-up only)."""

# Certificate and search
#
# Sizes are natural sizes: a row, a variable or an objective divided by its own `scale`. Rows are read to 1e-15 of them
# in floats and differenced at 40 digits, so that everything below is far above rounding.

ACCURACY, TIGHTEST, COARSEST = 1e-8, 1e-11, 0.1
"""Relative accuracy of whole-cycle values: usual, tightest (a sampled extreme is right to 1e-12), coarsest allowed."""

MOST_STARTS = 10_000
"""Starts that may be asked for: hours; more is a slip of the pen."""

FEASIBLE = 1e-9
"""What a limit may be exceeded by and still hold. Two decades above IPOPT's constr_viol_tol; certificate, findings."""

STATIONARY = 1e-6
"""Slope that KKT multipliers may leave: an objective that curves by 1 is then within 1e-12 of its least."""

SLOPING = 0.1
"""Slope left (at most 1, for the multipliers of an objective's pieces sum to 1) beyond which second order is not asked:
Newton's method is nowhere near, and a row may end where its slope has no end."""

COMPLEMENTARY = 1e-8
"""Multiplier times distance of a limit: what the objective might still gain by meeting it. The usual accuracy."""

ACTIVE = 1e-7
"""Distance from its bound at which a row takes part in the KKT system: ten times what complementarity lets pass."""

POSITIVE = 1e-8
"""Multiplier above which a limit binds: below it, loosening by a whole natural size gains less than the accuracy."""

RANK = 1e-7
"""Singular value, relative to the largest, below which slopes of binding rows depend on each other.

Slopes are differenced one-sided with a step of 1e-20 and come out right to 1e-16; 1e-7 is the root of what floats
resolve, where curvature of size 1 within the distance ACTIVE makes dependent slopes look apart.
"""

FLAT = 1e-7
"""Curvature, and slope of a touching row, that counts as none: ACTIVE's effect on a slope, where curvature is 1."""

FAINT = 1e-4
"""Curvature up to which a direction is looked along at PROBES, for what higher orders do there: at a step of 1e-2 a
cubic term of size 1 outweighs it (toys of tests/solving/test_adversary.py)."""

LARGEST_PRICE = 1e6
"""Multiplier above which there is no KKT point: STATIONARY times it is a slope of 1. Hock-Schittkowski's degenerate
problems end at 2e16, every packaged scene below 1e2."""

LARGEST_VARIABLE = 1e8
"""Variable above which slopes cannot be trusted: floats then resolve no better than 1e-8 of a natural size."""

NEWTON_CURVED, NEWTON_DONE = 1e-5, 1e-13
"""Curvature that Newton's step may follow: a slope of STATIONARY then moves a design by 0.1 at most. Slope and distance
that leave nothing to correct: a hundred times rounding."""

CORRECTIONS, PRECISE = 4, 1e-9
"""Newton's steps after a solve, each of which doubles the digits (1e-6 needs two), and the residual that ends them."""

DIGITS, FIRST_STEP, SECOND_STEP = 40, "1e-20", "1e-12"
"""Digits of the number system, and the steps of its differences. First, one-sided: error 1e-20 of both kinds. Second,
central: rounding 1e-40/1e-24 = 1e-16, truncation 1e-24."""

NEWTON_SHIFT = "1e-3"
"""How far, in u, one Newton step may move a sampled extreme: it is right to 1e-8, what moves farther is no extreme."""

CONE_SEEDS, CONE_STEPS = 12, 30
"""Random seeds and projected gradient steps by which the least curvature on the critical cone is sought. A heuristic:
the problem is NP-hard; eigenvectors are seeds too, and find all cones of up to three dimensions that tests draw."""

CONE_OPEN, CONE_TIP = 1e-9, 1e-9
"""Slope up to which a unit direction does not leave a limit, and length below which a projection is the cone's tip:
what non-negative least squares leaves of ROUNDING times the condition of a few dozen slopes."""

PROBES = 1e-2, 3e-3
"""Steps along a direction without curvature at which the Lagrangian is read: at both of them it must fall."""

FALLEN, FALL_MARGIN = 1e-12, 10.0
"""Fall of the Lagrangian that counts: a thousand times rounding, and this many times what the slope left explains."""

UNCHANGED = 1e-10
"""Change of an objective along a move that costs nothing: a hundredth of the usual accuracy (silent levels)."""

BEYOND = 1e-3
"""Share of a variable by which a flat move is tried beyond the design too: a bump at both ends of it would show."""

GIVES_WAY, MOVED = 1e-12, 1e-9
"""What a limit may give way to a silent level, and the least move of a variable that is told as a choice."""

SETTLE_BISECTIONS, SETTLE_NODES = 60, 64
"""Halvings of a silent level's way (to a float's last bit), and nodes of a turn on which a curve must not change."""

MORE_STARTS = 8
"""Starts tried before a target is called infeasible or uncertified: one in eight reaches the optimum of the scenes'
hardest target (tests/solving/test_rapier_starts.py: more than half do)."""

SAME_OBJECTIVE = 1e-7
"""Objectives that agree to this are one optimum: ten times the usual accuracy."""

MOST_ALIKE = 4
"""Points of one optimum that are put to the certificate where the first does not pass."""

STRONGER, STRONGEST_PENALTY = 100.0, 1e7
"""Factor on the weight between levels where a level gave way; the largest weight that IPOPT still solves to 1e-9."""

HELD_MARGIN = 2.0
"""A level's weight must exceed its multiplier [exact penalty: Nocedal and Wright, section 17.2], by this factor."""

PRICED, AGREEING, NEEDED = 1e-6, 3, 1e-9
"""Least relaxation: multiplier above which a limit belongs to the clash, starts that must agree on the least sum, and
excess that is none."""

FARTHEST_SIZE, SAME_SIZE = 4, 1e-9
"""Sizes sold that are tried on either side, and the share by which two answers to them are equally good."""

MOST_BOXES, MEAN_BOXES = 20_000, 2048
"""Boxes of crank angle after which a bound is undecided (every packaged row takes under 2000), and over which a mean is
enclosed: the cube of a width of 1/2048 is 1e-10."""

SLACK, LEAST_SLACK, MOST_SLACK = 1e-8, 1e-13, 0.1
"""What a proof leaves open, relative to a quantity's largest magnitude: usual, what balls resolve, most allowed."""

NNLS_PULL, NNLS_GONE, NNLS_RANK, NNLS_EXCHANGES = 1e-13, 1e-15, 1e-14, 10
"""Non-negative least squares: pull of a column that enters, size of one that leaves, singular value that counts, each
about a hundred roundings; exchanges allowed per column (Lawson and Hanson need about one)."""

ROUNDED = 1e-15
"""Nothing is known better, relative to its natural size: the least error an answer claims."""
