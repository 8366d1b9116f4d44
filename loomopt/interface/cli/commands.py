"""The commands that show: scenes, figures of a design, curves, drawings, proofs. Nothing is optimised here."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from loomopt.base.errors import BadInput
from loomopt.interface.cli.shell import DIFFERS, Progress, read_number, read_request, remark

if TYPE_CHECKING:
    from loomopt.scenes.designs import Design as DesignGiven
    from loomopt.scenes.scene import Scene
    from loomopt.solving.answer.solution import Evaluated

Problem = Annotated[
    str, typer.Argument(help="A packaged scene (see `loomopt list`), the path of a TOML scene, or an answer's JSON.")
]
Set = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Set a scene key by its dotted path.")
]
With = Annotated[list[str] | None, typer.Option("--with", metavar="EFFECT", help="Put on an effect from [available].")]
Without = Annotated[list[str] | None, typer.Option("--without", metavar="EFFECT", help="Take an effect off.")]
Free = Annotated[list[str] | None, typer.Option("--free", metavar="NAMES", help="Free bounds that are held.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Design = Annotated[
    Path | None, typer.Option("--design", metavar="FILE", help="A design or an answer as JSON; - for a pipe.")
]

Target = Annotated[
    str | None, typer.Option(help="Whose limits count; the answer's own, or the job's default, without it.")
]


def remarked(scene: "Scene", design: "DesignGiven") -> None:
    """Say on stderr what a reader of a design's figures should know."""
    from loomopt.jobs import registry
    from loomopt.scenes import designs

    for text in registry.of(scene).views.remarks(scene, designs.flat(design)):
        remark(f"Remark: {text}.")


def printed(found: "Evaluated") -> None:
    """Print one JSON object."""
    from loomopt.interface.files import outputs

    print(outputs.document(found))


def list_problems() -> None:
    """List the packaged problems and their targets."""
    from loomopt.interface.text import layout
    from loomopt.scenes import packaged

    heads, faults = [packaged.head(path) for path in packaged.problems().values()], list[BadInput]()
    silent = [head.name for head in heads if not head.targets]
    if silent or packaged.entry_points("loomopt.jobs"):  # whose targets only their jobs know: those are read whole
        from loomopt.jobs import registry

        others, wrong = registry.brought()
        read, faults = registry.heads([*silent, *(others.keys() - packaged.problems().keys())])
        heads, faults = [*(head for head in heads if head.targets), *read], [*wrong, *faults]
    lines = [
        row
        for head in sorted(heads)
        for row in (
            (head.name, head.title),
            ("", f"job {head.job}; targets {', '.join(head.targets)}"),
            ("", f"source: {head.source or 'not given'}"),
        )
    ]
    layout.show(layout.Grid("", ("problem", "what it is"), tuple(lines)))
    for fault in faults:
        remark(f"loomopt: {fault}")


def new(
    job: Annotated[str, typer.Argument(help="A loom job; a wrong name lists them all.")],
    file: Annotated[Path, typer.Argument(help="The scene to write; it must not exist yet.")],
) -> None:
    """Write a commented scene to start from."""
    from loomopt.base.errors import refusal
    from loomopt.base.files import atomically
    from loomopt.jobs import registry

    template = registry.template(job)
    if file.exists():
        raise refusal("the file exists already", str(file), remedy="Choose another name, or remove it first")
    atomically(file, lambda place: _write(place, template))
    remark(f"Wrote {file}. Next: loomopt show {file}, then loomopt solve {file}")


def _write(place: Path, text: str) -> None:
    place.write_text(text, encoding="utf-8")


def schema(job: Annotated[str, typer.Argument(help="A loom job; a wrong name lists them all.")]) -> None:
    """Print the JSON Schema of a scene, for editors."""
    import json

    from loomopt.interface.text import json_schema
    from loomopt.jobs import registry

    print(json.dumps(json_schema.scene(registry.declared(job)), indent=1, ensure_ascii=False))


def show(
    problem: Problem,
    equations: Annotated[bool, typer.Option("--equations", help="Print the equations the scene really uses.")] = False,
    symbols: Annotated[bool, typer.Option("--symbols", help="Print what every symbol of its tables means.")] = False,
    sources: Annotated[bool, typer.Option("--sources", help="Print its source's figures, and as computed.")] = False,
    figure: Annotated[list[Path] | None, typer.Option(metavar="F", help="Draw it: .png, .svg or .pdf.")] = None,
    design: Design = None,
    sets: Set = None,
    on: With = None,
    off: Without = None,
    free: Free = None,
) -> None:
    """Show a scene: as read, its equations, symbols, sources; draw it."""
    from loomopt.interface import api
    from loomopt.interface.files import outputs
    from loomopt.interface.text import glossary, layout, scenes

    scene, given, name, status = read_request(problem, design, None, sets, on, off, free)
    said = outputs.what(api.evaluate(scene, given, name), name, status) if given and figure else None
    for path in figure or ():
        outputs.picture(path, scene, given, said)
        remark(f"Wrote {path}")
    shown: list[str | layout.Grid] = [*scenes.equations(scene)] if equations else []
    shown += glossary.parts(scene) if symbols else []
    shown += glossary.printed(scene) if sources else []
    if shown or not figure:
        layout.show(*(shown or scenes.parts(scene)))


def evaluate(
    problem: Problem,
    design: Design = None,
    target: Target = None,
    sets: Set = None,
    on: With = None,
    off: Without = None,
    free: Free = None,
    as_json: Json = False,
) -> None:
    """Show the figures of a design (today's without one)."""
    from loomopt.interface import api

    scene, given, name, _ = read_request(problem, design, target, sets, on, off, free)
    found = api.evaluate(scene, given, name)
    remarked(scene, given)
    if as_json:
        printed(found)
        return
    from loomopt.interface.text import answers, layout

    layout.show(*answers.evaluation(found, scene, api.evaluate(scene, None, name) if given else None))


def prove(
    problem: Problem,
    design: Design = None,
    target: Target = None,
    slack: Annotated[str, typer.Option(metavar="R", help="What binding limits leave open, relative.")] = "1e-8",
    sets: Set = None,
    on: With = None,
    off: Without = None,
    free: Free = None,
    as_json: Json = False,
) -> None:
    """Prove limits and peaks at every crank angle, or show where not."""
    from loomopt.interface import api
    from loomopt.interface.files import outputs
    from loomopt.interface.text import answers, layout

    scene, given, name, _ = read_request(problem, design, target, sets, on, off, free)
    with Progress() as progress:
        progress.say("proving")
        found = api.prove(scene, given, name, slack=read_number("--slack", slack, float))
    if as_json:
        print(outputs.json_text(found.as_dict()))
    else:
        layout.show(*answers.proofs(found))
    raise typer.Exit(0 if found.passed else DIFFERS)


def simulate(
    problem: Problem,
    design: Design = None,
    target: Target = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(metavar="F", help="Write curves (.csv, .parquet) or a figure (.png, .svg, .pdf)."),
    ] = None,
    accuracy: Annotated[
        str | None, typer.Option(metavar="R", help="As few rows as show each peak to R; with --out.")
    ] = None,
    beside: Annotated[
        Path | None, typer.Option(metavar="F.csv", help="What was measured: phi [deg] and columns of the curves.")
    ] = None,
    sets: Set = None,
    on: With = None,
    off: Without = None,
    free: Free = None,
) -> None:
    """Compute curves over the cycle; print them without --out."""
    from loomopt.interface import api
    from loomopt.interface.files import outputs
    from loomopt.interface.text import layout, scenes
    from loomopt.solving.options import check_numbers

    scene, given, name, status = read_request(problem, design, target, sets, on, off, free)
    asked = None if accuracy is None else read_number("--accuracy", accuracy, float)
    if asked is not None:
        check_numbers(asked, 1)
    compared = [scenes.beside(scene, api.simulate(scene, given, name, beside=beside))] if beside else []
    said = outputs.what(api.evaluate(scene, given, name), name, status) if given and out else None
    for path in out or ():
        outputs.curves(path, scene, given, asked, name, said, beside)
        remark(f"Wrote {path}")
    if not out:
        layout.show(*scenes.curves(scene, given, layout.width()), *compared)
    elif compared:
        layout.show(*compared)
    remarked(scene, given)


def export(
    problem: Problem,
    out: Annotated[
        list[Path], typer.Option(metavar="F", help="The file: .svg, .dxf, or .csv for joints or profile; any number.")
    ],
    design: Design = None,
    target: Target = None,
    sets: Set = None,
    on: With = None,
    off: Without = None,
    free: Free = None,
) -> None:
    """Export linkage or cam at true scale, for the workshop."""
    from loomopt.interface import api
    from loomopt.interface.files import outputs

    scene, given, name, status = read_request(problem, design, target, sets, on, off, free)
    said = outputs.what(api.evaluate(scene, given, name), name, status) if given else None
    for path in out:
        outputs.linkage(path, scene, given, said)
        remark(f"Wrote {path}")
    remarked(scene, given)


FIRST: dict[str, Callable[..., None]] = {"list": list_problems, "new": new, "schema": schema, "show": show}
OF_A_DESIGN: dict[str, Callable[..., None]] = {
    "evaluate": evaluate,
    "prove": prove,
    "simulate": simulate,
    "export": export,
}
"""Name → command, in the order that help lists them in: before and after `solve`."""
