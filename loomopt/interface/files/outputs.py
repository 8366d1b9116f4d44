"""Files of answers, curves and drawings; each is written completely or not at all."""

import contextlib
import functools
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Protocol

from loomopt.base import __version__, quantities
from loomopt.base.errors import BadInput, misread, refusal
from loomopt.base.files import atomically, check, check_room, suffix, together
from loomopt.base.units import QuantityError
from loomopt.interface import answer_table, tables
from loomopt.interface.files import sheets
from loomopt.jobs import registry
from loomopt.model.program import shortfall
from loomopt.model.session import working
from loomopt.scenes import provenance
from loomopt.scenes.designs import Design, flat
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Evaluated, Solution

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from loomopt.picture.chart import Charts
    from loomopt.picture.shapes import Drawing, Primitive

PICTURES = (".png", ".svg", ".pdf")
CURVES = (*sheets.ENDINGS, *PICTURES)
ANSWER = ("answer.json", "table.csv", "curves.csv", "linkage.svg")
"""Files of an answer."""
TODAY, GIVEN = "today's machine", "a given design"
DESIGN_TEXTS = {
    "optimal": "best design for {}",
    "infeasible": "nearest design for {}",
    "uncertified": "uncertified design for {}",
    "failed": "no design for {} found, where the search ended",
    "interrupted": "best design for {} so far, interrupted",
}
"""Description of an answer's design, by status and target."""


class DrawnSubject(NamedTuple):
    """Description of a drawn design: its name, its violated limits, its missed goals."""

    name: str
    broken: tuple[str, ...] = ()
    shortfall: str = ""

    @property
    def text(self) -> str:
        """Name and violated limits, for a title."""
        return f"{self.name}; limits not held: {', '.join(self.broken)}" if self.broken else self.name


class Serialisable(Protocol):
    """Object with JSON data."""

    def as_dict(self) -> Mapping[str, object]:
        """JSON data."""


def document(result: Serialisable) -> str:
    """Evaluation or answer as one JSON object; undefined numbers are null."""
    return json_text({"loomopt": __version__, **result.as_dict()})


def json_text(data: Mapping[str, object]) -> str:
    """Data as one JSON object; undefined numbers are null."""
    return json.dumps(_speakable(data), indent=1, allow_nan=False)


def _speakable(data: object) -> object:
    """Data with None in place of numbers that JSON does not have."""
    if isinstance(data, Mapping):
        return {name: _speakable(value) for name, value in data.items()}
    if isinstance(data, list | tuple):
        return [_speakable(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def text(path: Path, content: str) -> None:
    """Write text. Raises BadInput if it cannot be written."""
    atomically(path, lambda place: _put(content, place))


def _put(content: str, place: Path) -> None:
    place.write_text(content, encoding="utf-8")


def answer(folder: Path, solution: Solution, scene: Scene, comma: bool = False) -> list[Path]:
    """Write an answer into a folder: answer.json, table.csv, curves.csv, and linkage.svg if there is a drawing.

    All files are written, or none if one of them cannot be. For a path that ends in .xlsx a workbook is written
    instead. comma: whether CSV has decimal commas. Returns the files. Raises BadInput.
    """
    from loomopt.interface.files import svg

    if folder.suffix.lower() == WORKBOOK and not folder.is_dir():
        sheets.write(folder, answer_sheets(solution, scene))
        return [folder]
    shown = tables.meaningful(answer_table.frame(solution, scene))
    contents = {
        "answer.json": document(solution) + "\n",
        "table.csv": sheets.to_decimal_comma(provenance.csv(shown), comma),
    }
    view = registry.of(scene).views
    if not solution.members:
        curves = tables.to_file(tables.curves(scene, solution.design, target=solution.target), scene)
        contents["curves.csv"] = sheets.to_decimal_comma(provenance.csv(curves), comma)
    if not solution.members and not view.missing(scene):
        contents["linkage.svg"] = svg.render(drawing(scene, solution.design, describe_design(solution)))
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        _make(folder, made)
        together({folder / name: functools.partial(_put, content) for name, content in contents.items()})
    except BaseException:
        for place in made:
            with contextlib.suppress(OSError):
                place.rmdir()
        raise
    return [folder / name for name in contents]


WORKBOOK = ".xlsx"


def answer_sheets(solution: Solution, scene: Scene) -> "dict[str, pd.DataFrame]":
    """Sheets of an answer's workbook: its design, its figures, its limits and its curves."""
    shown = tables.meaningful(answer_table.frame(solution, scene))
    is_design = [name in solution.design for name in shown.index]
    limits = tables.meaningful(answer_table.limits_frame(solution, scene))
    others = [not flag for flag in is_design]
    sheets = {"design": shown[is_design], "figures": shown[others], "limits": limits}
    if solution.members:
        return sheets
    curves = tables.to_file(tables.curves(scene, solution.design, target=solution.target), scene)
    return sheets | {"curves": curves}


def check_answer(path: Path) -> None:
    """Raise BadInput if an answer cannot be written to a path; called before any computation.

    A name with an ending is that of a file, not of a new folder.
    """
    if path.suffix and not path.is_dir():
        if path.suffix.lower() != WORKBOOK:
            allowed = f"{WORKBOOK}, or a folder name without an ending"
            name = path.stem or "answer"
            remedy = f"Name another folder, such as {name}, or a workbook, {name}{WORKBOOK}"
            problem = "the name's ending does not name a format that an answer can be written in"
            raise BadInput(problem, file=str(path), key="--out", value=path.suffix, allowed=allowed, remedy=remedy)
        check(path)
    else:
        check_folder(path)


def _make(folder: Path, missing: Sequence[Path]) -> None:
    """Make the missing folders of a path; missing: innermost first."""
    try:
        for place in reversed(missing):
            place.mkdir(exist_ok=True)
    except OSError as error:
        raise _no_folder(folder, error.strerror or str(error)) from None


def check_folder(folder: Path) -> None:
    """Raise BadInput if the folder of an answer or its files cannot be written; called before any computation."""
    try:
        taken = next((place for place in (folder, *folder.parents) if place.exists()), folder)
        if not taken.is_dir():
            raise _no_folder(folder, f"{taken} is a file")
        for name in ANSWER if folder == taken else ():
            check(folder / name)
        check_room(taken)
    except OSError as error:
        raise _no_folder(folder, error.strerror or str(error)) from None


def _no_folder(folder: Path, reason: str) -> BadInput:
    remedy = "Name another folder, on a disk with space left"
    return BadInput(f"the answer cannot be written there: {reason}", file=str(folder), key="--out", remedy=remedy)


def check_files(figures: Sequence[Path] = (), tables: Sequence[Path] = ()) -> None:
    """Raise BadInput if figures or tables cannot be written to these files; called before any computation."""
    for paths, endings in ((figures, PICTURES), (tables, sheets.ENDINGS)):
        for path in paths:
            suffix(path, endings)
            check(path)


def write_table(path: Path, frame: "pd.DataFrame", name: str = "points", comma: bool = False) -> None:
    """Write a table with its provenance, in the format of the file's ending. Raises BadInput.

    name: name of the sheet in a workbook; comma: whether CSV has decimal commas.
    """
    shown = frame if suffix(path, sheets.ENDINGS) == ".parquet" else tables.meaningful(frame)
    sheets.write(path, {name: shown}, comma)


def curves(
    path: Path,
    scene: Scene,
    design: Design,
    accuracy: float | None = None,
    target: str | None = None,
    subject: DrawnSubject | None = None,
    measured: Path | None = None,
    comma: bool = False,
) -> None:
    """Write the curves of a design as a table or a figure, by the file's ending.

    accuracy: of peaks, for as few rows as it needs. target: target of the design, for the provenance; subject:
    description of the design, for the title. measured: file of measured curves; comma: decimal commas in CSV.
    """
    ending = suffix(path, CURVES)
    frame = tables.curves(scene, design, accuracy, target, measured)
    if ending in sheets.ENDINGS:
        sheets.write(path, {"curves": tables.to_file(frame, scene)}, comma)
    else:
        from loomopt.interface.figures import figure

        drawn = plot_curves(frame, scene, flat(design), subject)
        atomically(path, functools.partial(figure.save, drawn))


def plot(
    evaluated: Evaluated,
    scene: Scene,
    target: str,
    path: Path | None,
    measured: str | os.PathLike[str] | None = None,
) -> "Figure":
    """Figure of the curves of an evaluated design; path: file to write. Raises BadInput."""
    from loomopt.interface.figures import figure

    if path:
        suffix(path, PICTURES)
    frame = tables.curves(scene, evaluated.design, target=target, measured=measured)
    drawn = plot_curves(frame, scene, flat(evaluated.design), describe_design(evaluated))
    if path:
        atomically(path, functools.partial(figure.save, drawn))
    return drawn


def plot_curves(
    frame: "pd.DataFrame", scene: Scene, design: Mapping[str, float], design_subject: DrawnSubject | None = None
) -> "Figure":
    """Figure of curves, SI, in the units of the scene, with the marks of the job and the curves of today's machine.

    design: SI; empty for today's. design_subject: description of the design, for the title.
    """
    from loomopt.interface.figures import charts

    drawn: Figure = charts.draw(curve_charts(frame, scene, design, design_subject))
    return drawn


@working()
def curve_charts(
    frame: "pd.DataFrame",
    scene: Scene,
    design: Mapping[str, float],
    design_subject: DrawnSubject | None = None,
    sparse: bool = False,
) -> "Charts":
    """Charts of curves, as `plot_curves` draws them; sparse: through fewer rows, for a page."""
    from loomopt.picture import turn
    from loomopt.picture.panels import in_units

    job, view = registry.of(scene), registry.of(scene).views
    now = job.today(scene)
    full_design = {**now, **design}
    columns = tuple(column for column in frame.columns if f"{tables.MEASURED} [" not in column)
    panels, unit = [in_units(scene, panel) for panel in view.panels(scene, design, columns)], scene.shown_in("angle")
    shown = turn.from_table(frame, view.marks(scene, full_design), unit)
    today = None if full_design == now else turn.from_table(tables.curves(scene, {}), view.marks(scene, now), unit)
    subject = design_subject or DrawnSubject(GIVEN if design else TODAY)
    short = ", limits not held" if subject.broken else f", {subject.shortfall}" if subject.shortfall else ""
    title = f"{scene.name}: {subject.name}{short}, curves over the cycle"
    return turn.charts(title, panels, shown, today, view.angle, sparse)


def describe_design(evaluated: Evaluated, target: str | None = None, status: str | None = None) -> DrawnSubject:
    """Description of the design of an evaluation or of an answer.

    target, status: those of the answer, if the evaluated design is that of an answer.
    """
    broken = tuple(limit.name for limit in evaluated.limits if not limit.ok and not limit.rounding)
    if isinstance(evaluated, Solution):
        missed = shortfall(evaluated.reached) if evaluated.status == "optimal" else ""
        return DrawnSubject(DESIGN_TEXTS[evaluated.status].format(evaluated.task_name), broken, missed)
    if target and status in DESIGN_TEXTS and not (broken and status == "optimal"):
        return DrawnSubject(DESIGN_TEXTS[status].format(target), broken, shortfall(evaluated.reached))
    full_design, scene = flat(evaluated.design), evaluated.scene
    now = registry.of(scene).today(scene) if scene else {}
    return DrawnSubject(TODAY if full_design.items() <= now.items() else GIVEN, broken)


@working()
def drawing(scene: Scene, design: Design, subject: DrawnSubject | None = None) -> "Drawing":
    """Drawing of a design's mechanism in its main positions; subject: description of the design, for the title."""
    drawn = registry.of(scene).views.linkage(scene, flat(design))
    return replace(drawn, title=f"{scene.name}: {subject.text if subject else GIVEN if design else TODAY}")


class Workshop(NamedTuple):
    """Options of a drawing for the workshop.

    version: version of DXF, a key of `dxf.VERSIONS`; arcs: tolerance, m, of the arcs that replace closed curves, None
    for straight lines; only: name of the only layer to write, "" for all layers.
    """

    version: str = "r2010"
    arcs: float | None = None
    only: str = ""


USUAL = Workshop()
LEAST_ARCS, ARCS_SHARE = 5e-6, 0.8
"""Least tolerance of arcs, m, and the share of it that points of the curve may lie off them: the rest is more than
straight strokes between these points leave (`jobs/shedding/drawing.py`, CURVE_CLOSE)."""


def workshop(version: str | None = None, arcs: str | None = None, only: str | None = None) -> Workshop:
    """Options of a drawing from --dxf, --arcs and --only of `export`. Raises BadInput."""
    from loomopt.interface.files.dxf import R2010, VERSIONS

    chosen = (version or R2010).lower()
    if chosen not in VERSIONS:
        raise refusal("unknown version of DXF", "", "--dxf", version, ", ".join(VERSIONS), "Choose one of them")
    if arcs is None:
        return Workshop(chosen, None, only or "")
    try:
        tolerance = quantities.read(arcs, "length")
    except QuantityError as error:
        raise misread(error, "", "--arcs", arcs) from None
    if tolerance < LEAST_ARCS:
        problem, allowed = "the tolerance of arcs is too small", f"{1e3 * LEAST_ARCS:g} mm or more"
        raise refusal(problem, "", "--arcs", arcs, allowed, 'Write --arcs "0.01 mm", or leave it out')
    return Workshop(chosen, tolerance, only or "")


def check_workshop(paths: Sequence[Path], how: Workshop) -> None:
    """Raise BadInput if the options do not apply to the files; called before any is written; how: the options."""
    endings = {path: path.suffix.lower() for path in paths}
    if how._replace(only="") != USUAL and ".dxf" not in endings.values():
        remedy = "Name a file that ends in .dxf"
        raise refusal("--dxf and --arcs are for DXF files only", "", "--out", str(paths[0]), remedy=remedy)
    for path, ending in endings.items():
        if how.only and ending in (".csv", ".xlsx"):
            remedy = "Name a file that ends in .dxf or .svg"
            raise refusal("--only is for drawings only", "", "--out", str(path), remedy=remedy)


@working()
def linkage(
    path: Path,
    scene: Scene,
    design: Design,
    subject: DrawnSubject | None = None,
    comma: bool = False,
    how: Workshop = USUAL,
) -> None:
    """Write the linkage of a design in its main positions, in the format of the file's ending (`DRAWINGS`).

    comma: whether CSV has decimal commas; how: options of the drawing. Raises BadInput.
    """
    ending = suffix(path, tuple(DRAWINGS))
    if ending == ".dxf":
        _dxf(path, scene, design, subject, how)
        return
    if how.only:
        from loomopt.interface.files import svg

        text(path, svg.render(only(drawing(scene, design, subject), how.only)))
        return
    if suffix(path, tuple(DRAWINGS)) == ".csv" and comma:
        sheets.write_text(path, registry.of(scene).views.joints_csv(scene, flat(design)), "joints", comma)
    else:
        DRAWINGS[suffix(path, tuple(DRAWINGS))](path, scene, design, subject)


def _joints(path: Path, scene: Scene, design: Design, subject: DrawnSubject | None) -> None:
    """Write a linkage's joints as CSV, or as a workbook."""
    sheets.write_text(path, registry.of(scene).views.joints_csv(scene, flat(design)), "joints")


def _svg(path: Path, scene: Scene, design: Design, subject: DrawnSubject | None) -> None:
    """Write a linkage as SVG at true scale."""
    from loomopt.interface.files import svg

    text(path, svg.render(drawing(scene, design, subject)))


def only(drawn: "Drawing", layer: str) -> "Drawing":
    """One layer of a drawing, without dimensions and legend. Raises BadInput for an unknown layer."""
    from loomopt.picture.shapes import Text

    if layer not in drawn.layers:
        raise refusal(
            "the drawing does not have this layer", "", "--only", layer, ", ".join(drawn.layers), "Choose one of them"
        )
    primitives = tuple(
        primitive for primitive in drawn.primitives if primitive.layer == layer and not isinstance(primitive, Text)
    )
    return replace(drawn, title="", legend=(), primitives=primitives, measures=())


def with_arcs(drawn: "Drawing", tolerance: float) -> "Drawing":
    """Drawing whose closed curves are replaced by tangent circular arcs, within a tolerance, m."""
    from loomopt.maths.arcs import closed_biarcs
    from loomopt.picture.shapes import Line, Point

    def bent(primitive: "Primitive") -> "Primitive":
        if not (isinstance(primitive, Line) and primitive.closed and len(primitive.points) > CORNERED):
            return primitive
        arcs = closed_biarcs([(point.x, point.y) for point in primitive.points], ARCS_SHARE * tolerance)
        points = tuple(Point(at.real, at.imag) for at, _ in arcs)
        return replace(primitive, points=points, bulges=tuple(bulge for _, bulge in arcs))

    return replace(drawn, primitives=tuple(map(bent, drawn.primitives)))


CORNERED = 12
"""Points up to which a closed line is an arrow or a symbol with corners, and no curve."""


def _dxf(path: Path, scene: Scene, design: Design, subject: DrawnSubject | None, how: Workshop = USUAL) -> None:
    """Write a linkage as DXF at true scale, with the tolerances of its lengths."""
    from loomopt.interface.files import dxf
    from loomopt.studies.tolerance.plan import read_tolerances

    drawn, made = drawing(scene, design, subject), read_tolerances(scene)
    nominal = registry.of(scene).numbers_of(scene, flat(design))
    bands = {tolerance.number: tolerance.band(nominal[name]) for name, tolerance in made.items() if name in nominal}
    measures = tuple(measure._replace(band=bands.get(measure.name, (0.0, 0.0))) for measure in drawn.measures)
    drawn = replace(drawn, measures=measures)
    drawn = only(drawn, how.only) if how.only else drawn
    drawn = drawn if how.arcs is None else with_arcs(drawn, how.arcs)
    atomically(path, functools.partial(dxf.write, drawn, version=how.version))


Writer = Callable[[Path, Scene, Design, DrawnSubject | None], None]
DRAWINGS: dict[str, Writer] = {".svg": _svg, ".dxf": _dxf, ".csv": _joints, ".xlsx": _joints}
"""Ending of a file → function that writes a linkage."""


def picture(path: Path, scene: Scene, design: Design, subject: DrawnSubject | None = None) -> None:
    """Write a picture of a design's linkage in its main positions."""
    from loomopt.interface.figures import figure

    suffix(path, PICTURES)
    atomically(path, functools.partial(figure.draw, drawing(scene, design, subject)))
