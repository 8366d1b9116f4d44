"""Scatter of manufactured machines: spread, yield, and what to tighten first."""
