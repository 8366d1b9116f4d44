"""What loomopt takes, and whether two checkouts say the same."""
