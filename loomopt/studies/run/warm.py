"""Where a solve ended as JSON data, and back: what a neighbour starts from is the same whoever solved it."""

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from loomopt.model.program import Program
from loomopt.model.sampling import Extreme
from loomopt.solving.nlp.point import Point
from loomopt.solving.nlp.rows import Multipliers, row_map

Nodes = tuple[tuple[Extreme, ...], ...]


def written(point: Point, program: Program) -> dict[str, Any]:
    """Return a point that a solve of a program ended in as JSON data."""
    said = point.multipliers
    raw = {"lam_x": said.lam_x, "lam_g": said.lam_g, "extra": point.extra} if said else {}
    return {
        "task": _task(program),
        "x": dict(point.x),
        "nodes": [[list(node) for node in family] for family in point.nodes],
        "binding": [[list(node) for node in family] for family in point.binding],
        "raw": {name: values.tolist() for name, values in raw.items()},
    }


def read(data: Mapping[str, Any], program: Program) -> Point | None:
    """Return the point that data say, as a start for a program; None where they are of another structure, or none."""
    if not data or data["task"] != _task(program):
        return None
    nodes, binding = _nodes(data["nodes"]), _nodes(data["binding"])
    point = Point(dict(data["x"]), "Solve_Succeeded", True, nodes=nodes, binding=binding, structure=program.structure)
    if not data["raw"]:
        return point
    lam_x, lam_g, extra = (np.array(data["raw"][name], dtype=np.float64) for name in ("lam_x", "lam_g", "extra"))
    rows = row_map(program, 0).sized(len(lam_g))
    return replace(point, extra=extra, multipliers=Multipliers(rows, lam_x, lam_g))


def _nodes(families: list[list[list[Any]]]) -> Nodes:
    return tuple(tuple(Extreme(*node) for node in family) for family in families)


def _task(program: Program) -> str:
    """Return what is alike in programs of one structure and in every process: names, no formulas."""
    objectives = [each.structure for each in program.objectives]
    limits = [limit.structure for limit in program.limits]
    names = [variable.name for variable in program.variables], list(program.parameters)
    return hashlib.sha256(repr((names, limits, objectives)).encode()).hexdigest()[:16]
