"""Scenes of every job with the made-up effects on, their answers solved once."""

import functools
import json

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.solving.answer.solution import Solution

JOBS = ("beatup", "rapier", "shedding")
LOOSE = {"most": "1 km", "high": "1 km"}
LOADS = {"effects.made_up_output": {"c": "0.02", "a": "0.3"}, "effects.made_up_drive": {"b": "0.01"}}

every_job = pytest.mark.parametrize("job", JOBS)


@functools.cache
def scene_of(job, **demands):
    """Return the job's packaged scene with all made-up effects on; demands: texts of the check's table."""
    return lo.load(job).update({**LOADS, "effects.made_up_check": LOOSE | demands})


SOLVED: dict[str, Solution] = {}


def solve(scene):
    """Return the scene's answer, once for the same tables."""
    text = json.dumps(scene.document)
    if text not in SOLVED:
        SOLVED[text] = lo.solve(scene, starts=1).result
    return SOLVED[text]


def sampler(scene, design=None):
    return registry.of(scene).sampler(scene, design or registry.of(scene).today(scene))
