"""Reference tables: one line for an answer, one for each design of a front; what of a line is not reproduced."""

import io
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from loomopt.studies.tolerances import REPRODUCED_DESIGN, REPRODUCED_OBJECTIVE

if TYPE_CHECKING:
    import pandas as pd

LEAST = {"[rad]": 1.0, "[m]": 1e-3, "[kg]": 1.0, "[N*m]": 1.0}
"""Sizes below which a difference is measured against the size instead, by unit, SI."""
LARGEST = {"[N*m]": "peak_torque [N*m]", "[N]": "contact_max [N]"}
"""Figures that another of the same unit, which may be zero, is measured against."""


def read(path: Path) -> "pd.DataFrame | None":
    """Return a reference table, its cells as they stand there; None where there is none."""
    import pandas as pd

    if not path.is_file():
        return None
    text = "".join(line for line in path.read_text(encoding="utf-8").splitlines(True) if not line.startswith("#"))
    return pd.read_csv(io.StringIO(text), keep_default_na=False, dtype=str)


def differing(now: "pd.DataFrame", then: "pd.DataFrame", objectives: Collection[str]) -> Iterator[str]:
    """Yield every difference between a table of one line, SI, and its reference; objectives: figures held closest."""
    yield from (f"column {name} is new" for name in now.columns.difference(then.columns))
    yield from (f"column {name} is gone" for name in then.columns.difference(now.columns))
    least = LEAST | {of: float(then[column].iloc[0]) for of, column in LARGEST.items() if column in then}
    for name in now.columns.intersection(then.columns):
        new, old = now[name].iloc[0], then[name].iloc[0]
        if isinstance(new, str) or name == "unique":
            if str(new) != str(old):
                yield f"{name}: {new}, reference {old}"
            continue
        allowed = REPRODUCED_OBJECTIVE if name.split(" [")[0] in objectives else REPRODUCED_DESIGN
        size = max(abs(float(old)), least.get(name.rpartition(" ")[2], 1e-3))
        if not abs(float(new) - float(old)) <= allowed * size:
            yield f"{name}: {float(new)!r}, reference {float(old)!r}"
