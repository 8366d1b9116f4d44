"""Common parts of the benchmarks: one thread, a fixed number of turns, medians and spread of ratios, tables."""

import importlib.util
import json
import os
import statistics
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def one_thread() -> None:
    """Restart this script with single-threaded linear algebra: on small problems threads only cost time."""
    if any(os.environ.get(name) != "1" for name in THREADS):
        os.environ |= dict.fromkeys(THREADS, "1")
        os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])


def processor_time() -> None:
    """Make every clock of this process, loomopt's too, count processor time, so that other work counts little."""
    time.perf_counter = time.process_time


def seconds(call: Callable[[], Any]) -> float:
    """Time of one call, s."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def turns(calls: Mapping[str, Callable[[], Any]], repeats: int) -> list[dict[str, float]]:
    """Time of every call in every turn, s; a turn runs all calls, so that noise affects all alike.

    The number of turns is fixed in advance, since a benchmark that stops at a good result is biased.
    """
    return [{name: seconds(call) for name, call in calls.items()} for _ in range(repeats)]


def medians(times: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Median time of every call, s."""
    return {name: statistics.median(turn[name] for turn in times) for name in times[0]}


def spread(ratios: Sequence[float]) -> dict[str, float]:
    """Median, lowest and highest of the ratios of all turns."""
    return {"median": statistics.median(ratios), "lowest": min(ratios), "highest": max(ratios)}


def installed(module: str) -> bool:
    """Whether an optional peer can be imported."""
    return importlib.util.find_spec(module) is not None


def show(rows: Sequence[Mapping[str, Any]], as_json: bool, **facts: Any) -> None:
    """Print rows as a table, then the facts, lists of rows as tables too; or all as one JSON object."""
    if as_json:
        print(json.dumps({"rows": rows, **facts}))
        return
    _print(rows)
    for name, value in facts.items():
        if isinstance(value, list):
            print(f"\n{name.replace('_', ' ')}:")
            _print(value)
        else:
            print(f"{name.replace('_', ' ')}: {_text(value)}")


def _print(rows: Sequence[Mapping[str, Any]]) -> None:
    columns = list(rows[0])
    cells = [columns, *([_text(row[name]) for name in columns] for row in rows)]
    widths = [max(len(line[k]) for line in cells) for k in range(len(columns))]
    for line in cells:
        print(
            "  ".join(
                cell.ljust(w) if k == 0 else cell.rjust(w) for k, (cell, w) in enumerate(zip(line, widths, strict=True))
            )
        )


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, dict) and set(value) == {"median", "lowest", "highest"}:
        return f"{value['median']:.3g} ({value['lowest']:.3g} to {value['highest']:.3g})"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
