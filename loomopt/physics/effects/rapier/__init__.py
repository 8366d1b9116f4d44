"""Effects of the rapier drive: they read the head's travel alone."""
