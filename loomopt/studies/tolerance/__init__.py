"""Machines as they are made: spread, yield, and what to tighten first."""
