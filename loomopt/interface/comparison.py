"""Designs side by side in one unit: dimensions, figures, limits, curves laid over each other, what differs marked."""

import functools
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from loomopt.base import arguments
from loomopt.base.errors import refusal
from loomopt.base.files import atomically, suffix
from loomopt.base.units import factor
from loomopt.interface import results
from loomopt.interface.files import outputs
from loomopt.interface.results import PICTURE, Evaluation
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.picture.table import TextTable
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Finding, Words

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

DIFFERS = 1e-6
"""Share of the largest from which on numbers of a row differ; an answer is right to 1e-8, and machines round."""
TODAY = "today"


class Named(NamedTuple):
    """A design with what it is called beside others, judged in a scene."""

    name: str
    found: Evaluation


class ComparedRow(NamedTuple):
    """One number of all designs, in one unit; None where a design has none; differs: whether they are not all one.

    limits: as of each design: whether it holds; None where there is none.
    """

    name: str
    unit: str
    values: tuple[float | None, ...]
    held: tuple[bool | None, ...]
    differs: bool


@dataclass(frozen=True, repr=False)
class Comparison:
    """Designs side by side, in the units of the first one's scene."""

    designs: tuple[Named, ...]

    @property
    def scene(self) -> Scene:
        """The scene whose units all are shown in: the first design's."""
        return self.designs[0].found.scene

    @functools.cached_property
    def rows(self) -> tuple[ComparedRow, ...]:
        """Dimensions, then figures, then limits on what is neither."""
        words = Words(self.scene)
        parts = [each.found.design for each in self.designs], [each.found.figures for each in self.designs]
        limits = [{limit.name: limit for limit in each.found.limits} for each in self.designs]
        rows, taken = [], set[str]()
        for numbers in parts:
            for name in dict.fromkeys(name for each in numbers for name in each):
                values = [_number(each.get(name)) for each in numbers]
                if name not in taken and any(value is not None for value in values):
                    rows.append(_row(name, values, limits, words))
                    taken.add(name)
        margins = self.scene.schema.margins
        for name in dict.fromkeys(
            name for each in limits for name in each if name not in taken and name not in margins
        ):
            found = [each.get(name) for each in limits]
            rows.append(_row(name, [limit.value if limit else None for limit in found], limits, words))
        return tuple(_cleaned(rows))

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Return one row per number, a column per design, with whether they differ; si: in SI."""
        from loomopt.interface.table_frame import TableFrame
        from loomopt.scenes.provenance import provenance

        whole, words = arguments.flag(si, "si"), Words(self.scene)
        cells: dict[str, list[object]] = {"name": [], "unit": []}
        cells |= {each.name: [] for each in self.designs} | {"differs": [], "not held by": []}
        for row in self.rows:
            size = factor(row.unit) if whole else 1.0
            cells["name"].append(row.name)
            cells["unit"].append(words.si(row.name) if whole else row.unit)
            for each, value in zip(self.designs, row.values, strict=True):
                cells[each.name].append(None if value is None else value * size)
            cells["differs"].append(row.differs)
            cells["not held by"].append(", ".join(_broken(row, self.designs)))
        frame = TableFrame(cells).set_index("name")
        frame.attrs.update(provenance(self.scene, designs=", ".join(each.name for each in self.designs)))
        return frame

    def plot(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Return the curves of all designs laid over each other; path: a file to write them to as well.

        .png, .svg or .pdf. Raises BadInput.
        """
        from loomopt.interface.figures import compare, figure

        place = None if path is None else Path(arguments.path(path, "path", *PICTURE))
        if place:
            suffix(place, outputs.PICTURES)
        drawn: Figure = compare.overlaid([(each.name, each.found.scene, each.found.design) for each in self.designs])
        if place:
            atomically(place, functools.partial(figure.save, drawn))
        return drawn

    def as_dict(self) -> dict[str, object]:
        """Return the object that `compare --json` prints, SI."""
        told = [(each.name, each.found.as_dict()) for each in self.designs]
        units = {name: unit for _, found in told for name, unit in found["units"].items()}
        kept = ("problem", "design", "figures", "limits")
        found = [{"name": name, **{key: each[key] for key in kept}} for name, each in told]
        return {"designs": found, "units": units, "differs": [row.name for row in self.rows if row.differs]}

    def parts(self) -> list[str | TextTable]:
        """Return the parts that a terminal shows."""
        names = tuple(each.name for each in self.designs)
        lines = []
        for row in self.rows:
            cells = [_cell(value, held) for value, held in zip(row.values, row.held, strict=True)]
            lines.append((row.name, *cells, "" if row.unit == "1" else row.unit, "differs" if row.differs else ""))
        right = tuple(range(1, len(names) + 1))
        heads = ("", *names, "unit", "")
        grid = TextTable("", heads, tuple(lines), right, first=(0, *right, len(names) + 1), more="--json")
        told = []
        for each in self.designs:
            broken = [limit.name for limit in each.found.limits if not limit.ok and not limit.rounding]
            held = f"NOT admissible (!): {', '.join(broken)}" if broken else "all limits held"
            told.append(f"{each.name}: {each.found.problem}, {each.found.sought or 'no target'}: {held}")
        return [*told, grid]

    def __str__(self) -> str:
        from loomopt.interface.text import layout

        return layout.render(self.parts(), layout.width())

    def __repr__(self) -> str:
        count = sum(row.differs for row in self.rows)
        return (
            f"<Comparison of {', '.join(each.name for each in self.designs)}: {count} of {len(self.rows)} rows differ>"
        )

    def _repr_html_(self) -> str:
        from loomopt.interface.text import notebook

        return notebook.page(self.parts())


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def _row(
    name: str, values: Sequence[float | None], limits: Sequence[Mapping[str, Finding]], words: Words
) -> ComparedRow:
    """Return a row in the unit that a reader of the first design's scene sees it in."""
    unit, known = words.unit(name), [abs(value) for value in values if value is not None]
    size = max(known, default=0.0)
    first = next((value for value in values if value is not None), None)
    differs = any(value is None or abs(value - (first or 0.0)) > DIFFERS * size for value in values) and size > 0.0
    held = tuple((limit.ok or limit.rounding) if (limit := each.get(name)) else None for each in limits)
    shown = tuple(None if value is None else value / factor(unit) for value in values)
    return ComparedRow(name, unit, shown, held, differs)


def _cleaned(rows: Sequence[ComparedRow]) -> list[ComparedRow]:
    """Return rows in which what is only rounding beside the largest of its unit is 0, and does not differ."""
    sizes: dict[str, float] = {}
    for row in rows:
        sizes[row.unit] = max(sizes.get(row.unit, 0.0), *(abs(value or 0.0) for value in row.values))
    found = []
    for row in rows:
        tiny = SHOWN_AS_ZERO * sizes[row.unit]
        values = tuple(value if value is None or abs(value) > tiny else 0.0 for value in row.values)
        found.append(row._replace(values=values, differs=row.differs and len(set(values)) > 1))
    return found


def _cell(value: float | None, held: bool | None) -> str:
    return "" if value is None else f"{value:.6g}{' !' if held is False else ''}"


def _broken(row: ComparedRow, designs: Sequence[Named]) -> list[str]:
    return [each.name for each, held in zip(designs, row.held, strict=True) if held is False]


def compared(found: Sequence[object], within: Scene | None = None, names: Sequence[str] = ()) -> Comparison:
    """Return designs side by side: answers, evaluations, or "today" for the first one's machine as it is.

    within: a scene that all are judged in; each in its own without it. names: of each, what it is called. Raises
    BadInput for what is none of them, for one design alone, and for designs of different jobs.
    """
    known = [each for each in found if isinstance(each, Evaluation)]
    stray = next((each for each in found if not isinstance(each, Evaluation) and each != TODAY), None)
    allowed = f'answers, evaluations, and "{TODAY}"'
    if stray is not None:
        raise refusal("it is no design to compare", "", "compare", type(stray).__name__, allowed, "Give answers")
    if not known or len(found) < 2:
        raise refusal("there is nothing to compare", "", "compare", allowed=allowed, remedy="Give two designs at least")
    first = known[0]
    home = within or first.scene
    judged = []
    for each in found:
        if not isinstance(each, Evaluation):
            target = first.target if home.job == first.scene.job else None
            judged.append(results.evaluated(home, None, target or None))
            continue
        designs.check_job(each.scene.job, home, f"<{each.problem}>")
        judged.append(_within(each, within) if within else each)
    called = [name or _called(each) for name, each in zip([*names, *[""] * len(found)], found, strict=False)]
    counts, seen = Counter(called), Counter[str]()
    unique = []
    for name in called:
        seen[name] += 1
        unique.append(f"{name} {seen[name]}" if counts[name] > 1 else name)
    return Comparison(tuple(map(Named, unique, judged)))


def _within(found: Evaluation, scene: Scene) -> Evaluation:
    """Return a design judged in another scene, by the same target where that has one of its name."""
    target = found.target if found.target in scene.schema.targets else None
    return results.evaluated(scene, designs.checked(found.design, scene), target)


def _called(each: object) -> str:
    return f"{each.problem}, {each.sought}" if isinstance(each, Evaluation) else TODAY
