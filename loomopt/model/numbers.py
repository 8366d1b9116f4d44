"""A scene's numbers by one name each, whatever table they stand in."""

from collections.abc import Mapping

from loomopt.physics.effects.kinds import label, owned
from loomopt.scenes.scene import Scene


def numbers(scene: Scene) -> dict[str, float]:
    """Return every number of the scene by full name, SI."""
    found = {**scene.mechanism, **scene.operation}
    for effect, own in zip(scene.active, scene.effects.values(), strict=True):
        for key, value in own.model_dump().items():
            if isinstance(value, float | int):
                found[owned(effect, key)] = float(value)
    return found


def words(scene: Scene) -> tuple[tuple[str, str, str], ...]:
    """Return (effect, key, word) for every value that chooses an effect's formula."""
    return tuple(
        (name, key, value)
        for name, own in scene.effects.items()
        for key, value in own.model_dump().items()
        if isinstance(value, str)
    )


def bounds(scene: Scene, known: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Return lower and upper bound of the design variables and of every bounded number, by full name, SI.

    What is held stands at today's value.
    """
    found = {name: (known[name], known[name]) for name in scene.schema.variables}
    for name, bound in scene.bounds.items():
        full = scene.full(name)
        found[full] = (bound.min, bound.max) if bound.free else (known[full], known[full])
    return found


def labels(scene: Scene) -> dict[str, str]:
    """Return what a designer calls each number of the effects that are on, by its full name."""
    return {owned(effect, key): label(effect, key) for effect in scene.active for key in effect.own.model_fields}
