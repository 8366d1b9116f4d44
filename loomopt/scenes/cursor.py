"""Cursor on the raw tables of a scene: a value, its key, and the list of mistakes.

Every reader of a table gets a cursor. Mistakes are built here, so that all messages name file and key in the same way.
"""

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from loomopt.base import errors
from loomopt.base.errors import GAP, NOTHING, SAME, VALUE, WHOLE, BadInput, Faults, near_file, nearest, refusal, shown
from loomopt.base.quantities import Quantity, described, quantity_of
from loomopt.base.units import QuantityError

_Model = TypeVar("_Model", bound=BaseModel)
_NAN = float("nan")
LARGEST_FILE = 1_000_000
"""Bytes of a scene, design or table; an answer has a few thousand."""
_PROBLEMS = {
    "dict_type": ("it is not a table", "a table"),
    "model_type": ("it is not a table", "a table"),
    "tuple_type": ("it is not a list", "a list"),
    "list_type": ("it is not a list", "a list"),
    "string_type": ("it is not text", "text in quotes"),
    "bool_type": ("it is neither true nor false", "true, false"),
    "bool_parsing": ("it is neither true nor false", "true, false"),
    "int_type": ("it is not a whole number", "a whole number"),
    "int_parsing": ("it is not a whole number", "a whole number"),
    "int_parsing_size": ("it is not a whole number", "a whole number"),
    "int_from_float": ("it is not a whole number", "a whole number"),
    "greater_than": ("it is out of range", ""),
    "greater_than_equal": ("it is out of range", ""),
    "less_than": ("it is out of range", ""),
    "less_than_equal": ("it is out of range", ""),
    "finite_number": ("it is not a finite number", "a finite number"),
    "string_pattern_mismatch": ("it is empty", "a name in quotes"),
    "extra_forbidden": ("unknown key", ""),
}
"""Type of a pydantic error → the mistake in words, and what is allowed."""
_LIMITS = {"gt": "more than", "ge": "at least", "lt": "less than", "le": "at most"}
"""pydantic's names of a field's limits → in words."""


class Cursor(NamedTuple):
    """Value in a file, and its place.

    raw: the value as TOML or JSON gives it, None if the key is missing; path: its dotted key, "" for the whole file;
    faults: the list of mistakes, which knows the name of the file.
    """

    raw: object
    path: str
    faults: Faults

    def at(self, key: str | int) -> "Cursor":
        """Cursor on an entry of the table, or of the list; list entries count from 1."""
        path = f"{self.path}.{key}" if self.path else str(key)
        raw = self.raw
        if isinstance(key, int):
            return Cursor(raw[key - 1] if isinstance(raw, list | tuple) else None, path, self.faults)
        return Cursor(raw.get(key) if isinstance(raw, Mapping) else None, path, self.faults)

    def entries(self, values: Mapping[str, object] | None = None) -> dict[str, "Cursor"]:
        """Cursors on the entries of the table, or on other values of its keys, by key. Raises BadInput for no table."""
        start = f"{self.path}." if self.path else ""
        inner = self.table() if values is None else values
        return {key: Cursor(value, f"{start}{key}", self.faults) for key, value in inner.items()}

    def apart(self) -> "Cursor":
        """Same place with an empty list of mistakes, for a reader that raises its mistakes together."""
        return self._replace(faults=Faults(self.faults.file))

    @property
    def label(self) -> str:
        """Key inside the outermost table: rod.m of bounds.rod.m."""
        return self.path.partition(".")[2]

    # Mistakes.

    def fault(
        self, problem: str, value: object = NOTHING, allowed: str = "", remedy: str = "", grade: int = VALUE
    ) -> BadInput:
        """Mistake at this place; value: value that the message repeats, if any; grade: severity."""
        return refusal(problem, self.faults.file, self.path, value, allowed, remedy, grade)

    def unknown(
        self,
        sort: str,
        name: str,
        known: Iterable[str],
        remedy: str = "Correct the name or take it out",
        given: Collection[str] = (),
    ) -> BadInput:
        """Mistake: unknown name; sort: kind of thing that is named; other arguments as in `errors.unknown`."""
        return errors.unknown(sort, name, known, self.faults.file, self.path, remedy, given)

    def missing(self, model: type[BaseModel], key: str, reason: str = "") -> BadInput:
        """Mistake: missing key of a table; reason: job or effect that needs the key."""
        quantity = quantity_of(model, key)
        allowed = described(quantity.kind) if quantity else "text"
        problem = f"{key} is missing{': ' if reason else ''}{reason}"
        return self.at(key).fault(problem, allowed=allowed, remedy=f"Add {key} to [{self.path}]", grade=GAP)

    # Values.

    def table(self) -> Mapping[str, Any]:
        """The value as a table. Raises BadInput."""
        if not isinstance(self.raw, Mapping):
            raise self.fault("it is not a table", self.raw, "a table", f"Write a table [{self.path}]", WHOLE)
        return self.raw

    def number(self, quantity: Quantity) -> float:
        """The value as a number of a quantity, SI. Raises BadInput."""
        try:
            return quantity.validate(self.raw)
        except QuantityError as error:
            raise errors.misread(error, self.faults.file, self.path, self.raw) from None

    def content(self, path: Path, kind: str, hint: str = "") -> bytes:
        """Bytes of a file that the value names; kind: of file, in words; hint: advice if the file does not exist.

        Raises BadInput for what is no ordinary file, cannot be read or is larger than 1 MB.
        """
        problem, allowed, remedy = "", "", "Name a file"
        try:
            if path.is_dir():
                problem, remedy = "it is a folder, not an ordinary file", "Name the file in it"
            elif not path.exists():
                near = near_file(path)
                near = str(Path(self.raw).with_name(Path(near).name)) if near and isinstance(self.raw, str) else near
                problem, remedy = (
                    "the file does not exist",
                    f'Perhaps "{near}" is meant' if near else "Correct the path",
                )
                remedy += hint
            elif not path.is_file():
                problem = "it is not an ordinary file"
            else:
                with path.open("rb") as file:
                    raw = file.read(LARGEST_FILE + 1)
                if len(raw) <= LARGEST_FILE:
                    return raw
                problem, allowed, remedy = "the file is too large", "up to 1 MB", "Check that this is the file you mean"
        except (OSError, ValueError) as error:
            problem, remedy = getattr(error, "strerror", None) or str(error), "Check the path and its permissions"
        value = NOTHING if self.raw is None else self.raw
        name = "" if self.raw is None else f" {path.name}"
        raise self.fault(f"the {kind}{name} cannot be read: {problem}", value, allowed, remedy)

    def word(self, known: Collection[str], sort: str) -> str:
        """The value as one of the known words; sort: kind of thing that is named. Raises BadInput."""
        if not isinstance(self.raw, str) or self.raw not in known:
            raise self.unknown(sort, self.raw if isinstance(self.raw, str) else shown(self.raw), known)
        return self.raw

    def check_keys(self, keys: Collection[str], known: Collection[str], sort: str = "key") -> None:
        """Add a mistake for every unknown key; sort: kind of thing that the keys name."""
        for key in keys:
            if key not in known:
                self.faults.add(self.at(key).unknown(sort, key, known, given=keys))

    def subtables(self, known: Collection[str], sort: str) -> dict[str, "Cursor"]:
        """Tables inside the table; an unknown name is read as the similar known name that is missing."""
        with self.faults:
            given = self.table()
            self.check_keys(given, known, sort)
            near = {nearest(name, known, given, SAME): values for name, values in given.items() if name not in known}
            return self.entries(near | dict(given))
        return {}

    def record(self, model: type[_Model]) -> _Model:
        """Table as its model, with NaN for values that cannot be read.

        An unknown key is read as the missing key of a similar name: this is one mistake, not two.
        """
        fields = model.model_fields
        try:
            given = self.table()
        except BadInput as error:
            self.faults.add(error)
            return _readable({}, model).model_copy(update=dict.fromkeys(fields, _NAN))
        known = {name: value for name, value in given.items() if name in fields}
        near = {nearest(name, fields, given) for name in given if name not in fields} - {"", *known}
        unread = dict.fromkeys(near, _NAN)
        self.check_keys(given, fields)
        try:
            read = model.model_validate(known)
        except ValidationError as error:
            for detail in error.errors(include_url=False):
                name = str(detail["loc"][0])
                if detail["type"] != "missing" or len(detail["loc"]) > 1 or name not in near:
                    self.faults.add(self._invalid(detail, model))
                unread[name] = _NAN
            read = _readable({name: value for name, value in known.items() if name not in unread}, model)
        return read.model_copy(update=unread) if unread else read

    def _invalid(self, error: ErrorDetails, model: type[BaseModel]) -> BadInput:
        """Mistake that pydantic finds in a table."""
        # Places in a list count from 1, as a caller's keys do.
        names = [str(name + 1 if isinstance(name, int) else name) for name in error["loc"]]
        if error["type"] == "missing" and len(names) == 1:
            return self.missing(model, names[0])
        place, value = Cursor(error["input"], ".".join((self.path, *names)), self.faults), error["input"]
        cause = error.get("ctx", {}).get("error")
        if isinstance(cause, QuantityError):
            return place.fault(cause.problem, value, cause.allowed, cause.remedy)
        choices = str(error.get("ctx", {}).get("expected", "")).replace("'", '"')
        if choices:
            return place.fault("unknown choice", value, choices, "Correct the value")
        problem, allowed = _PROBLEMS.get(error["type"], (error["msg"], ""))
        remedy = f"Write [{shown(value)}]" if allowed == "a list" and isinstance(value, str) else "Correct the value"
        return place.fault(problem, value, _limits(model, names) or allowed, remedy)


def _readable(values: Mapping[str, Any], model: type[_Model]) -> _Model:
    """Record of the readable values; other requirements of the model are not checked."""
    try:
        return model.model_validate(values)
    except ValidationError:
        return model.model_construct(**values)


def _limits(model: type[BaseModel], names: list[str]) -> str:
    """Limits of a field in words; "" without limits."""
    field = model.model_fields.get(names[0]) if len(names) == 1 else None
    if field is None:
        return ""
    limits = (
        (word, getattr(constraint, name, None)) for name, word in _LIMITS.items() for constraint in field.metadata
    )
    words = [f"{word} {limit}" for word, limit in limits if limit is not None]
    return ", ".join([*(["a whole number"] if field.annotation is int else []), *words])
