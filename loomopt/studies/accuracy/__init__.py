"""Cost of accuracy in time: work-precision studies."""
