"""Motion that is not given by geometry alone: only reached by scenes that need it."""
