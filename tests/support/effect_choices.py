"""A scene of every job, with every effect that can be put on it: one by one, and all that combine."""

import functools
from pathlib import Path

import pytest

import loomopt as lo
from loomopt.jobs import linkage
from loomopt.physics.effects.kinds import Speed
from loomopt.studies.effects import study
from support import uncoiled

ALL = "all that combine"
MACHINES: dict[str, tuple[str | Path, dict[str, str]]] = {
    "beatup": ("beatup", {"operation.M0": "700:800:5 N*m", "operation.speed": "560:620:3 rpm"}),
    "rapier": ("rapier", {"operation.stroke": "830:870:2 mm", "mechanism.l3": "680:690:0.5 mm"}),
    "shedding": ("shedding", {"operation.speed": "500:600:5 rpm", "mechanism.travel": "60:70:0.5 mm"}),
    "linkage": (
        Path(linkage.__file__).parent / "template.toml",
        {"operation.speed": "560:620:3 rpm", "effects.resistance.torque": "700:800:5 N*m"},
    ),
}
"""Scene of every job, and two numbers to sweep over, 21 values each."""


@functools.cache
def machine(job):
    """Scene of a job, with the effects that have no values in [available]."""
    scene = lo.load(MACHINES[job][0])
    bare = [
        name
        for name, advice in study.effects_without_values(scene, study.known_effects(scene)).items()
        if "no values to set" in advice
    ]
    for name in bare:
        scene = scene.with_effect(name).without_effect(name)
    return scene


def choices(job):
    """Effects to put on, by name: every effect with those that it needs, and all that combine."""
    scene = machine(job)
    known = study.known_effects(scene)
    single = {e.name: (*(b for b in e.companions if b not in scene.effects), e.name) for e in known}
    single = {name: effects for name, effects in single.items() if name not in scene.effects}
    together = study.combine_effects(known, uncoiled.scene(scene) if job == "shedding" else scene).effects
    return single | {ALL: tuple(e.name for e in together if e.name not in scene.effects and not isinstance(e, Speed))}


CASES = [pytest.param(job, name, id=f"{job}-{name}") for job in MACHINES for name in choices(job)]
