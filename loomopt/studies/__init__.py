"""Many solves, as rows."""
