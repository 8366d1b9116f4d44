"""Two keys for one number of a scene: either is read, and both together only if they give the same value."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from loomopt.base import quantities
from loomopt.base.errors import refusal
from loomopt.base.units import QuantityError
from loomopt.scenes.document import looked_up, removed, replaced


class Synonym(NamedTuple):
    """Two keys, `name` and `other`, for one number of a kind; without_other: whether the job reads `name` only."""

    name: str
    other: str
    kind: str
    without_other: bool


def current_key(key: str, synonyms: tuple[Synonym, ...], document: Mapping[str, Any]) -> str:
    """Key under which the tables give the number of a key."""
    for synonym in synonyms:
        if key == synonym.other and (synonym.without_other or _given(document, synonym.name)):
            return synonym.name
        if key == synonym.name and not synonym.without_other and _given(document, synonym.other):
            return synonym.other
    return key


def keys_of(name: str, synonyms: tuple[Synonym, ...], document: Mapping[str, Any]) -> list[str]:
    """Keys of the tables whose other key ends in a name."""
    keys = (key for synonym in synonyms for key in (synonym.name, synonym.other) if key.rpartition(".")[2] == name)
    return list(dict.fromkeys(current_key(key, synonyms, document) for key in keys))


def current_values(
    values: Mapping[str, object], synonyms: tuple[Synonym, ...], document: Mapping[str, Any], origin: str
) -> dict[str, object]:
    """Values by the keys under which the tables give them. Raises BadInput where two keys of one number differ."""
    result: dict[str, object] = {}
    for key, value in values.items():
        name = current_key(key, synonyms, document)
        if name in result:
            synonym = next(item for item in synonyms if name in (item.name, item.other))
            _compare(synonym, result[name], value, origin)
        result[name] = value
    return result


def current_document(document: Mapping[str, Any], synonyms: tuple[Synonym, ...], origin: str) -> Mapping[str, Any]:
    """Tables with one key for each number; the same object where they are so. Raises BadInput where both differ."""
    for synonym in synonyms:
        other = looked_up(document, synonym.other.split("."))
        if other is None:
            continue
        first = looked_up(document, synonym.name.split("."))
        if first is not None:
            _compare(synonym, first, other, origin)
        elif synonym.without_other:
            document = replaced(document, synonym.name.split("."), other, origin, synonym.name)
        else:
            continue
        document = removed(document, synonym.other.split("."))
    return document


def _given(document: Mapping[str, Any], key: str) -> bool:
    return looked_up(document, key.split(".")) is not None


def _compare(synonym: Synonym, first: object, other: object, origin: str) -> None:
    """Raise BadInput where two values of one number differ, or one of them cannot be read."""
    values = []
    for key, value in ((synonym.name, first), (synonym.other, other)):
        try:
            values.append(quantities.read(value if isinstance(value, str) else repr(value), synonym.kind))
        except QuantityError as error:
            raise refusal(error.problem, origin, key, value, error.allowed, error.remedy) from None
    if values[0] != values[1]:
        problem = f"{synonym.name} and {synonym.other} are one number, and {first} and {other} differ"
        raise refusal(problem, origin, synonym.other, remedy="Give one of them")
