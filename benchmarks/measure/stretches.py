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

ALIKE = 1e-9
"""Share of an axis by which two rows may be asked apart and be one."""
LEAST = 1e-9
"""SI; what is smaller throughout a study is rounding of 0."""


class Case(NamedTuple):
    """A study, planned anew each time; asked: certified rows a CPU second of the design; quick: whether it is short."""

    name: str
    asked: float
    study: Callable[[], SceneStudy]
    quick: bool = False


def front(problem: str, axes: tuple[str, str], most: str = "", target: str | None = None, points: int = 40) -> Trade:
    """Return a front of two axes of a packaged machine; most: the axis of which the most is sought."""
    first: Sense
    second: Sense
    first, second = ("most" if axis == most else "least" for axis in axes)
    return Trade(lo.load(problem), axes, (first, second), target, (), points)


def resistances(count: int) -> sweep.Sweep:
    """Return a sweep of the beat-up's resistance, 600 to 900 N·m."""
    values = [f"{600 + 300 * k / (count - 1)!r} N*m" for k in range(count)]
    return sweep.plan_sweep(lo.load("beatup"), {"operation.M0": values})


def cases() -> tuple[Case, ...]:
    """Return all studies."""
    mass = "peak_torque", "m4e"
    return (
        Case("sweep of 65 M0", 0.0, partial(resistances, 65), quick=True),
        Case("front of 40, beat-up", 45.0, partial(front, "beatup", mass, target="balance"), quick=True),
        Case("front of 200, beat-up", 140.0, partial(front, "beatup", mass, target="balance", points=200)),
        Case("front of 40, shedding", 60.0, partial(front, "shedding", ("K1", "X0"))),
        Case("front of 40, rapier", 8.0, partial(front, "rapier", ("peak_acceleration", "dwell"), "dwell")),
        Case("sweep of 1000 M0", 200.0, partial(resistances, 1000)),
    )


def timed(planned: Callable[[], SceneStudy], together: bool) -> tuple[tuple[Row, ...], float]:
    """Return a study's rows, solved together or each alone and searched as often as before, and the CPU seconds."""
    began = time.process_time()
    if together:
        return run.run(planned()), time.process_time() - began
    alone = mock.patch.object(neighbour_newton, "solve_between", lambda tasks: [None] * len(tasks))
    with alone, mock.patch.object(sweep, "MOST_COARSE", 10**6):
        # What a study has planned it keeps: with other points from scratch it is another one.
        return run.run(planned()), time.process_time() - began


def paired(one: Sequence[Row], other: Sequence[Row]) -> list[tuple[Row, Row]]:
    """Return the certified rows of both that were asked at the same place."""
    known = [row for row in other if row.certified and row.place]
    wide = max((abs(value) for row in known for value in row.place.values()), default=1.0)
    found = []
    for row in one:
        near = min(known, key=lambda each: distance(row.place, each.place)) if row.certified and row.place else None
        if near and distance(row.place, near.place) <= ALIKE * wide:
            found.append((row, near))
    return found


def distance(one: Mapping[str, float], other: Mapping[str, float]) -> float:
    """Return how far apart two places are."""
    return max(abs(one[name] - other[name]) for name in one)


def apart(pairs: Sequence[tuple[Row, Row]], part: str) -> float:
    """Return the largest difference of one part of rows, in the largest size of each number of it."""
    sizes: dict[object, float] = {}
    for _, row in pairs:
        for name, value in getattr(row, part).items():
            sizes[name] = max(sizes.get(name, LEAST), abs(value or 0.0))
    found = [
        abs((value or 0.0) - (getattr(row, part).get(name, 0.0) or 0.0)) / sizes.get(name, LEAST)
        for own, row in pairs
        for name, value in getattr(own, part).items()
    ]
    return max(found, default=0.0)


def main(arguments: Sequence[str] | None = None) -> None:
    """Tell all studies."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="the short ones alone")
    quick = parser.parse_args(arguments).quick
    print("study                     rows  alone  together  asked   ratio  design  figures  prices")
    for case in cases():
        if quick and not case.quick:
            continue
        alone, before = timed(case.study, together=False)
        rows, after = timed(case.study, together=True)
        rates = len(alone) / before, len(rows) / after
        pairs = paired(rows, alone)
        parts = "  ".join(f"{apart(pairs, part):7.0e}" for part in ("design", "figures", "multipliers"))
        print(
            f"{case.name:24} {len(rows):5} {rates[0]:6.1f} {rates[1]:9.1f} {case.asked:6.0f} {rates[1] / rates[0]:7.2f}"
            f"  {parts}",
            flush=True,
        )


if __name__ == "__main__":
    main()
