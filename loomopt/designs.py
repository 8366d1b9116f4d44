"""Designs from files: the JSON of a `design` object, or of a whole answer."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from loomopt.errors import BadInput

LARGEST = 1_000_000
"""Bytes; an answer has a few thousand."""


def read(path: Path, scene: Any) -> dict[str, float]:
    """Return the design in a JSON file, SI and rad, by design variable. Raises BadInput."""
    try:
        if path.stat().st_size > LARGEST:
            raise BadInput("the file is too large for a design", file=str(path), remedy="Give the JSON of an answer.")
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise BadInput(
            f"the design cannot be read: {error.strerror}", file=str(path), remedy="Check the path."
        ) from None
    except (ValueError, RecursionError):
        remedy = "Give the JSON that `loomopt solve --json` prints, or its design object."
        raise BadInput("the file is not JSON", file=str(path), remedy=remedy) from None
    if isinstance(data, dict) and isinstance(data.get("design"), dict):
        data = data["design"]
    return checked(data, scene, str(path))


def checked(data: Any, scene: Any, origin: str = "<design>") -> dict[str, float]:
    """Return a design given as a mapping, SI and rad, after checking names, numbers and assembly. Raises BadInput."""
    known = [*scene.job.variables, *(name for name in scene.bounds if name not in scene.job.variables)]
    if not isinstance(data, Mapping) or not data:
        raise BadInput("there is no design", file=origin, allowed=f"an object of {', '.join(known)}, SI")
    for name, value in data.items():
        if name not in known:
            raise BadInput(
                f"{name!s:.60} is no design variable",
                file=origin,
                key=f"design.{name!s:.60}",
                allowed=", ".join(known),
            )
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value < 0:
            raise BadInput(
                "it is not a number that a design can have",
                file=origin,
                key=f"design.{name}",
                value=f"{value!s:.60}",
                allowed="a finite number, not negative, in SI units",
            )
    design = {name: float(value) for name, value in data.items()}
    fault = scene.job.fault({**scene.mechanism, **design})
    if fault:
        raise BadInput(
            f"the design does not assemble: {fault}", file=origin, key="design", remedy="Correct its lengths."
        )
    return design
