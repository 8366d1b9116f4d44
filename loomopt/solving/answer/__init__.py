"""What a solve says: plain data, and words."""
