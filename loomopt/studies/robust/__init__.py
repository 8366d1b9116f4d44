"""Robust optima: limits are backed off by the scatter of manufactured machines."""
