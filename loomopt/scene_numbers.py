"""What a study varies and depends on: the numbers of a scene by dotted key, and the files that it names."""

import contextlib
from collections.abc import Iterator, Mapping
from typing import Any

from loomopt.base.errors import BadInput
from loomopt.base.quantities import Quantity, quantity_of
from loomopt.base.refusals import refusal, unknown
from loomopt.physics.effects.kinds import label
from loomopt.physics.schema import Table
from loomopt.scenes import Scene

WITHOUT_FILES = ("problem", "display")
"""Tables whose texts are never names of files."""


def quantity(scene: Scene, key: str) -> Quantity:
    """Return what the number under a dotted key may be. Raises BadInput where the scene has no number there."""
    known = dict(_quantities(scene))
    table = key.rpartition(".")[0]  # such as a target's weights, each number of which has a name of its own
    if key in known or (table in known and scene.given(key) is not None):
        return known.get(key) or known[table]
    if scene.given(key) is not None:
        remedy = "Vary a number, such as operation.speed"
        raise refusal("it is no number", scene.origin, key, scene.given(key), remedy=remedy)
    raise unknown("number", key, known, scene.origin, key)


def _quantities(scene: Scene) -> Iterator[tuple[str, Quantity]]:
    """Yield the dotted key of every number that a scene may hold, with what it may be."""
    schema, labels = scene.schema, {name: Quantity(kind) for name, kind in scene.schema.variables.items()}
    for table, model in (("operation", schema.operation), ("mechanism", schema.mechanism)):
        for key, found in _fields(model):
            yield f"{table}.{key}", found
            labels.setdefault(key, found)
    for effect in scene.active:
        for key, found in _fields(effect.own):
            yield ".".join(("effects", *effect.path, key)), found
            labels.setdefault(label(effect, key), found)
    for name, target in schema.targets.items():
        for key, found in _fields(target.own):
            yield f"targets.{name}.{key}", found
    for name in scene.bounds:
        for place in (f"bounds.{name}", f"bounds.{name}.min", f"bounds.{name}.max"):
            yield place, labels[name]
    for name, limit in scene.limits.items():
        for side in ("min", "max"):
            if getattr(limit, side) is not None:
                yield f"limits.{name}.{side}", Quantity(schema.figures[name].kind)


def _fields(model: type[Table]) -> Iterator[tuple[str, Quantity]]:
    for key in model.model_fields:
        found = quantity_of(model, key)
        if found:
            yield key, found


def files(scene: Scene) -> dict[str, str]:
    """Return the SHA-256 of every file that a scene names, by the dotted key of its name."""
    import hashlib

    found = {}
    for key, text in _texts({name: own for name, own in scene.document.items() if name not in WITHOUT_FILES}):
        with contextlib.suppress(BadInput, OSError, ValueError):  # what can be no file's name is none
            path = scene.paths.located(text, key, scene.origin)
            if path.is_file():
                found[key] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def _texts(table: Mapping[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[str, str]]:
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _texts(value, (*path, name))
        elif isinstance(value, str):
            yield ".".join((*path, name)), value
