"""Answers to be proven: a program with its certified optimum, solved once for all tests."""

import functools
from typing import NamedTuple

import numpy as np

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.solving.nlp.point import Settings
from loomopt.solving.proof import task
from loomopt.solving.proof.levels import monotone_slack
from loomopt.solving.proof.task import BoxTask, reduced
from loomopt.solving.search.multistart import run_search
from loomopt.solving.search.search import Search


class Solved(NamedTuple):
    job: Job
    program: Program
    search: Search

    @property
    def x(self):
        assert self.search.best is not None
        return self.search.best.x

    @property
    def task(self) -> BoxTask:
        return reduced(self.program, monotone_slack(self.job, self.program), task.silent(self.program), {})


@functools.cache
def solved(name: str, target: str, *changes: str) -> Solved:
    """Return a packaged problem solved; changes: KEY=VALUE, or an effect to put on."""
    scene = lo.load(name)
    for effect in (change for change in changes if "=" not in change):
        scene = scene.with_effect(effect)
    numbers = dict(change.split("=") for change in changes if "=" in change)
    scene = scene.update(numbers) if numbers else scene
    job = registry.of(scene)
    program = job.program(scene, target)
    return Solved(job, program, run_search(Search(job, program, Settings())))


def quietly(text: str) -> None:
    pass


def designs(program: Program, count: int, seed: int = 0):
    """Yield random designs (variables, SI) that keep every limit but for whole-cycle ones, with their samplers."""
    rng = np.random.default_rng(seed)
    result = 0
    while result < count:
        shares = rng.random(len(program.variables))
        x = {v.name: v.range[0] + t * (v.range[1] - v.range[0]) for v, t in zip(program.variables, shares, strict=True)}
        if "s" in x:
            x["s"] = min(x["s"], max(limit.value for limit in program.limits if limit.name == "m4e") * x["r4e"] ** 2)
        try:
            sampler = Sampler(program.model, {**program.parameters, **x}, 180)
            remaining = all(limit.excess(sampler) <= 0 for limit in program.design_limits.values() if limit.sign)
        except (ArithmeticError, TypeError, ValueError):
            continue
        if remaining:
            result += 1
            yield x, sampler
