"""The search for the best certified design."""
