"""Benchmarks: README.md says what each shows. Their second opinion, tests/reference, is put on the path here."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))
