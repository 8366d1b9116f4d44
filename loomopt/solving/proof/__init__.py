"""Proof that no admissible design is better: branch and bound over boxes of designs, level by level."""
