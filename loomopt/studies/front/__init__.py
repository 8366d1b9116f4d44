"""Certified Pareto fronts of two figures of a machine."""
