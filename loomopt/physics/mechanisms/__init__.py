"""Geometry of the mechanisms: positions, derivatives, margins; no forces."""
