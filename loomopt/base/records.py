"""Immutable mappings, of which answers and scenes consist."""

import functools
from collections.abc import Callable, ItemsView, Iterable, Iterator, Mapping, Sequence
from typing import Any, Generic, NoReturn, TypeVar, overload


class Frozen(dict[str, Any]):
    """A dict that refuses to change; it pickles, compares and prints as JSON like any other."""

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("it cannot be changed: make a new one, such as {**this, name: value}")

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[type["Frozen"], tuple[dict[str, Any]]]:
        """Constructor and items for pickle, which would otherwise set items one by one."""
        return Frozen, (dict(self),)


class Awaited(Mapping[str, float | None]):
    """Immutable mapping whose values are computed when read: the first one alone, then all others.

    names: of all, in order; known: those that are there; later(names): others, which cost less together. It pickles as
    a `Frozen`.
    """

    def __init__(
        self,
        names: Iterable[str],
        known: Mapping[str, float | None],
        later: Callable[[Sequence[str]], Mapping[str, float | None]],
    ) -> None:
        self._names, self._known, self._later = dict.fromkeys(names), dict(known), later
        self._was_read = False

    def __getitem__(self, name: str) -> float | None:
        if name in self._names and name not in self._known:
            missing = [absent for absent in self._names if absent not in self._known] if self._was_read else [name]
            self._known, self._was_read = {**self._known, **self._later(missing)}, True
        return self._known[name]

    def items(self) -> ItemsView[str, float | None]:
        """Names with their values; missing values are computed together."""
        self._was_read = True
        return {name: self[name] for name in self._names}.items()

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __contains__(self, name: object) -> bool:
        return name in self._names

    def __or__(self, other: Mapping[str, float | None]) -> dict[str, float | None]:
        """Union as a dict; the right operand's value is used where both have one."""
        return {**self, **other}

    def __repr__(self) -> str:
        return repr(dict(self))

    def __reduce__(self) -> tuple[type[Frozen], tuple[dict[str, float | None]]]:
        """Constructor and values for pickle; missing values are computed first."""
        return Frozen, (dict(self),)


def freeze(record: object, *names: str) -> None:
    """Make the named mappings of a frozen dataclass unchangeable; for its `__post_init__`."""
    for name in names:
        value = getattr(record, name)
        object.__setattr__(record, name, value if isinstance(value, Awaited) else Frozen(value))


Computed = TypeVar("Computed")


class lazy(functools.cached_property[Computed]):  # noqa: N801 (it is written like a property)
    """A cached property for objects of one thread: the lock would cost as much as a position's own arithmetic."""

    @overload
    def __get__(self, instance: None, owner: type[Any] | None = None) -> "lazy[Computed]": ...

    @overload
    def __get__(self, instance: object, owner: type[Any] | None = None) -> Computed: ...

    def __get__(self, instance: object | None, owner: type[Any] | None = None) -> "lazy[Computed] | Computed":
        """Value, computed once and stored in the instance."""
        if instance is None:
            return self
        value = instance.__dict__[self.attrname or ""] = self.func(instance)
        return value


_SHOWN_BY: list[Callable[["Shown"], str]] = []


class Shown:
    """Record that Jupyter shows as HTML once `show_by` is called, and by its `repr` before."""

    def _repr_html_(self) -> str | None:
        return _SHOWN_BY[-1](self) if _SHOWN_BY else None


def show_by(html: Callable[[Shown], str]) -> None:
    """Set the function that shows records as HTML."""
    _SHOWN_BY[:] = [html]


class attribute(Generic[Computed]):  # noqa: N801 (it is written like a property)
    """Attribute of a result that is the one of its record, `result`, with the same name."""

    def __set_name__(self, owner: type[Any], name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type[Any]) -> "attribute[Computed]": ...

    @overload
    def __get__(self, instance: Any, owner: type[Any]) -> Computed: ...

    def __get__(self, instance: Any, owner: type[Any]) -> "attribute[Computed] | Computed":
        """Value in the record."""
        return self if instance is None else getattr(instance.result, self._name)
