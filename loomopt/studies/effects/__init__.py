"""What each effect is worth, and what may be left out."""
