"""Origin of a table, and CSV text with this origin."""

import functools
from typing import TYPE_CHECKING

from loomopt.scenes.scene import Scene

if TYPE_CHECKING:
    import pandas as pd

VERSIONED = ("loomopt", "casadi", "numpy")


def versions() -> dict[str, str]:
    """Versions that numbers depend on: this package's, CasADi's with its IPOPT, NumPy's."""
    return {name: _version(name) for name in VERSIONED}


@functools.cache
def _version(name: str) -> str:
    import importlib.metadata

    return importlib.metadata.version(name)


def provenance(scene: Scene, **more: object) -> dict[str, str]:
    """Origin of a table: scene, its hash and effects, versions, date, and `more`."""
    import datetime

    today = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    details = {name: str(value) for name, value in more.items()}
    effects = ", ".join(scene.effects) or "none"
    return {"scene": scene.name, "scene_hash": scene.hash, "effects": effects, **details, **versions(), "date": today}


def csv(frame: "pd.DataFrame") -> str:
    """A table as CSV text, its provenance in comment lines before the header; digits round-trip."""
    head = "".join(f"# {name}: {value}\n" for name, value in frame.attrs.items())
    return head + str(frame.to_csv(index=frame.index.name is not None, lineterminator="\n"))
