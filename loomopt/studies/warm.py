"""Where a solve ended as plain JSON, exact, so that a neighbour starts from a row as from the solve itself."""

from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np

from loomopt.nlp.point import Point
from loomopt.program.sampling import Extreme

Nodes = tuple[tuple[Extreme, ...], ...]


def packed(point: Point, x: Mapping[str, float]) -> dict[str, Any]:
    """Return a point as JSON data; x: the design that came of it, SI."""
    return {
        "x": {name: float(value) for name, value in x.items()},
        "status": point.status,
        "nodes": _listed(point.nodes),
        "binding": _listed(point.binding),
        "raw": {name: np.asarray(values).ravel().tolist() for name, values in point.raw.items()},
    }


def unpacked(data: Mapping[str, Any], structure: Hashable) -> Point:
    """Return the point of JSON data, as one of a program's structure."""
    raw = {name: np.array(values) for name, values in data["raw"].items()}
    nodes, binding = _read(data["nodes"]), _read(data["binding"])
    return Point(dict(data["x"]), data["status"], True, 0, nodes, raw=raw, binding=binding, structure=structure)


def _listed(nodes: Nodes) -> list[list[list[Any]]]:
    return [[[int(e.piece), float(e.u), float(e.value), bool(e.signed)] for e in of] for of in nodes]


def _read(nodes: list[list[list[Any]]]) -> Nodes:
    return tuple(tuple(Extreme(*e) for e in of) for of in nodes)
