"""Optima whose numbers are sizes that can be ordered."""
