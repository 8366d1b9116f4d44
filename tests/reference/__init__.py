"""Physics a second time in plain NumPy, SciPy and mpmath: what tests and benchmarks compare loomopt with."""
