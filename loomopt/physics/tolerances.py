"""Every number that decides a verdict, a stop or a step, but a job's own: where it comes from, what depends on it.

Those of studies alone are in studies/tolerances.py.
"""

ASSEMBLY_MARGIN = 1.001
"""Factor to spare by which every dyad's triangle must close at both ends (assembly margins of all jobs)."""

NEARLY_SINGULAR = 5e-4
"""Share by which a dyad's triangle closes, below which peaks stand so close that even samples miss them."""

NO_MASS = 1e-9
"""Share of the largest counterweight below which there is none: IPOPT stops this far inside its bounds (beatup)."""

BALANCED = 1e-8
"""|M3| at front dead centre below this share of the peak torque is called zero (words of the beat-up only)."""

# Sampling and reading
#
# Rows are relative to their own largest magnitude; u is the share of a piece, 0 to 1.

SAMPLES, LEAST_SHARE = 720, 8
"""Samples of one turn from which extremes are refined at the usual accuracy, and the part of them that the narrowest
piece gets. `loomopt accuracy` (refined points) is exact from 180 on today's machines; fourfold for sharper peaks."""

LEAST_NODES = 8
"""Nodes that the narrowest of many pieces gets at least: more than 16 pieces share twice the samples. A piece of a free
cam law is one cubic, which the five points that refine an extreme hold exactly."""

SAMPLED = ((1e-3, 180), (1e-6, 360))
"""Samples that are enough for a coarser accuracy: what refining misses at so many is far below it (same study)."""

CLOSER = 1 / 8
"""Step, in samples, of the five points that refine a sampled extreme: their quartic errs by the step's 6th power, 4e-6
of what the samples' own would, and values a step apart still differ by far more than rounding."""

GAUSS_NODES = 32
"""Nodes of a mean on each piece: of an analytic formula the error falls by a constant factor a node. Packaged means are
right to 2e-10 with 8 of them and to rounding with 12 (benchmarks/tolerances.py); the rest is for narrower peaks."""


SINGULAR_SAMPLES, WORTH_A_LOOK = 361, 10
"""Samples of one turn between which the closest position of a triangle is sought, and how many times NEARLY_SINGULAR
its share may be there: between samples a degree apart a top stands at most 4e-5 of its curvature higher."""

SAME_ANGLE = 1e-12
"""rad: a piece that ends this close before an angle ends at it, a thousand roundings."""


SPARSE_STEPS = ((1e-3, 90), (1e-6, 180), (0.0, 360))
"""Equal steps of one turn that curves of few rows begin with, by accuracy; no stretch between corners gets fewer than
LEAST_SHARE of them. Half the samples that are enough: rows are added around what they show."""

SPARSE_ROUNDS, SPARSE_MOST_ROWS = 40, 20_000
"""Rounds in which rows are added, each of which narrows a top's neighbourhood threefold (3^40 is past rounding), and
rows beyond which a curve is as dense as any plot."""

SPARSE_NEARLY, SPARSE_LEVEL = 0.8, 2e-13
"""Share of a column's largest magnitude above which another top may turn out higher: a top between 90 rows stands less
than a fifth above them. Share by which rows on a level may differ: a thousand roundings of the terms they sum."""

SAME_ROW = 1e-9
"""rad; an even row this close to a corner stands for it: no plot and no workshop tells them apart."""


SPEED_AT_REST, SPEED_STEPS, SPEED_MET = 1e-12, 30, 1e-8
"""Largest speed that keeps a bound: share of the largest value by which one at rest may miss it, for rounding; Newton's
steps at most, and the share of the speed after which there is none left to take: the next would be its square."""

START_ROOM = 0.01
"""Share of a bound's width that a start keeps from its ends: IPOPT would push it there."""

# NLP
#
# Variables, rows and objectives in their natural sizes. The experiment: benchmarks/tolerances.py solves every target of
# three packaged scenes, and two neighbours of each, with one number at a time a tenth and ten times as large (counts:
# half and double). What is not said below changes no objective there by 4e-11, nor IPOPT's iterations by a tenth.

IPOPT_TOLERANCE, IPOPT_SLOPE, IPOPT_ITERATIONS = 1e-11, 1e-9, 300
"""Where IPOPT stops: rows and complementarity three decades below the usual accuracy, slopes three below STATIONARY;
and where it gives up: no packaged target takes it a hundred iterations from its first start."""

WARM_BARRIER, WARM_PUSH = 1e-8, 1e-10
"""Barrier that a warm start begins with, which keeps a row of multiplier 1 so far from its bound, and how far a start
is pushed inside: less than what IPOPT itself left."""

PENALTY = 1000.0
"""Weight of each earlier objective against the next, first try: more than a level's multiplier keeps it exactly [exact
penalty: Nocedal and Wright, section 17.2]. A tenth of it does in the experiment; where it fails, the search raises it
(STRONGER)."""

CHECKED, MOST_CHECKED = 1.6384, 65536
"""Points of one turn on which refined values are checked again, times √accuracy: what is missed between points falls
with their square. 16384 for the usual accuracy, where a curve that bends by its size over a radian errs by 2e-8."""

NEAR, ROUNDING = 1e-8, 1e-12
"""Largest excess between nodes that ends the exchange whatever the accuracy: Newton's method must start near. And the
smallest that is asked: a sum of rounded terms cannot be told closer."""

BINDING = 1e-6
"""Multiplier above which a row binds where a solve ends: IPOPT leaves TOLERANCE/distance, so what is farther than 1e-5
from its bound is below it. A row wrongly held is told by the certificate."""

FIRST_SLOTS, LEADING = 6, 4
"""Nodes that a built NLP has room for (doubled when they are used up), and those of a start: its largest extremes.

The experiment: two of them take IPOPT a third more iterations; eight, or room for twelve, end one target's first start
in another local optimum.
"""

BESIDE_STATIONS = 2, 1
"""The same where rows stand at corners from the first. None of 28 free cam laws of 16 and 64 intervals, with every
effect, ends at a node beside its knots, and each that there is room for takes a twentieth of building."""

FIRST_SHARE, FIRST_ROOM = 1.01, 0.01
"""Factor and room by which a first epigraph variable stands above its rows: inside, so that IPOPT need not move it."""

ELASTIC_SHARE = 1e-3
"""Share of a positive lower bound below which no relaxation goes: lengths stay positive."""

FEW_CHOICES = 8
"""Numbers that a node may choose from by a switch before the chosen one becomes a variable: a row that reads more makes
slopes and curvatures dense. Named cam laws have five pieces at most."""

EXCHANGE_ROUNDS, ELASTIC_ROUNDS = 16, 32
"""Rounds of the exchange, each with an NLP solve: half of them do in the experiment. Least relaxations are flat, and
creep (tests/solving/test_infeasible.py)."""

STANDS = 1e-7
"""Largest excess of a row at a point that the certificate should look at though IPOPT gave up: ACTIVE."""

DRAWS = 200
"""Random starts drawn for each that is wanted: where fewer than one in 200 assembles, the ranges hold no machine."""

TOUCHING, SETTLED = 1e-8, 1e-8
"""Distance from its bound at which an extreme is polished onto it; move, in u or scaled, below which nothing moves:
both the root of rounding, for a maximum's place is known no better."""

POLISH_STEPS, POLISH_FARTHEST, POLISH_FARTHER, POLISH_RANK = 3, 1e-6, 2e-5, 1e-10
"""Newton steps of polishing; the farthest they may lead, and where that is not certified, twice what IPOPT leaves of
what just binds, IPOPT_TOLERANCE/BINDING; the singular value below which rows depend."""

POLISH_MET, POLISH_DONE = 1e-12, 1e-13
"""Excess of a polished row that is rounding of its terms, and the step after which there is none left to take."""

FOLLOW_FARTHEST, FOLLOW_ROUNDS = 0.2, 24
"""Farthest that a neighbour's answer is followed, in natural sizes, and the rounds it may take.

The experiment: a tenth of the way doubles IPOPT's iterations, ten times saves a seventh; but pivots are local, and
beyond a fifth of its size a design is another. Half the rounds do.
"""

FOLLOW_PROGRESS, FOLLOW_PATIENCE = 0.9, 5
"""Share to which the extremes' moves must shrink, and the rounds in a row in which they may fail to: with two, one of
the experiment's neighbours is left to IPOPT."""

SAME_NODE = 1e-3
"""Nodes of one piece this close in u stand for one extreme: less than a sample apart, they are no two maxima."""

PIVOTS, PIVOT_NEWTON_STEPS, PIVOT_STEP = 20, 8, 1e-9
"""Limits exchanged before the solver must choose, Newton steps to where they meet, and the step that ends them: what
is left is its square."""

PIVOT_MET, PIVOT_STATIONARY = 1e-12, 1e-9
"""Excess and slope of a KKT point reached by pivots: IPOPT's own, met by Newton's method at once."""

PIVOT_DEPENDENT, PIVOT_CURVED = 1e-7, 1e-6
"""Part of a slope outside the span of others below which it depends on them, and curvature below which a direction is
flat: ten and a hundred times the error of an extreme's place, 1e-8, with which slopes and curvatures change."""

PIVOT_SLOPE, PIVOT_RANK = 1e-9, 1e-10
"""Rise toward a limit along a way, and relative singular value, that are no more than rounding of slopes."""

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

JET_ERROR, DOUBT = 1e-10, 10.0
"""Error of jets, relative to the largest derivative of a row where that exceeds 1: a hundred times what is seen. 1500
certificates of adversaries and hard cases show 2e-13, rapier drives beside their optimum 6e-13 (test_forward.py). And
the factor from its threshold within which a figure that decides is looked at again in 40 digits."""

NEWTON_CURVED, NEWTON_DONE = 1e-5, 1e-13
"""Curvature that Newton's step may follow: a slope of STATIONARY then moves a design by 0.1 at most. Slope and distance
that leave nothing to correct: a hundred times rounding."""

CORRECTIONS, PRECISE = 4, 1e-9
"""Newton's steps after a solve, each of which doubles the digits (1e-6 needs two), and the residual that ends them."""

SLOPE_ERROR = 1e-12
"""Error of a slope by jets, relative to the largest of a row where that exceeds 1: five times what is seen of
JET_ERROR. Where an earlier level stays least is found to that over its curvature."""

DIGITS, FIRST_STEP, SECOND_STEP = 40, "1e-20", "1e-12"
"""Digits of the number system, and the steps of its differences. First, one-sided: error 1e-20 of both kinds. Second,
central: rounding 1e-40/1e-24 = 1e-16, truncation 1e-24."""

THIRD_STEP, THIRD_STEPS = "1e-8", (4e-3, 2e-3, 1e-3)
"""Steps of third derivatives. At 40 digits central: rounding 1e-40/1e-24 = 1e-16, truncation 1e-16. In floats by
differences of the curvatures, extrapolated: their rounding of 1e-16/1e-3 = 1e-13, truncation (1e-3)⁶ beside 1."""

NEWTON_SHIFT = "1e-3"
"""How far, in u, one Newton step may move a sampled extreme: it is right to 1e-8, what moves farther is no extreme."""


PROBES = 1e-2, 3e-3
"""Steps along a direction without curvature at which the Lagrangian is read: at both of them it must fall."""

FALLEN, FALL_MARGIN = 1e-12, 10.0
"""Fall of the Lagrangian that counts: a thousand times rounding, and this many times what the slope left explains."""

FALL_GROWTH = 18.0
"""How many times a fall within the error of an earlier level's valley must grow from the second probe to the first
to be doubted: of third order it grows 37 times, of higher more, an error by chance (tests/solving/test_valley.py)."""

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

PRICED, NEEDED, CHEAP, SCREENED = 1e-6, 1e-9, 1e-9, 1e-5
"""Least relaxation: multiplier above which a limit belongs to the clash; excess that is none; cost of the excess of a
limit that is tried alone, beside 1 of all others; their sum from which it does not suffice."""

FARTHEST_SIZE, SAME_SIZE = 4, 1e-9
"""Sizes sold that are tried on either side, and the share by which two answers to them are equally good."""

MOST_BOXES, MEAN_BOXES = 20_000, 2048
"""Boxes of crank angle after which a bound is undecided (every packaged row takes under 2000), and over which a mean is
enclosed: the cube of a width of 1/2048 is 1e-10."""

NEAR_TOP = 1.5
"""Widths between a box's middle and a refined top within which the box is expanded at the top, or at its end toward it.
Proofs of all packaged scenes take a tenth more readings with 0.5, tops inside a box alone; with 1 to 6 as many."""

SLACK, LEAST_SLACK, MOST_SLACK = 1e-8, 1e-13, 0.1
"""What a proof leaves open, relative to a quantity's largest magnitude: usual, what balls resolve, most allowed."""


ROUNDED = 1e-15
"""Nothing is known better, relative to its natural size: the least error an answer claims."""

# Pictures
#
# How closely a curve is drawn, and what is shown of a number.

CURVE_CLOSE, CURVE_NARROW, CURVE_PROMISED = 5e-7, 1e-8, 2.0
"""How far, m, a traced curve may lie from the true one, measured at nine points of each chord, or as a share of a huge
machine; and the chord tolerance that is promised over what is measured."""

SHOWN_AS_ZERO = 1e-8
"""Share of the largest number of its kind below which one is shown as 0: the accuracy asked by default."""
