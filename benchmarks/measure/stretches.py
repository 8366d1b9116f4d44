"""Rows a CPU second of fronts and sweeps, each solved alone and, where it lies between two neighbours, with others.

Both in one run, one after the other, and how far apart their rows are: of each part of a row the largest difference, in
its own largest size. Points that narrow a change down follow digits, and are compared where both runs have them.

    python benchmarks/measure/stretches.py [--quick]
"""

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple
from unittest import mock

import loomopt as lo
from loomopt.physics.schema import Sense
from loomopt.solving.search import neighbour_newton
from loomopt.studies import sweep
from loomopt.studies.front.trade import Trade
from loomopt.studies.run import run
from loomopt.studies.run.rows import Row, SceneStudy

SAME_PLACE = 1e-9
"""Distance of two places, as a share of the axis, within which they are the same."""
LEAST = 1e-9
"""SI; a number below this in all rows is a rounding of 0."""


class Case(NamedTuple):
    """A study, made anew for every run; goal: certified rows a CPU second; quick: whether it is short."""

    name: str
    goal: float
    study: Callable[[], SceneStudy]
    quick: bool = False


def front(problem: str, axes: tuple[str, str], most: str = "", target: str | None = None, points: int = 40) -> Trade:
    """Front of two axes of a packaged machine; most: the axis that is maximised."""
    first: Sense
    second: Sense
    first, second = ("most" if axis == most else "least" for axis in axes)
    return Trade(lo.load(problem), axes, (first, second), target, (), points)


def resistances(count: int) -> sweep.Sweep:
    """Sweep of the beat-up's resistance, 600 to 900 N·m."""
    values = [f"{600 + 300 * k / (count - 1)!r} N*m" for k in range(count)]
    return sweep.plan_sweep(lo.load("beatup"), {"operation.M0": values})


def cases() -> tuple[Case, ...]:
    """All studies."""
    mass = "peak_torque", "m4e"
    return (
        Case("sweep of 65 M0", 0.0, partial(resistances, 65), quick=True),
        Case("front of 40, beat-up", 45.0, partial(front, "beatup", mass, target="balance"), quick=True),
        Case("front of 200, beat-up", 140.0, partial(front, "beatup", mass, target="balance", points=200)),
        Case("front of 40, shedding", 60.0, partial(front, "shedding", ("K1", "X0"))),
        Case("front of 40, rapier", 8.0, partial(front, "rapier", ("peak_acceleration", "dwell"), "dwell")),
        Case("sweep of 1000 M0", 200.0, partial(resistances, 1000)),
    )


def run_timed(make_study: Callable[[], SceneStudy], together: bool) -> tuple[tuple[Row, ...], float]:
    """Rows of a study, and CPU seconds; together: whether rows are solved in batches, or one by one as in a search."""
    start = time.process_time()
    if together:
        return run.run(make_study()), time.process_time() - start
    alone = mock.patch.object(neighbour_newton, "solve_neighbours", lambda tasks: [None] * len(tasks))
    with alone, mock.patch.object(sweep, "MOST_COARSE", 10**6):
        # A study caches its plan, so that other points from scratch need a new study.
        return run.run(make_study()), time.process_time() - start


def pair_rows(first: Sequence[Row], second: Sequence[Row]) -> list[tuple[Row, Row]]:
    """Pairs of certified rows of both studies at the same place."""
    known = [row for row in second if row.certified and row.place]
    wide = max((abs(value) for row in known for value in row.place.values()), default=1.0)
    pairs = []
    for row in first:
        if not (row.certified and row.place):
            continue
        near = min(known, key=lambda candidate: distance(row.place, candidate.place))
        if distance(row.place, near.place) <= SAME_PLACE * wide:
            pairs.append((row, near))
    return pairs


def distance(first: Mapping[str, float], second: Mapping[str, float]) -> float:
    """Largest difference of two places."""
    return max(abs(first[name] - second[name]) for name in first)


def largest_difference(pairs: Sequence[tuple[Row, Row]], part: str) -> float:
    """Largest difference of one part of rows, relative to the largest size of every number."""
    sizes: dict[object, float] = {}
    for _, row in pairs:
        for name, value in getattr(row, part).items():
            sizes[name] = max(sizes.get(name, LEAST), abs(value or 0.0))
    differences = [
        abs((value or 0.0) - (getattr(row, part).get(name, 0.0) or 0.0)) / sizes.get(name, LEAST)
        for first, row in pairs
        for name, value in getattr(first, part).items()
    ]
    return max(differences, default=0.0)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the rates of all studies."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="the short ones alone")
    quick = parser.parse_args(arguments).quick
    print("study                     rows  alone  together   goal   ratio  design  figures  prices")
    for case in cases():
        if quick and not case.quick:
            continue
        alone, before = run_timed(case.study, together=False)
        rows, after = run_timed(case.study, together=True)
        rates = len(alone) / before, len(rows) / after
        pairs = pair_rows(rows, alone)
        parts = "  ".join(f"{largest_difference(pairs, part):7.0e}" for part in ("design", "figures", "multipliers"))
        print(
            f"{case.name:24} {len(rows):5} {rates[0]:6.1f} {rates[1]:9.1f} {case.goal:6.0f} {rates[1] / rates[0]:7.2f}"
            f"  {parts}",
            flush=True,
        )


if __name__ == "__main__":
    main()
