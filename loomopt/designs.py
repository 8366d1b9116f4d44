"""Designs from files: the JSON of a `design` object, or of a whole answer."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from loomopt.errors import BadInput
from loomopt.owned import label
from loomopt.quantities import Quantity, quantity_of
from loomopt.scene_errors import refusal, unknown
from loomopt.scenes import Scene

LARGEST_FILE = 1_000_000
"""Bytes; an answer has a few thousand."""
LONGEST = 1000
"""Numbers in a list."""
LARGEST = 1e60
"""SI; fourth powers of it are still numbers."""
Design = Mapping[str, float | Sequence[float]]
"""A design by label, SI and rad; parts of it may be lists of numbers."""
_ALLOWED = "a finite number in SI units, not negative"
_GIVE = "Give an answer's design, or a part of it"
_GIVE_FILE = "Give the JSON that `loomopt solve --json` prints, or its design object"


def read(path: Path, scene: Scene) -> dict[str, float]:
    """Return the design in a JSON file, SI and rad, by design variable. Raises BadInput."""
    data = loaded(path)
    return checked(data["design"] if isinstance(data, dict) and "design" in data else data, scene, str(path))


def loaded(path: Path) -> object:
    """Return what a JSON file of a design or an answer holds, unchecked. Raises BadInput."""
    import json

    origin = str(path)
    try:
        if not path.is_file():
            what = "it is no ordinary file" if path.exists() else "there is no such file"
            raise refusal(f"the design cannot be read: {what}", origin, remedy="Correct the path")
        if path.stat().st_size > LARGEST_FILE:
            raise refusal("the file is too large for a design", origin, allowed="up to 1 MB", remedy=_GIVE_FILE)
        found: object = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        reason = error.strerror or str(error)
        raise refusal(f"the design cannot be read: {reason}", origin, remedy="Check the path") from None
    except BadInput:
        raise
    except (ValueError, RecursionError):
        raise refusal("the file is not JSON", origin, remedy=_GIVE_FILE) from None
    return found


def packed(design: Mapping[str, float], names: Iterable[str]) -> dict[str, float | Sequence[float]]:
    """Return a design with NAME_0, NAME_1 ... of each named list as one tuple."""
    found: dict[str, float | Sequence[float]] = dict(design)
    for name in names:
        members = {k: key for key in design if (k := _place(key, name)) is not None}
        if members:
            found = {key: value for key, value in found.items() if key not in members.values()}
            found[name] = tuple(design[members[k]] for k in sorted(members))
    return found


def flat(design: Design) -> dict[str, float]:
    """Return a design with each list's numbers under names of their own, NAME_0, NAME_1 ..."""
    found: dict[str, float] = {}
    for name, value in design.items():
        found |= {name: value} if isinstance(value, float | int) else {f"{name}_{k}": v for k, v in enumerate(value)}
    return found


def _place(key: str, name: str) -> int | None:
    number = key.removeprefix(f"{name}_")
    return int(number) if number != key and number.isdigit() else None


def checked(data: object, scene: Scene, origin: str = "<design>") -> dict[str, float]:
    """Return a design given as a mapping, SI and rad, after checking names, numbers and assembly. Raises BadInput."""
    kinds = _numbers(scene)
    lists = {name: Quantity(kind) for name, kind in scene.schema.lists.items()}
    if not isinstance(data, Mapping) or not data:
        known = ", ".join(scene.schema.variables)
        raise refusal("there is no design", origin, allowed=f"an object of {known}, SI", remedy=_GIVE)
    data = {name: value for name, value in data.items() if name not in lists} | _listed(data, lists, origin)
    for name, value in data.items():
        listed = next((lists[of] for of in lists if _place(str(name), of) is not None), None)
        if listed:
            kinds[name] = listed
        if name not in kinds:
            raise unknown("design variable", str(name), [*kinds, *lists], origin, f"design.{name}")
        number = not isinstance(value, bool) and isinstance(value, int | float) and abs(value) < LARGEST
        if not number or not _fits(kinds[name], value):
            allowed = f"{_ALLOWED}; {kinds[name].range}" if number else _ALLOWED
            raise refusal("no design can have it", origin, f"design.{name}", value, allowed, "Correct the number")
    design = {name: float(value) for name, value in data.items()}
    fault = scene.schema.fault({**scene.mechanism, **design})
    if fault:
        raise refusal(f"the design does not assemble: {fault}", origin, "design", remedy="Correct its lengths")
    return design


def _listed(data: Mapping[str, Any], lists: Mapping[str, Quantity], origin: str) -> dict[str, Any]:
    """Return the numbers of a design's lists, each under a name of its own. Raises BadInput."""
    found: dict[str, Any] = {}
    for name in lists:
        values = data.get(name, [])
        if not isinstance(values, list | tuple) or len(values) > LONGEST:
            allowed = f"a list of up to {LONGEST} numbers"
            raise refusal("it is not such a list", origin, f"design.{name}", allowed=allowed, remedy=_GIVE)
        found |= {f"{name}_{k}": value for k, value in enumerate(values)}
    return found


def _numbers(scene: Scene) -> dict[str, Quantity]:
    """Return what kind of quantity each number of a scene is that a design may hold."""
    found: dict[str, Quantity | None] = {}
    for model in (scene.schema.mechanism, scene.schema.operation):
        found |= {name: quantity_of(model, name) for name in model.model_fields}
    for effect in scene.active:
        found |= {label(effect, key): quantity_of(effect.own, key) for key in effect.own.model_fields}
    first = {name: found[name] for name in scene.schema.variables}
    return {name: quantity for name, quantity in {**first, **found}.items() if quantity}


def _fits(quantity: Quantity, value: float) -> bool:
    """Say whether a number in SI lies in its quantity's range."""
    return value >= quantity.least and quantity.above < value < quantity.below
