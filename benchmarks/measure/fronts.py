"""Whole fronts of the packaged machines beside known points; certified points per CPU second; is any dominated?

`python benchmarks/measure/fronts.py` (CPU minutes); `--cold` also searches every third point from scratch, to see
whether a front stays in a worse basin.
"""

import argparse
import itertools
import math
import time
from collections.abc import Mapping
from typing import NamedTuple

import loomopt as lo
from loomopt.physics.tolerances import SAME_OBJECTIVE
from loomopt.studies.front import front, plan, trade
from loomopt.studies.front.solver import Subproblem
from loomopt.studies.front.trade import POINTS, read_front
from loomopt.studies.run import run
from loomopt.studies.run.rows import Findings, Row, StudyTask

RPM, DEGREE, MM = math.pi / 30, math.pi / 180, 1e-3
LARGEST_AREA, CORNER = 34.892414, (7.0, 97.0)
"""Area below (7 kg, 97 N·m) and above the continuous front of the beat-up."""


class Case(NamedTuple):
    """A front; known: second axis → first, SI; least: certified points per CPU second that are asked for."""

    problem: str
    axes: tuple[str, str]
    target: str | None
    most: tuple[str, ...]
    known: Mapping[float, float]
    least: float
    ranges: Mapping[str, tuple[float, float]] = {}


CASES = (
    Case(
        "beatup",
        ("peak_torque", "m4e"),
        "balance",
        (),
        {0.0: 96.540355060, 1.0: 95.103966045, 3.0: 92.460846773, 5.0: 90.088516886, 6.286039692: 88.689413492},
        50.0,
    ),
    Case(
        "beatup",
        ("peak_torque", "M3_fdc"),
        None,
        (),
        {
            0.0: 88.689413492,
            20.0: 86.308489640,
            40.0: 83.927565788,
            45.3960098: 83.28519136,
            68.018897919: 82.337138533,
        },
        50.0,
    ),
    Case(
        "rapier",
        ("peak_acceleration", "dwell"),
        "stroke-dwell",
        ("dwell",),
        {
            25 * DEGREE: 0.672656909,
            30 * DEGREE: 0.694984754,
            35 * DEGREE: 0.714035795,
            45 * DEGREE: 0.751506644,
        },
        4.0,
    ),
    Case(
        "shedding",
        ("K1", "X0"),
        None,
        (),
        {80 * MM: 102602.609425, 60 * MM: 119901.395181, 40 * MM: 144270.372242, 20 * MM: 181234.597037},
        30.0,
    ),
    Case(
        "shedding",
        ("K1", "speed"),
        None,
        ("speed",),
        {200 * RPM: 13354.018003, 400 * RPM: 46819.099799, 900 * RPM: 228117.326425},
        30.0,
        {"speed": (10 * RPM, 900 * RPM)},
    ),
)


def main() -> None:
    """Print a block for each front."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cold", action="store_true")
    parser.add_argument("--points", type=int, default=POINTS)
    options = parser.parse_args()
    for case in CASES:
        began = time.process_time()
        trade = front.trade(
            lo.load(case.problem), case.axes, case.target, maximise=case.most, ranges=case.ranges, points=options.points
        )
        rows = run.run(trade)
        spent = time.process_time() - began
        second_front = read_front(trade, rows)
        print_front(case, trade, second_front, spent)
        if options.cold:
            searched(trade, second_front)


def print_front(case: Case, trade: trade.Trade, result: Findings, spent: float) -> None:
    """Print a front's points beside known ones, its ends, its changes and its speed."""
    first, second = case.axes
    optimised, paid = plan.values(result.rows, first), plan.values(result.rows, second)
    print(f"\n{case.problem}: {first} against {second}, {result.message}")
    for k in (0, -1):
        print(f"  end: {second} {paid[k]:.9g}, {first} {optimised[k]:.9g}")
    for change in result.changes:
        limits = ", ".join(side.text for side in change.limits)
        print(f"  {change.kind} at {second} {change.at:.9g}: {limits}")
    for value, expected in case.known.items():
        row = row_at(trade, result, value)
        reached = plan.value(row, first)
        print(f"  {second} {value:.9g}: {reached:.9f}, known {expected:.9f}, apart {reached / expected - 1:+.1e}")
    if second == "m4e":
        corners = [(x, CORNER[1] - y) for x, y in zip([*paid, CORNER[0]], [*optimised, optimised[-1]], strict=True)]
        area = sum((b[0] - a[0]) * (a[1] + b[1]) / 2 for a, b in itertools.pairwise(corners))
        print(f"  area to {CORNER}: {area:.6f}, known {LARGEST_AREA}, apart {area / LARGEST_AREA - 1:+.1e}")
    certified = [row for row in result.rows if row.certified]
    inner = [row for row in certified if row.place]
    print(f"  {len(certified) / spent:.1f} certified points per CPU second, searches and ends included", end="")
    print(f" (asked: {case.least:g}); median {sorted(row.seconds for row in inner)[len(inner) // 2]:.3f} s a point")


def row_at(trade: trade.Trade, result: Findings, value: float) -> Row:
    """Row with the second axis at a value, solved from its nearest neighbour on the front."""
    near = min((row for row in result.rows if row.certified), key=lambda row: abs(trade_value(trade, row) - value))
    ask = {"also": [], "held": near.warm["held"], "wide": False}
    return trade.solved(StudyTask(len(result.rows), near.point, {trade.axes[1]: value}, ask), near)


def trade_value(trade: trade.Trade, row: Row) -> float:
    """Second axis of a row."""
    return plan.value(row, trade.axes[1])


def searched(trade: trade.Trade, result: Findings) -> None:
    """Print which of every third point a search from scratch is better at, and which it is worse at."""
    better, worse, count = [], [], 0
    optimised = trade.solver.axes[0]
    for row in [row for row in result.rows if row.certified and row.place][::3]:
        cap = trade.solver.axes[1].value(row.place[trade.axes[1]])
        cold = trade.solver.solve(Subproblem(0, (None, cap)), (), wide=True)
        if not cold.certified:
            continue
        count += 1
        mine, its = (optimised.value(item.warm["axes"][trade.axes[0]]) for item in (row, cold))
        apart = (mine - its) / optimised.objective.scale
        better += [(row.place, apart)] if apart > SAME_OBJECTIVE else []
        worse += [(row.place, apart)] if apart < -SAME_OBJECTIVE else []
    print(f"  of {count} searches from scratch {len(better)} are better, {len(worse)} worse", *better)


if __name__ == "__main__":
    main()
