"""Frozen dataclasses of which each compiles its own `__init__` only.

Before Python 3.13 the standard decorator compiles six functions for every class one by one: most of what importing a
module of dataclasses takes, and a tenth of a whole command. Here the others are closures over the names of the fields;
what a class then does is the same, and type checkers read the standard decorator. InitVar is not known here.
"""

import dataclasses
import functools
import inspect
import operator
import reprlib
import sys
from collections.abc import Callable, Mapping
from types import FunctionType
from typing import TYPE_CHECKING, TypeVar

Made = TypeVar("Made", bound=type)
Fields = tuple["dataclasses.Field[object]", ...]
Methods = dict[str, object]
NOT_GIVEN = object()


def record(*, frozen: bool, eq: bool = True, repr: bool = True, kw_only: bool = False) -> Callable[[Made], Made]:
    """Return what makes a frozen dataclass of a class, as `dataclasses.dataclass` with the same words does."""
    if not frozen:
        raise TypeError("these dataclasses are frozen: dataclasses.dataclass makes others")
    return functools.partial(_record, eq=eq, repr=repr, kw_only=kw_only)


def _record(cls: Made, eq: bool, repr: bool, kw_only: bool) -> Made:
    fields = _read_fields(cls, kw_only, {"eq": eq, "repr": repr, "frozen": True})
    placed = tuple(field.name for field in fields if field.init and not field.kw_only)
    made: Methods = {"__match_args__": placed, "__init__": _initializer(cls, fields)}
    made |= _refusals(cls, {field.name for field in fields})
    made |= _printer(tuple(field.name for field in fields if field.repr)) if repr else {}
    made |= _comparisons(tuple(field.name for field in fields if field.compare)) if eq else {}
    for name, value in made.items():
        if cls.__dict__.get(name) is None:
            setattr(cls, name, value)
    return cls


def _read_fields(cls: type, kw_only: bool, words: Mapping[str, bool]) -> Fields:
    """Return the fields, set where the standard library finds them; it reads them from a namesake without bases."""
    annotations = inspect.get_annotations(cls)
    given = {name: cls.__dict__[name] for name in annotations if name in cls.__dict__}
    about = {"__module__": cls.__module__, "__doc__": cls.__doc__ or "", "__annotations__": annotations}
    namesake = type(cls.__name__, (), {**about, **given})
    read = vars(dataclasses.dataclass(init=False, eq=False, repr=False, kw_only=kw_only)(namesake))
    for name in given:
        if name in read:
            setattr(cls, name, read[name])
        else:
            delattr(cls, name)
    for word, said in words.items():
        setattr(read["__dataclass_params__"], word, said)
    bases = (vars(base).get("__dataclass_fields__", {}) for base in reversed(cls.__mro__[1:]))
    fields = functools.reduce(operator.or_, bases, {}) | read["__dataclass_fields__"]
    for name, value in {**read, "__dataclass_fields__": fields}.items():
        if name.startswith("__dataclass_"):
            setattr(cls, name, value)
    return dataclasses.fields(cls)


def _initializer(cls: type, fields: Fields) -> FunctionType:
    """Return `__init__`, the one method that has to be compiled: its arguments are the fields."""
    known: dict[str, object] = {"_set": object.__setattr__, "_NOT_GIVEN": NOT_GIVEN, "__name__": cls.__module__}
    before, after, lines = ["self"], ["*"], []
    for field in fields:
        name, value, default = field.name, field.name, ""
        if field.default_factory is not dataclasses.MISSING:
            known[f"_make_{name}"] = field.default_factory
            value = f"_make_{name}() if {name} is _NOT_GIVEN else {name}" if field.init else f"_make_{name}()"
            default = "=_NOT_GIVEN"
        elif field.default is not dataclasses.MISSING:
            known[f"_default_{name}"] = field.default
            default = f"=_default_{name}"
        if field.init:
            (after if field.kw_only else before).append(name + default)
        if field.init or field.default_factory is not dataclasses.MISSING:
            lines.append(f"_set(self, {name!r}, {value})")
    lines += ["self.__post_init__()"] if hasattr(cls, "__post_init__") else []
    arguments = ", ".join([*before, *(after if len(after) > 1 else [])])
    exec(f"def __init__({arguments}):\n " + "\n ".join(lines or ["pass"]), known)
    made = known["__init__"]
    assert isinstance(made, FunctionType)
    made.__qualname__ = f"{cls.__qualname__}.__init__"
    made.__annotations__ = {**{field.name: field.type for field in fields if field.init}, "return": None}
    return made


def _refusals(cls: type[object], names: set[str]) -> Methods:
    """Return what refuses to set and to delete the fields; a subclass may have attributes beside them."""

    def __setattr__(self: object, name: str, value: object) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)  # type: ignore[misc]  # the class is any

    def __delattr__(self: object, name: str) -> None:  # noqa: N807
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)  # type: ignore[misc]

    return {"__setattr__": __setattr__, "__delattr__": __delattr__}


def _printer(names: tuple[str, ...]) -> Methods:
    @reprlib.recursive_repr()
    def __repr__(self: object) -> str:  # noqa: N807
        return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    return {"__repr__": __repr__}


def _comparisons(names: tuple[str, ...]) -> Methods:
    def each(record: object) -> tuple[object, ...]:
        return tuple([getattr(record, name) for name in names])

    compared: Callable[[object], tuple[object, ...]] = operator.attrgetter(*names) if len(names) > 1 else each

    def __eq__(self: object, other: object) -> bool:  # noqa: N807
        return compared(self) == compared(other) if type(other) is type(self) else NotImplemented

    def __hash__(self: object) -> int:  # noqa: N807
        return hash(compared(self))

    return {"__eq__": __eq__, "__hash__": __hash__}


if TYPE_CHECKING or sys.version_info >= (3, 13):
    from dataclasses import dataclass as dataclass
else:
    dataclass = record
