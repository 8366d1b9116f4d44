"""What other distributions bring: entry points by group. Nothing of theirs is imported here."""

import functools
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


@functools.cache
def of(group: str) -> "tuple[EntryPoint, ...]":
    """Return the entry points of a group, by name; the same one found twice on the path counts once."""
    from importlib.metadata import entry_points

    return tuple(sorted(set(entry_points(group=group)), key=lambda point: (point.name, point.value)))
