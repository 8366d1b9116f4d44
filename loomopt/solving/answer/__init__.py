"""Answers of solves: plain data, and their sentences."""
