"""Fronts of random scenes: two axes of each drawn, every point certified or shown to have no admissible design.

Scene K is of the job that K names in turn, drawn as `attack.py` draws it (a linkage: a packaged one whose numbers are
drawn within a tenth), with its target's demands or without any; its axes are two that the scene offers. Then certified
rows are attacked: what each seeks is searched for from scratch, from many starts, and solved from the design of every
other row of the front. A row is beaten where that is certified too and better by more than 1e-6 of its scale.
Each front that ends otherwise is printed with how to make it again.

    python -m benchmarks.adversarial.fronts [--from A] [--to B] [--points N] [--rows R] [--jobs linkage,rapier]
                                            [--seconds T] [--json]

--rows: how many of a front, evenly spread, are attacked; --seconds: no front is begun later. Seconds of rows and fronts
are the processor's: other work on the machine counts little. Ends in exit status 1 where a row is beaten, uncertified
or failed.
"""

import argparse
import sys
import time
import zlib
from collections import Counter
from typing import Any, NamedTuple

from benchmarks import harness
from benchmarks.adversarial import attack
from benchmarks.adversarial.attack import BETTER, scene_of

LINKAGES = ("sixbar-sley", "shaper", "knuckle-press")
JOBS = (*attack.JOBS, "linkage")
SHARE_DRAWN = 0.1
"""Within which the numbers of a packaged linkage are drawn."""

OPEN = ("uncertified", "failed")
"""Statuses of rows that say nothing."""
SHARE = 0.5
"""Of fronts that hold what the target demands; the others hold the scene's limits alone."""
COUNTED = ("tried", "certified", "infeasible", "refused", "uncertified", "beaten", "rows attacked")


class Request(NamedTuple):
    """A front to be made: of which scene, which two axes, of which of them the most is sought, whose demands hold."""

    scene: Any
    axes: tuple[str, str]
    maximise: tuple[str, ...]
    target: str


def linkage(number: int) -> tuple[Any, str]:
    """Linkage whose numbers are drawn, the next draw where one does not close, and a target of it."""
    import numpy as np

    import loomopt as lo
    from loomopt.base.errors import BadInput

    rng = np.random.default_rng([zlib.crc32(b"linkages of fronts"), number])
    base = lo.load(LINKAGES[number // len(JOBS) % len(LINKAGES)])
    while True:
        changes = {}
        for name in base.bounds:
            if name in base.document["mechanism"]:
                size, unit = str(base.document["mechanism"][name]).split()
                share = rng.uniform(1.0 - SHARE_DRAWN, 1.0 + SHARE_DRAWN)
                changes[f"mechanism.{name}"] = f"{float(size) * share:.6g} {unit}"
        try:
            return base.update(changes), next(iter(base.schema.targets))
        except BadInput:
            continue


def drawn(number: int, jobs: tuple[str, ...] = JOBS) -> Request:
    """Front of scene `number`; always the same one."""
    import numpy as np

    import loomopt as lo
    from loomopt.base.errors import BadInput
    from loomopt.studies.front import front

    job = jobs[number % len(jobs)]
    if job == "linkage":
        scene, values = linkage(number)
    else:
        task = scene_of(job, 0, number)
        scene, values = lo.load(task.base).update(task.changes), task.target
    rng = np.random.default_rng([zlib.crc32(b"fronts"), number])
    target = values if rng.random() < SHARE else "none"
    offered = {name: axis.senses for name, axis in scene.schema.axes.items()}
    while True:
        first, other = map(str, rng.choice(sorted(offered), 2, replace=False))
        axes = first, other
        most = tuple(name for name in axes if rng.choice(offered[name]) == "most")
        try:
            front.trade(scene, axes, front.demanding(scene, target), maximise=most)
        except BadInput:
            # The scene has not what this axis needs.
            continue
        return Request(scene, axes, most, target)


def beaten(study: Any, rows: int) -> tuple[int, list[dict[str, Any]]]:
    """Return how many rows of a front were attacked, and those that are beaten, with by how much."""
    from loomopt.model.session import working
    from loomopt.studies.front import plan

    trade, result = study.study, list[dict[str, Any]]()
    axis = trade.solver.axes[0]
    known = [row for row in study.rows if row.certified and trade.axes[1] in row.place]
    chosen = known[:: max(1, len(known) // rows)][:rows]
    for row in chosen:
        request = trade.subproblem(row.place)
        others = [other.warm for other in study.rows if other.certified and other is not row]
        with working():
            ends = [trade.solver.solve(request, (), True), trade.solver.solve(request, others, None)]
        mine = axis.value(plan.value(row, trade.axes[0]))
        for by, end in zip(("search", "rows"), ends, strict=True):
            remaining = all(
                a <= b + plan.ALIKE for a, b in zip(end.warm.get("held", ()), row.warm["held"], strict=False)
            )
            apart = mine - axis.value(end.warm["axes"][trade.axes[0]]) if end.certified and remaining else 0.0
            if apart > BETTER * axis.objective.scale:
                share = apart / axis.objective.scale
                result.append({"point": row.point, "place": dict(row.place), "by": by, "apart": share})
    return len(chosen), result


def outcome(number: int, points: int, rows: int, jobs: tuple[str, ...]) -> tuple[str, dict[str, Any]]:
    """Return what became of a front: a word, and what tells it apart."""
    import loomopt as lo
    from loomopt.base.errors import BadInput

    request, began = drawn(number, jobs), time.perf_counter()
    call = {"number": number, "job": request.scene.job, "axes": request.axes, "maximise": request.maximise}
    call["target"] = request.target
    try:
        study = lo.pareto(request.scene, request.axes, request.target, maximise=request.maximise, points=points)
    except BadInput as error:
        return "refused", call | {"why": str(error), "seconds": time.perf_counter() - began}
    amiss = [row.reason for row in study.rows if row.status in OPEN]
    certified = sum(row.certified for row in study.rows)
    record = {"rows": len(study.rows), "certified": certified, "amiss": amiss}
    record |= {"slowest": max(row.seconds for row in study.rows), "seconds": time.perf_counter() - began}
    record["attacked"], record["beaten"] = beaten(study, rows)
    record["bettered"] = study.findings.bettered
    word = "beaten" if record["beaten"] else "uncertified" if amiss else "certified" if certified else "infeasible"
    return word, call | record


def parsed() -> argparse.Namespace:
    words = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    words.add_argument("--from", dest="first", type=int, default=0)
    words.add_argument("--to", type=int, default=189)
    words.add_argument("--points", type=int, default=8)
    words.add_argument("--rows", type=int, default=4)
    words.add_argument("--jobs", default=",".join(JOBS))
    words.add_argument("--seconds", type=float, default=float("inf"))
    words.add_argument("--json", action="store_true")
    return words.parse_args()


def main() -> None:
    harness.one_thread()
    harness.processor_time()
    request, began = parsed(), time.monotonic()
    counts, failures = Counter[str](), list[dict[str, Any]]()
    for number in range(request.first, request.to + 1):
        if time.monotonic() - began > request.seconds:
            break
        word, message = outcome(number, request.points, request.rows, tuple(request.jobs.split(",")))
        counts.update(["tried", word])
        counts["rows attacked"] += message.get("attacked", 0)
        if word in ("uncertified", "beaten"):
            failures.append(message)
        print(word, message, file=sys.stderr, flush=True)
    row = {name: counts[name] for name in COUNTED}
    harness.show([row], request.json, **({"failures": failures} if request.json else {}))
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
