"""The `loomopt` command line: it reads arguments and prints results; the library computes."""

import atexit
import contextlib
import gc
import importlib.metadata
import importlib.util
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from loomopt.base import __version__, interrupts
from loomopt.base.errors import BadInput, blamed, clean
from loomopt.interface.cli import commands, pages, studies
from loomopt.interface.cli.commands import print_json, print_remarks, tell
from loomopt.interface.cli.options import NO_CHANGES, Decimal, Json, Problem, SceneOptions, Target, expand
from loomopt.interface.cli.shell import (
    DIFFERS,
    call_progress,
    former_names_as_remarks,
    mistake,
    name_option,
    only,
    read_number,
    read_steps,
    remark,
)

HEADER = Path("include", "coin-or", "IpoptConfig.h")
"""Header with IPOPT's version: next to its library in CasADi's wheel, else below the prefix of a separate build."""
UNTOLD = "of a version that it does not tell"
_VERSION = r'^#define IPOPT_VERSION "(.+)"'


def line() -> str:
    """Line that `loomopt --version` prints."""
    return f"loomopt {__version__} (CasADi {importlib.metadata.version('casadi')}, IPOPT {ipopt()})"


def ipopt() -> str:
    """Version of IPOPT, by the header that it was built with."""
    spec = importlib.util.find_spec("casadi")
    folders = [*(spec.submodule_search_locations or () if spec else ()), sys.prefix]
    for header in (Path(folder) / HEADER for folder in folders):
        if header.is_file() and (
            version := re.search(_VERSION, header.read_text(encoding="utf-8", errors="replace"), re.MULTILINE)
        ):
            return version[1]
    return UNTOLD


# One short-lived process: collecting garbage, and searching all installed packages for pydantic plugins, would cost
# a third of the time from the shell to the answer.
_COLLECTING = gc.isenabled()
gc.disable()
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
# Threads of the linear algebra would wait for each other longer than matrices as small as these take.
for _threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
    os.environ.setdefault(_threads, "1")


UNPROVEN = 4
EXIT = {"optimal": 0, "infeasible": 3, "uncertified": 4, "failed": 4, "interrupted": interrupts.INTERRUPTED}
BAD_INPUT = 2
SUMMARY = "Optimal design of weaving-loom mechanisms, with a certificate and the price of every limit."
CommandLineError: type[Any] = typer.BadParameter.__mro__[2]
"""Click's base exception, which Typer carries inside itself or imports, by version."""


def start(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the versions of loomopt, CasADi and IPOPT.")] = False,
) -> None:
    """Show the version or the help."""
    if version:
        print(line())
        raise typer.Exit
    if context.invoked_subcommand is None:
        print(context.get_help())


def solve(
    problem: Problem,
    target: Target = None,
    changes: SceneOptions = NO_CHANGES,
    accuracy: Annotated[str, typer.Option(metavar="R", help="Set the relative accuracy, 1e-11 to 0.1.")] = "1e-8",
    starts: Annotated[str | None, typer.Option(metavar="N", help="Use N starts in place of a wide search.")] = None,
    proven: Annotated[bool, typer.Option("--prove", help="Also prove every limit at every crank angle.")] = False,
    everywhere: Annotated[bool, typer.Option("--global", help="Prove that no admissible design is better.")] = False,
    gap: Annotated[str, typer.Option(metavar="R", help="Set the relative gap of --global.")] = "1e-3",
    seconds: Annotated[str, typer.Option("--time", metavar="S", help="Set the time limit of --global, s.")] = "60",
    robust: Annotated[
        str | None, typer.Option(metavar="SIGMAS", help="Keep a margin to every limit, in sigma of its figure.")
    ] = None,
    least: Annotated[
        str | None,
        typer.Option("--yield", metavar="Y", help="Keep margins so that this share of machines holds all limits."),
    ] = None,
    steps: Annotated[
        str | None,
        typer.Option(
            "--round", metavar="NAME=STEP,…", help="Round numbers to steps; `scene` for its [steps] and [stock]."
        ),
    ] = None,
    as_json: Json = False,
    outs: Annotated[
        list[Path] | None,
        typer.Option("--out", metavar="DIR|F.xlsx", help="Write answer, tables and drawing to a folder or a workbook."),
    ] = None,
    decimal: Decimal = "point",
) -> None:
    """Solve a problem and certify the answer."""
    from loomopt.interface import api

    scene = changes.scene(problem)
    settings: dict[str, Any] = {"accuracy": read_number("--accuracy", accuracy, float)}
    settings["starts"] = None if starts is None else read_number("--starts", starts, int)
    settings |= {"gap": read_number("--gap", gap, float), "seconds": read_number("--time", seconds, float)}
    settings |= {"prove": proven, "global_proof": everywhere}
    settings["robust"] = None if robust is None else read_number("--robust", robust, float)
    settings["min_yield"] = None if least is None else read_number("--yield", least, float)
    settings["round_to"] = steps is not None and (steps == "scene" or read_steps(steps))
    out = only("--out", outs)
    if out:
        from loomopt.interface.files import outputs, sheets

        comma = sheets.decimal_comma(decimal)
        outputs.check_answer(out)
    with call_progress() as progress:
        answer = api.solve(scene, target, **settings, on_step=progress.say)
    unwritten = None
    if out:
        try:
            remark("Wrote " + ", ".join(str(path) for path in outputs.answer(out, answer.result, scene, comma)))
        except BadInput as error:
            unwritten = error
    print_remarks(scene, answer.design)
    if as_json:
        print_json(answer)
    else:
        from loomopt.interface.text import answers, layout

        layout.show(*answers.solution(answer.result, scene))
    if unwritten:
        raise unwritten
    unproven = answer.global_bound is not None and not answer.global_bound.proven
    raise typer.Exit(UNPROVEN if unproven and answer.status == "optimal" else EXIT[answer.status])


def accuracy(
    problem: Problem,
    changes: SceneOptions = NO_CHANGES,
    full: Annotated[bool, typer.Option("--full", help="Run more settings and repeats; this takes minutes.")] = False,
    as_json: Json = False,
    out: Annotated[
        list[Path] | None,
        typer.Option(metavar="F", help="Write a figure (.png, .svg, .pdf) or the table (.csv, .xlsx)."),
    ] = None,
    decimal: Decimal = "point",
) -> None:
    """Show error and time of each numerical method."""
    from loomopt.base import files
    from loomopt.interface.files import outputs, sheets
    from loomopt.interface.study.accuracy import AccuracyStudy
    from loomopt.studies.accuracy import accuracy as study

    comma = sheets.decimal_comma(decimal)
    for path in out or ():
        files.suffix(path, (*outputs.PICTURES, ".csv", ".xlsx"))
        files.check(path)
    scene = changes.scene(problem)
    climbs: list[study.Climb] = []
    try:
        with call_progress() as progress:
            climbs.extend(study.climbs(scene, full, progress.say))
    finally:
        if climbs:
            result = AccuracyStudy(study.summarise(scene, climbs, full))
            tell(as_json, result.as_dict, result.tables)
    for path in out or ():
        if path.suffix.lower() in outputs.PICTURES:
            result.plot(path)
        else:
            sheets.write(path, {"accuracy": result.table()}, comma)
        remark(f"Wrote {path}")


def check(
    problems: Annotated[
        list[str] | None, typer.Argument(help="Names of packaged scenes; all of them if omitted.")
    ] = None,
    write: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write new reference tables to DIR, and compare nothing.")
    ] = None,
) -> None:
    """Solve the packaged problems again, and compare with results/."""
    from loomopt.interface.text import layout
    from loomopt.studies import check as study

    if write:
        with call_progress() as progress:
            written = study.write(write, problems or (), progress.say)
        remark(f"Wrote {len(written)} reference tables to {write}")
        return
    outcomes: list[study.Outcome] = []
    try:
        with call_progress() as progress:
            outcomes.extend(study.check(problems or (), on_step=progress.say))
    finally:
        if outcomes:
            lines = tuple((o.problem, o.target, o.status, "; ".join(o.differences) or "reproduces") for o in outcomes)
            from loomopt.picture.table import TextTable

            layout.show(TextTable("", ("problem", "target", "status", "against the reference"), lines))
    differ = [outcome for outcome in outcomes if outcome.differences]
    if differ:
        remark(f"loomopt: {len(differ)} of {len(outcomes)} differ from the reference")
        raise typer.Exit(DIFFERS)


COMMANDS: dict[str, Callable[..., None]] = {
    **commands.FIRST,
    "solve": solve,
    **commands.OF_A_DESIGN,
    **studies.STUDIES,
    **pages.PAGES,
    "accuracy": accuracy,
    "check": check,
}
"""Name → command, in the order that help lists them in."""


EXAMPLES = {
    "list": "loomopt list --json",
    "new": "loomopt new beatup my-loom.toml",
    "schema": "loomopt schema beatup > beatup.schema.json",
    "show": "loomopt show beatup --equations --animate beatup.html",
    "solve": 'loomopt solve beatup --target balance --set operation.M0="800 N*m" --out balanced',
    "evaluate": "loomopt evaluate beatup --design answer.json --json",
    "prove": "loomopt prove beatup --design answer.json",
    "simulate": "loomopt simulate beatup --design answer.json --out curves.csv --out curves.png",
    "export": "loomopt export shedding --design answer.json --out cam.dxf",
    "sweep": 'loomopt sweep beatup --over "operation.M0=600:900:25 N*m" --out m0.xlsx --figure m0.png',
    "pareto": "loomopt pareto beatup --minimise peak_torque --against m4e --points 20 --figure front.png",
    "budget": "loomopt budget beatup --design answer.json --fluctuation 0.02 --figure shares.png",
    "sensitivity": "loomopt sensitivity beatup --figure tornado.png",
    "tolerance": "loomopt tolerance my-loom.toml --design answer.json --figure spread.png",
    "effects": "loomopt effects beatup --tolerance 0.01 --figure effects.png",
    "compare": "loomopt compare one.json other.json today --figure both.png",
    "report": "loomopt report beatup answer.json front.db --out report.html",
    "accuracy": "loomopt accuracy beatup --out accuracy.png",
    "check": "loomopt check beatup",
}
"""Name of each command → the example in its help."""


def application(words: list[str]) -> typer.Typer:
    """Typer application for these arguments: with the one command that they begin with, else with all commands."""
    app = typer.Typer(
        add_completion=not words or words[0] not in COMMANDS,  # what one command never needs
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        context_settings={"help_option_names": ["-h", "--help"]},
        help=SUMMARY,
    )
    app.callback(invoke_without_command=True)(start)
    for name in set(words[:1]) & COMMANDS.keys() or COMMANDS:
        epilog = f"For example: {EXAMPLES[name]}" if name in EXAMPLES else None
        app.command(name, epilog=epilog)(expand(COMMANDS[name]))
    return app


def run(arguments: list[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    words = sys.argv[1:] if arguments is None else arguments
    try:
        with former_names_as_remarks():
            status = int(application(words)(words, standalone_mode=False, prog_name="loomopt") or 0)
    except typer.Exit as error:
        status = error.exit_code
    except BadInput as error:
        remark("\n".join(f"loomopt: {line}" for line in str(name_option(error)).split("\n")))
        return BAD_INPUT
    except CommandLineError as error:
        remark(f"loomopt: {mistake(error)}")
        return BAD_INPUT
    except (KeyboardInterrupt, typer.Abort):
        status = interrupts.INTERRUPTED
    except BrokenPipeError:  # the reader has closed the pipe
        return 0
    except OSError as error:
        blame = blamed(error)
        message = blame if isinstance(blame, BadInput) else f"the output cannot be written: {error.strerror or error}"
        remark(f"loomopt: {message}")
        return BAD_INPUT
    except BaseException as error:
        if isinstance(error, SystemExit) and isinstance(error.__context__, BrokenPipeError):
            return 0  # Click's exit status if the reader has closed the pipe
        from concurrent.futures import BrokenExecutor

        if isinstance(error, BrokenExecutor):
            remark(f"loomopt: {error}")
            return UNPROVEN
        failed = not_ours(error)
        if not failed:
            raise
        remark(f"loomopt: {failed}")
        return BAD_INPUT
    if status == interrupts.INTERRUPTED:
        remark(interrupts.STOPPED)
    return status


def not_ours(error: BaseException) -> str:
    """One line for an error in the code of another distribution; "" for an error of loomopt itself."""
    blame = blamed(error)
    if isinstance(blame, BadInput):
        return str(blame)
    if isinstance(error, SystemExit):  # so Typer leaves where it has answered a shell's completion
        return ""
    notes = getattr(error, "__notes__", ())
    return clean("; ".join([f"it fails: {type(error).__name__}: {error}", *notes])) + "." if notes else ""


def main() -> None:
    """Run as a process, and exit without the destruction of all objects, which takes a tenth of the time."""
    gc.disable()
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure:
            reconfigure(errors="replace")
    status = interrupts.stoppable(run)
    atexit._run_exitfuncs()
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        status = 0
    except OSError as error:
        remark(f"loomopt: the output cannot be written: {error.strerror}")
        status = BAD_INPUT
    with contextlib.suppress(OSError):
        sys.stderr.flush()
    os._exit(status)


if _COLLECTING:
    gc.freeze()  # what is imported by now stays: looking through it once more would cost what was saved
    gc.enable()
