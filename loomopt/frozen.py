"""Mappings that never change: what answers and scenes are made of."""

from typing import Any, NoReturn


class Frozen(dict[str, Any]):
    """A dict that refuses to change; it pickles, compares and prints as JSON like any other."""

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("it never changes: make a new one, such as {**this, name: value}")

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[type["Frozen"], tuple[dict[str, Any]]]:
        """Return how to make it again: unpickling would otherwise set items one by one."""
        return Frozen, (dict(self),)


def freeze(record: object, *names: str) -> None:
    """Make the named mappings of a frozen dataclass unchangeable; for its `__post_init__`."""
    for name in names:
        object.__setattr__(record, name, Frozen(getattr(record, name)))
