"""loomopt beside other ways to the same answer."""
