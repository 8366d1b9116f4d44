"""How many certified answers a second: warm ones from a neighbour's, one after the other, and where their time goes.

    python benchmarks/measure/answers.py [--count 60] [--memory 1000] [--json]

The clock counts the processor's time: of the median answer, the fastest and the slowest. The steps are those that every
answer tells in its `time`, as shares of it. An answer counts where it is optimal and certified. Memory: what the
process holds after the first tenth of so many beat-up answers and after the last, in MB.
"""

import argparse
import itertools
import resource
import statistics
import time
from collections.abc import Iterator
from typing import Any

from benchmarks import harness

CASES = {
    "beatup balance": ("beatup", "balance", "operation.M0", "{} N*m", 700.0, 2.0),
    "rapier stroke-dwell": ("rapier", "stroke-dwell", "operation.stroke", "{} mm", 849.0, -0.25),
    "shedding stiffness": ("shedding", "stiffness", "operation.N_min", "{} N", 100.0, 2.0),
}
"""Name → scene, target, and the number that changes from answer to answer: its key, unit, first value and step."""
SHARE = {"beatup balance": 1, "rapier stroke-dwell": 5, "shedding stiffness": 2}
"""How many times fewer answers of the slower ones there are."""
STEPS = ("build", "solve", "settle", "certify", "report")


def scenes(name: str) -> Iterator[Any]:
    """Yield the scenes of a case, to and fro so that their number has no end."""
    import loomopt as lo

    problem, _, key, unit, first, step = CASES[name]
    there = [first + step * k for k in range(20)]
    scene = lo.load(problem)
    changed = [scene.set(key, unit.format(value)) for value in there]
    yield from itertools.cycle([*changed, *changed[-2:0:-1]])


def answers(name: str, count: int) -> dict[str, Any]:
    """Return what `count` warm answers took, after one cold."""
    import loomopt as lo

    target, ahead = CASES[name][1], scenes(name)
    answer = lo.solve(next(ahead), target)
    taken, spent, certified, by = [], dict.fromkeys(STEPS, 0.0), 0, set()
    for scene in itertools.islice(ahead, count):
        began = time.process_time()
        answer = lo.solve(scene, target, warm_start=answer)
        taken.append(time.process_time() - began)
        certified += answer.status == "optimal" and answer.certificate.passed
        by.add(answer.certificate.by if answer.certificate else "")
        for step in STEPS:
            spent[step] += answer.time[f"{step}_s"]
    whole = sum(spent.values())
    items = {f"{step} %": 100 * value / whole for step, value in spent.items()}
    row = {"answers": name, "a second": 1 / statistics.median(taken), "ms": harness.spread([1e3 * s for s in taken])}
    return {**row, **items, "certified": f"{certified} of {count}", "by": ", ".join(sorted(by))}


def memory(count: int) -> dict[str, float]:
    """Largest memory, MB, after a tenth of `count` beat-up answers, and after all."""
    import loomopt as lo

    result, ahead = {}, scenes("beatup balance")
    answer = lo.solve(next(ahead))
    for k, scene in enumerate(itertools.islice(ahead, count), 1):
        answer = lo.solve(scene, warm_start=answer)
        if k in (max(1, count // 10), count):
            result[f"MB after {k}"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return result


def main() -> None:
    """Print the answers a second of each job with their budget, and what many answers leave in memory."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--memory", type=int, default=1000)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    rows = [answers(name, max(1, options.count // share)) for name, share in SHARE.items()]
    harness.show(rows, options.json, **(memory(options.memory) if options.memory else {}))


if __name__ == "__main__":
    harness.one_thread()
    main()
