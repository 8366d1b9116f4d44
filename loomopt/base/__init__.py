"""What every room stands on: errors, records, files, arguments, units; no mechanics."""
