"""The `loomopt` command: words only, every one of them thin over the library."""

import atexit
import gc
import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

# One short-lived process: collecting garbage, and searching all installed packages for pydantic plugins, would cost
# a third of the time from the shell to the answer.
gc.disable()
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")

import typer  # noqa: E402

from loomopt import api, designs  # noqa: E402
from loomopt.errors import BadInput  # noqa: E402
from loomopt.jobs import JOBS, load  # noqa: E402
from loomopt.packaged import problem_names  # noqa: E402
from loomopt.scenes import Scene  # noqa: E402

EXIT = {"optimal": 0, "infeasible": 3, "uncertified": 4, "failed": 4, "interrupted": 130}
BAD_INPUT, DIFFERS, INTERRUPTED = 2, 1, 130
CommandLineError: type[Any] = typer.BadParameter.__mro__[2]
"""Click's base exception, which Typer carries inside itself or imports, by version."""

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
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


def read_scene(problem: str, sets: list[str] | None, on: list[str] | None, off: list[str] | None) -> Scene:
    """Return a scene with what the command line changes in it."""
    scene, changes = load(problem), {}
    for item in sets or ():
        key, equals, value = item.partition("=")
        if not equals:
            raise BadInput("it is not KEY=VALUE", key="--set", value=item, remedy='Write --set operation.M0="800 N*m".')
        changes[key.strip()] = value.strip()
    if changes:
        scene = scene.update(changes)
    for name in on or ():
        scene = scene.with_effect(name)
    for name in off or ():
        scene = scene.without_effect(name)
    return scene


def read_design(path: Path | None, scene: Scene) -> dict[str, float]:
    """Return the design of a file, or none for today's."""
    return designs.read(path, scene) if path else {}


def remark(text: str) -> None:
    """Say something beside the result."""
    print(text, file=sys.stderr)


def printed(data: dict[str, Any]) -> None:
    """Print one JSON object."""
    print(json.dumps(data, indent=1, allow_nan=False))


@app.command("list")
def list_problems() -> None:
    """List the packaged problems, their targets, where they come from."""
    from loomopt.views import terminal

    scenes = [load(name) for name in problem_names()]
    lines = [(s.name, s.job.name, ", ".join(s.job.targets), s.title, s.source) for s in scenes]
    terminal.show(terminal.grid("", ("problem", "job", "targets", "title", "source"), lines))


@app.command()
def new(
    job: Annotated[str, typer.Argument(help=f"One of: {', '.join(JOBS)}.")],
    file: Annotated[Path, typer.Argument(help="The scene to write; it must not exist yet.")],
) -> None:
    """Write a commented scene to start from."""
    from loomopt.store import atomically

    if job not in JOBS:
        raise BadInput(f"there is no job {job}", value=job, allowed=", ".join(JOBS), remedy="Name one of them.")
    if file.exists():
        raise BadInput("the file exists already", file=str(file), remedy="Choose another name, or remove it first.")
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
    """Show a scene as it was read, in SI and as given; its equations; a drawing."""
    from loomopt.views import outputs, scene_view, terminal

    scene = read_scene(problem, sets, on, off)
    if figure:
        outputs.picture(figure, scene, {})
        remark(f"Wrote {figure}")
    if equations:
        terminal.show(*scene_view.equations(scene))
    elif not figure:
        terminal.show(*scene_view.parts(scene))


@app.command()
def solve(
    problem: Problem,
    target: Annotated[str | None, typer.Option(help="What to optimise; the job's default without it.")] = None,
    sets: Set = None,
    free: Free = None,
    on: With = None,
    off: Without = None,
    accuracy: Annotated[float, typer.Option(help="Relative accuracy of every figure and the optimum.")] = 1e-8,
    starts: Annotated[int, typer.Option(help="How many starts to try.")] = 1,
    as_json: Json = False,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Write answer, tables and drawing there.")] = None,
) -> None:
    """Solve a problem and certify the answer."""
    scene = read_scene(problem, sets, on, off)
    if free:
        scene = scene.free([name for names in free for name in names.replace(",", " ").split()])
    answer = api.solve(scene, target, accuracy=accuracy, starts=starts, on_start=_progress())
    if out:
        from loomopt.views import outputs

        remark("Wrote " + ", ".join(str(path) for path in outputs.answer(out, answer, scene)))
    if as_json:
        printed(answer.as_dict())
    else:
        from loomopt.views import terminal

        terminal.show(*terminal.solution(answer, scene))
    raise typer.Exit(EXIT[answer.status])


def _progress() -> Callable[[int, int], None] | None:
    """Return a reporter of starts for a terminal; it keeps silent through the first second."""
    if not sys.stderr.isatty():
        return None
    began = time.monotonic()

    def report(number: int, of: int) -> None:
        if time.monotonic() - began > 1.0:
            print(f"\rstart {number} of {of}", end="" if number < of else "\n", file=sys.stderr, flush=True)

    return report


@app.command()
def evaluate(
    problem: Problem,
    design: Design = None,
    sets: Set = None,
    on: With = None,
    off: Without = None,
    as_json: Json = False,
) -> None:
    """Show the figures of a given design (today's without one), nothing optimised."""
    scene = read_scene(problem, sets, on, off)
    found = api.evaluate(scene, read_design(design, scene))
    if as_json:
        printed(found.as_dict())
        return
    from loomopt.views import terminal

    held = (
        "all limits held"
        if found.admissible
        else "NOT admissible: " + ", ".join(limit.name for limit in found.limits if not limit.ok)
    )
    terminal.show(f"{found.problem}: {held}", terminal.comparison(found, scene))


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
    """Compute curves over the cycle; without --out, print them every 15 degrees."""
    from loomopt.views import outputs, scene_view, terminal

    scene = read_scene(problem, sets, on, off)
    given = read_design(design, scene)
    for path in out or ():
        outputs.curves(path, scene, given)
        remark(f"Wrote {path}")
    if not out:
        terminal.show(scene_view.curves(scene, given))


@app.command()
def export(
    problem: Problem,
    out: Annotated[Path, typer.Option(metavar="F", help="The file: .svg, .dxf, or .csv for the joints.")],
    design: Design = None,
    sets: Set = None,
) -> None:
    """Export the linkage in both dead centres, at true scale, for the workshop."""
    from loomopt.views import outputs

    scene = read_scene(problem, sets, None, None)
    outputs.linkage(out, scene, read_design(design, scene))
    remark(f"Wrote {out}")


@app.command()
def check(
    problems: Annotated[list[str] | None, typer.Argument(help="Packaged scenes; all of them without a name.")] = None,
    write: Annotated[Path | None, typer.Option(metavar="DIR", help="Write new reference tables there instead.")] = None,
) -> None:
    """Solve the packaged problems again and compare with the reference results."""
    from loomopt.studies import check as study
    from loomopt.views import terminal

    if write:
        remark(f"Wrote {len(study.write(write))} reference tables to {write}")
        return
    outcomes = list(study.check(problems or ()))
    lines = [(o.problem, o.target, o.status, "; ".join(o.differences) or "reproduces") for o in outcomes]
    terminal.show(terminal.grid("", ("problem", "target", "status", "against the reference"), lines))
    if any(outcome.differences for outcome in outcomes):
        raise typer.Exit(DIFFERS)


def run(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    try:
        status = int(app(arguments, standalone_mode=False) or 0)
    except BadInput as error:
        remark(f"loomopt: {error}")
        return BAD_INPUT
    except CommandLineError as error:
        remark(f"loomopt: {error.format_message()} See `loomopt --help`.")
        return BAD_INPUT
    except (KeyboardInterrupt, typer.Abort):
        status = INTERRUPTED
    except typer.Exit as error:
        status = error.exit_code
    except BrokenPipeError:
        sys.stderr.close()
        return 0
    if status == INTERRUPTED:
        remark("loomopt: stopped; nothing was left half-written.")
    return status


def main() -> None:
    """Enter from the shell; leave without taking the interpreter apart object by object, a tenth of the whole time."""
    status = run()
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)
