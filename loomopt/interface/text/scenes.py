"""A scene for the terminal: numbers as given and in SI, its equations, its curves."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from loomopt.base.units import factor
from loomopt.interface.text.layout import GAP
from loomopt.jobs import registry
from loomopt.model.curves import split
from loomopt.physics.cycle import Floats
from loomopt.physics.effects.kinds import keys, label, owned, value_at
from loomopt.physics.schema import Table
from loomopt.picture.job_views import Marks, Span
from loomopt.picture.table import TextTable
from loomopt.scenes import family
from loomopt.scenes.designs import Design, flat
from loomopt.scenes.display import KINDS
from loomopt.scenes.scene import Scene, given
from loomopt.scenes.tables import FAMILY
from loomopt.solving.answer.solution import UnitFormatter

if TYPE_CHECKING:
    import pandas as pd

STEP = 15
"""Crank angle between printed rows, deg."""


def parts(scene: Scene) -> list[str | TextTable]:
    """Tables of `loomopt show`."""
    formatter = UnitFormatter(scene)
    lines = []
    for key, name, value in _values(scene):
        number = isinstance(value, int | float)
        unit = formatter.si(name) if number else "1"
        size = f"{value:.9g}" if isinstance(value, int | float) else list_text(value)
        lines.append((key, scene.given(key) or "(default)", size, "" if unit == "1" else unit))
    effects = tuple((effect.name, effect.summary) for effect in scene.active)
    off = [name for name in scene.schema.effects if name not in scene.effects]
    figures = tuple((figure.name, figure.text) for figure in scene.schema.figures.values())
    return [
        f"{scene.name}: {scene.title}",
        f"Job: {scene.job}, {scene.schema.title}",
        f"Source: {scene.source or 'not given'}",
        f"Tables show {', '.join(f'{key} in {scene.shown_in(kind)}' for key, kind in _kinds(scene).items())}",
        TextTable("Numbers", ("key", "as given", "SI", ""), tuple(lines), right=(1, 2), units=(3,)),
        TextTable("Effects that are on", ("effect", "what it is"), effects) if effects else "No effect is on",
        *(record.summary for record in registry.of(scene).tables(scene, scene.schema.default_target)),
        f"Effects that are off, and not in the equations: {', '.join(off) or 'none'}",
        TextTable("Targets", ("target", "objectives", "expected"), tuple(_targets(scene))),
        *_family(scene),
        TextTable("Figures", ("figure", "what it is"), figures),
    ]


def _kinds(scene: Scene) -> dict[str, str]:
    """Kinds of quantity, by their keys in [display], of a scene's design variables and figures."""
    kinds = [*scene.schema.variables.values(), *(figure.kind for figure in scene.schema.figures.values())]
    keys = {kind: key for key, kind in KINDS.items()}
    return {keys[kind]: kind for kind in dict.fromkeys(kinds) if kind in keys}


def _targets(scene: Scene) -> list[tuple[str, str, str]]:
    """Targets with the values that the scene expects of them."""
    lines = []
    for name, target in scene.schema.targets.items():
        expected = getattr(scene.targets[name], "expected", None) or {}
        lines.append((name, target.text, ", ".join(f"{key} = {value}" for key, value in expected.items())))
    return lines


def _family(scene: Scene) -> list[str | TextTable]:
    """Members of the scene's family, where it has one. Raises BadInput for one that is no scene."""
    if FAMILY not in scene.schema.targets:
        return []
    table, members = family.table(scene), family.members(scene)
    changes = [", ".join(f"{key} = {value}" for key, value in change.items()) for change in family.changes(scene)]
    lines = tuple((str(place + 1), changes[place]) for place in range(len(members)))
    free_variables = f"; each has its own {', '.join(table.own)}" if table.own else ""
    sentence = f"A family of target {family.of_target(scene)}: the least {table.combine} of its members{free_variables}"
    return [sentence, TextTable("Members of the family", ("member", "changes"), lines)]


def list_text(values: str | Sequence[float]) -> str:
    """A list of numbers in a few words; "" for a word."""
    return "" if isinstance(values, str) else f"{len(values)} numbers, {min(values):.3g} ... {max(values):.3g}"


def _values(scene: Scene) -> Iterator[tuple[str, str, float | str | Sequence[float]]]:
    """Yield dotted key, designer's name and SI value of each number, word and list."""
    for table in ("operation", "mechanism"):
        for name, value in given(scene.tables[table]).items():
            if isinstance(value, tuple) and value and isinstance(value[0], Table):
                for k, number in enumerate(value, 1):
                    yield from ((f"{table}.{name}.{k}.{key}", key, amount) for key, amount in given(number).items())
            else:
                yield f"{table}.{name}", name, value
    for effect in scene.active:
        for key in keys(effect.table):
            value = value_at(scene.effects[effect.name], key)
            if isinstance(value, int | float | str):
                yield f"effects.{owned(effect, key)}", label(effect, key), value
    for table in ("bounds", "limits"):
        for name, limit in getattr(scene, table).items():
            for end in ("min", "max"):
                if (value := getattr(limit, end)) is not None:
                    yield _range_text(scene, f"{table}.{name}", end), name, value


def _range_text(scene: Scene, key: str, end: str) -> str:
    """Key of a limit's end; a limit given as one value has no ends."""
    return key if scene.given(key) else f"{key}.{end}"


def equations(scene: Scene) -> list[str]:
    """Equations a scene really uses, as text, those of one name together."""
    groups = itertools.groupby(scene.equations(), key=lambda equation: equation.name)
    return ["\n".join([name, *(f"    {equation.text}" for equation in group)]) for name, group in groups]


def curves(scene: Scene, design: Design, width: int | None) -> list[str | TextTable]:
    """Curves every 15 degrees and at the marks, both sides of a jump, in the scene's display units.

    More tables where one is too wide.
    """
    job = registry.of(scene)
    full = {**job.today(scene), **flat(design)}
    columns = dict(job.curves(scene, full))
    angle = np.degrees(columns.pop("phi [rad]"))
    places = {name: math.degrees(value) for name, value in _angles(job.views.marks(scene, full)).items()}
    rows = [
        k
        for k, a in enumerate(angle)
        if abs(a / STEP - round(a / STEP)) < 1e-9
        or any(abs(math.remainder(a - place, 360)) < 1e-9 for place in places.values())
    ]
    unit = scene.shown_in("angle")
    size = math.radians(1.0) / factor(unit)
    marks = ", ".join(f"{name} at {size * place:.3f} {unit}" for name, place in places.items())
    first = (f"phi\n[{unit}]", [f"{size * degrees:.3f}" for degrees in angle])
    groups: list[list[tuple[str, list[str]]]] = [[]]
    for curve in (_curve(scene, name, values) for name, values in columns.items()):
        if width and groups[-1] and sum(map(_width, (first, *groups[-1], curve))) > width + len(GAP):
            groups.append([])
        groups[-1].append(curve)
    tables = [_table([first, *group], rows) for group in groups]
    return [f"{scene.title}: {marks}", *tables]


def comparison(scene: Scene, frame: "pd.DataFrame") -> TextTable:
    """Difference of curves, SI, from measured ones, in the scene's display units."""
    lines = []
    for column in frame.columns:
        name, _, unit = column.removesuffix("]").partition("_measured [")
        if unit:
            shown = scene.unit_for(unit)
            size = 1.0 if shown == unit else factor(shown) / factor(unit)
            off = (frame[f"{name} [{unit}]"] - frame[column]).to_numpy(dtype=float) / size
            there = np.flatnonzero(np.isfinite(off))
            worst = there[np.argmax(np.abs(off[there]))]
            angle = scene.show(float(frame["phi [rad]"].iloc[worst]), "angle", 5)
            rms = math.sqrt(float(np.mean(off[there] ** 2)))
            known = f"{float(frame.attrs.get(f'precision_{name}', 0.0)) / size:.2g}"
            lines.append((name, shown, str(len(there)), f"{rms:.4g}", f"{off[worst]:.4g}", angle, known))
    heads = ("curve", "unit", "samples", "rms", "largest", "at", "digits to \u00b1")
    file = "; ".join(str(frame.attrs[key]) for key in ("measured", "read") if key in frame.attrs)
    return TextTable(f"Computed minus measured curves ({file})", heads, tuple(lines), right=(2, 3, 4, 5, 6))


def _angles(marks: Marks) -> dict[str, float]:
    """Marks that are one crank angle, rad."""
    return {name: mark for name, mark in marks.items() if not isinstance(mark, Span) and math.isfinite(mark)}


def _table(some: Sequence[tuple[str, list[str]]], rows: Sequence[int]) -> TextTable:
    """Some curves as a table; rows: places of the rows it shows."""
    lines = tuple(tuple(texts[k] for _, texts in some) for k in rows)
    return TextTable("", tuple(head for head, _ in some), lines, right=tuple(range(len(some))))


def _width(curve: tuple[str, list[str]]) -> int:
    """Characters a curve's column takes with the gap after it."""
    head, texts = curve
    return max(len(text) for text in (*head.split("\n"), *texts)) + len(GAP)


def _curve(scene: Scene, name: str, values: Floats) -> tuple[str, list[str]]:
    """A curve's heading and its cells in its display unit, four digits of the largest; empty where undefined."""
    symbol, si = split(name)
    unit = scene.unit_for(si)
    numbers = np.asarray(values, dtype=float) * (1.0 if unit == si else factor(si) / factor(unit))
    known = numbers[np.isfinite(numbers)]
    largest = float(np.max(np.abs(known), initial=0.0))
    places = min(9, max(0, 3 - math.floor(math.log10(largest)))) if largest > 0 else 0
    texts = ["" if math.isnan(number) else f"{round(float(number), places) + 0.0:.{places}f}" for number in numbers]
    return f"{symbol}\n[{unit}]", texts
