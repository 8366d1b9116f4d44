"""What tries to break loomopt: random scenes, spoilt input, mutants."""
