"""Properties computed when they are first read, without the lock that functools takes before Python 3.12."""

import functools
from typing import Any, TypeVar, overload

Value = TypeVar("Value")


class lazy(functools.cached_property[Value]):  # noqa: N801 (it is written like a property)
    """A cached property for objects of one thread: the lock would cost as much as a position's own arithmetic."""

    @overload
    def __get__(self, instance: None, owner: type[Any] | None = None) -> "lazy[Value]": ...

    @overload
    def __get__(self, instance: object, owner: type[Any] | None = None) -> Value: ...

    def __get__(self, instance: object | None, owner: type[Any] | None = None) -> "lazy[Value] | Value":
        """Return the value, computed once and kept in the instance."""
        if instance is None:
            return self
        value = instance.__dict__[self.attrname or ""] = self.func(instance)
        return value
