"""Fronts of random scenes: two axes of each drawn, every point certified or shown to have no admissible design.

Scene K is of the job that K names in turn, drawn as `attack.py` draws it, with its target's demands or without any;
its axes are two that the scene offers. Each front that ends otherwise is printed with how to make it again.

    python -m benchmarks.adversarial.fronts [--from A] [--to B] [--points N] [--seconds T] [--json]

--seconds: no front is begun later. Seconds of rows and fronts are the processor's: other work on the machine counts
little. Ends in exit status 1 where a row is uncertified or failed.
"""

import argparse
import sys
import time
import zlib
from collections import Counter
from typing import Any, NamedTuple

from benchmarks import harness
from benchmarks.adversarial.attack import JOBS, scene_of

OPEN = ("uncertified", "failed")
"""Statuses of rows that say nothing."""
SHARE = 0.5
"""Of fronts that hold what the target demands; the others hold the scene's limits alone."""
COUNTED = ("tried", "certified", "infeasible", "refused", "uncertified")


class Asked(NamedTuple):
    """A front to be made: of which scene, which two axes, of which of them the most is sought, whose demands hold."""

    scene: Any
    axes: tuple[str, str]
    maximise: tuple[str, ...]
    target: str


def drawn(number: int) -> Asked:
    """Return the front of scene `number`; always the same one."""
    import numpy as np

    import loomopt as lo
    from loomopt.base.errors import BadInput
    from loomopt.studies.front import front

    task = scene_of(JOBS[number % len(JOBS)], 0, number)
    scene = lo.load(task.base).update(task.changes)
    rng = np.random.default_rng([zlib.crc32(b"fronts"), number])
    target = task.target if rng.random() < SHARE else "none"
    offered = {name: axis.senses for name, axis in scene.schema.axes.items()}
    while True:
        one, other = map(str, rng.choice(sorted(offered), 2, replace=False))
        axes = one, other
        most = tuple(name for name in axes if rng.choice(offered[name]) == "most")
        try:
            front.trade(scene, axes, front.demanding(scene, target), maximise=most)
        except BadInput:
            # The scene has not what this axis needs.
            continue
        return Asked(scene, axes, most, target)


def told(number: int, points: int) -> tuple[str, dict[str, Any]]:
    """Return what became of a front: a word, and what tells it apart."""
    import loomopt as lo
    from loomopt.base.errors import BadInput

    asked, began = drawn(number), time.perf_counter()
    call = {"number": number, "job": asked.scene.job, "axes": asked.axes, "maximise": asked.maximise}
    call["target"] = asked.target
    try:
        study = lo.pareto(asked.scene, asked.axes, asked.target, maximise=asked.maximise, points=points)
    except BadInput as error:
        return "refused", call | {"why": str(error), "seconds": time.perf_counter() - began}
    amiss = [row.reason for row in study.rows if row.status in OPEN]
    certified = sum(row.certified for row in study.rows)
    said = {"rows": len(study.rows), "certified": certified, "amiss": amiss}
    said |= {"slowest": max(row.seconds for row in study.rows), "seconds": time.perf_counter() - began}
    return "uncertified" if amiss else "certified" if certified else "infeasible", call | said


def parsed() -> argparse.Namespace:
    words = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    words.add_argument("--from", dest="first", type=int, default=0)
    words.add_argument("--to", type=int, default=189)
    words.add_argument("--points", type=int, default=8)
    words.add_argument("--seconds", type=float, default=float("inf"))
    words.add_argument("--json", action="store_true")
    return words.parse_args()


def main() -> None:
    harness.one_thread()
    harness.processor_time()
    asked, began = parsed(), time.monotonic()
    counts, failures = Counter[str](), list[dict[str, Any]]()
    for number in range(asked.first, asked.to + 1):
        if time.monotonic() - began > asked.seconds:
            break
        word, said = told(number, asked.points)
        counts.update(["tried", word])
        if word == "uncertified":
            failures.append(said)
        print(word, said, file=sys.stderr, flush=True)
    row = {name: counts[name] for name in COUNTED}
    harness.show([row], asked.json, **({"failures": failures} if asked.json else {}))
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
