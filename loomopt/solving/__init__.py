"""Answers: certified, explained, or honestly refused."""
