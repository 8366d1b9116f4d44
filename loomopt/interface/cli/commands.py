"""Commands that optimise nothing: scenes, figures of a design, curves, drawings, proofs."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from loomopt.interface.cli.options import (
    NO_CHANGES,
    Decimal,
    Design,
    Figure,
    Json,
    Limits,
    Problem,
    SceneOptions,
)
from loomopt.interface.cli.shell import DIFFERS, call_progress, read_number, read_request, remark

if TYPE_CHECKING:
    from loomopt.interface.results import Evaluation
    from loomopt.picture.table import TextTable
    from loomopt.scenes.designs import Design as DesignGiven
    from loomopt.scenes.scene import Scene


def tell(
    as_json: bool, document: Callable[[], Mapping[str, object]], parts: "Callable[[], Sequence[str | TextTable]]"
) -> None:
    """Print a result as one JSON object, or its parts as text."""
    if as_json:
        from loomopt.interface.files import outputs

        print(outputs.json_text(document()))
    else:
        from loomopt.interface.text import layout

        layout.show(*parts())


def write(paths: Sequence[Path] | None, write_file: Callable[[Path], object]) -> None:
    """Write the requested files, with a remark for each."""
    for path in paths or ():
        write_file(path)
        remark(f"Wrote {path}")


def print_remarks(scene: "Scene", design: "DesignGiven") -> None:
    """Print the remarks on a design to stderr."""
    from loomopt.jobs import registry
    from loomopt.scenes import designs

    for text in registry.of(scene).views.remarks(scene, designs.flat(design)):
        remark(f"Remark: {text}.")


def print_json(evaluation: "Evaluation") -> None:
    """Print one JSON object."""
    from loomopt.interface.files import outputs

    print(outputs.document(evaluation))


def list_problems(as_json: Json = False) -> None:
    """List the packaged problems and their targets."""
    from loomopt.interface import listing

    heads, faults = listing.problems()
    if as_json:
        from loomopt.interface.files import outputs

        print(outputs.json_text({"problems": [head._asdict() for head in heads]}))
    else:
        from loomopt.interface.text import layout
        from loomopt.picture.table import TextTable

        lines = [
            row
            for head in heads
            for row in (
                (head.name, head.title),
                ("", f"job {head.job}; targets {', '.join(head.targets)}"),
                ("", f"source: {head.source or 'not given'}"),
            )
        ]
        layout.show(TextTable("", ("problem", "what it is"), tuple(lines)))
    for fault in faults:
        remark(f"loomopt: {fault}")


def new(
    job: Annotated[str, typer.Argument(help="Name of a job, such as beatup; with --from, the file.")],
    file: Annotated[Path | None, typer.Argument(help="File to write; it must not exist yet.")] = None,
    start: Annotated[
        str | None,
        typer.Option(
            "--from", metavar="NAME", help="Copy this packaged scene; a .zip file gets all scenes of its job."
        ),
    ] = None,
) -> None:
    """Write a commented scene to start from."""
    from loomopt.base.errors import refusal
    from loomopt.interface import listing

    if (file is None) == (start is None):
        remedy = "Write `loomopt new JOB FILE`, or `loomopt new --from NAME FILE`"
        raise refusal("it takes a job and a file, or a packaged problem and a file", "", "new", remedy=remedy)
    path = listing.copy_scene(start, Path(job)) if start is not None else listing.template(job, file or Path())
    zipped = path.suffix.lower() == listing.ZIP
    scene = f"{start}.toml" if zipped else path
    then = "unpack it, then " if zipped else ""
    remark(f"Wrote {path}. Next: {then}loomopt show {scene}, then loomopt solve {scene}")


def schema(job: Annotated[str, typer.Argument(help="Name of a job, such as beatup.")]) -> None:
    """Print the JSON Schema of a scene, for editors."""
    import json

    from loomopt.interface.text import json_schema
    from loomopt.jobs import registry

    print(json.dumps(json_schema.scene(registry.declared(job)), indent=1, ensure_ascii=False))


def show(
    problem: Problem,
    equations: Annotated[
        bool, typer.Option("--equations", help="Print the equations of the effects that are on.")
    ] = False,
    symbols: Annotated[bool, typer.Option("--symbols", help="Explain every symbol of the tables.")] = False,
    sources: Annotated[
        bool, typer.Option("--sources", help="Print the figures of the source beside the computed ones.")
    ] = False,
    figure: Figure = None,
    animate: Annotated[
        list[Path] | None, typer.Option(metavar="F", help="Write an animation: .html, .gif or .mp4.")
    ] = None,
    design: Design = None,
    changes: SceneOptions = NO_CHANGES,
) -> None:
    """Show a scene as read, its equations, symbols and sources."""
    from loomopt.interface import api
    from loomopt.interface.files import outputs
    from loomopt.interface.text import glossary, layout, scenes

    scene, given, name, status = read_request(problem, design, None, changes.call)
    parts = (
        outputs.describe_design(api.evaluate(scene, given, name).result, name, status)
        if given and (figure or animate)
        else None
    )
    write(figure, lambda path: outputs.picture(path, scene, given, parts))
    if animate:
        from loomopt.interface.report import animation

        for path in animate:
            animation.check_file(path)
        write(animate, lambda path: animation.animate(scene, given, path, parts))
    shown: list[str | TextTable] = [*scenes.equations(scene)] if equations else []
    shown += glossary.parts(scene) if symbols else []
    shown += glossary.source_tables(scene) if sources else []
    if shown or not (figure or animate):
        layout.show(*(shown or scenes.parts(scene)))


def evaluate(
    problem: Problem,
    design: Design = None,
    target: Limits = None,
    changes: SceneOptions = NO_CHANGES,
    as_json: Json = False,
) -> None:
    """Compute the figures of a design, by default today's."""
    from loomopt.interface import api

    scene, given, name, _ = read_request(problem, design, target, changes.call)
    evaluation = api.evaluate(scene, given, name)
    print_remarks(scene, given)
    if as_json:
        print_json(evaluation)
        return
    from loomopt.interface.text import answers, layout

    before = api.evaluate(scene, None, name).result if given else None
    layout.show(*answers.evaluation(evaluation.result, scene, before))


def prove(
    problem: Problem,
    design: Design = None,
    target: Limits = None,
    slack: Annotated[str, typer.Option(metavar="R", help="Permit this relative violation of a limit.")] = "1e-8",
    changes: SceneOptions = NO_CHANGES,
    as_json: Json = False,
) -> None:
    """Prove limits and peaks at every crank angle, or refute."""
    from loomopt.interface import api
    from loomopt.interface.text import answers

    scene, given, name, _ = read_request(problem, design, target, changes.call)
    with call_progress() as progress:
        progress.say("proving")
        proofs = api.prove(scene, given, name, slack=read_number("--slack", slack, float))
    tell(as_json, proofs.as_dict, lambda: answers.proofs(proofs))
    raise typer.Exit(0 if proofs.passed else DIFFERS)


def simulate(
    problem: Problem,
    design: Design = None,
    target: Limits = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(metavar="F", help="Write the curves (.csv, .xlsx, .parquet) or a figure (.png, .svg, .pdf)."),
    ] = None,
    accuracy: Annotated[
        str | None, typer.Option(metavar="R", help="Write as few rows as give each peak to R; with --out.")
    ] = None,
    measured: Annotated[
        Path | None,
        typer.Option("--beside", metavar="F.csv", help="Compare with measured curves, by phi [deg]."),
    ] = None,
    forces: Annotated[
        bool, typer.Option("--forces", help="Show the forces in the joints; figures are polar diagrams.")
    ] = False,
    decimal: Decimal = "point",
    changes: SceneOptions = NO_CHANGES,
) -> None:
    """Compute curves over the cycle, and print or write them."""
    from loomopt.interface import api
    from loomopt.interface.files import outputs, sheets
    from loomopt.interface.text import layout, scenes
    from loomopt.solving.options import check_numbers

    comma = sheets.decimal_comma(decimal)
    scene, given, name, status = read_request(problem, design, target, changes.call)
    relative = None if accuracy is None else read_number("--accuracy", accuracy, float)
    if relative is not None:
        check_numbers(relative, 1)
    force_parts: Sequence[str | TextTable] = ()
    if forces:
        from loomopt.interface.forces import from_curves

        force_parts = from_curves(scene, api.simulate(scene, given, name), given).tables()
    compared = [scenes.comparison(scene, api.simulate(scene, given, name, measured=measured))] if measured else []
    subject = outputs.describe_design(api.evaluate(scene, given, name).result, name, status) if given and out else None
    for path in out or ():
        if forces and path.suffix.lower() in outputs.PICTURES:
            api.evaluate(scene, given, name).plot_forces(path)
        else:
            outputs.curves(path, scene, given, relative, name, subject, measured, comma)
        remark(f"Wrote {path}")
    if forces:
        layout.show(*force_parts, *compared)
    elif not out:
        layout.show(*scenes.curves(scene, given, layout.width()), *compared)
    elif compared:
        layout.show(*compared)
    print_remarks(scene, given)


def budget(
    problem: Problem,
    design: Design = None,
    fluctuation: Annotated[
        str | None, typer.Option(metavar="R", help="Size the flywheel for this speed fluctuation, such as 0.02.")
    ] = None,
    figures: Annotated[
        list[Path] | None, typer.Option("--figure", metavar="F", help="Draw the shares: .png, .svg or .pdf.")
    ] = None,
    changes: SceneOptions = NO_CHANGES,
    as_json: Json = False,
) -> None:
    """Show the shares of the crank torque; size the motor."""
    from loomopt.interface.files import outputs
    from loomopt.interface.study.budget import compute

    outputs.check_files(figures or ())
    scene, given, _, _ = read_request(problem, design, None, changes.call)
    irregularity = None if fluctuation is None else read_number("--fluctuation", fluctuation, float)
    result = compute(scene, given, irregularity)
    print_remarks(scene, given)
    tell(as_json, result.as_dict, result.tables)
    write(figures, result.plot)


def export(
    problem: Problem,
    out: Annotated[
        list[Path],
        typer.Option(metavar="F", help="Write a drawing (.svg, .dxf), or joints or profile (.csv, .xlsx)."),
    ],
    design: Design = None,
    target: Limits = None,
    decimal: Decimal = "point",
    dxf: Annotated[str | None, typer.Option(metavar="V", help="Set the version of DXF: r2010 or r12.")] = None,
    arcs: Annotated[
        str | None,
        typer.Option(metavar="T", help='Approximate closed curves by arcs, within a tolerance such as "0.01 mm".'),
    ] = None,
    only: Annotated[str | None, typer.Option(metavar="L", help="Write only this layer, such as profile.")] = None,
    changes: SceneOptions = NO_CHANGES,
) -> None:
    """Export linkage or cam at true scale, for the workshop."""
    from loomopt.interface import api
    from loomopt.interface.files import outputs, sheets

    comma = sheets.decimal_comma(decimal)
    scene, given, name, status = read_request(problem, design, target, changes.call)
    subject = outputs.describe_design(api.evaluate(scene, given, name).result, name, status) if given else None
    how = outputs.workshop(dxf, arcs, only)
    outputs.check_workshop(out, how)
    write(out, lambda path: outputs.linkage(path, scene, given, subject, comma, how))
    print_remarks(scene, given)


FIRST: dict[str, Callable[..., None]] = {"list": list_problems, "new": new, "schema": schema, "show": show}
OF_A_DESIGN: dict[str, Callable[..., None]] = {
    "evaluate": evaluate,
    "prove": prove,
    "simulate": simulate,
    "budget": budget,
    "export": export,
}
"""Name → command in the order of the help: those before `solve`, and those after it."""
