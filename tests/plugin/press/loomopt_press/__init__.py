"""A slider-crank press for loomopt, in the files every job has."""
