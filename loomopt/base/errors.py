"""The one error a user can cause.

Text from outside is shortened, and stripped of whatever a terminal would obey.
"""

import difflib
from collections.abc import Iterable, Sequence

from pydantic import BaseModel, ValidationError

from loomopt.base.quantities import described, quantity_of
from loomopt.base.units import QuantityError

_LONGEST = {"file": 240, "key": 190, "problem": 480, "value": 120, "allowed": 480, "remedy": 240}
"""Characters of each part, so that a message is read."""


def clean(text: str, longest: int = 1000) -> str:
    """Return text without control characters, shortened to about `longest` characters."""
    ending = f"... ({len(text)} characters)" if len(text) > longest else ""
    kept = text[:longest]
    if not kept.isprintable():
        kept = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in kept)[:longest]
    return kept + ending


class BadInput(ValueError):  # noqa: N818 (it names what happened; users catch it by this name)
    """Input that cannot be worked with, as one plain message.

    file: where it stands; key: dotted path; value: as given; allowed: what may stand there; remedy: what to do.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: str = "",
        key: str = "",
        value: str = "",
        allowed: str = "",
        remedy: str = "",
    ) -> None:
        self.problem, self.file, self.key = problem, file, key
        self.value, self.allowed, self.remedy = value, allowed, remedy
        parts = {"file": file, "key": key, "problem": problem, "value": value, "allowed": allowed, "remedy": remedy}
        file, key, problem, value, allowed, remedy = (clean(text, _LONGEST[name]) for name, text in parts.items())
        place = ": ".join(part for part in (file, key) if part)
        shown = f" (given: {value})" if value else ""
        sentences = [f"{problem}{shown}", f"Allowed: {allowed}" if allowed else "", remedy]
        text = " ".join(sentence.rstrip(".") + "." for sentence in sentences if sentence)
        super().__init__(f"{place}: {text}" if place else text)


_LONGEST_VALUE, _LONGEST_PART = 80, 450
_NOTHING = object()
_PROBLEMS = {
    "dict_type": "it is not a table",
    "string_type": "it is not text",
    "bool_type": "it is neither true nor false",
    "bool_parsing": "it is neither true nor false",
    "int_type": "it is not a whole number",
    "int_parsing": "it is not a whole number",
    "int_from_float": "it is not a whole number",
    "greater_than": "it is out of range",
    "greater_than_equal": "it is out of range",
    "less_than": "it is out of range",
    "less_than_equal": "it is out of range",
}
_BOUNDS = {"gt": "more than", "ge": "at least", "lt": "less than", "le": "at most"}
"""How pydantic names the bounds of a field → in words."""


def shown(value: object) -> str:
    """Return a scene's raw value as it would be written, shortened."""
    if isinstance(value, str):
        return f'"{clean(value, _LONGEST_VALUE)}"'
    if isinstance(value, bool) or value is None:
        return str(value).lower()
    if isinstance(value, int) and value.bit_length() > 256:
        return "a huge whole number"
    if isinstance(value, dict | list | tuple):
        return "a table" if isinstance(value, dict) else "a list"
    return clean(str(value), _LONGEST_VALUE) if isinstance(value, int | float) else type(value).__name__


def refusal(
    problem: str, origin: str, key: str = "", value: object = _NOTHING, allowed: str = "", remedy: str = ""
) -> BadInput:
    """Return the error for one problem; value: as given, where one is given."""
    return BadInput(
        clean(problem, _LONGEST_PART),
        file=clean(origin, _LONGEST_PART),
        key=clean(key, 2 * _LONGEST_VALUE),
        value="" if value is _NOTHING else shown(value),
        allowed=clean(allowed, _LONGEST_PART),
        remedy=clean(remedy, _LONGEST_PART),
    )


def unknown(
    what: str,
    name: str,
    known: Iterable[str],
    origin: str,
    key: str,
    remedy: str = "Correct the name or take it out",
) -> BadInput:
    """Return the error for a name nobody knows, with the nearest known one; what: "key", "effect", …

    remedy: where none is near.
    """
    names = list(known)
    near = difflib.get_close_matches(name[:_LONGEST_VALUE], names, n=1, cutoff=0.5)
    remedy = f'Perhaps "{near[0]}" is meant' if near else remedy
    return refusal(f"unknown {what} {shown(name)}", origin, key, allowed=", ".join(names) or "none", remedy=remedy)


def misread(error: QuantityError, origin: str, key: str, value: object) -> BadInput:
    """Return the error for a value that is not the quantity asked for."""
    return refusal(error.problem, origin, key, value, error.allowed, error.remedy)


def missing(model: type[BaseModel], origin: str, table: str, name: str, needed: str = "") -> BadInput:
    """Return the error for a key that a table lacks; needed: what needs it."""
    quantity = quantity_of(model, name)
    sort = described(quantity.kind) if quantity else "text"
    problem = f"{name} is missing{': ' if needed else ''}{needed}"
    return refusal(problem, origin, f"{table}.{name}", allowed=sort, remedy=f"Add {name} to [{table}]")


def invalid(error: ValidationError, model: type[BaseModel], origin: str, table: str) -> BadInput:
    """Return the error for the first thing pydantic found wrong with a table."""
    first = error.errors(include_url=False)[0]
    # Places in a list count from 1, as a caller's keys do.
    names = [str(name + 1 if isinstance(name, int) else name) for name in first["loc"]]
    if first["type"] == "missing" and len(names) == 1:
        return missing(model, origin, table, names[0])
    key, value = ".".join((table, *names)), first["input"]
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, QuantityError):
        return misread(cause, origin, key, value)
    allowed = str(first.get("ctx", {}).get("expected", "")).replace("'", '"')
    problem = "it is none of the known choices" if allowed else _PROBLEMS.get(first["type"], first["msg"])
    return refusal(problem, origin, key, value, allowed or _bounds(model, names), "Correct the value")


def _bounds(model: type[BaseModel], names: Sequence[str]) -> str:
    """Return within what a field of a table may lie, where it has bounds of its own."""
    field = model.model_fields.get(names[0]) if len(names) == 1 else None
    if field is None:
        return ""
    known = ((word, getattr(each, name, None)) for name, word in _BOUNDS.items() for each in field.metadata)
    found = [f"{word} {bound}" for word, bound in known if bound is not None]
    return ", ".join([*(["a whole number"] if field.annotation is int else []), *found])
