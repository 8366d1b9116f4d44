"""Names of the numbers in effects' tables: made in one place, and never parted again."""

from loomopt.effects.kinds import Effect


def owned(effect: Effect, key: str) -> str:
    """Return the full name of a number of an effect's table, unique in a scene."""
    return f"{effect.name}.{key}"


def label(effect: Effect, key: str) -> str:
    """Return what a designer calls a number of an effect's table; of an instance the label names that too."""
    return f"{effect.instance}.{key}" if effect.instance else key
