"""Base of all packages: errors, records, files, arguments, units; no mechanics."""

__version__ = "0.1.0"
