"""Mappings that never change: what answers and scenes are made of."""

import functools
from collections.abc import Callable
from typing import Any, NoReturn, TypeVar, overload


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


Computed = TypeVar("Computed")


class lazy(functools.cached_property[Computed]):  # noqa: N801 (it is written like a property)
    """A cached property for objects of one thread: the lock would cost as much as a position's own arithmetic."""

    @overload
    def __get__(self, instance: None, owner: type[Any] | None = None) -> "lazy[Computed]": ...

    @overload
    def __get__(self, instance: object, owner: type[Any] | None = None) -> Computed: ...

    def __get__(self, instance: object | None, owner: type[Any] | None = None) -> "lazy[Computed] | Computed":
        """Return the value, computed once and kept in the instance."""
        if instance is None:
            return self
        value = instance.__dict__[self.attrname or ""] = self.func(instance)
        return value


_SHOWN_BY: list[Callable[["Shown"], str]] = []


class Shown:
    """What shows itself in Jupyter as HTML, once it is said how; as its `repr` until then."""

    def _repr_html_(self) -> str | None:
        return _SHOWN_BY[-1](self) if _SHOWN_BY else None


def show_by(html: Callable[[Shown], str]) -> None:
    """Say how everything is shown."""
    _SHOWN_BY[:] = [html]
