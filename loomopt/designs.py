"""Designs from files: the JSON of a `design` object, or of a whole answer."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from loomopt.errors import BadInput
from loomopt.quantities import quantity_of
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
    known = [*scene.job.variables, *(name for name in scene.bounds if name not in scene.job.variables)]
    if not isinstance(data, Mapping) or not data:
        raise refusal("there is no design", origin, allowed=f"an object of {', '.join(known)}, SI", remedy=_GIVE)
    for name, value in data.items():
        if name not in known:
            raise unknown("design variable", str(name), known, origin, f"design.{name}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < LARGEST:
            remedy = "Correct the number"
            raise refusal("no design can have it", origin, f"design.{name}", value, _ALLOWED, remedy)
        if value == 0 and name in scene.job.mechanism.model_fields:
            quantity = quantity_of(scene.job.mechanism, name)
            if quantity and quantity.above == 0:
                raise refusal("it is zero", origin, f"design.{name}", value, quantity.range, "Correct the number")
    design = {name: float(value) for name, value in data.items()}
    fault = scene.job.fault({**scene.mechanism, **design})
    if fault:
        raise refusal(f"the design does not assemble: {fault}", origin, "design", remedy="Correct its lengths")
    return design
