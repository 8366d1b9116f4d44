"""The loom jobs: one folder per job (registry.py finds them by name); base.py has their common part."""
