"""Numbers of a scene by full name, from all its tables."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from loomopt.base.errors import refusal
from loomopt.maths import periodic_cubic
from loomopt.maths.periodic_cubic import PeriodicCubic, PeriodicCubics
from loomopt.physics.effects.kinds import Load, keys, label, owned, value_at
from loomopt.physics.schema import Table
from loomopt.scenes.scene import Scene, cached

if TYPE_CHECKING:
    from loomopt.scenes import csv_tables

CORNER = "corner"
"""The column that marks corners of a curve."""


def numbers(scene: Scene) -> dict[str, float]:
    """Every number of the scene by full name, SI."""
    values = {**scene.mechanism, **scene.operation}
    for effect, table in zip(scene.active, scene.effects.values(), strict=True):
        for key in keys(effect.table):
            value = value_at(table, key)
            if isinstance(value, float | int):
                values[owned(effect, key)] = float(value)
    return values


def words(scene: Scene) -> tuple[tuple[str, str, Any], ...]:
    """(effect, key, word) for every value that chooses an effect's formula; a curve for the name of its file.

    Raises BadInput.
    """
    return cached(scene, "words", lambda: tuple(_words(scene)))


def _words(scene: Scene) -> Iterator[tuple[str, str, Any]]:
    known = curves(scene)
    for name, table in scene.effects.items():
        for key, value in table.model_dump().items():
            if isinstance(value, str):
                yield name, key, known.get((name, key), value)


Curve = PeriodicCubic | PeriodicCubics


def curves(scene: Scene) -> dict[tuple[str, str], Curve]:
    """Curves that the scene's loads are, read from its files, by effect and key. Raises BadInput."""
    return {place: curve for place, (curve, _) in _curves(scene).items()}


def _curves(scene: Scene) -> "dict[tuple[str, str], tuple[Curve, csv_tables.Table]]":
    """Curves that the scene's loads are, each with its table. Raises BadInput."""
    on = zip(scene.active, scene.effects.values(), strict=True)
    loads = [(effect, table) for effect, table in on if isinstance(effect, Load) and effect.tabulated]
    curve_tables = {
        (load.name, load.tabulated.key): _curve(scene, load, table) for load, table in loads if load.tabulated
    }
    return {place: curve for place, curve in curve_tables.items() if curve is not None}


def _curve(scene: Scene, load: Load[Any], parameters: Table) -> "tuple[Curve, csv_tables.Table] | None":
    """Curve that a load's table names, with the table; None where it names none. Raises BadInput."""
    table = load.tabulated
    given = getattr(parameters, table.key) if table else None
    if table is None or given is None:
        return None
    # Most scenes name no table.
    from loomopt.scenes import csv_tables

    key = ".".join(("effects", *load.path, table.key))
    read = csv_tables.read(
        scene,
        given,
        key,
        table.columns,
        marks=(CORNER,),
        fewest=periodic_cubic.FEWEST,
        twice=True,
        digits=getattr(parameters, "digits", None),
    )
    angles, *values = read.columns.values()
    marked = read.marks[CORNER]
    try:
        cubics = tuple(periodic_cubic.through(angles, samples, tuple(map(bool, marked))) for samples in values)
        return (PeriodicCubics(cubics) if table.second_column else cubics[0]), read
    except ValueError as error:
        remedy = f"Correct the table: angles are {table.angle}; a column {CORNER} marks corners with 1"
        raise refusal(f"the table is not a curve over one turn: {error}", read.file, remedy=remedy) from None


def bounds(scene: Scene, known: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Lower and upper bound of the design variables and of every bounded number, by full name, SI.

    A constant number has today's value at both ends.
    """
    pairs = {name: (known[name], known[name]) for name in scene.schema.variables}
    for name, bound in scene.bounds.items():
        full = scene.full(name)
        pairs[full] = (bound.min, bound.max) if bound.free else (known[full], known[full])
    return pairs


def labels(scene: Scene) -> dict[str, str]:
    """Labels of the numbers of the active effects, by full name."""
    return {owned(effect, key): label(effect, key) for effect in scene.active for key in keys(effect.table)}


def table_remarks(scene: Scene) -> tuple[str, ...]:
    """Remarks on the curves of the loads: sentences without full stop."""
    return tuple(record.summary for record in records(scene))


def records(scene: Scene) -> "tuple[csv_tables.Record, ...]":
    """Remarks on the tables of the loads. Raises BadInput."""
    remarks = []
    loads = {load.name: load for load in scene.active if isinstance(load, Load)}
    for (name, key), (curve, read) in _curves(scene).items():
        table = loads[name].tabulated
        assert table is not None
        corners = "one corner" if curve.corners == 1 else f"{curve.corners or 'no'} corners"
        left = ""
        if curve.spread is not None:
            left = f"; left out one at a time, samples lie {scene.show(curve.spread, table.kind, 3)} rms off the curve "
            left += "of the others"
        unread = [number for number in table.needless if scene.given(number) is not None]
        summary = f"a cubic through {curve.samples} samples with {corners}, "
        summary += f"rms of the fit {scene.show(0.0, table.kind)}{left}"
        parts = curve.curves if isinstance(curve, PeriodicCubics) else (curve,)
        columns = [column for column in table.columns if column != "angle"]
        record = read.record(f"{name}.{key}", {n: part.spread for n, part in zip(columns, parts, strict=True)}, summary)
        remarks.append(record._replace(summary=f"{record.summary}{f'. {unread[0]} is not read' if unread else ''}"))
    return tuple(remarks)
