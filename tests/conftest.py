"""One Hypothesis profile for every run: the same examples each time, no clock; "thorough" looks farther by hand.

pytest tests/properties --hypothesis-profile=thorough

Beside other workers (pytest -n) linear algebra keeps to one thread, as in the command: threads of several processes
wait for each other, which takes up to three times the processor time.

What a shell starts in the background ignores Ctrl-C, and passes that on: here it is heard again.
"""

import gc
import itertools
import math
import os
import signal

if "PYTEST_XDIST_WORKER" in os.environ:  # before NumPy is imported: afterwards it would not listen
    for library in ("OPENBLAS", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")

import pytest
from hypothesis import settings

from loomopt.interface import progress

settings.register_profile("ci", derandomize=True, deadline=None, database=None, max_examples=100)
settings.register_profile("thorough", deadline=None, database=None, max_examples=2000)
settings.load_profile("ci")

signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def no_line_of_progress(monkeypatch):
    """Keep commands that are called here from saying what they are doing, however slow the machine is."""
    monkeypatch.setattr(progress, "LINE_INTERVAL", 600.0)


def pytest_collection_modifyitems(items):
    """Sort the cases of a test marked `few` into quick, slow and whole ones; one that is marked slow itself stays so.

    The quick and the slow ones are spread over all, so that values of several columns change together.
    """
    tests: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("few") and not item.get_closest_marker("slow"):
            tests.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for cases in tests.values():
        marker, of = cases[0].get_closest_marker("few"), len(cases)
        (count,), slow = marker.args, marker.kwargs.get("slow", of)
        step = next(step for step in itertools.count(of // max(count, 1) + 1) if math.gcd(step, of) == 1)
        ranks = {k * step % of: k for k in range(of)}
        for place, item in enumerate(cases):
            if ranks[place] >= count:
                item.add_marker(pytest.mark.slow)
            if ranks[place] >= count + slow:
                item.add_marker(pytest.mark.whole)


def pytest_collection_finish():
    """Leave what was collected to itself: looking through it for garbage again and again takes a fifth of the time.

    What tests make is looked through for garbage more seldom than Python does it by itself.
    """
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)
