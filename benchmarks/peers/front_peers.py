"""Whole fronts beside NSGA-II [pymoo], which gets ten times the time; both judged by plain evaluators of their own.

`python benchmarks/peers/front_peers.py [--points N] [--only PROBLEM] [--quick] [--json]`: as many points are asked of
the front as NSGA-II has designs. Without --only also what two workers reach beside two plain loops, and memory.
"""

import argparse
import functools
import pickle
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor

import numpy as np

import loomopt as lo
from benchmarks import harness
from benchmarks.measure.fronts import row_at
from benchmarks.peers.front_rivals import Rival, Spot, beatup, rapier, shedding
from loomopt.studies.front import front, plan, trade
from loomopt.studies.front.trade import read_front
from loomopt.studies.run import run
from loomopt.studies.run.rows import Findings, Row, StudyTask

LONGER = 10.0
"""Times the front's own that the peer gets."""
POINTS, SEED = 100, 1
BEYOND = 0.1
"""Share of all designs' range by which the corner of the hypervolume lies beyond them."""


def evolved(rival: Rival, designs: int, seconds: float) -> tuple[np.ndarray, int]:
    """Return so many designs that NSGA-II ends with after so much of the processor's time; how many it looked at."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import Problem

    class Traded(Problem):
        def __init__(self):
            rows = rival.evaluate(rival.high[None])[1].shape[1]
            super().__init__(n_var=len(rival.low), n_obj=2, n_ieq_constr=rows, xl=rival.low, xu=rival.high)

        def _evaluate(self, x, out, *_, **__):
            with np.errstate(all="ignore"):
                objectives, rows = rival.evaluate(x)
            out["F"] = np.nan_to_num(objectives, nan=1e12)
            out["G"] = np.nan_to_num(rows, nan=1e12)

    problem, algorithm = Traded(), NSGA2(pop_size=designs)
    algorithm.setup(problem, termination=("n_gen", sys.maxsize), seed=SEED, verbose=False)
    began = time.process_time()
    while time.process_time() - began < seconds:
        algorithm.next()
    return np.atleast_2d(algorithm.opt.get("X")), int(algorithm.evaluator.n_eval)


def area(spots: Sequence[Spot], corner: Spot) -> float:
    """Hypervolume of two least-is-best axes below a corner."""
    total, height = 0.0, corner[0]
    for first, second in sorted(spots, key=lambda spot: spot[1]):
        if first < height and second < corner[1]:
            total += (height - first) * (corner[1] - second)
            height = first
    return total


def compared(rival: Rival, points: int) -> list[dict[str, object]]:
    """Row for loomopt's front, one for the peer's, and one for the front asked at the peer's places too."""
    began = time.process_time()
    trade = front.trade(lo.load(rival.problem), rival.axes, rival.target, points=points)
    second_front = read_front(trade, run.run(trade))
    spent, name = time.process_time() - began, " against ".join(rival.axes)
    certified = [row for row in second_front.rows if row.certified]
    mine = _spots(rival, [rival.variables(row) for row in certified])
    if not harness.installed("pymoo"):
        absent = f"{name}: pymoo is not installed (extra `bench`)"
        return [_row(f"{name}: loomopt", spent, len(certified), mine, mine), _row(absent, 0.0, 0, [], mine)]
    designs, looked = evolved(rival, points, LONGER * spent)
    theirs = _spots(rival, list(designs))
    began = time.process_time()
    requests = [row for _, second in theirs if (row := _row_at(trade, second_front, rival.sign * second))]
    fuller = [*mine, *_spots(rival, [rival.variables(row) for row in requests])]
    longer = spent + time.process_time() - began
    whole = [*fuller, *theirs]
    return [
        _row(f"{name}: loomopt", spent, len(certified), mine, whole),
        _row(f"{name}: loomopt, asked at the peer's places too", longer, len(certified) + len(requests), fuller, whole),
        _row(f"{name}: NSGA-II", LONGER * spent, looked, theirs, whole),
    ]


def _spots(rival: Rival, designs: Sequence[np.ndarray]) -> list[Spot]:
    return [spot for design in designs if (spot := rival.judge(design))]


def _row_at(trade: trade.Trade, result: Findings, second: float) -> Row | None:
    """Front's design at a place; None beside the front."""
    paid = plan.values(result.rows, trade.axes[1])
    row = row_at(trade, result, second) if min(paid) < second < max(paid) else None
    return row if row and row.certified else None


def _row(method: str, seconds: float, looked: int, spots: Sequence[Spot], whole: Sequence[Spot]) -> dict[str, object]:
    """Return what a method ended with; missed: what of the hypervolume of all designs of all methods it has not."""
    values = np.array(whole)
    # Beyond the worst of either axis, so that a front's own ends count too.
    first, second = values.max(axis=0) + BEYOND * np.ptp(values, axis=0)
    corner = float(first), float(second)
    missed = 1 - area(spots, corner) / area(whole, corner) if spots else None
    return {"method": method, "CPU [s]": seconds, "designs": looked, "admissible": len(spots), "missed": missed}


# Workers and memory.


def plain_loop(points: int) -> int:
    """Solve a whole front, one point after the other; returns how many rows there are."""
    trade = front.trade(lo.load("beatup"), ("peak_torque", "M3_fdc"), points=points)
    return len(run.run(trade))


@functools.lru_cache(maxsize=2)
def _trade(payload: bytes) -> trade.Trade:
    data: trade.Trade = pickle.loads(payload)
    return data


def half(payload: bytes, work: Sequence[tuple[StudyTask, Row | None]]) -> None:
    """Solve tasks of a front one after the other, each parent's row at hand: no rounds, nothing handed over."""
    for task, parent in work:
        _trade(payload).solved(task, parent)


def shared(axes: tuple[str, str], target: str | None, repeats: int, fresh: bool) -> float:
    """Return how fast two workers are beside two plain loops over half of the same points each, the median of turns.

    In turn, so that the machine's other work hits both alike. fresh: each turn starts processes of its own, which both
    pay for; else the same two do all, warm.
    """
    trade = front.trade(lo.load("beatup"), axes, target)
    work, payload = list(run.tasks(trade, run.run(trade))), pickle.dumps(trade)

    def halves(pool: Executor) -> None:
        for item in [pool.submit(half, payload, work[first::2]) for first in (0, 1)]:
            item.result()

    def timed(pool: Executor | None, solve: Callable[[Executor], object]) -> float:
        began = time.perf_counter()
        values = pool or run.workers(2)()
        solve(values)
        if not pool:
            values.shutdown()
        return time.perf_counter() - began

    pool = None if fresh else run.workers(2)()
    if pool:
        halves(pool)
        run.run(trade, pool)
    turns = [(timed(pool, halves), timed(pool, lambda values: run.run(trade, values))) for _ in range(repeats)]
    if pool:
        pool.shutdown()
    return statistics.median(plain / ours for plain, ours in turns)


MEMORY = """
import resource, sys
from benchmarks.peers.front_peers import plain_loop
plain_loop(3)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
rows = plain_loop(int(sys.argv[1]))
print(rows, before, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def memory(points: int) -> tuple[int, float, float]:
    """Of a front so many points long: rows, and the process' largest size before and after it, MB."""
    done = subprocess.run([sys.executable, "-c", MEMORY, str(points)], capture_output=True, text=True, check=True)
    rows, *sizes = map(int, done.stdout.split())
    unit = 1024.0**2 if sys.platform == "darwin" else 1024.0
    return rows, sizes[0] / unit, sizes[1] / unit


RIVALS = (beatup, shedding, rapier)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--points", type=int, default=POINTS)
    parser.add_argument("--only", choices=[rival.__name__ for rival in RIVALS])
    parser.add_argument("--quick", action="store_true", help="shedding alone, no workers, no memory")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if options.quick:
        harness.show(compared(shedding(), 6), options.json)
        return
    wanted = [rival() for rival in RIVALS if options.only in (None, rival.__name__)]
    rows = [row for rival in wanted for row in compared(rival, options.points)]
    if options.only:
        harness.show(rows, options.json)
        return
    sizes = [dict(zip(("rows", "MB before", "MB after"), memory(points), strict=True)) for points in (10, 40, 160)]
    fronts = {"M3": (("peak_torque", "M3_fdc"), None), "m4e": (("peak_torque", "m4e"), "balance")}
    ratios = [
        {"front": name, "processes": "own" if fresh else "warm", "of two plain loops": shared(*asking, 5, fresh)}
        for name, asking in fronts.items()
        for fresh in (True, False)
    ]
    harness.show(rows, options.json, memory=sizes, two_workers=ratios)


if __name__ == "__main__":
    main()
