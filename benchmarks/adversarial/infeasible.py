"""Infeasible targets drawn at random: CPU seconds of each, and the least relaxations told.

    python benchmarks/adversarial/infeasible.py --count 30 --out now.json # in this checkout
    PYTHONPATH=OTHER python benchmarks/adversarial/infeasible.py --out before.json # in another one
    python benchmarks/adversarial/infeasible.py --compare before.json now.json
                                      # what is told otherwise, and the ratio of times

A scene that is admissible after all is told and not counted.
"""

import argparse
import json
import random
import time
from pathlib import Path
from typing import Any

import loomopt as lo

FIVE_BAR = {"l4": (10, 60), "l5": (300, 600), "l6": (150, 300), "l3p": (120, 240), "C0x": (300, 520), "C0y": (120, 320)}
FOUR_BAR = {"l1": (60, 100), "l2": (150, 320), "l3": (140, 220), "l4": (300, 400)}
SAME = 1e-6


def bounds(generator: random.Random, names: dict[str, tuple[int, int]], least: int, width: float) -> dict[str, Any]:
    """Narrow bounds, mm, of at least so many lengths, around a random centre."""
    results = {}
    for name in generator.sample(sorted(names), generator.randint(least, len(names))):
        centre = generator.uniform(*names[name])
        room = width * centre
        results[f"bounds.{name}"] = {"min": f"{centre - room:.2f} mm", "max": f"{centre + room:.2f} mm"}
    return results


def drawn(generator: random.Random) -> tuple[str, str | None, dict[str, Any]]:
    """Scene's name, its target and changes that leave it little room."""
    job = generator.choice(["rapier", "rapier", "rapier", "beatup", "shedding"])
    if job == "rapier":
        changes = {
            "operation.stroke": f"{generator.uniform(700, 1900):.1f} mm",
            "operation.s_dwell": f"{generator.uniform(0.5, 6):.3f} mm",
            "operation.dwell_after": f"{generator.uniform(15, 60):.2f} deg",
            "operation.dwell_before": f"{generator.uniform(15, 60):.2f} deg",
        }
        return job, None, changes | bounds(generator, FIVE_BAR, 1, generator.uniform(0.05, 0.4))
    if job == "beatup":
        target = generator.choice(["balance", "pulse", "torque"])
        return (
            job,
            target,
            {"operation.M0": f"{generator.uniform(500, 900):.1f} N*m"} | bounds(generator, FOUR_BAR, 2, 0.02),
        )
    most = generator.uniform(20, 90), generator.uniform(800, 3500)
    return (
        job,
        None,
        {
            "operation.speed": f"{generator.uniform(60, 260):.1f} rpm",
            "operation.N_min": f"{generator.uniform(50, 600):.1f} N",
            "bounds.X0": {"min": f"{most[0] / 2:.2f} mm", "max": f"{most[0]:.2f} mm"},
            "bounds.K1": {"min": f"{most[1] / 2:.1f} N/m", "max": f"{most[1]:.1f} N/m"},
        },
    )


def summary(name: str, target: str | None, changes: dict[str, Any]) -> dict[str, Any]:
    """Return what is said of a scene, and the CPU seconds that took."""
    began = time.process_time()
    answer = lo.solve(lo.load(name).update(changes), target)
    relaxed = {f"{r.limit} {r.side}{' alone' if r.alone else ''}": abs(r.needed - r.value) for r in answer.relaxation}
    return {"status": answer.status, "cpu": time.process_time() - began, "relaxed": relaxed}


def run(count: int, seed: int, out: Path | None) -> None:
    """Solve so many scenes; print and write what is said of each."""
    generator, result = random.Random(seed), {}
    for place in range(count):
        name, target, changes = drawn(generator)
        result[f"{place} {name}"] = summary(name, target, changes)
        print(place, name, result[f"{place} {name}"], flush=True)
        if out:
            out.write_text(json.dumps(result, indent=1), encoding="utf-8")


def compare(before: Path, after: Path) -> None:
    """Print what two runs say otherwise, and the ratio of their times where both call a scene infeasible."""
    first, other = (json.loads(path.read_text(encoding="utf-8")) for path in (before, after))
    spent = [0.0, 0.0]
    for key in (key for key in first if key in other):
        a, b = first[key], other[key]
        if a["status"] != b["status"]:
            print(key, a["status"], "->", b["status"])
        if a["status"] != "infeasible" or b["status"] != "infeasible":
            continue
        spent = [spent[0] + a["cpu"], spent[1] + b["cpu"]]
        for name in sorted({*a["relaxed"], *b["relaxed"]}):
            needs = a["relaxed"].get(name), b["relaxed"].get(name)
            if None in needs or abs(needs[0] - needs[1]) > SAME * max(needs):
                print(key, name, *needs)
    print(f"CPU {spent[0]:.1f} s and {spent[1]:.1f} s: {spent[0] / spent[1]:.1f} times")


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--compare", type=Path, nargs=2)
    given = parser.parse_args()
    if given.compare:
        compare(*given.compare)
    else:
        run(given.count, given.seed, given.out)


if __name__ == "__main__":
    main()
