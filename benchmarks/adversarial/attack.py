"""Attack answers from outside: random scenes of all jobs, physics in plain NumPy, SLSQP, evolution, linear programmes.

A certified answer is beaten where an admissible design (every limit held to 1e-9 on a fine grid) is better by more than
1e-6 in units of the scale, the first objective first; broken where it breaks a limit or states another figure than it
has; matched where the attack, not knowing it, ends within 1e-6 of it, which measures the attack. `infeasible` is
refuted where an admissible design is found. Whatever is not certified is told with its reasons. Lost is a scene whose
referee died, raised is one that ends in a traceback. Each failure is printed with its scene and design. Any of them but
"second order open" ends in exit status 1, and so do many lost ones.

    python benchmarks/adversarial/attack.py [--count N] [--seed S] [--jobs rapier,beatup,shedding,linkage] [--seconds T]
                                [--first K] [--only K] [--compare] [--global] [--json]

--count: scenes of each job; --seconds: no scene is begun later. Scene K of a job and seed is always the same one:
--first K begins with it, --only K draws it alone. --compare also solves with one and with eight starts, and counts who
finds the best known. --global (with --jobs beatup) also proves that no design is better, and counts what is proven; a
bound is false where an admissible design lies below it.
"""

import argparse
import importlib
import itertools
import multiprocessing
import sys
import time
import traceback
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any, NamedTuple

from benchmarks import harness

BETTER = 1e-6
"""What counts as better, in units of the scale; an earlier objective counts as held within 1e-9."""
FEASIBLE_EXCESS = 1e-9
BROKEN = 1e-7
"""What a certified answer may be off the referee's figures and limits: ten times the accuracy it was asked for."""
JOBS = ("rapier", "beatup", "shedding", "linkage")
OPEN = "second order open"
CALLS: dict[str, dict[str, Any]] = {"default": {}, "starts=1": {"starts": 1}, "starts=8": {"starts": 8}}
GLOBAL_CALL: dict[str, dict[str, Any]] = {"global": {"global_proof": True}}
ROUNDED = 1e-9
"""What an objective of the referee may be off, in units of the scale."""
COUNTED = (
    "tried",
    "optimal",
    "matched",
    "infeasible",
    "beaten",
    "broken",
    "refuted",
    f"uncertified: {OPEN}",
    "uncertified: other",
    "raised",
    "lost",
)
MOST_LOST = 0.05
"""Scenes whose referee may die, for each that was tried."""
FAILURES = ("beaten", "broken", "refuted", "false bound", "uncertified: other", "raised")


def better(first: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Whether objectives are lower by more than 1e-6: the first, or where it is held the second."""
    for a, b in zip(first, other, strict=True):
        if a < b - BETTER:
            return True
        if a > b + FEASIBLE_EXCESS:
            return False
    return False


def near(first: tuple[float, ...], other: tuple[float, ...], room: float = BETTER) -> bool:
    """Whether no objective is higher by more than `room`."""
    return all(a <= b + room for a, b in zip(first, other, strict=True))


def scene_of(job: str, seed: int, number: int) -> Any:
    """Scene `number` of a job and seed, with its question by hand."""
    import numpy as np

    rng = np.random.default_rng([zlib.crc32(job.encode()), seed, number])
    return importlib.import_module(f"benchmarks.adversarial.attack_{job}").drawn(rng)


class Trial:
    """One scene: the answer, and what became of it."""

    def __init__(self, task: Any, seed: int) -> None:
        import loomopt as lo

        self.task, self.seed = task, seed
        known = getattr(task, "document", None)
        self.scene = lo.scene(known) if known else lo.load(task.base).update(task.changes)
        self.best_known: tuple[dict[str, float], tuple[float, ...]] | None = None
        self.admissible: list[tuple[float, ...]] = []
        self.answers: dict[str, Any] = {}
        self.verdicts: list[tuple[str, str]] = []
        self.matched = False

    def solved(self, names: Any) -> None:
        """Solve by the public call in each of the ways named; the answer of the first is attacked."""
        import loomopt as lo

        for name in names:
            self.answers[name] = lo.solve(self.scene, self.task.target, **(CALLS | GLOBAL_CALL)[name])
        self.answer = next(iter(self.answers.values()))

    def compare_answer(self) -> None:
        """Attack the answer and note what became of it."""
        answer, task = self.answer, self.task
        claimed = task.objectives(answer.design) if answer.status == "optimal" else None
        if claimed is not None:
            excess, stated = task.excess(answer.design), task.stated(answer.figures)
            if not excess <= BROKEN:
                self.verdicts.append(("broken", f"its own design exceeds a limit by {excess:.3g}"))
            if not near(stated, claimed, BROKEN) or not near(claimed, stated, BROKEN):
                self.verdicts.append(("broken", f"it states {stated} and has {claimed}"))
        if answer.status not in ("optimal", "infeasible"):
            reasons = list(answer.certificate.reasons) if answer.certificate else [answer.message]
            known = answer.status == "uncertified" and reasons == [OPEN]
            self.verdicts.append(
                (f"uncertified: {OPEN if known else 'other'}", f"{answer.status}: {'; '.join(reasons)}")
            )
        self._attack(claimed)
        self.verdicts += [("false bound", why) for why in self.false_bounds()]
        if self.best_known is None:
            return
        design, objectives = self.best_known
        if answer.status == "infeasible":
            self.verdicts.append(("refuted", f"{design} is admissible, objectives {objectives}"))
        elif claimed is not None and better(objectives, claimed):
            self.verdicts.append(("beaten", f"{objectives} instead of {claimed} by {design}"))

    def _attack(self, claimed: tuple[float, ...] | None) -> None:
        """Keep the best admissible design: of what does not know the answer, then around it and by more starts."""
        for design in self.task.attack(self.seed, claimed):
            self._keep(design)
            if self.answer.status == "infeasible" and self.best_known is not None:
                return
        if claimed is None:
            return
        self.matched = self.best_known is not None and near(self.best_known[1], claimed)
        for design in self.task.attack(self.seed, claimed, self.answer.design):
            self._keep(design)
        for answer in self.answers.values():
            if answer.status == "optimal":
                self._keep(answer.design)

    def false_bounds(self) -> Iterator[str]:
        """Yield admissible designs below a proven bound, of a later level those within the bands of the earlier."""
        levels = self.answer.global_bound.levels if self.answer.global_bound else ()
        for objectives in self.admissible:
            for value, level in zip(objectives, levels, strict=False):
                scale = self.task.scales[level.objective]
                if value < level.bound / scale - ROUNDED:
                    yield f"{level.objective} is at least {level.bound / scale} but there is {objectives}"
                if value > (level.best + level.band) / scale:
                    break

    def _keep(self, design: Mapping[str, float]) -> None:
        if self.task.excess(design) <= FEASIBLE_EXCESS:
            objectives = self.task.objectives(design)
            self.admissible.append(objectives)
            if self.best_known is None or better(objectives, self.best_known[1]):
                self.best_known = dict(design), objectives

    def hits(self) -> dict[str, bool]:
        """Say which ways to solve found the best known."""
        assert self.best_known is not None
        best = self.best_known[1]
        return {
            name: answer.status == "optimal" and not better(best, self.task.objectives(answer.design))
            for name, answer in self.answers.items()
        }


def report(job: str, seed: int, number: int, task: Any, verdicts: list[tuple[str, str]]) -> list[str]:
    """Line for each failure, from which it can be made again."""
    known = getattr(task, "document", None)
    made = f"lo.scene({known!r})" if known else f"lo.load({task.base!r}).update({task.changes!r})"
    again = f"lo.solve({made}, {task.target!r})"
    place = f"--jobs {job} --seed {seed} --only {number}"
    return [f"{kind} ({place}): {why}\n    {again}" for kind, why in verdicts]


def parsed() -> argparse.Namespace:
    words = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    words.add_argument("--count", type=int, default=10)
    words.add_argument("--seed", type=int, default=0)
    words.add_argument("--jobs", default=",".join(JOBS))
    words.add_argument("--seconds", type=float, default=float("inf"))
    words.add_argument("--first", type=int, default=0)
    words.add_argument("--only", type=int)
    words.add_argument("--compare", action="store_true")
    words.add_argument("--global", action="store_true", dest="is_global")
    words.add_argument("--json", action="store_true")
    return words.parse_args()


class Outcome(NamedTuple):
    """What became of a scene: all that is counted of it, and a line for each failure."""

    counted: list[str]
    lines: list[str]


def outcome(job: str, seed: int, number: int, compare: bool, is_global: bool = False) -> Outcome:
    """Return what becomes of a scene."""
    task = scene_of(job, seed, number)
    try:
        trial = Trial(task, number)
        trial.solved([*(GLOBAL_CALL if is_global else ["default"]), *(CALLS if compare else [])])
        trial.compare_answer()
    except Exception:
        return Outcome(["tried", "raised"], report(job, seed, number, task, [("raised", traceback.format_exc())]))
    counted = ["tried", trial.answer.status, *{kind for kind, _ in trial.verdicts}, *["matched"] * trial.matched]
    if trial.answer.global_bound and trial.answer.status == "optimal":
        counted.append("proven" if trial.answer.global_bound.proven else "open")
    if compare and trial.best_known is not None:
        counted += ["comparable", *(f"best by {name}" for name, hit in trial.hits().items() if hit)]
    verdicts = [(kind, f"{why}\n    answer {dict(trial.answer.design)}") for kind, why in trial.verdicts]
    return Outcome(counted, report(job, seed, number, task, verdicts))


def outcomes(options: argparse.Namespace) -> Iterator[tuple[str, Outcome]]:
    """Yield what becomes of each scene, with its job.

    In a process of its own: SciPy's SLSQP has ended it by a segmentation fault, once in some hundred scenes.
    """
    jobs, began = options.jobs.split(","), time.perf_counter()
    numbers = [options.only] if options.only is not None else range(options.first, options.first + options.count)
    pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
    for number, job in itertools.product(numbers, jobs):
        if time.perf_counter() - began > options.seconds:
            break
        try:
            yield job, pool.submit(outcome, job, options.seed, number, options.compare, options.is_global).result()
        except BrokenProcessPool:
            print(f"lost (--jobs {job} --seed {options.seed} --only {number}): its process died", file=sys.stderr)
            yield job, Outcome(["lost"], [])
            pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
    pool.shutdown()


def main() -> None:
    harness.one_thread()
    options = parsed()
    counts = {job: Counter[str]() for job in options.jobs.split(",")}
    failures = list[str]()
    for job, result in outcomes(options):
        counts[job].update(result.counted)
        for line in result.lines:
            failures.append(line)
            print(line, file=sys.stderr, flush=True)
    columns = [*COUNTED, *(["proven", "open", "false bound"] if options.is_global else [])]
    columns += [*(["comparable", *(f"best by {name}" for name in CALLS)] if options.compare else [])]
    rows = [{"job": job, **{name: counts[job][name] for name in columns}} for job in counts]
    harness.show(rows, options.json, **({"failures": failures} if options.json else {}))
    failed = any(of[kind] for of in counts.values() for kind in FAILURES)
    sys.exit(failed or any(of["lost"] > MOST_LOST * of["tried"] for of in counts.values()))


if __name__ == "__main__":
    main()
