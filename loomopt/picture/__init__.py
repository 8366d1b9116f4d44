"""Shapes, panels and equations as records that jobs return and renderers draw."""
