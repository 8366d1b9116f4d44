"""Arguments of the public functions: checks of their kind, and former names of renamed ones."""

import functools
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from numbers import Integral, Real
from typing import Any, ParamSpec, TypeGuard, TypeVar

from loomopt.base.errors import refusal

PICTURE = "a path that ends in .png, .svg or .pdf", "Name a file, or leave it out"
"""Allowed paths of a picture, and the remedy for another one."""


Arguments = ParamSpec("Arguments")
Returned = TypeVar("Returned")


def renamed(**names: str) -> Callable[[Callable[Arguments, Returned]], Callable[Arguments, Returned]]:
    """Decorator that accepts former names of keyword arguments for one version, with a DeprecationWarning.

    names: today's name of each argument by its former name. The function raises BadInput where both are given.
    """

    def decorate(function: Callable[Arguments, Returned]) -> Callable[Arguments, Returned]:
        @functools.wraps(function)
        def accept(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Returned:
            for former in names.keys() & kwargs.keys():
                name = names[former]
                if name in kwargs:
                    raise refusal(f"{former} is the former name of {name}; both are given", "", name, remedy="Give one")
                text = (
                    f"the argument {former} of {function.__name__} is now {name}; the old name goes in the next version"
                )
                warnings.warn(text, DeprecationWarning, stacklevel=2)
                kwargs[name] = kwargs.pop(former)
            return function(*args, **kwargs)

        return accept

    return decorate


def number(given: object, key: str, allowed: str, remedy: str) -> float:
    """Number, of Python or of NumPy. Raises BadInput for anything else, a truth value too."""
    if isinstance(given, bool) or not isinstance(given, Real):
        raise refusal("it is not a number", "", key, given, allowed, remedy)
    try:
        return float(given)
    except OverflowError:
        raise refusal("the number is too large to compute with", "", key, given, allowed, remedy) from None


def flag(given: object, key: str, remedy: str = "Write True or False") -> bool:
    """Truth value, of Python or of NumPy. Raises BadInput for anything else, such as 1 or "yes"."""
    if isinstance(given, bool) or (type(given).__module__ == "numpy" and type(given).__name__ in ("bool", "bool_")):
        return bool(given)
    raise refusal("it is neither true nor false", "", key, given, "true, false", remedy)


def whole(given: object, key: str, allowed: str, remedy: str) -> int:
    """Whole number, of Python or of NumPy. Raises BadInput for anything else, a truth value too."""
    if isinstance(given, bool) or not isinstance(given, Integral):
        raise refusal("it is not a whole number", "", key, given, allowed, remedy)
    return int(given)


def text(given: object, key: str, allowed: str, remedy: str) -> str:
    """Text, of Python or of NumPy. Raises BadInput for anything else."""
    if not isinstance(given, str):
        raise refusal("it is not text", "", key, given, allowed, remedy)
    return str(given)


def texts(given: object, key: str, allowed: str, remedy: str) -> tuple[str, ...]:
    """Names of a sequence, in its order. Raises BadInput for anything else: a set has no order."""
    if isinstance(given, str) or not _ordered(given):
        raise refusal("it is not a list of names", "", key, given, allowed, remedy)
    return tuple(text(name, key, allowed, remedy) for name in given)


def names(given: object, key: str, allowed: str, remedy: str) -> tuple[str, ...]:
    """Names of an iterable, in its order. Raises BadInput for anything else, a single name too."""
    try:
        items = None if isinstance(given, str | bytes | Mapping) else iter(given)  # type: ignore[call-overload]
    except TypeError:
        items = None
    if items is None:
        raise refusal("it is not a list of names", "", key, given, allowed, remedy)
    return tuple(text(name, key, allowed, remedy) for name in items)


def listed(given: object, key: str, allowed: str, remedy: str) -> list[Any]:
    """Members of a sequence. Raises BadInput for anything else: a set has no order."""
    if isinstance(given, str | bytes | Mapping) or not _ordered(given):
        raise refusal("it is not a list", "", key, given, allowed, remedy)
    return list(given)


def table(given: object, key: str, allowed: str, remedy: str) -> dict[str, Any]:
    """Mapping by names. Raises BadInput for anything else."""
    if not isinstance(given, Mapping):
        raise refusal("it is not a mapping", "", key, given, allowed, remedy)
    return {text(name, key, allowed, remedy): value for name, value in given.items()}


def path(given: object, key: str, allowed: str, remedy: str) -> str:
    """Path or the name that is given. Raises BadInput for anything else."""
    if not isinstance(given, str | os.PathLike):
        raise refusal("it is not a path", "", key, given, allowed, remedy)
    return text(os.fspath(given), key, allowed, remedy)


def called(given: object, key: str, allowed: str, remedy: str) -> Callable[..., Any]:
    """Function or other callable. Raises BadInput for anything else."""
    if not callable(given):
        raise refusal("it cannot be called", "", key, given, allowed, remedy)
    return given


def _ordered(given: object) -> TypeGuard[Sequence[Any]]:
    if isinstance(given, Mapping) or not hasattr(given, "__getitem__"):
        return False
    try:
        len(given)  # type: ignore[arg-type]
    except TypeError:  # NumPy's array of no dimension
        return False
    return True
