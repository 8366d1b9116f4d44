"""Cache and counters that solves share; one thread computes at a time.

CasADi counts the references to its expressions without a lock, and all expressions share some of theirs.
"""

import contextlib
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextvars import ContextVar
from typing import TypeVar, cast

from loomopt.base.errors import naming

Made = TypeVar("Made")

LOCK = threading.RLock()
"""Held by the thread that computes, whatever its session: what CasADi's expressions share, all sessions do."""


class Session:
    """Cache, and the number of evaluated positions of mechanisms, by samples, nodes and boxes."""

    def __init__(self) -> None:
        self.positions = 0
        self._values: dict[str, OrderedDict[Hashable, object]] = {}
        self._values_by_owner: weakref.WeakKeyDictionary[object, dict[Hashable, object]] = weakref.WeakKeyDictionary()

    def cached(self, kind: str, most: int, key: Hashable, make: Callable[[], Made]) -> Made:
        """Cached value of a key, made where it is missing; beyond `most` values the least recently used is dropped.

        kind: the kind of value, of which `most` are cached.
        """
        with LOCK:
            values = self._values.setdefault(kind, OrderedDict())
            if key in values:
                values.move_to_end(key)
            else:
                values[key] = make()
                if len(values) > most:
                    values.popitem(last=False)
            return cast(Made, values[key])

    def cached_for(self, owner: object, key: Hashable, make: Callable[[], Made]) -> Made:
        """Cached value of an owner by a key, made where it is missing; it is dropped with its owner."""
        with LOCK:
            values = self._values_by_owner.setdefault(owner, {})
            if key not in values:
                values[key] = make()
            return cast(Made, values[key])

    def latest(self, kind: str) -> Iterator[object]:
        """Yield the cached values of one kind, the last used first."""
        return reversed(self._values.get(kind, OrderedDict()).values())

    def count(self, kind: str) -> int:
        """Number of cached values."""
        return len(self._values.get(kind, ()))

    def forget(self, *sorts: str) -> None:
        """Drop the cached values of these kinds."""
        for kind in sorts:
            self._values.pop(kind, None)


OF_PROCESS = Session()
"""Where a thread computes that has entered no other: so a sweep finds the NLPs that a solve has built."""
_CURRENT = ContextVar[Session | None]("session", default=None)


def current() -> Session:
    """Session in which this thread computes."""
    return _CURRENT.get() or OF_PROCESS


@contextlib.contextmanager
def working(session: Session | None = None) -> Iterator[Session]:
    """Compute in a session, the current one by default, with the lock that keeps other threads out; yields the session.

    A thread that holds the lock may call it again, as a solve within a solve does. If the code of another distribution
    fails, BadInput names the distribution. NumPy's warnings of numbers that are not finite are off: a search evaluates
    designs that do not assemble, and its readers test for such numbers.
    """
    # Every computation imports NumPy; the commands that only read a scene do not.
    import numpy as np

    with LOCK, naming(), np.errstate(all="ignore"):
        token = _CURRENT.set(session or current())
        try:
            yield current()
        finally:
            _CURRENT.reset(token)
