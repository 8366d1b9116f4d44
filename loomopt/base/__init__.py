"""What every room stands on: errors, records, files, arguments, units; no mechanics."""

__version__ = "0.1.0"
