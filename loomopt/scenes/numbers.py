"""Input of a study: the numbers of a scene by dotted key, and the files that it names."""

import contextlib
import re
from collections.abc import Iterator, Mapping
from decimal import Decimal, localcontext
from typing import TYPE_CHECKING, Any

from loomopt.base.errors import BadInput, refusal, unknown
from loomopt.base.quantities import Quantity, plain_number, quantity_of
from loomopt.physics.effects.kinds import label
from loomopt.physics.schema import Table
from loomopt.scenes import table_cells
from loomopt.scenes.scene import Scene, cursor, places

if TYPE_CHECKING:
    from loomopt.scenes.sizes import Sizes

WITHOUT_FILES = ("problem", "display")
"""Tables whose texts are never names of files."""


def quantity(scene: Scene, key: str) -> Quantity:
    """Quantity of the number under a dotted key. Raises BadInput where the scene has no number there."""
    known = dict(_quantities(scene))
    table = key.rpartition(".")[0]  # such as a target's weights, each number of which has a name of its own
    if key in known or (table in known and scene.given(key) is not None):
        return known.get(key) or known[table]
    if scene.given(key) is not None:
        remedy = "Vary a number, such as operation.speed"
        raise refusal("it is not a number", scene.origin, key, scene.given(key), remedy=remedy)
    raise unknown("number", key, known, scene.origin, key)


def _quantities(scene: Scene) -> Iterator[tuple[str, Quantity]]:
    """Yield the dotted key of every number that a scene may have, with its quantity."""
    schema, labels = scene.schema, {name: Quantity(kind) for name, kind in scene.schema.variables.items()}
    for table, model in (("operation", schema.operation), ("mechanism", schema.mechanism)):
        for key, quantity in _fields(model):
            yield f"{table}.{key}", quantity
            labels.setdefault(key, quantity)
        for key, value in scene.tables[table]:
            if isinstance(value, tuple) and value and isinstance(value[0], Table):
                for k, item in enumerate(value, 1):
                    for name, quantity in _fields(type(item)):
                        if getattr(item, name) is not None:
                            yield f"{table}.{key}.{k}.{name}", quantity
    for effect in scene.active:
        for key, quantity in _fields(effect.table):
            yield ".".join(("effects", *effect.path, key)), quantity
            if getattr(scene.effects[effect.name], key) is not None:
                labels.setdefault(label(effect, key), quantity)
    for name, target in schema.targets.items():
        for key, quantity in _fields(target.table):
            yield f"targets.{name}.{key}", quantity
    for name in scene.bounds:
        for place in (f"bounds.{name}", f"bounds.{name}.min", f"bounds.{name}.max"):
            yield place, labels[name]
    for name, limit in scene.limits.items():
        for side in ("min", "max"):
            if getattr(limit, side) is not None:
                yield f"limits.{name}.{side}", Quantity(schema.figures[name].kind)


def _fields(model: type[Table]) -> Iterator[tuple[str, Quantity]]:
    for key in model.model_fields:
        quantity = quantity_of(model, key)
        if quantity:
            yield key, quantity


def files(scene: Scene) -> dict[str, str]:
    """SHA-256 of every file that a scene names, by the dotted key of its name."""
    import hashlib

    return {key: hashlib.sha256(raw).hexdigest() for key, raw in _contents(scene)}


def tables(scene: Scene) -> dict[str, str]:
    """Tables of the files that a scene names as CSV text, by the dotted key of the name; huge files are left out."""
    texts: dict[str, str] = {}
    for key, raw in _contents(scene, table_cells.ENDINGS):
        with contextlib.suppress(BadInput):
            text = table_cells.text(raw, key)
            texts |= {key: text} if len(text) <= LARGEST_TABLE else {}
    return texts


def _contents(scene: Scene, endings: tuple[str, ...] = ("",)) -> Iterator[tuple[str, bytes]]:
    """Yield the contents of files that a scene names or contains, by the dotted key of the name."""
    for key, text in _texts({name: value for name, value in scene.document.items() if name not in WITHOUT_FILES}):
        if not text.lower().endswith(endings):
            continue
        with contextlib.suppress(BadInput, OSError, ValueError):  # what can be no file's name is none
            content = scene.paths.text(key)
            path = None if content is not None else scene.paths.located(text, key, scene.origin)
            if content is not None:
                yield key, content.encode()
            elif path and path.is_file():
                yield key, path.read_bytes()


def _texts(table: Mapping[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[str, str]]:
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _texts(value, (*path, name))
        elif isinstance(value, str):
            yield ".".join((*path, name)), value


LARGEST_TABLE = 200_000
"""Bytes of a table that goes with an answer: of as many rows as are read, each as long as a row is."""
MOST_VALUES = 20_000
"""Points of a study."""
_RANGE = re.compile(r"([^:\s]+) *: *([^:\s]+) *: *([^:\s]+)(?: +(\S.*))?")
_ENDS = re.compile(r"([^:\s]+) *: *([^:\s]+)(?: +(\S.*))?")
FORM, EXAMPLE = "LO:HI:STEP UNIT", "600:900:25 N*m"
_ALLOWED = f"{FORM}, such as {EXAMPLE}"


def range_values(text: str, key: str) -> list[str]:
    """LO, LO + STEP, … and HI of "LO:HI:STEP UNIT", each as text with the unit; digits are exact.

    Where the steps do not meet HI the last one is shorter. Raises BadInput.
    """
    match = _RANGE.fullmatch(text.strip())
    numbers = [number for number in (match.groups()[:3] if match else ()) if plain_number(number) is not None]
    if match is None or len(numbers) < 3:
        raise _refused("it is no range of numbers", key, text)
    low, high, step = map(Decimal, numbers)
    if step <= 0 or high < low:
        raise _refused("the range has no step forward", key, text, "Write the smaller end first, and a step above 0")
    with localcontext(prec=200):
        if (high - low) / step > MOST_VALUES:
            raise _refused(f"the range has more than {MOST_VALUES} values", key, text, "Write a larger step")
        steps = [low + k * step for k in range(int((high - low) / step) + 1)]
        steps += [high] if steps[-1] < high else []
        texts = [f"{value.normalize():f}" for value in steps]
    return [f"{number} {match[4]}" if match[4] else number for number in texts]


def range_ends(text: str, key: str) -> tuple[str, str]:
    """LO and HI of "LO:HI UNIT", each as text with the unit. Raises BadInput."""
    match = _ENDS.fullmatch(text.strip())
    if match is None or None in map(plain_number, match.groups()[:2]):
        raise _refused("it is no range of numbers", key, text, allowed="LO:HI UNIT, such as 0:5 kg")
    low, high = (f"{number} {match[3]}" if match[3] else number for number in match.groups()[:2])
    return low, high


def _refused(problem: str, key: str, text: str, remedy: str = "Correct the range", allowed: str = _ALLOWED) -> BadInput:
    return refusal(problem, "", key, text, allowed, remedy)


def sizes(scene: Scene) -> "Sizes":
    """Sizes of a scene that can be ordered. Raises BadInput."""
    from loomopt.scenes import sizes as ordered

    tables = cursor(scene)
    size_tables = ordered.read(tables, scene.schema, places(scene))
    tables.faults.tell()
    return size_tables
