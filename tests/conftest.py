"""One Hypothesis profile for every run: the same examples each time, no clock; "thorough" looks farther by hand.

pytest tests/properties --hypothesis-profile=thorough

Beside other workers (pytest -n) linear algebra keeps to one thread, as in the command: threads of several processes
wait for each other, which takes up to three times the processor time.

What a shell starts in the background ignores Ctrl-C, and passes that on: here it is heard again.
"""

import os
import signal

if "PYTEST_XDIST_WORKER" in os.environ:  # before NumPy is imported: afterwards it would not listen
    for library in ("OPENBLAS", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import pytest
from hypothesis import settings

from loomopt.interface.cli import shell

settings.register_profile("ci", derandomize=True, deadline=None, database=None, max_examples=100)
settings.register_profile("thorough", deadline=None, database=None, max_examples=2000)
settings.load_profile("ci")

signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def no_line_of_progress(monkeypatch):
    """Keep commands that are called here from saying what they are doing, however slow the machine is."""
    monkeypatch.setattr(shell, "APART", 600.0)
