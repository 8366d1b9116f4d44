"""Optima that stay admissible as they are made: limits backed off by what machines vary."""
