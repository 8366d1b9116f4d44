"""Mathematics on its own: the number systems that formulas run in, least squares, cones, evenly spread points."""
