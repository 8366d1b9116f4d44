"""Designs from files: the JSON of a `design` object, or of a whole answer."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from loomopt.errors import BadInput
from loomopt.quantities import Quantity, quantity_of
from loomopt.scene_errors import refusal, unknown

LARGEST_FILE = 1_000_000
"""Bytes; an answer has a few thousand."""
LARGEST = 1e60
"""SI; fourth powers of it are still numbers."""
_ALLOWED = "a finite number in SI units, not negative"
_GIVE = "Give the JSON that `loomopt solve --json` prints, or its design object"


def read(path: Path, scene: Any) -> dict[str, float]:
    """Return the design in a JSON file, SI and rad, by design variable. Raises BadInput."""
    origin = str(path)
    try:
        if not path.is_file():
            what = "it is no ordinary file" if path.exists() else "there is no such file"
            raise refusal(f"the design cannot be read: {what}", origin, remedy="Correct the path")
        if path.stat().st_size > LARGEST_FILE:
            raise refusal("the file is too large for a design", origin, allowed="up to 1 MB", remedy=_GIVE)
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        reason = error.strerror or str(error)
        raise refusal(f"the design cannot be read: {reason}", origin, remedy="Check the path") from None
    except BadInput:
        raise
    except (ValueError, RecursionError):
        raise refusal("the file is not JSON", origin, remedy=_GIVE) from None
    if isinstance(data, dict) and "design" in data:
        data = data["design"]
    return checked(data, scene, origin)


def checked(data: Any, scene: Any, origin: str = "<design>") -> dict[str, float]:
    """Return a design given as a mapping, SI and rad, after checking names, numbers and assembly. Raises BadInput."""
    kinds = _numbers(scene)
    if not isinstance(data, Mapping) or not data:
        known = ", ".join(scene.job.variables)
        raise refusal("there is no design", origin, allowed=f"an object of {known}, SI", remedy=_GIVE)
    for name, value in data.items():
        if name not in kinds:
            raise unknown("design variable", str(name), list(kinds), origin, f"design.{name}")
        number = not isinstance(value, bool) and isinstance(value, int | float) and abs(value) < LARGEST
        if not number or not _fits(kinds[name], value):
            allowed = f"{_ALLOWED}; {kinds[name].range}" if number else _ALLOWED
            raise refusal("no design can have it", origin, f"design.{name}", value, allowed, "Correct the number")
    design = {name: float(value) for name, value in data.items()}
    fault = scene.job.fault({**scene.mechanism, **design})
    if fault:
        raise refusal(f"the design does not assemble: {fault}", origin, "design", remedy="Correct its lengths")
    return design


def _numbers(scene: Any) -> dict[str, Quantity]:
    """Return what kind of quantity each number of a scene is that a design may hold."""
    models = [scene.job.mechanism, scene.job.operation, *(type(own) for own in scene.effects.values())]
    found = {name: quantity_of(model, name) for model in models for name in model.model_fields}
    first = {name: found[name] for name in scene.job.variables}
    return {name: quantity for name, quantity in {**first, **found}.items() if quantity}


def _fits(quantity: Quantity, value: float) -> bool:
    """Say whether a number in SI lies in its quantity's range."""
    return value >= quantity.least and quantity.above < value < quantity.below
