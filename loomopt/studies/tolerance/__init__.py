"""Scatter of manufactured machines: spread, yield, and the tolerance to tighten first."""
