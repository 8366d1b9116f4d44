"""What accuracy costs in time: work-precision studies."""
