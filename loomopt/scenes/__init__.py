"""Scenes: from a TOML file to checked numbers in SI, and designs and answers read back; knows no job."""
