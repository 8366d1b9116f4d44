"""From the shell to the answer: the processor's time of whole commands beside that of `import casadi, numpy` alone.

Commands run in turn, each in a process of its own, all with bytecode cached in a folder of this run, so that noise
hits all alike and nothing has to be compiled. "loomopt solve beatup, less the solve" leaves out what `lo.solve` itself
takes in that process; the rest is start-up: Python, imports, words, scene, tables. From one start: how wide a search
is made is no start-up (benchmarks/measure/answers.py).

Importing CasADi and NumPy is mostly loading shared libraries, a command is mostly running Python: their ratio differs
by machine. "The same, with Typer and pydantic at work" is both, and so the fairer measure between machines. Two
processes of one turn are not disturbed alike: the median of all turns beside the libraries' median is steadier.

What no machine and no other work changes is how many calls Python makes in a command (`calls` of the same, by
`sys.setprofile`): imports, classes, words, scene and tables, but neither loading libraries nor what CasADi computes.

    python benchmarks/measure/startup.py [--quick] [--json]
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile

from benchmarks import harness

ALONE = "import casadi, numpy"
FLOOR = "the same, with Typer and pydantic at work"
LIBRARIES = """import gc
gc.disable()
import casadi, numpy, pydantic, typer
class Table(pydantic.BaseModel):
    length: float
Table.model_validate({"length": 1.0})
app = typer.Typer(add_completion=False, rich_markup_mode=None)
@app.callback()
def start() -> None: ...
@app.command()
def solve(problem: str, target: str = "balance") -> None: ...
app()"""
FEW = ("--version", "evaluate beatup", "solve beatup --starts 1")
COMMANDS = (*FEW, "list", "solve beatup")
SOLVE, REST = "loomopt solve beatup --starts 1", "loomopt solve beatup, less the solve"
TIMED = """import sys, time
from loomopt.interface import api; from loomopt.interface.cli import app as cli
solve = api.solve
def timed(*arguments, **options):
    import casadi
    began = time.process_time()
    answer = solve(*arguments, **options)
    print(time.process_time() - began, file=sys.stderr)
    return answer
api.solve = timed
cli.main()"""
LEFT_OUT = ("COLUMNS", "PYTHONDONTWRITEBYTECODE")
COUNTED = """import atexit, os, sys
events, leave = [0], os._exit
def counted(frame, event, argument):
    events[0] += 1
def told(status=0):
    sys.setprofile(None)
    print(events[0], file=sys.stderr, flush=True)
    leave(status)
os._exit = told
atexit.register(told)
sys.setprofile(counted)
"""
MAIN = "from loomopt.interface.cli.app import main; main()"
ROUNDS, QUICK = 21, 9


def spent(code, words, cache):
    """Processor's seconds of one process, and the line it says on stderr."""
    # A width that is asked for makes a command draw its tables with Rich: here its output is piped.
    environment = {name: value for name, value in os.environ.items() if name not in LEFT_OUT}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-c", code, *words],
        env={**environment, "PYTHONPYCACHEPREFIX": cache, "PYDANTIC_DISABLE_PLUGINS": "__all__"},
        capture_output=True,
        text=True,
        check=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stderr


def time_round(cache, commands):
    """Processor's milliseconds of each command, run once."""
    results = {ALONE: spent(ALONE, (), cache)[0], FLOOR: spent(LIBRARIES, ("solve", "beatup"), cache)[0]}
    for words in commands:
        results[f"loomopt {words}"] = spent(MAIN, words.split(), cache)[0]
    if commands == COMMANDS:
        whole, solved = spent(TIMED, SOLVE.split()[1:], cache)
        results[REST] = whole - float(solved)
    return {name: 1e3 * seconds for name, seconds in results.items()}


def calls(cache):
    """Return how many calls and returns Python makes in each command of `FEW`, and in the libraries at work."""
    made = {FLOOR: (LIBRARIES, ["solve", "beatup"])} | {f"loomopt {words}": (MAIN, words.split()) for words in FEW}
    return {name: int(spent(COUNTED + code, words, cache)[1].split()[-1]) for name, (code, words) in made.items()}


def main():
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as cache:
        commands = FEW if options.quick else COMMANDS
        time_round(cache, commands)
        rounds = [time_round(cache, commands) for _ in range(QUICK if options.quick else ROUNDS)]
        counted = calls(cache)
    floor, rows = statistics.median(item[FLOOR] for item in rounds), []
    for name in rounds[0]:
        times, ratios = [item[name] for item in rounds], [item[name] / item[ALONE] for item in rounds]
        rows.append(
            {
                "command": name,
                "median [ms]": statistics.median(times),
                "beside the import": harness.spread(ratios),
                "beside the libraries at work": harness.spread([item[name] / item[FLOOR] for item in rounds]),
                "median beside their median": statistics.median(times) / floor,
            }
        )
    harness.show(rows, options.json, calls=[{"command": name, "calls": made} for name, made in counted.items()])


if __name__ == "__main__":
    harness.one_thread()
    main()
