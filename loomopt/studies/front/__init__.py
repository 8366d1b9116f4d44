"""What two figures of a machine cost each other: certified fronts."""
