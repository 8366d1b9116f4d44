"""How wide a search looks, and how far apart its starts are: what costs time, and decides no verdict."""

SCREENED_NODES, DESIGNS, MOVED_SHARE, PROJECTIONS, SCREENED_STARTS = 48, 512, 8, 3, 4
"""A search's look at many designs: nodes of a turn, designs, one in how many is moved onto its limits, in so many
steps, and starts kept of these and of those as drawn (benchmarks/attack.py)."""

MOST_NODES, FEWEST = 65536, 32
"""Nodes of all designs together, where a cycle has many of its own, and the fewest designs that are looked at."""

APART, CLOSER_TOGETHER, FAR_END, LONGEST_STEP = 0.35, 0.6, 0.02, 0.3
"""Of the box of variables: distance of starts (rms), its factor until there are enough, what a flipped variable stays
from its end, and the longest step of a projection."""

BETTER, FLIPS = 1e-8, 2
"""What another start must be able to fall below the best by, in natural sizes, to be followed to its end; rounds of
flips."""

CHANGE_WEIGHTS = 1e3, 1e4, 1e5, 1e6
"""Weights of a target's levels against least change from today, in turn, until all of them are held: linear ones are by
the first. IPOPT fails at a large one from afar; from one to the next, pivots lead."""

LEVELS_APART, VIOLATION_WEIGHT, WORST, REGULAR = 100.0, 10.0, 10.0, 1e-6
"""A search's merit in natural sizes: factor between objectives, weight of the worst violation, and what stands for no
value; share of a row's own size by which its projection is held regular."""
