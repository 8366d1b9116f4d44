"""Shapes, panels and equation records: what jobs return and views render."""
