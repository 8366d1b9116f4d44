"""Input spoilt at random: whatever is given is read or refused, by one plain line; nothing else is raised.

    python benchmarks/adversarial/fuzz.py [--count N] [--seed S] [--kind scenes|files|linkages|designs|tables|calls]

Without --count 10 000 scenes, 2000 files of linkages, 900 of other jobs, 500 designs, 500 tables and 500 calls of the
command, some forty minutes; with it so many of each. Prints how many of each were read and refused, and each one that
was neither, by its number: the same seed and number are the same input. Exit status 1 where there is one.
"""

import argparse
import collections
import contextlib
import copy
import datetime
import io
import json
import math
import os
import random
import re
import sys
import tempfile
import tomllib
import traceback
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

FULL = {"scenes": 10_000, "files": 900, "linkages": 2000, "designs": 500, "tables": 500, "calls": 500}
SOLVED = 0.01
"""Share of the scenes that are read which are solved too; all are evaluated."""
LONGEST_LINE = 2100
PROBLEMS = ("beatup", "beatup-light", "rapier", "shedding", "shedding-static", "shedding-printed-travel")
UNITS = (
    "mm",
    "m",
    "deg",
    "rad",
    "kg",
    "N*m",
    "rpm",
    "kg*m^2",
    "N/m",
    "N",
    "Hz",
    "Nm",
    "furlong",
    "m**99",
    "",
    "%",
    "°",
)
NUMBERS = (
    "0", "-1", "31", "31,5", "1_0", "1e-40", "1e-12", "1e59", "1e999", "-1e-59", "nan", "inf", "0x1f", "1/3", "1/0",
    "\u0661\u0662", "\u00b2", "1 000", "9" * 5000, "1e-9999999", "--1", "1.2.3", "3+4", "9**9**9", "\u22125",
)  # fmt: skip
WORDS = (
    "", " ", "x" * 5000, "\x1b[2J", "\u2028", "\u202e", "织机", "../../etc/passwd", "/dev/zero", "/proc/self/environ",
    "-rf", "CON", "true", "null", "[1, 2", "[1, 2, 3]", "{}", "exact", "table", "spline", "levels", "\ud800", "a.b.c",
)  # fmt: skip
LINKAGES = ("sixbar-sley", "shaper", "knuckle-press", "path-18")
CAM = """
problem = { name = "lever", job = "linkage", title = "A cam moves a lever" }
operation = { speed = "300 rpm" }
mechanism = { arm = "100 mm", rod = "200 mm", rock = "150 mm" }
limits = { mu.push = { min = "30 deg" } }
bounds = { rod = { min = "180 mm", max = "220 mm" } }
targets = { t = { least = ["peak_torque"] } }
[parts]
D = { kind = "pivot" }
G = { kind = "pivot", x = "250 mm", y = "0 mm" }
P = { kind = "point", on = "follower", along = "20 mm" }
[parts.follower]
kind = "cam"
at = "D"
pin = "V"
length = "arm"
law = "cycloidal"
lift = "20 deg"
begins = "60 deg"
rise = "100 deg"
far_dwell = "60 deg"
return = "100 deg"
"""
CAMS = {
    "dyad": """
[parts.push]
kind = "dyad"
joins = ["V", "G"]
pin = "C"
side = "left"
links = { bar = "rod", lever = "rock" }
[output]
angle = "lever"
[events]
top = { extreme = "max" }
[effects]
inertia = { J = "0.1 kg*m^2" }
mass = { bar = { mass = "1 kg", along = "90 mm" } }
joint_forces = {}
""",
    "slider": """
[parts.push]
kind = "slider"
from = "V"
through = "G"
direction = "0 deg"
pin = "C"
side = "ahead"
links = { bar = "rod" }
[parts.extra]
kind = "pivot"
x = "rock"
[parts.slot]
kind = "slot"
at = "extra"
through = "C"
link = "arm2"
[parts.Q]
kind = "point"
on = "arm2"
along = "10 mm"
[output]
slide = "push"
[effects]
inertia = { mass = "1 kg" }
gravity = { down = "-90 deg" }
""",
}
"""What hangs on the cam's lever."""
TABLES = {"rapier": ("targets.match.table",), "shedding": ("mechanism.law_table", "mechanism.law=table")}
HEADS = {"rapier": "phi1 [deg],S [mm]", "shedding": "angle [deg],s [mm]"}
CELLS = (
    "",
    ",",
    "\n",
    '"',
    ";",
    "1,5",
    "1_0",
    "\u0661",
    "nan",
    "1e999",
    "1" * 140_000,
    "#",
    "\r",
    "\0",
    "\ufeff",
    "-",
    " ",
)


def quantity(draw: random.Random) -> str:
    """Text that may be a quantity."""
    size = draw.choice((1.0, 1.0, 1e-3, 1e-12, 1e12))
    number = (
        draw.choice(NUMBERS)
        if draw.random() < 0.5
        else repr(draw.uniform(-0.2, 1.0) * 10 ** draw.randint(-3, 4) * size)
    )
    return f"{number}{draw.choice((' ', ' ', ''))}{draw.choice(UNITS)}"


def junk(draw: random.Random, depth: int = 0) -> Any:
    """Value that does not belong."""
    plain: list[Callable[[], Any]] = [
        lambda: quantity(draw),
        lambda: draw.choice(WORDS),
        lambda: draw.choice((0, -1, 1, 38, 10**400, 2.5, 1e300, math.nan, math.inf, True, False, None)),
        lambda: datetime.date(2024, 1, 1),
    ]
    nested: list[Callable[[], Any]] = [
        lambda: [junk(draw, depth + 1) for _ in range(draw.randint(0, 3))],
        lambda: {draw.choice(("min", "max", "free", *WORDS)): junk(draw, depth + 1) for _ in range(draw.randint(0, 3))},
    ]
    return draw.choice(plain * 3 + (nested if depth < 3 else []))()


def paths(table: Mapping[str, Any], start: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    """Path of everything in nested tables."""
    inner = [path for name, value in table.items() if isinstance(value, dict) for path in paths(value, (*start, name))]
    return [(*start, name) for name in table] + inner


def rescaled(draw: random.Random, value: object, mild: bool = False) -> str:
    """Quantity of the same unit and of another size; mild: of nearly the same."""
    number, _, unit = str(value).partition(" ")
    try:
        size = float(number) or 1.0
    except ValueError:
        size = 1.0
    near, wild = draw.uniform(0.9, 1.1), (draw.uniform(-1.0, 2.0), 10.0 ** draw.uniform(-60, 60), 0.0)
    factor = 0.8 + 0.2 * near if mild else near if draw.random() < 0.6 else draw.choice(wild)
    return f"{size * factor!r} {unit}".rstrip(" ")


def spoil(draw: random.Random, table: dict[str, Any], names: Sequence[str] = ()) -> None:
    """Remove, replace, rescale or add something in nested tables; names: words that the scene knows."""
    *path, last = draw.choice(paths(table))
    for name in path:
        table = table[name]
    subject = draw.random()
    if subject < 0.1:
        del table[last]
    elif subject < 0.85 and not isinstance(table[last], dict | list):
        text = rescaled(draw, table[last])
        table[last] = text if isinstance(table[last], str) else float(text)
        if names and draw.random() < 0.3:
            table[last] = draw.choice(names)
    elif subject < 0.93:
        table[last] = junk(draw)
    elif names and draw.random() < 0.5:
        table[draw.choice(names)] = draw.choice(
            (*names, [draw.choice(names)], {draw.choice(names): draw.choice(names)})
        )
    else:
        table[draw.choice((last, *WORDS, "l1", "J4", "K1", "rise", "free", "M0", "pulse", "gravity", "coil"))] = junk(
            draw
        )


def spoilt_text(draw: random.Random, text: str, parts: tuple[str, ...]) -> bytes:
    """Text with a few parts cut out and others put in, some of them no text."""
    content = text.encode()
    for _ in range(draw.choice((0, 1, 1, 2, 3))):
        at = draw.randrange(len(content) + 1)
        put = draw.choice((draw.choice(parts).encode("utf-8", "surrogatepass"), draw.randbytes(draw.randint(0, 4))))
        content = content[:at] + put + content[at + draw.choice((0, 1, 5, 50)) :]
    return content


def toml(value: object) -> str:
    """Value as TOML writes it in one line; what TOML cannot say is text."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_text(name)} = {toml(item)}" for name, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float | datetime.date):
        return str(value)
    return _text(str(value))


def _text(text: str) -> str:
    """Text in quotes."""
    return json.dumps(text, ensure_ascii=False)


def plain_line(text: str) -> None:
    """Check that a message has printable lines, one for each mistake, that are read to their end."""
    assert all(line.isprintable() for line in text.split("\n")), "it has control characters"
    assert all(len(line) <= LONGEST_LINE for line in text.split("\n")), f"{len(text)} characters"
    assert "Traceback" not in text


def finite(data: object) -> None:
    """Check that nothing in an answer is NaN or infinite."""
    if isinstance(data, Mapping):
        for value in data.values():
            finite(value)
    elif isinstance(data, list | tuple):
        for value in data:
            finite(value)
    else:
        assert not isinstance(data, float) or math.isfinite(data), "a number is not finite"


def called(arguments: list[str]) -> str:
    """Run the command; return whether it read what it was given or refused it, and check how it said so."""
    from loomopt.interface.cli.app import run

    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = run(arguments)
    assert status in {0, 1, 2, 3, 4}, f"exit status {status}"
    assert "Traceback" not in err.getvalue()
    if status == 2:
        assert out.getvalue() == "", "stdout is not empty"
        lines = [line for line in err.getvalue().splitlines() if not line.startswith(("Remark: ", "remark: "))]
        assert lines, "nothing is said"
        assert all(line.startswith("loomopt: ") for line in lines)
        assert len(set(lines)) == len(lines), "a line is said twice"
        plain_line(err.getvalue().removesuffix("\n"))
        return "refused"
    if "--json" in arguments:
        finite(json.loads(out.getvalue(), parse_constant=lambda name: math.nan))
    return "read"


def scenes(draw: random.Random, folder: Path) -> str:
    """Spoil a packaged scene, as tables or as bytes; evaluate what is read, and solve some of it."""
    import loomopt as lo
    from loomopt.scenes import packaged

    problem = draw.choice(PROBLEMS)
    try:
        if draw.random() < 0.2:
            text = packaged.problems()[problem].read_text(encoding="utf-8")
            (folder / "scene.toml").write_bytes(spoilt_text(draw, text, (*WORDS, *NUMBERS, "]", "[", "=", '"')))
            scene = lo.load(folder / "scene.toml")
        else:
            document = copy.deepcopy(dict(lo.load(problem).document))
            for _ in range(draw.randint(1, 3)):
                spoil(draw, document)
            scene = lo.scene(document)
        finite(lo.evaluate(scene).as_dict()["design"])
        figures = lo.evaluate(scene).figures.values()
        assert all(value is None or math.isfinite(value) for value in figures), "a figure is not finite"
        if draw.random() < SOLVED:
            lo.solve(scene)
    except lo.BadInput as error:
        plain_line(str(error))
        return "refused"
    return "read"


def files(draw: random.Random, folder: Path, sources: Mapping[str, Mapping[str, Any]] | None = None) -> str:
    """Spoil a packaged scene; have its file shown and evaluated by the command, and some of it solved."""
    import loomopt as lo

    documents = sources or {name: lo.load(name).document for name in PROBLEMS}
    document: dict[str, Any] = copy.deepcopy(dict(documents[draw.choice(sorted(documents))]))
    if draw.random() < 0.3:  # what is off is on
        for name, values in document.pop("available", {}).items():
            document.setdefault("effects", {}).setdefault(name, values)
    if draw.random() < 0.3:  # another machine: dimensions are a little different
        for path in draw.sample(_quantities(document), 2):
            _at(document, path[:-1])[path[-1]] = rescaled(draw, _at(document, path), mild=True)
    else:
        for _ in range(draw.choice((1, 1, 2, 3))):
            spoil(draw, document, names(document))
    text = "\n".join(f"{_text(name)} = {toml(value)}" for name, value in document.items())
    (folder / "scene.toml").write_bytes(text.encode("utf-8", "surrogatepass"))
    texts = [called(["show", "scene.toml"]), called(["evaluate", "scene.toml", "--json"])]
    if texts[-1] == "read":
        off = sorted(document["available"]) if isinstance(document.get("available"), dict) else []
        rest = [["evaluate", "scene.toml", *(word for name in off for word in ("--with", name))]]
        rest += [["show", "scene.toml", "--equations"], ["simulate", "scene.toml", "--out", "curves.csv"]]
        rest += [["solve", "scene.toml", "--starts", "2"]] if draw.random() < SOLVED else []
        called(draw.choice(rest))
    return texts[-1]


def names(document: Mapping[str, Any]) -> list[str]:
    """Words that a scene uses: its keys, and text that is no quantity."""
    keys = {name for path in paths(document) for name in path}
    texts = [value for path in paths(document) if isinstance(value := _at(document, path), str)]
    return sorted({*keys, *(text for text in texts if text.isidentifier())})


def _quantities(document: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Paths of the numbers of a scene's mechanism, operation and effects that have a unit."""
    tables = [path for path in paths(document) if path[0] in ("mechanism", "operation", "effects")]
    return [path for path in tables if re.match(r"-?[0-9.]+ [^\W\d]", str(_at(document, path)))]


def _at(table: Any, path: tuple[str, ...]) -> Any:
    for name in path:
        table = table[name]
    return table


def linkages(draw: random.Random, folder: Path) -> str:
    """Spoil a scene of a linkage likewise: packaged ones, the template, and levers that a cam drives."""
    import loomopt as lo
    from loomopt.jobs import registry
    from loomopt.scenes import packaged

    for path in packaged.problems().values():
        if path.with_suffix(".csv").exists():
            (folder / f"{path.stem}.csv").write_bytes(path.with_suffix(".csv").read_bytes())
    documents = {name: lo.load(name).document for name in LINKAGES}
    documents["template"] = tomllib.loads(registry.template("linkage"))
    documents |= {f"cam {name}": tomllib.loads(CAM + text) for name, text in CAMS.items()}
    return files(draw, folder, documents)


def designs(draw: random.Random, folder: Path) -> str:
    """Spoil today's design, as an object or as bytes, and have it evaluated."""
    import loomopt as lo

    problem = draw.choice(PROBLEMS)
    design: dict[str, Any] = dict(lo.evaluate(lo.load(problem)).design)
    if draw.random() < 0.3:
        content = spoilt_text(draw, json.dumps(design), (*WORDS, *NUMBERS, "{", "}", '"', ":"))
    else:
        for _ in range(draw.randint(1, 3)):
            if design:
                spoil(draw, design)
        if problem.startswith("shedding") and draw.random() < 0.4:
            design[f"law_{draw.choice(NUMBERS)}"] = draw.random()
        content = json.dumps(draw.choice((design, {"design": design})), default=str).encode("utf-8", "surrogatepass")
    (folder / "design.json").write_bytes(content)
    subject = draw.choice((["evaluate"], ["evaluate"], ["evaluate"], ["export", "--out", str(folder / "joints.csv")]))
    json_too = ["--json"] if subject == ["evaluate"] else []
    return called([*subject, problem, "--design", str(folder / "design.json"), *json_too])


def tables(draw: random.Random, folder: Path) -> str:
    """Spoil a table of head travel or of a cam law, and have it read."""
    problem = draw.choice(tuple(TABLES))
    ends = draw.choice(("\n", "\r\n", "\r"))
    rows = [f"{k * 10},{k * k * (36 - k) / 100:.6g}" for k in range(draw.choice((0, 9, 13, 37)))]
    (folder / "table.csv").write_bytes(spoilt_text(draw, ends.join([HEADS[problem], *rows, ""]), CELLS))
    key, *more = TABLES[problem]
    sets = [f"--set={text}" for text in (*more, f"{key}={folder / 'table.csv'}")]
    return called(["evaluate", problem, *sets, "--json"])


def calls(draw: random.Random, folder: Path) -> str:
    """Call the command with words that may not belong."""
    import loomopt as lo

    problem = draw.choice(PROBLEMS if draw.random() < 0.85 else (*WORDS, "problems", str(folder)))
    keys = [".".join(path) for path in paths(dict(lo.load(draw.choice(PROBLEMS)).document))]
    options = [
        lambda: ["--set", f"{draw.choice((*keys, *WORDS))}={draw.choice((quantity(draw), draw.choice(WORDS)))}"],
        lambda: ["--set", f"operation.speed={quantity(draw)}"],
        lambda: ["--set", f"operation.speed={draw.uniform(1, 900)!r} rpm"],
        lambda: ["--set", draw.choice(WORDS)],
        lambda: ["--with", draw.choice(("gravity", "coil", "tape_friction", *WORDS))],
        lambda: ["--without", draw.choice(("inertia", "resistance", "weight", *WORDS))],
        lambda: ["--target", draw.choice(("balance", "stiffness", "dwell", *WORDS))],
        lambda: ["--free", draw.choice(("sley", "rise", "J4", *WORDS))],
        lambda: ["--accuracy", draw.choice(("1e-3", "1e-8", *NUMBERS))],
        lambda: ["--starts", draw.choice(("2", *(text for text in NUMBERS if text != "31")))],
        lambda: ["--design", str(folder / draw.choice(("none.json", "", "x" * 300)))],
        lambda: [
            "--out",
            str(folder / draw.choice(("a.csv", "a.foo", "x" * 300, "no/such/a.csv", "織.svg", "\ud800.csv"))),
        ],
        lambda: ["--json"],
        lambda: [draw.choice(WORDS)],
    ]
    known = ("list", "new", "show", "solve", "solve", "evaluate", "evaluate", "simulate", "export", "prove")
    command = draw.choice(known if draw.random() < 0.95 else WORDS)
    chosen = [word for _ in range(draw.choice((0, 1, 1, 2, 3))) for word in draw.choice(options)()]
    return called([command, *([] if command == "list" else [problem]), *chosen])


KINDS: dict[str, Callable[[random.Random, Path], str]] = {
    "scenes": scenes,
    "files": files,
    "linkages": linkages,
    "designs": designs,
    "tables": tables,
    "calls": calls,
}


def attempt(kind: str, seed: int, number: int) -> str:
    """Return "read" or "refused"; raises whatever else comes of one input. It works in a folder of its own."""
    draw = random.Random(f"{kind} {seed} {number}")
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        os.chdir(folder)
        try:
            return KINDS[kind](draw, Path(folder))
        finally:
            os.chdir(before)


def fuzz(kind: str, count: int, seed: int) -> tuple[collections.Counter[str], dict[int, str]]:
    """Return how often each outcome was seen, and what was raised for each number that was neither read nor refused."""
    seen: collections.Counter[str] = collections.Counter()
    raised: dict[int, str] = {}
    for number in range(count):
        try:
            seen[attempt(kind, seed, number)] += 1
        except Exception:
            raised[number] = traceback.format_exc()
    return seen, raised


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kind", choices=tuple(KINDS), action="append")
    options = parser.parse_args()
    neither = 0
    for kind in options.kind or KINDS:
        seen, raised = fuzz(kind, FULL[kind] if options.count is None else options.count, options.seed)
        neither += len(raised)
        print(f"{kind}: {seen['read']} read, {seen['refused']} refused, {len(raised)} neither", flush=True)
        for number, trace in raised.items():
            print(f"--- {kind} {number}, seed {options.seed}\n{trace}", flush=True)
    return 1 if neither else 0


if __name__ == "__main__":
    sys.exit(main())
