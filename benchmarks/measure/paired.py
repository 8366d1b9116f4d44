"""This checkout against another in one run: what solving, certifying, evaluating, simulating and reading cost in each.

Two worker processes do the same piece of work in turn, over and over, so that noise hits both alike; the clock counts
the processor's time, so that other work on the machine counts little. "Built" is a solve with no NLP built before;
"cold" one from the job's own starts; "warm" one from a neighbour's answer; "certificate" is part of the cold one.

    git worktree add ../before TAG
    python benchmarks/measure/paired.py ../before [--repeats N] [--only CASE] [--work evaluate,warm] [--most 1.05]
        [--json]

Quartiles are of the ratios of each round. With `--most` the exit code says whether a piece of work took longer than
that by all that is told: medians, least times, and three quarters of the rounds.
"""

import functools
import gc
import inspect
import math
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from benchmarks import harness
from benchmarks.measure import checkouts
from benchmarks.measure.same_answers import FRAME, REED, TAPE

CASES = {
    "beatup": ("beatup", "balance", "operation.M0", "755 N*m"),
    "beatup pulse": ("beatup", "pulse", "operation.M0", "755 N*m"),
    "rapier": ("rapier", "stroke-dwell", "operation.stroke", "845 mm"),
    "rapier smooth": ("rapier", "smooth", "operation.stroke", "845 mm"),
    "shedding": ("shedding", "stiffness", "operation.speed", "590 rpm"),
    "shedding law": ("shedding", "law", "operation.speed", "590 rpm"),
    "beatup, all": ("beatup", "balance", "operation.M0", "755 N*m", *REED),
    "rapier, all": ("rapier", "stroke-dwell", "operation.stroke", "845 mm", *TAPE),
    "shedding, all": ("shedding", "stiffness", "operation.speed", "590 rpm", *FRAME),
}
"""Name → scene, target, the one number by which the neighbour differs whose answer a warm solve starts from, and
effects that are put on: all algebraic ones that stand together."""
WORK = ("built", "cold", "warm", "evaluate", "simulate", "read")
OFTEN = {"read": 10, "evaluate": 20, "simulate": 5}
"""How often a short piece of work is done for one time."""
REPEATS = 9
RATIOS = "ratio of medians", "ratio of least", "lower quartile"
"""What must all be above a number for a piece of work to count as slower than that."""


@functools.cache
def case(name: str) -> tuple[Any, str, Any]:
    """Case's scene, its target, and its neighbour's answer."""
    import loomopt as lo

    job, target, key, value, *effects = CASES[name]
    scene = lo.load(job)
    for effect in effects:
        scene = scene.with_effect(effect)
    return scene, target, lo.solve(scene.set(key, value), target)


def work(name: str, subject: str) -> Callable[[], Any]:
    """One piece of work."""
    import loomopt as lo

    scene, target, neighbour = case(name)

    warm_start = "warm_start" if "warm_start" in inspect.signature(lo.solve).parameters else "near"  # older checkouts

    def built() -> Any:
        from loomopt.model import session
        from loomopt.solving.nlp import transcribe

        session.current().forget(transcribe.NLPS)
        return lo.solve(scene, target)

    calls: dict[str, Callable[[], Any]] = {
        "built": built,
        "cold": lambda: lo.solve(scene, target),
        "warm": lambda: lo.solve(scene, target, **{warm_start: neighbour}),
        "evaluate": lambda: lo.evaluate(scene, neighbour.design),
        "simulate": lambda: lo.simulate(scene, neighbour.design),
        "read": lambda: lo.load(CASES[name][0]),
    }
    return calls[subject]


def timed(question: tuple[str, str]) -> dict[str, float]:
    """Milliseconds of processor time that a piece of work takes; of a solve, the certificate's too."""
    name, subject = question
    call, often = work(name, subject), OFTEN.get(subject, 1)
    gc.collect()
    began = time.process_time()
    for _ in range(often):
        result = call()
    seconds = (time.process_time() - began) / often
    part = {"certificate": 1e3 * result.time["certify_s"]} if subject == "cold" else {}
    return {subject: 1e3 * seconds, **part}


def times(pair: tuple[checkouts.Worker, ...], question: tuple[str, str], repeats: int) -> list[list[dict[str, float]]]:
    """Return what a piece of work took in each worker, the first time left out."""
    results: list[list[dict[str, float]]] = [[] for _ in pair]
    for repeat in range(repeats + 1):
        places = range(len(pair)) if repeat % 2 else reversed(range(len(pair)))
        for place in places:
            taken = pair[place].ask(question)
            if repeat:
                results[place].append(taken)
    return results


def rows(name: str, here: list[dict[str, float]], there: list[dict[str, float]]) -> Iterator[dict[str, Any]]:
    """Yield the table's lines of one piece of work."""
    for part in here[0]:
        first, other = [taken[part] for taken in here], [taken[part] for taken in there]
        low, high = np.quantile([a / b for a, b in zip(first, other, strict=True)], (0.25, 0.75)).tolist()
        yield {
            "case": name,
            "work": part,
            "here [ms]": statistics.median(first),
            "there [ms]": statistics.median(other),
            "ratio of medians": statistics.median(first) / statistics.median(other),
            "ratio of least": min(first) / min(other),
            "lower quartile": low,
            "upper quartile": high,
        }


def main() -> None:
    """Print the table of one run."""
    parser = checkouts.arguments(__doc__ or "")
    parser.add_argument("--repeats", type=int, default=REPEATS)
    parser.add_argument("--only", default="", help="cases whose name starts so")
    parser.add_argument("--work", default=",".join(WORK), help="pieces of work, with commas between")
    parser.add_argument("--most", type=float, default=math.inf, help="largest ratio that passes")
    options = parser.parse_args()
    wanted = [subject for subject in WORK if subject in options.work.split(",")]
    questions = [(name, subject) for name in CASES if name.startswith(options.only) for subject in wanted]
    with checkouts.workers(__file__, options.other) as pair:
        results = [
            line for question in questions for line in rows(question[0], *times(pair, question, options.repeats))
        ]
    worst = max(min(item[ratio] for ratio in RATIOS) for item in results)
    harness.show(results, options.json, worst=worst)
    sys.exit(worst > options.most)


if __name__ == "__main__":
    if checkouts.WORKER in sys.argv:
        # loomopt's own times are those of the processor too.
        time.perf_counter = time.process_time
        checkouts.serve(timed)
    else:
        main()
