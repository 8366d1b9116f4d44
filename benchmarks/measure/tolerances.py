"""The numbers of the solver, one at a time a tenth and ten times as large (counts half and double): what do they do?

    python benchmarks/measure/tolerances.py [--only NAME] [--json]

Every target of three packaged scenes is solved from its first start, then warm at two neighbours. Told of each number:
solves that were not reached, by how much the worst objective is off (scales), excess between nodes, IPOPT's
iterations, and neighbours that pivots alone did not reach. Where a mean is read, GAUSS_NODES says how far it is off.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any
from unittest import mock

from benchmarks import harness
from loomopt.jobs import registry
from loomopt.model import reading, session
from loomopt.model.program import Program
from loomopt.solving.nlp import exchange, transcribe
from loomopt.solving.nlp.point import PENALTY, Settings, sampler_at

NEIGHBOURS: dict[str, tuple[str, tuple[str, ...]]] = {
    "beatup": ("operation.M0", ("745 N*m", "752 N*m", "770 N*m")),
    "rapier": ("operation.dwell_after", ("30 deg", "30.2 deg", "30.6 deg")),
    "shedding": ("operation.speed", ("600 rpm", "603 rpm", "612 rpm")),
}
NUMBERS = (
    *(
        "SAMPLES",
        "REFINED_MULTIPLIER",
        "IPOPT_TOLERANCE",
        "IPOPT_SLOPE",
        "WARM_BARRIER",
        "WARM_PUSH",
        "PENALTY",
        "NEAR",
        "BINDING",
    ),
    *("FIRST_SLOTS", "LEADING", "FIRST_SHARE", "FIRST_ROOM", "EXCHANGE_ROUNDS", "END_EXCESS", "TOUCHING", "CONVERGED"),
    *("POLISH_STEPS", "POLISH_FARTHEST", "POLISH_RANK", "POLISH_EXCESS", "POLISH_DONE", "FOLLOW_FARTHEST"),
    *("FOLLOW_ROUNDS", "FOLLOW_PROGRESS", "FOLLOW_PATIENCE", "SAME_NODE", "PIVOTS", "PIVOT_NEWTON_STEPS"),
    *("PIVOT_STEP", "PIVOT_RESIDUAL", "PIVOT_STATIONARY", "PIVOT_DEPENDENT", "PIVOT_FLAT", "PIVOT_SLOPE", "PIVOT_RANK"),
)
IPOPTS = {
    "IPOPT_TOLERANCE": ("tol", "constr_viol_tol", "compl_inf_tol"),
    "IPOPT_SLOPE": ("dual_inf_tol",),
    "WARM_BARRIER": ("mu_init",),
    "WARM_PUSH": tuple(name for name in transcribe.WARM if name not in ("mu_init", "warm_start_init_point")),
}


@dataclass(frozen=True)
class Outcome:
    """Result of a choice of the numbers; objectives: of every solve, in units of the scale, None where not reached."""

    objectives: tuple[tuple[float, ...] | None, ...]
    excess: float
    iterations: int
    left: int


def tasks() -> Iterator[tuple[Program, ...]]:
    """Yield each target's program with its neighbours'."""
    for name, (key, values) in NEIGHBOURS.items():
        scenes = [registry.load(name).set(key, value) for value in values]
        job = registry.of(scenes[0])
        for target in scenes[0].schema.targets:
            yield tuple(job.program(scene, target) for scene in scenes)


def outcome(programs: list[tuple[Program, ...]]) -> Outcome:
    """Return what all solves lead to."""
    session.current().forget(transcribe.NLPS)
    results: list[tuple[float, ...] | None] = []
    excess, iterations, left = 0.0, 0, 0
    for first, *others in programs:
        near = None
        for program in (first, *others):
            settings = Settings(penalty=PENALTY)
            point = exchange.solve(program, exchange.starts(program, 1)[0], settings, near)
            sampler = sampler_at(program, point.x)
            iterations += point.iterations
            left += near is not None and point.iterations > 0
            near = point if point.usable else None
            if not point.usable or sampler is None:
                results.append(None)
                continue
            excess = max(excess, point.violation, *(k.excess(sampler) for k in program.limits if k.sign != 0))
            results.append(tuple(level.merit(sampler) / level.scale for level in program.objectives))
    return Outcome(tuple(results), excess, iterations, left)


def bearers(name: str) -> list[Any]:
    """Modules that have or read a number."""
    return [m for key, m in list(sys.modules.items()) if key.startswith("loomopt") and hasattr(m, name)]


@contextmanager
def changed(name: str, value: Any) -> Iterator[None]:
    """Give a number another value wherever it is read."""
    with ExitStack() as stack:
        for module in bearers(name):
            stack.enter_context(mock.patch.object(module, name, value))
        for message in (transcribe.IPOPT, transcribe.WARM):
            values = {key: value for key in IPOPTS.get(name, ()) if key in message}
            stack.enter_context(mock.patch.dict(message, values))
        reading.gauss.cache_clear()
        yield
    reading.gauss.cache_clear()


def variations(name: str) -> tuple[Any, ...]:
    """Values a number is given."""
    value = next(getattr(m, name) for m in bearers(name))
    if isinstance(value, int):
        return max(1, value // 2), 2 * value
    if name == "FIRST_SHARE":
        return 1 + (value - 1) / 10, 1 + (value - 1) * 10
    return value / 10, value * 10


def row(name: str, value: Any, usual: Outcome, programs: list[tuple[Program, ...]]) -> dict[str, Any]:
    """Return what a number's other value does."""
    with changed(name, value):
        here = outcome(programs)
    pairs = [(a, b) for a, b in zip(here.objectives, usual.objectives, strict=True) if a and b]
    off = max((abs(a - b) for pair in pairs for a, b in zip(*pair, strict=True)), default=0.0)
    return {
        "number": name,
        "value": value,
        "not reached": sum(objective is None for objective in here.objectives),
        "objective off": off,
        "excess": here.excess,
        "iterations": here.iterations,
        "not followed": here.left,
    }


def means(programs: list[tuple[Program, ...]]) -> Mapping[str, float]:
    """Return by how much the means over the cycle are off with fewer nodes, relative, against 64."""

    def values(count: int) -> list[float]:
        with changed("GAUSS_NODES", count):
            samplers = [sampler_at(first, exchange.starts(first, 1)[0]) for first, *_ in programs]
            return [s.mean(mean) for s in samplers if s for mean in s.model.integrals]

    exact = values(64)
    return {
        f"means of {count} nodes off": max(abs(a / b - 1) for a, b in zip(values(count), exact, strict=True))
        for count in (8, 12, 16, 20, 24, 32)
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="part of the names of the numbers to vary")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    programs = list(tasks())
    usual = outcome(programs)
    rows = [row("as they are", 0, usual, programs) | {"value": None}] if not options.only else []
    rows += [row(name, v, usual, programs) for name in NUMBERS if options.only in name for v in variations(name)]
    harness.show(rows, options.json, solves=len(usual.objectives), **means(programs))


if __name__ == "__main__":
    harness.one_thread()
    main()
