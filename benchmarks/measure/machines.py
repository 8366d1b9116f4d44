"""Figures of toleranced machines, whole-cycle extremes too, in one batched pass: how long, how right, in what memory.

    python benchmarks/measure/machines.py [--machines N] [--quick] [--json]

An optimum's own numbers are spread as they are made. What counts is the ratio: seconds of many at once, a machine, over
those of one machine alone, in turn in one run. Error: the largest over the figures read, of machines drawn at random,
against the machine alone, of the figure's size. Memory: by how much the process grows from an eighth of the machines to
all of them.
"""

import argparse
import resource
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks import harness
from loomopt.jobs import registry
from loomopt.jobs.base import EVERY
from loomopt.model.machines import BLOCK, read_all
from loomopt.model.sampling import sampled
from loomopt.physics.mechanisms.cam_motion import named_knots
from loomopt.solving import engine

MACHINES, ALONE, REPEATS = 100_000, 40, 3
"""Machines of a row, machines that are read alone beside them, and turns of both."""
SIGMA = 2e-4
"""Spread of each number, of its size: 0.02 mm of 100 mm."""


AT_A_TOP = {"contact_angle", "phi_stroke"}
"""Angles where a curve is level: rounding shows by its root."""


@dataclass(frozen=True)
class Case:
    """What is spread of an optimum, and which figures are read: all of them without a name."""

    problem: str
    target: str
    spread: tuple[str, ...]
    figures: tuple[str, ...] = ()


LINKS = ("l1", "l2", "l3", "l4", "m4e", "r4e")
DRIVE = ("l4", "l5", "l6", "l3p", "alpha", "C0x", "C0y", "phi40")
CASES = (
    Case("beatup", "balance", LINKS, ("peak_torque",)),
    Case("beatup", "balance", (*LINKS, "M0", "speed", "inertia.J4")),
    Case("rapier", "stroke-dwell", DRIVE, ("peak_acceleration", "mu_min")),
    Case("rapier", "stroke-dwell", DRIVE),
    Case("shedding", "stiffness", ("K1", "X0"), ("contact_min",)),
    Case("shedding", "stiffness", ("K1", "X0", "speed", "travel")),
    Case("shedding", "law", ("K1", "X0"), ("contact_min",)),
)


class Task:
    """A case's optimum with its machines."""

    def __init__(self, case: Case) -> None:
        self.scene = registry.load(case.problem)
        self.job = registry.of(self.scene)
        self.design: dict[str, float] = {}
        for name, value in engine.solve(self.scene, case.target).design.items():
            values = {self.scene.full(name): value} if isinstance(value, float) else named_knots(value)
            self.design |= values
        self.known = self.job.numbers_of(self.scene, self.design)
        self.model = self.job.model(self.scene, self.design)
        self.spread = [name if name in self.known else self.scene.full(f"effects.{name}") for name in case.spread]
        self.figures = case.figures

    def drawn(self, count: int) -> Iterator[dict[str, Any]]:
        """Yield machines, a block at a time."""
        generator = np.random.default_rng(1)
        for begin in range(0, count, BLOCK):
            shares = 1 + SIGMA * generator.standard_normal((len(self.spread), min(BLOCK, count - begin)))
            yield {name: self.known[name] * values for name, values in zip(self.spread, shares, strict=True)}

    def many(self, count: int) -> None:
        """Read machines a block at a time and let go of them."""
        for block in self.drawn(count):
            self.read(block)

    def read(self, drawn: Mapping[str, Any]) -> dict[str, Any]:
        """Figures of machines."""
        like = sampled(self.model, self.known)

        def figures(machines: Any) -> Any:
            return self.job.figures_of(self.scene, machines, self.figures or EVERY)

        return read_all(self.model, {**self.known, **drawn}, like, figures, self.alone)

    def alone(self, values: Mapping[str, float]) -> Mapping[str, Any]:
        """Figures of one machine."""
        parameters = {**self.design, **{name: float(values[name]) for name in self.spread}}
        return self.job.figures(self.scene, parameters)


def measured(case: Case, machines: int, alone: int, repeats: int) -> dict[str, Any]:
    """Row of the table."""
    task = Task(case)
    few = next(task.drawn(alone))
    ones = [{name: value[k] for name, value in few.items()} for k in range(alone)]
    task.many(machines // 8)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    calls: dict[str, Callable[[], Any]] = {
        "many": lambda: task.many(machines),
        "alone": lambda: [task.alone(instance) for instance in ones],
    }
    taken = harness.turns(calls, repeats)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    times = harness.medians(taken)
    result, worst = task.read(few), 0.0
    for k, instance in enumerate(ones):
        figures = task.alone(instance)
        for name in figures.keys() & result.keys() - AT_A_TOP:
            # The least force is a difference of forces as large as the largest.
            size = figures["contact_max" if name == "contact_min" else name]
            worst = max(worst, abs(result[name][k] - figures[name]) / (abs(size) or 1.0))
    ratios = [(turn["alone"] / alone) / (turn["many"] / machines) for turn in taken]
    return {
        "scene": f"{case.problem} {case.target}",
        "spread": len(case.spread),
        "figures": ", ".join(case.figures) or "every figure",
        "s for 1e5": times["many"] * 1e5 / machines,
        "times as fast": harness.spread(ratios)["median"],
        "lowest": min(ratios),
        "highest": max(ratios),
        "worst error": worst,
        "grown, MB": grown / 1024,
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--machines", type=int, default=MACHINES)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", action="store_true")
    chosen = parser.parse_args()
    harness.one_thread()
    harness.processor_time()
    count, alone, repeats = (4096, 8, 1) if chosen.quick else (chosen.machines, ALONE, REPEATS)
    harness.show([measured(case, count, alone, repeats) for case in CASES], chosen.json)


if __name__ == "__main__":
    main()
