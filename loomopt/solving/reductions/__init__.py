"""Reductions: a task is made simpler, and the answer to the simpler one becomes its own."""
