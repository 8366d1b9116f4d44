"""Every symbol that a table shows, in words, and every figure that a source prints."""

import csv
import math
import re
from collections.abc import Iterator
from typing import NamedTuple

from pydantic import BaseModel

from loomopt.base.errors import BadInput
from loomopt.base.quantities import quantity_of, table_inside
from loomopt.base.units import SI_UNIT
from loomopt.interface.answer_table import PER_SECOND
from loomopt.jobs import registry
from loomopt.model.curves import split
from loomopt.model.model import COMPONENTS
from loomopt.physics.effects.kinds import Check, Load
from loomopt.physics.schema import Figure
from loomopt.picture.job_views import JobViews
from loomopt.picture.shapes import Text
from loomopt.picture.table import TextTable
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import UnitFormatter


class Printed(NamedTuple):
    """Printed figure of a source: computed value, inputs, unit; "reproduces", or the reason why it does not."""

    key: str
    item: str
    inputs: str
    unit: str
    printed: str
    computed: str
    verdict: str
    remark: str


class Source(NamedTuple):
    """A source and the figures it prints."""

    citation: str
    figures: tuple[Printed, ...]


def read(job: str) -> Source:
    """Source of a job's scenes. Raises BadInput where the job names none."""
    place = registry.find(job).resources / "sources.csv"
    if not place.is_file():
        remedy = "`loomopt show` gives the sources of the numbers of a scene"
        raise BadInput(f"job {job} has no published figures", key="--sources", remedy=remedy)
    first, _, rest = place.read_text(encoding="utf-8").partition("\n")
    return Source(first.removeprefix("# "), tuple(Printed(**row) for row in csv.DictReader(rest.splitlines())))


ORDINALS = ("first", "second", "third")
GREEK = {"alpha": "α", "beta": "β", "theta": "θ", "phi": "φ", "psi": "ψ", "mu": "μ"}
"""Letters that drawings write as such."""
SHARED = {
    "phi": "angle of the shaft",
    "omega": "speed of the shaft",
    "motor_torque": "torque of the motor: on the shaft and on the flywheel",
    "motor_power": "torque of the motor times the speed of the shaft",
}
"""Columns that every job's curves may have."""
KINDS = {unit: kind for kind, unit in SI_UNIT.items() if kind != "angular speed"}
"""SI unit → kind of quantity."""
LONGEST_SYMBOL = 5
"""Letters beyond which a name is made of words."""
DRAWN = "x"
"""Mark of a symbol that the sketch shows."""


class Symbol(NamedTuple):
    """Symbol, unit ("1" without one) and description."""

    name: str
    unit: str
    text: str


def parts(scene: Scene) -> list[str | TextTable]:
    """Tables of `loomopt show --symbols`; units are those of the scene's tables, of curves SI."""
    drawn = labels(scene)
    grids = (_grid(title, symbols, drawn) for title, symbols in _tables(scene).items())
    return [f"{scene.name}: {scene.schema.title}", *grids]


def symbols(scene: Scene) -> list[Symbol]:
    """Every symbol; one that names a number of the scene and a figure too comes twice, the figure last."""
    return [symbol for symbols in _tables(scene).values() for symbol in symbols]


def _tables(scene: Scene) -> dict[str, list[Symbol]]:
    """Symbols by their group."""
    schema, words = scene.schema, UnitFormatter(scene)
    return {
        "Operation": _numbers(scene, schema.operation),
        "Mechanism; what [bounds] frees of it is the design": _numbers(scene, schema.mechanism),
        "Values of effects": [
            entry
            for effect in dict.fromkeys([*schema.effects.values(), *scene.active])
            for entry in _numbers(scene, effect.table, f"{effect.name}.")
        ],
        "Columns of the curves": list(columns(scene)),
        "Figures": [entry for figure in schema.figures.values() for entry in _figure(figure, scene, words)],
    }


def _figure(figure: Figure, scene: Scene, formatter: UnitFormatter) -> Iterator[Symbol]:
    """Yield a figure and, with a known speed, its derivatives with respect to time in tables."""
    yield Symbol(figure.name, formatter.unit(figure.name), figure.text)
    if figure.kind in PER_SECOND and "speed" in scene.operation:
        yield Symbol(f"{figure.name}_t", scene.shown_in(PER_SECOND[figure.kind][0]), f"{figure.text}, in time")


def _grid(title: str, symbols: list[Symbol], drawn: frozenset[str]) -> TextTable:
    lines = tuple(
        (symbol.name, "" if symbol.unit == "1" else symbol.unit, symbol.text, DRAWN if symbol.name in drawn else "")
        for symbol in symbols
    )
    return TextTable(title, ("symbol", "unit", "what it is", "in the sketch"), lines)


def _numbers(scene: Scene, model: type[BaseModel], path: str = "") -> list[Symbol]:
    """Keys of a table with their units and descriptions; a word or a list has no unit."""
    numbers = []
    for name, field in model.model_fields.items():
        inner = table_inside(model, name)
        if inner:
            numbers += _numbers(scene, inner, f"{path}{name}.")
            continue
        quantity = quantity_of(model, name)
        unit = scene.shown_in(quantity.kind) if quantity else "1"
        numbers.append(Symbol(path + name, unit, field.description or ""))
    return numbers


def columns(scene: Scene) -> Iterator[Symbol]:
    """Yield the columns of the curves of today's machine, SI."""
    job, model = registry.of(scene), registry.of(scene).model(scene)
    descriptions = {
        getattr(load, "symbol", "") or load.name: load.summary for load in model.loads if isinstance(load, Load)
    }
    for check in scene.active:
        if isinstance(check, Check):
            descriptions |= {name: f"at each angle; its peak is the figure {name}" for name in check.over_cycle}
            descriptions |= {
                f"{name}_{axis}": f"{name} along {axis} of the mechanism's axes"
                for name in check.vectors
                for axis in COMPONENTS
            }
    descriptions |= SHARED
    for column in job.curves(scene, job.today(scene), steps=4):
        name, unit = split(column)
        yield Symbol(name, unit, descriptions.get(name) or _column_name(job.views, name, unit) or _derivative(name))


def _column_name(views: JobViews, name: str, unit: str) -> str:
    """Name that a job gives to one of its columns, with the kind where there are several of a kind; "" without one."""
    curve = views.words().get(name)
    if not (curve and curve.name):
        return name.replace("_", " ") if len(name) > LONGEST_SYMBOL else ""
    return f"{KINDS[unit]} of {curve.name}" if curve.panel and unit in KINDS else str(curve.name)


def _derivative(name: str) -> str:
    """Description of a column that is the derivative of another one, by its name; "" for any other."""
    base, _, order = name.rpartition("_")
    if base and order in ("1", "2", "3"):
        return f"{ORDINALS[int(order) - 1]} derivative of {base} with respect to the angle phi"
    if base and order in ("t", "tt", "ttt"):
        return f"{ORDINALS[len(order) - 1]} derivative of {base} with respect to time"
    return ""


def sketch_design(scene: Scene) -> dict[str, float]:
    """Design, SI, of a sketch: today's, with numbers that are 0 today in the middle of their bounds."""
    bounds = {name: bound for name, bound in scene.bounds.items() if scene.mechanism.get(name) == 0.0}
    return {name: (bound.min + bound.max) / 2 for name, bound in bounds.items() if bound.max < math.inf}


def labels(scene: Scene) -> frozenset[str]:
    """Symbols that the sketch of a scene names; none where it cannot be drawn."""
    views = registry.of(scene).views
    if views.missing(scene):
        return frozenset()
    texts = {part.text for part in views.linkage(scene, sketch_design(scene)).primitives if isinstance(part, Text)}
    named = {name for text in texts for name in re.findall(r"(\w+) = ", text)}
    return frozenset(named | {name for name, letter in GREEK.items() if letter in named})


def source_tables(scene: Scene) -> list[str | TextTable]:
    """Tables of `loomopt show --sources`: printed value, computed value, verdict and reason.

    Of a scene that is not packaged, whose machine no source prints, it is what the scene itself says.
    """
    if not registry.is_packaged(scene):
        origin = f"source: {scene.source}" if scene.source else "source: not given"
        return [f"{scene.name}: a scene of your own; its machine has no published figures", origin]
    source = read(scene.job)
    lines = tuple(
        (
            figure.key,
            figure.printed or "not printed",
            figure.computed,
            "" if figure.unit == "-" else figure.unit,
            figure.verdict,
        )
        for figure in source.figures
    )
    why = tuple((figure.key, figure.item, figure.inputs, figure.remark) for figure in source.figures)
    return [
        source.citation,
        "Machines of the source in its units, also if this scene has other numbers. The suite computes all of "
        "these figures.",
        TextTable("Printed and computed", ("figure", "printed", "computed", "unit", "verdict"), lines, right=(1, 2)),
        TextTable("Meaning and origin of each figure", ("figure", "what it is", "from", "why"), why),
    ]
