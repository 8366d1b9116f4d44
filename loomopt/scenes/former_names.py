"""Former names of figures, accepted with a warning for one version."""

import warnings
from collections.abc import Mapping
from typing import Any

from loomopt.base.errors import FormerNameWarning, refusal

TABLES = ("limits", "accept")
"""Tables of a scene whose keys are figures."""


def current(name: str, former: Mapping[str, str]) -> str:
    """Today's name of a figure, with a FormerNameWarning for a former one; former: today's name by former name."""
    if name not in former:
        return name
    warnings.warn(f"{name} is now {former[name]}; the old name goes in the next version", FormerNameWarning, 2)
    return former[name]


def current_key(key: str, former: Mapping[str, str]) -> str:
    """Dotted key of a scene with today's name of the figure in it, such as "limits.moment.front.max"."""
    table, _, rest = key.partition(".")
    head = f"{table}."
    if table == "targets":
        head += "".join(f"{part}." for part in rest.split(".")[:2])
    elif table not in TABLES:
        return key
    end = key.removeprefix(head)
    name = next((name for name in former if f"{end}.".startswith(f"{name}.")), None)
    return key if name is None else f"{head}{current(name, former)}{end.removeprefix(name)}"


def current_document(document: Mapping[str, Any], former: Mapping[str, str], origin: str) -> Mapping[str, Any]:
    """Tables of a scene with today's names of figures; the same object if they have no former name.

    Raises BadInput if a figure has both names.
    """
    tables = {name: _keys(document[name], former, origin, name) for name in TABLES if name in document}
    if isinstance(targets := document.get("targets"), Mapping):
        tables["targets"] = {
            name: _target(target, former, origin, f"targets.{name}") for name, target in targets.items()
        }
    changed = {name: table for name, table in tables.items() if table != document[name]}
    return {**document, **changed} if changed else document


def _target(table: object, former: Mapping[str, str], origin: str, path: str) -> object:
    if not isinstance(table, Mapping):
        return table
    new_table = dict(table)
    for key in ("least", "most"):
        names = table.get(key)
        if isinstance(names, list | tuple):
            new_table[key] = [current(name, former) if isinstance(name, str) else name for name in names]
            new_table[key] = tuple(new_table[key]) if isinstance(names, tuple) else new_table[key]
    if "expected" in table:
        new_table["expected"] = _keys(table["expected"], former, origin, f"{path}.expected")
    return new_table


def _keys(table: object, former: Mapping[str, str], origin: str, path: str) -> object:
    """Table with today's names as keys; a former one may be parted at its dot, as TOML parts it."""
    if not isinstance(table, Mapping):
        return table
    new_table: dict[str, Any] = {}
    for name, value in table.items():
        parts = value if isinstance(value, Mapping) else {}
        moved = {key: f"{name}.{key}" for key in parts if f"{name}.{key}" in former}
        if name in former:
            moved, parts, name = {"": name}, {"": value}, ""
        rest = {key: entry for key, entry in parts.items() if key not in moved}
        if rest or not moved:
            new_table[name] = rest if moved else value
        for key, full in moved.items():
            now = former[full]
            head, _, tail = now.partition(".")
            if now in table or (isinstance(table.get(head), Mapping) and tail in table[head]):
                problem = f"{full} is the former name of {now}; both are given"
                raise refusal(problem, origin, f"{path}.{full}", remedy="Give one")
            new_table[current(full, former)] = parts[key]
    return new_table
