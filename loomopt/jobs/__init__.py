"""The loom jobs: a folder each, found by name (registry.py); what they share stands in base.py."""
