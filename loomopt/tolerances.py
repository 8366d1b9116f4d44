"""Every number that decides a verdict, a stop or a step: where it comes from, and what depends on it."""

ASSEMBLY_MARGIN = 1.001
"""Factor to spare by which every dyad's triangle must close at both ends (assembly margins of all jobs)."""

NEARLY_SINGULAR = 5e-4
"""Share by which a dyad's triangle closes, below which peaks stand so close that even samples miss them."""

NO_MASS = 1e-9
"""Share of the largest counterweight below which there is none: IPOPT stops this far inside its bounds (beatup)."""

BALANCED = 1e-8
"""|M3| at front dead centre below this share of the peak torque is called zero (words of the beat-up only)."""
