"""The effects that a study of them knows: those whose values stand in the scene, and which of these combine."""

import shlex
from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.physics.effects.declared import Fault, faults
from loomopt.physics.effects.kinds import Effect, Event, Speed, State
from loomopt.physics.schema import Table
from loomopt.scene import answers
from loomopt.scene.document import looked_up, replaced
from loomopt.scene.scene import Scene, build
from loomopt.scene.tables import effects as read

YIELDING = (State, Speed, Event)
"""Kinds that yield to any other where both cannot be on together."""


class Together(NamedTuple):
    """Effects that combine, in the order of the job; out: those that stay out, each with the reason."""

    effects: tuple[Effect, ...]
    out: Mapping[str, str]


def known(scene: Scene) -> dict[Effect, Table]:
    """Return the effects of [effects] and [available] with their values, in the order of the job."""
    off = read(scene.document.get("available", {}), scene.schema, scene.origin, "available")
    found = {**off, **dict(zip(scene.active, scene.effects.values(), strict=True))}
    order = list(scene.schema.effects)
    return dict(sorted(found.items(), key=lambda pair: (order.index(pair[0].path[0]), pair[0].name)))


def unknown(scene: Scene, given: Iterable[Effect]) -> dict[str, str]:
    """Return the job's other effects, each with what it takes to study it: nothing is invented."""
    there = {effect.path[0] for effect in given}
    return {name: _asked(effect) for name, effect in scene.schema.effects.items() if name not in there}


def _asked(effect: Effect) -> str:
    own = f"effects.{effect.name}.NAME" if effect.many else f"effects.{effect.name}"
    keys = [f"{own}.{key}" for key, info in effect.own.model_fields.items() if info.is_required()]
    return f"no values: set {', '.join(keys)}" if keys else f"it has no values to set: --with {effect.name}"


def combined(given: Mapping[Effect, Table], scene: Scene) -> Together:
    """Return which effects can be on together.

    Of two that cannot, a state, a speed or an event yields to any other kind, else the later one in the order of the
    job. What needs a number of the scene that is not there, or an effect that stays out, stays out too.
    """
    out = {e.name: text for e in given if (text := _lacking(e, scene))}
    while True:
        chosen, yielding = _chosen({e: own for e, own in given.items() if e.name not in out})
        fault = next((each for each in faults(chosen) if each.missing), None)
        if fault is None:
            return Together(tuple(e for e in given if e in chosen), {**out, **yielding})
        out[fault.effect.name] = f"it needs the effect {fault.other}"


def _chosen(given: Mapping[Effect, Table]) -> tuple[dict[Effect, Table], dict[str, str]]:
    chosen: dict[Effect, Table] = {}
    out: dict[str, str] = {}
    for effect in sorted(given, key=lambda each: isinstance(each, YIELDING)):
        fault = next((each for each in faults({**chosen, effect: given[effect]}) if not each.missing), None)
        if fault:
            out[effect.name] = f"it yields to {_other(fault, effect)}: {fault.problem}"
        else:
            chosen[effect] = given[effect]
    return chosen, out


def _other(fault: Fault, effect: Effect) -> str:
    return fault.other if fault.effect is effect else fault.effect.name


def _lacking(effect: Effect, scene: Scene) -> str:
    """Return what of the scene an effect lacks; "" where it has all it needs."""
    given = {f"{table}.{key}" for table, own in scene.tables.items() for key, value in own if value is not None}
    keys = [key for key in effect.needs if key not in given]
    return f"it needs {', '.join(keys)}" if keys else ""


def with_only(scene: Scene, names: Collection[str]) -> Scene:
    """Return a scene with these of its known effects on, the others in [available]. Raises BadInput."""
    document = {**scene.document, "effects": {}, "available": {}}
    for effect in known(scene):
        own = [looked_up(scene.document, (table, *effect.path)) for table in ("effects", "available")]
        values = own[1] if own[0] is None else own[0]
        table = "effects" if effect.name in names else "available"
        document = replaced(document, (table, *effect.path), values, scene.origin, f"{table}.{effect.name}")
    return build(document, scene.jobs, scene.origin, scene.paths)


def command(scene: Scene, target: str, names: Collection[str]) -> str | None:
    """Return the call of the shell that solves a scene with these effects alone; None for a scene without a file."""
    problem = _problem(scene)
    try:
        file = registry.load(problem)
    except BadInput:
        return None
    words = ["loomopt", "solve", problem, "--target", target]
    before, after = dict(answers.values(file.document)), dict(answers.values(scene.document))
    if before.keys() - after.keys():
        return None  # what was taken out of a scene no option takes out
    idle = tuple(f"effects.{effect.name}." for effect in known(scene) if effect.name not in names)
    changes = {key: value for key, value in after.items() if before.get(key) != value and not key.startswith(idle)}
    changes.pop("problem.name", None)
    for key, value in changes.items():
        if isinstance(value, list):
            return None
        words += ["--set", f"{key}={str(value).lower() if isinstance(value, bool) else value}"]
    on = {*file.effects, *(effect.name for effect in known(scene) if _set(effect.name, changes))}
    for option, asked in (("--with", set(names) - on), ("--without", on - set(names))):
        words += [word for effect in known(scene) if effect.name in asked for word in (option, effect.name)]
    return shlex.join(words)


def _problem(scene: Scene) -> str:
    """Return what the command line calls a scene: a packaged name, or its file."""
    name = scene.origin.removesuffix(".toml")
    file = registry.problems().get(name)
    return name if file and file.parent.absolute() == scene.paths.folder else scene.origin


def _set(effect: str, changes: Collection[str]) -> bool:
    """Say whether a change is one of an effect's own values, which puts it on."""
    return any(key.startswith(f"effects.{effect}.") for key in changes)
