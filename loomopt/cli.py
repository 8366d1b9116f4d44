"""The `loomopt` command: words only, every one of them thin over the library."""

import atexit
import gc
import os
import sys
from pathlib import Path
from typing import Annotated, Any

# One short-lived process: collecting garbage, and searching all installed packages for pydantic plugins, would cost
# a third of the time from the shell to the answer.
_COLLECTING = gc.isenabled()
gc.disable()
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")

import typer  # noqa: E402

from loomopt import __version__, api  # noqa: E402
from loomopt.errors import BadInput  # noqa: E402
from loomopt.jobs import JOBS, load  # noqa: E402
from loomopt.packaged import problem_names  # noqa: E402
from loomopt.scene_errors import refusal, unknown  # noqa: E402
from loomopt.shell import Progress, mistake, read_design, read_number, read_scene, remark  # noqa: E402
from loomopt.solving.solution import Evaluation  # noqa: E402

EXIT = {"optimal": 0, "infeasible": 3, "uncertified": 4, "failed": 4, "interrupted": 130}
BAD_INPUT, DIFFERS, INTERRUPTED = 2, 1, 130
CommandLineError: type[Any] = typer.BadParameter.__mro__[2]
"""Click's base exception, which Typer carries inside itself or imports, by version."""

app = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Optimal design of weaving-loom mechanisms: dimensions that work, proof that they do, what each limit costs.",
)

Problem = Annotated[str, typer.Argument(help="A packaged scene (see `loomopt list`) or the path of a TOML scene.")]
Set = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Set a scene key by its dotted path.")
]
With = Annotated[list[str] | None, typer.Option("--with", metavar="EFFECT", help="Put on an effect from [available].")]
Without = Annotated[list[str] | None, typer.Option("--without", metavar="EFFECT", help="Take an effect off.")]
Free = Annotated[list[str] | None, typer.Option("--free", metavar="NAMES", help="Free bounds that are held.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Design = Annotated[Path | None, typer.Option("--design", metavar="FILE", help="A design or an answer as JSON.")]


def remarked(scene: Any, design: Any) -> None:
    """Say on stderr what a reader of a design's figures should know."""
    from loomopt.views import job_views

    for text in job_views.view(scene).remarks(scene, design):
        remark(f"Remark: {text}.")


def printed(found: Evaluation) -> None:
    """Print one JSON object."""
    from loomopt.views import outputs

    print(outputs.document(found))


@app.callback(invoke_without_command=True)
def start(
    context: typer.Context, version: Annotated[bool, typer.Option("--version", help="Show the version.")] = False
) -> None:
    """Show the version, or what there is to do."""
    if version:
        print(f"loomopt {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(context.get_help())


@app.command("list")
def list_problems() -> None:
    """List the packaged problems and their targets."""
    from loomopt.views import layout, scene_view

    layout.show(scene_view.listing([load(name) for name in problem_names()]))


@app.command()
def new(
    job: Annotated[str, typer.Argument(help=f"One of: {', '.join(JOBS)}.")],
    file: Annotated[Path, typer.Argument(help="The scene to write; it must not exist yet.")],
) -> None:
    """Write a commented scene to start from."""
    from loomopt.store import atomically

    if job not in JOBS:
        raise unknown("job", job, JOBS, "", "")
    if file.exists():
        raise refusal("the file exists already", str(file), remedy="Choose another name, or remove it first")
    atomically(file, lambda place: _write(place, JOBS[job].template))
    remark(f"Wrote {file}. Next: loomopt show {file}, then loomopt solve {file}")


def _write(place: Path, text: str) -> None:
    place.write_text(text, encoding="utf-8")


@app.command()
def show(
    problem: Problem,
    equations: Annotated[bool, typer.Option("--equations", help="Print the equations the scene really uses.")] = False,
    figure: Annotated[Path | None, typer.Option(metavar="F", help="Draw the mechanism: .png, .svg or .pdf.")] = None,
    sets: Set = None,
    on: With = None,
    off: Without = None,
) -> None:
    """Show a scene as it was read; its equations; a drawing."""
    from loomopt.views import layout, outputs, scene_view

    scene = read_scene(problem, sets, on, off)
    if figure:
        outputs.picture(figure, scene, {})
        remark(f"Wrote {figure}")
    if equations:
        layout.show(*scene_view.equations(scene))
    elif not figure:
        layout.show(*scene_view.parts(scene))


@app.command()
def solve(
    problem: Problem,
    target: Annotated[str | None, typer.Option(help="What to optimise; the job's default without it.")] = None,
    sets: Set = None,
    free: Free = None,
    on: With = None,
    off: Without = None,
    accuracy: Annotated[str, typer.Option(metavar="R", help="Relative accuracy, 1e-11 to 0.1.")] = "1e-8",
    starts: Annotated[str, typer.Option(metavar="N", help="How many starts to try.")] = "1",
    proven: Annotated[bool, typer.Option("--prove", help="Prove every limit at every crank angle too.")] = False,
    as_json: Json = False,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Write answer, tables and drawing there.")] = None,
) -> None:
    """Solve a problem and certify the answer."""
    from loomopt.views import layout, outputs, terminal

    scene = read_scene(problem, sets, on, off)
    if free:
        scene = scene.free([name for names in free for name in names.replace(",", " ").split()])
    settings = {"accuracy": read_number("--accuracy", accuracy, float), "starts": read_number("--starts", starts, int)}
    if out:
        outputs.check_folder(out)
    with Progress() as progress:
        answer = api.solve(
            scene, target, **settings, prove=proven, on_start=lambda number, of: progress.say(f"start {number} of {of}")
        )
    if out:
        remark("Wrote " + ", ".join(str(path) for path in outputs.answer(out, answer, scene)))
    remarked(scene, answer.design)
    if as_json:
        printed(answer)
    else:
        layout.show(*terminal.solution(answer, scene))
    raise typer.Exit(EXIT[answer.status])


@app.command()
def evaluate(
    problem: Problem,
    design: Design = None,
    sets: Set = None,
    on: With = None,
    off: Without = None,
    as_json: Json = False,
) -> None:
    """Show the figures of a design (today's without one)."""
    scene = read_scene(problem, sets, on, off)
    given = read_design(design, scene)
    found = api.evaluate(scene, given)
    remarked(scene, given)
    if as_json:
        printed(found)
        return
    from loomopt.views import layout, terminal

    layout.show(*terminal.evaluation(found, scene, api.evaluate(scene) if given else None))


@app.command()
def prove(
    problem: Problem,
    design: Design = None,
    target: Annotated[str | None, typer.Option(help="Whose limits; the job's default without it.")] = None,
    slack: Annotated[str, typer.Option(metavar="R", help="What binding limits leave open, relative.")] = "1e-8",
    sets: Set = None,
    on: With = None,
    off: Without = None,
    as_json: Json = False,
) -> None:
    """Prove that limits and claimed peaks hold at every crank angle, or show where they fail."""
    from loomopt.views import layout, outputs, terminal

    scene = read_scene(problem, sets, on, off)
    found = api.prove(scene, read_design(design, scene), target, slack=read_number("--slack", slack, float))
    if as_json:
        print(outputs.json_text(found.as_dict()))
    else:
        layout.show(*terminal.proofs(found))
    raise typer.Exit(0 if found.passed else DIFFERS)


@app.command()
def simulate(
    problem: Problem,
    design: Design = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(metavar="F", help="Write curves (.csv, .parquet) or a figure (.png, .svg, .pdf)."),
    ] = None,
    sets: Set = None,
    on: With = None,
    off: Without = None,
) -> None:
    """Compute curves over the cycle; print them without --out."""
    from loomopt.views import layout, outputs, scene_view

    scene = read_scene(problem, sets, on, off)
    given = read_design(design, scene)
    for path in out or ():
        outputs.curves(path, scene, given)
        remark(f"Wrote {path}")
    if not out:
        layout.show(*scene_view.curves(scene, given, layout.width()))


@app.command()
def export(
    problem: Problem,
    out: Annotated[Path, typer.Option(metavar="F", help="The file: .svg, .dxf, or .csv for joints or profile.")],
    design: Design = None,
    sets: Set = None,
    on: With = None,
    off: Without = None,
) -> None:
    """Export linkage or cam at true scale, for the workshop."""
    from loomopt.views import outputs

    scene = read_scene(problem, sets, on, off)
    given = read_design(design, scene)
    outputs.linkage(out, scene, given)
    remark(f"Wrote {out}")
    remarked(scene, given)


@app.command()
def check(
    problems: Annotated[list[str] | None, typer.Argument(help="Packaged scenes; all of them without a name.")] = None,
    write: Annotated[Path | None, typer.Option(metavar="DIR", help="Write new reference tables there instead.")] = None,
) -> None:
    """Solve the packaged problems again; compare with results/."""
    from loomopt.studies import check as study
    from loomopt.views import layout

    if write:
        remark(f"Wrote {len(study.write(write))} reference tables to {write}")
        return
    outcomes: list[study.Outcome] = []
    try:
        with Progress() as progress:
            for outcome in study.check(problems or ()):
                outcomes.append(outcome)
                progress.say(f"checked {outcome.problem}, {outcome.target}")
    finally:
        if outcomes:
            lines = tuple((o.problem, o.target, o.status, "; ".join(o.differences) or "reproduces") for o in outcomes)
            layout.show(layout.Grid("", ("problem", "target", "status", "against the reference"), lines))
    differ = [outcome for outcome in outcomes if outcome.differences]
    if differ:
        remark(f"loomopt: {len(differ)} of {len(outcomes)} differ from the reference")
        raise typer.Exit(DIFFERS)


def run(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    try:
        status = int(app(arguments, standalone_mode=False, prog_name="loomopt") or 0)
    except typer.Exit as error:
        status = error.exit_code
    except BadInput as error:
        remark(f"loomopt: {error}")
        return BAD_INPUT
    except CommandLineError as error:
        remark(f"loomopt: {mistake(error)}")
        return BAD_INPUT
    except (KeyboardInterrupt, typer.Abort):
        status = INTERRUPTED
    except (BrokenPipeError, SystemExit):  # nobody reads on: Click leaves by SystemExit
        return 0
    except OSError as error:
        remark(f"loomopt: the output cannot be written: {error.strerror or error}")
        return BAD_INPUT
    if status == INTERRUPTED:
        remark("loomopt: stopped; nothing was left half-written.")
    return status


def main() -> None:
    """Enter from the shell; leave without taking the interpreter apart object by object, a tenth of the whole time."""
    gc.disable()
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure:
            reconfigure(errors="replace")
    status = run()
    atexit._run_exitfuncs()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except BrokenPipeError:
        pass
    except OSError as error:
        remark(f"loomopt: the output cannot be written: {error.strerror}")
        status = BAD_INPUT
    os._exit(status)


if _COLLECTING:
    gc.freeze()  # what is imported by now stays: looking through it once more would cost what was saved
    gc.enable()
