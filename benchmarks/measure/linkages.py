"""What a linkage costs, in CPU seconds and as shares of the beat-up's search: search, one start, proof, infeasible.

The six-bar sley without its rest is solved, started once, proven, and asked for what it cannot have; the beat-up is
solved before and after, in the same process, so that shares hold on any machine. The median of the repeats is told.

    python -m benchmarks.measure.linkages [--repeats 3] [--json]
"""

import argparse
import json
import statistics
import time
from collections.abc import Callable
from typing import Any

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model.session import Session, working

REST = {"windows": "rest", "mechanism": "end", "bounds": "end", "limits": "travel", "targets": "dwell"}
"""What of the packaged six-bar is its rest, by table."""
BEYOND = {"limits.mu.beat.min": "85 deg", "limits.mu.drive.min": "85 deg"}
"""Transmission angles that no six-bar within the bounds has."""


def six_bar() -> lo.Scene:
    """Six-bar sley without its rest."""
    document: dict[str, Any] = dict(lo.load("sixbar-sley").document)
    for table, key in REST.items():
        document[table] = {name: item for name, item in document[table].items() if name != key}
    return registry.scene(document)


def spent(action: Callable[[], object], repeats: int) -> float:
    """Median of the CPU seconds that an action takes, each time in a session of its own."""
    results = []
    for _ in range(repeats):
        with working(Session()):
            began = time.process_time()
            action()
            results.append(time.process_time() - began)
    return statistics.median(results)


def measured(repeats: int) -> dict[str, float]:
    """CPU seconds by what was done."""
    scene, beatup = six_bar(), lo.load("beatup")
    beyond = scene.update(BEYOND)
    started = lo.solve(scene, starts=1)
    actions: dict[str, Callable[[], object]] = {
        "beat-up search": lambda: lo.solve(beatup),
        "six-bar search": lambda: lo.solve(scene),
        "six-bar, one start": lambda: lo.solve(scene, starts=1),
        "six-bar proof": lambda: lo.prove(scene, started),
        "six-bar infeasible": lambda: lo.solve(beyond),
    }
    return {name: spent(action, repeats) for name, action in actions.items()}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    result = measured(options.repeats)
    if options.json:
        print(json.dumps(result))
        return
    base = result["beat-up search"]
    for name, seconds in result.items():
        print(f"{name:20s} {seconds:8.3f} s {seconds / base:8.2f} beat-up searches")


if __name__ == "__main__":
    main()
