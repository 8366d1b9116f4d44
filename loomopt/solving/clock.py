"""Seconds of a solve, part by part, as its answer tells them."""

import contextlib
import time
from collections import defaultdict
from collections.abc import Iterator

from loomopt.solving.search.search import Search


class Clock:
    """Runs from its making; what the search counts itself is added when all is told."""

    def __init__(self) -> None:
        self.began = time.perf_counter()
        self._parts: defaultdict[str, float] = defaultdict(float)

    @contextlib.contextmanager
    def charged(self, part: str) -> Iterator[None]:
        """Charge a part with what is done meanwhile."""
        began = time.perf_counter()
        yield
        self._parts[part] += time.perf_counter() - began

    def seconds(self, search: Search) -> dict[str, float]:
        """Return the seconds of each part and of all; making NLPs counts as building, not as solving."""
        parts = self._parts
        return {
            "import_s": parts["import"],
            "build_s": parts["build"] + search.built,
            "solve_s": parts["solve"] + search.solved - search.built,
            "settle_s": search.tie_broken,
            "certify_s": search.certified,
            "report_s": parts["report"],
            "total_s": time.perf_counter() - self.began,
        }
