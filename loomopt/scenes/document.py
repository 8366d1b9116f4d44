"""A scene's raw tables: read from a file, copied, looked into and changed; where the files lie that it names."""

import functools
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from loomopt.base.errors import BadInput, Faults, refusal, shown
from loomopt.base.records import Frozen
from loomopt.scenes.cursor import Cursor

_DEEPEST = 8
_DOTS = 2 * _DEEPEST
"""Dots in a key that is not read: each further one costs the parser the square of those before it."""
_PART = r"""(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')[ \t]*+"""
_DEEP_KEY = re.compile(rf"(?m)(?:^|[\[{{,])[ \t]*+(?:{_PART}\.[ \t]*+){{{_DOTS}}}")
_MOST_REMEMBERED = 16
_LONGEST_NUMBER = 4096
"""Bits of a whole number that is read."""


def read_document(path: Path | str) -> Mapping[str, Any]:
    """Tables of a TOML file. Raises BadInput for a file that cannot be read as one."""
    origin = str(path)
    text = _read_text(Path(path), origin)
    try:
        if _DEEP_KEY.search(text):
            raise RecursionError
        return _tables(text)
    except tomllib.TOMLDecodeError as error:
        problem, remedy = f"it is not TOML: {str(error)[:200]}", "Correct the line"
    except RecursionError:
        problem, remedy = "its tables or lists are nested too deep", "Write a scene as `loomopt new` does"
    except ValueError:
        problem, remedy = "a whole number has too many digits", "Correct the number"
    raise refusal(problem, origin, allowed="a scene in TOML", remedy=remedy) from None


@functools.lru_cache(maxsize=_MOST_REMEMBERED)
def _tables(text: str) -> dict[str, Any]:
    return tomllib.loads(text)


def read_list_or_table(text: str) -> list[Any] | dict[str, Any] | None:
    """List or table that text is as TOML writes it in one line; None for anything else."""
    if text[:1] not in ("[", "{") or "\n" in text or _DEEP_KEY.search(text):
        return None
    try:
        value: list[Any] | dict[str, Any] = tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return None
    return value


def _read_text(path: Path, origin: str) -> str:
    """Text of a file that is regular, small and UTF-8."""
    hint = "; a packaged scene is called by its name alone: see `loomopt list`"
    try:
        return Cursor(None, "", Faults(origin)).content(path, "scene", hint).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        problem, allowed = f"it is not UTF-8 text (byte {error.start})", "a TOML file of a scene, in UTF-8"
        raise refusal(problem, origin, allowed=allowed, remedy="Save the file as UTF-8") from None


def copied(table: object, origin: str, path: tuple[str, ...] = ()) -> dict[str, Any]:
    """A copy of nested tables and lists.

    Raises BadInput for a name that is no text or empty, for endless nesting and for a number of thousands of digits.
    """
    if not isinstance(table, Mapping):
        remedy = "Give the tables of a scene: names and their values"
        raise refusal("it is not a mapping", origin, value=table, remedy=remedy)
    for name in table:
        if not isinstance(name, str):
            remedy = "Write names as text"
            raise refusal(f"a name is not text: {shown(name)}", origin, ".".join(path), remedy=remedy)
        if path and not name.strip():
            remedy = "Write a name, or take it out"
            raise refusal(f"a name is empty: {shown(name)}", origin, ".".join(path), remedy=remedy)
    return {name: _copied_value(value, origin, (*path, name)) for name, value in table.items()}


def _copied_value(value: object, origin: str, path: tuple[str, ...]) -> object:
    """Copy of a value; path: its place, with indices of lists from 1."""
    if len(path) > _DEEPEST and isinstance(value, Mapping | list | tuple):
        key, remedy = ".".join(path[:3]) + "...", "Write a scene as `loomopt new` does"
        raise refusal("its tables or lists are nested too deep", origin, key, remedy=remedy)
    if isinstance(value, Mapping):
        return copied(value, origin, path)
    if isinstance(value, list | tuple):
        items = [_copied_value(item, origin, (*path, str(k))) for k, item in enumerate(value, 1)]
        return items if isinstance(value, list) else tuple(items)
    if isinstance(value, int) and value.bit_length() > _LONGEST_NUMBER:
        raise refusal("the whole number has too many digits", origin, ".".join(path), remedy="Correct the number")
    return value


def looked_up(document: Mapping[str, Any], parts: Sequence[str]) -> object:
    """Raw value of a path of names; None where there is none."""
    value: object = document
    for part in parts:
        if isinstance(value, list):
            value = value[int(part) - 1] if _is_place(part, value) else None
            continue
        if not isinstance(value, Mapping) or part not in value:
            return None
        value = value[part]
    return value


def replaced(document: Mapping[str, Any], parts: Sequence[str], value: object, origin: str, key: str) -> dict[str, Any]:
    """Tables with the value at a path replaced; missing tables on the path are created.

    key: the whole path, for the BadInput raised where it leads through a value, or too deep.
    """
    if len(parts) > _DEEPEST + 1:
        remedy = "Name the table and the key, such as operation.M0"
        raise refusal(f"the key has {len(parts)} parts", origin, key, allowed=f"up to {_DEEPEST + 1}", remedy=remedy)
    first, *rest = parts
    if rest:
        inner = document.get(first, {})
        if isinstance(inner, list):
            return {**document, first: _replaced_in(inner, rest, value, origin, key)}
        if not isinstance(inner, Mapping):
            raise refusal(f"{first} is a value, not a table", origin, key, inner, remedy=f"Set {first} itself")
        value = replaced(inner, rest, value, origin, key)
    return {**document, first: value}


def _is_place(part: str, values: Sequence[object]) -> bool:
    """Whether a name is the place of a value of a list, counted from 1."""
    return part.isascii() and part.isdigit() and 1 <= int(part[:9]) <= len(values)


def _replaced_in(values: list[Any], parts: Sequence[str], value: object, origin: str, key: str) -> list[Any]:
    """List of tables with the value at a path replaced; the first part of the path counts from 1."""
    if not _is_place(parts[0], values):
        problem = f"the list has no place {shown(parts[0])}"
        raise refusal(problem, origin, key, allowed=f"1 to {len(values)}", remedy="Count from 1")
    place = int(parts[0]) - 1
    if parts[1:]:
        if not isinstance(values[place], Mapping):
            raise refusal("it is a value, not a table", origin, key, values[place], remedy="Set it itself")
        value = replaced(values[place], parts[1:], value, origin, key)
    return [*values[:place], value, *values[place + 1 :]]


def removed(document: Mapping[str, Any], parts: Sequence[str]) -> dict[str, Any]:
    """Tables in which the last table on a path of names has lost the last name."""
    first, *rest = parts
    if rest:
        return {**document, first: removed(document[first], rest)}
    return {key: value for key, value in document.items() if key != first}


@dataclass(frozen=True)
class Paths:
    """folder: of the scene's file, absolute; None where there is none. caller_keys: dotted keys that the caller has
    set.

    texts: of files that came with the scene, by the dotted key under which it names them.
    """

    folder: Path | None = None
    caller_keys: frozenset[str] = frozenset()
    texts: Mapping[str, str] = field(default_factory=Frozen)

    def set_by_caller(self, keys: Iterable[str]) -> "Paths":
        """The same paths with more keys that the caller has set."""
        caller_keys = self.caller_keys | {_on(key) for key in keys}
        return Paths(self.folder, caller_keys, self.texts)

    def text(self, key: str) -> str | None:
        """Text of a file that came with the scene; None where it did not, or the caller names another."""
        return None if self._is_own(_on(key)) else self.texts.get(_on(key))

    def located(self, given: str, key: str, origin: str) -> Path:
        """Path of the file that a dotted key names. Raises BadInput for a file that a scene may not name.

        A path in a scene file starts at the file's folder and, with all links resolved, must lie in it or below. A path
        of the caller starts at the working folder, then at the scene's folder.
        """
        try:
            if self.folder is None or self._is_own(_on(key)):
                path = Path(given)
                return path if self.folder is None or path.exists() else self.folder / path
            folder = self.folder.resolve()
            path = (folder / given).resolve()
        except (OSError, ValueError, RuntimeError):  # a loop of links, a name that no file can have
            problem = "the file name is invalid"
            raise refusal(problem, origin, key, given, remedy="Correct the path") from None
        if not path.is_relative_to(folder):
            raise _outside(given, key, origin)
        return path

    def _is_own(self, key: str) -> bool:
        return any(key == prefix or key.startswith(f"{prefix}.") for prefix in self.caller_keys)


def _on(key: str) -> str:
    """Key of a value once its effect is on: values from [available] move to [effects]."""
    table, dot, rest = key.partition(".")
    return f"effects{dot}{rest}" if table == "available" else key


def _outside(given: str, key: str, origin: str) -> BadInput:
    return refusal(
        "a scene may name files in its own folder only",
        origin,
        key,
        given,
        allowed="a file beside the scene's file, or in a folder below",
        remedy=f"Put it there, or name it in the call: --set {key}=PATH",
    )
