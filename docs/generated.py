"""What the site takes from the program: commands, scenes key by key, functions, equations; and notebooks that are run.

A line `<!-- generated KIND WORDS -->` of a page is replaced by the Markdown of `KINDS[KIND](WORDS)`
when the page is read, so it follows the program by itself.
"""

import dataclasses
import functools
import hashlib
import importlib
import inspect
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import nbformat
import typer
from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx.application import Sphinx

import loomopt as lo
from loomopt.interface.cli.app import EXAMPLES, application
from loomopt.interface.report import mathml
from loomopt.interface.text import json_schema
from loomopt.jobs import registry
from loomopt.picture.equations import Equation
from loomopt.scenes.scene import Scene

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "notebooks"))
run = importlib.import_module("run")
write = importlib.import_module("write")

MARK = re.compile(r"^<!-- generated (\w+) ?(.*?) -->$", re.MULTILINE)
WORKERS = 2
"""Notebooks that are run at once: a kernel each."""


# Commands


def commands(words: str) -> str:
    """Return every command with its options, as its help has them."""
    group = typer.main.get_command(application([]))
    return "\n".join(_command(name, command) for name, command in group.commands.items())


def _command(name: str, command: Any) -> str:
    context = command.make_context(name, [], resilient_parsing=True)
    records = [parameter.get_help_record(context) for parameter in command.get_params(context)]
    lines = [
        f"| `{_cell(form)}` | {_cell(_plain(text))} |" for form, text in filter(None, records) if "--help" not in form
    ]
    table = ["| | what it is |", "| --- | --- |", *lines] if lines else []
    example = ["For example:", "", "```", EXAMPLES[name], "```"] if name in EXAMPLES else []
    return "\n".join([f"### {name}", "", command.help, "", *table, "", *example, ""])


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ").strip()


def _plain(text: str) -> str:
    """Return text in which nothing is read as Markdown or HTML, but what stands in backquotes."""
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(part if part.startswith("`") else re.sub(r"([\\*_<>\[\]$#{}])", r"\\\1", part) for part in parts)


# Scenes


OWN_NAMES = "Names are the scene's own: [parts and their keys](linkages.md). Tables beside these: {}."
EFFECTS = (
    "## [effects.NAME], [available.NAME]\n\nIn `[effects]` it is on; in `[available]` it waits for `--with NAME`.\n"
)
ACCEPT = "## [accept]\n\nA figure → half the band around an equality or a goal by which made machines are judged.\n"


NEEDED = "needed"
"""Beside the definitions of a schema: who needs which key."""


def scene(job: str) -> str:
    """Return the tables of a job's scenes, key by key, as the JSON Schema for editors has them."""
    schema = _scene(job).schema
    own = bool(schema.tables)
    full = json_schema.scene(dataclasses.replace(schema, tables={}) if own else schema)
    tables, known = full["properties"], full["$defs"] | {NEEDED: _needed(schema)}
    parts = [OWN_NAMES.format(_listed(schema.tables))] if own else []
    parts += [
        _table("problem", tables["problem"], known),
        _table("operation", tables["operation"], known),
        "" if own else _table("mechanism", tables["mechanism"], known),
        EFFECTS,
        *(_table(f"effects.{name}", table, known, 3) for name, table in tables["effects"]["properties"].items()),
        _ranges("bounds", "What may change, and how far: a range, or one value.", tables["bounds"], known, not own),
        _figures(schema.figures, own),
        _ranges("tolerances", "How a number is made.", tables["tolerances"], known, not own),
        ACCEPT,
        _table("display", tables["display"], known),
        *([] if own else [_targets(schema, tables["targets"], known)]),
    ]
    return "\n".join(parts)


def _needed(schema: Any) -> dict[str, str]:
    """Return the keys that the job, or some of its effects, cannot do without → who needs them."""
    found = dict.fromkeys(schema.needs, "")
    for effect in schema.effects.values():
        for key in effect.needs:
            if found.get(key) != "":
                found[key] = ", ".join(filter(None, [found.get(key), effect.name]))
    return {key: f"needed by {who}" if who else "" for key, who in found.items()}


def _scene(job: str) -> Scene:
    return registry.load(write.SHOWN.get(job, job))


def _listed(names: Any) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _table(name: str, table: Mapping[str, Any], known: Mapping[str, Any], level: int = 2) -> str:
    """Return one table: its keys, what each is, and what may stand there."""
    if "properties" not in table and isinstance(table.get("additionalProperties"), dict):
        name, table = f"{name}.NAME", table["additionalProperties"]  # one for each of several things
    rows = list(_keys(table, known, of=f"{name}."))
    head = f"{'#' * level} [{name}]\n\n{_sentence(table.get('description', ''))}\n"
    if not rows:
        return f"{head}\nNo values of its own.\n" if level > 2 else head
    lines = "\n".join(f"| `{key}` | {_cell(_plain(what))} | {_cell(_plain(form))} |" for key, what, form in rows)
    return f"{head}\n| key | what it is | what stands there |\n| --- | --- | --- |\n{lines}\n"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}." if text else ""


def _keys(
    table: Mapping[str, Any], known: Mapping[str, Any], path: str = "", of: str = ""
) -> Iterator[tuple[str, str, str]]:
    for key, own in table.get("properties", {}).items():
        whole = {**known.get(own.get("$ref", "").rpartition("/")[2], {}), **own}
        if "properties" in whole:
            yield from _keys(whole, known, f"{path}{key}.")
            continue
        needed = "" if key in table.get("required", ()) else known[NEEDED].get(of + path + key, "optional")
        if own.get("default"):
            needed = f"default {own['default']!r}"
        form = ", ".join(filter(None, [_form(whole, known), needed]))
        said = whole.get("description", "")
        yield f"{path}{key}", "" if said == _form(whole, known) else said, form


def _form(value: Mapping[str, Any], known: Mapping[str, Any]) -> str:
    """Return in words what a value may be."""
    if "else" in value and "const" in value["else"]:
        return str(value["else"]["const"])
    if "$ref" in value:
        return _form(known[value["$ref"].rpartition("/")[2]], known)
    if "const" in value:
        return f'"{value["const"]}"'
    if "enum" in value:
        return " or ".join(f'"{each}"' for each in value["enum"])
    for several in ("anyOf", "oneOf"):
        forms = [_form(each, known) for each in value.get(several, ()) if "required" not in each and "not" not in each]
        if forms := list(dict.fromkeys(filter(None, forms))):
            return ", or ".join(forms)
    words = {
        "string": "text",
        "number": "a number",
        "integer": "a whole number",
        "boolean": "true or false",
        "array": "a list",
    }
    if value.get("type") == "object":
        inner = value.get("additionalProperties")
        return (
            f"a table of names, each {_form(inner, known)}"
            if isinstance(inner, dict) and _form(inner, known)
            else "a table"
        )
    return words.get(str(value.get("type", "")), "")


def _ranges(name: str, text: str, table: Mapping[str, Any], known: Mapping[str, Any], listed: bool) -> str:
    """Return a table that has one form for every number."""
    first = next(iter(table["properties"].values()))
    rows = [
        f"| `{key}` | {_cell(_plain(what))} | {_cell(_plain(form.replace(', optional', '')))} |"
        for key, what, form in _keys(first.get("then", {}), known)
    ]
    names = f"Numbers: {_listed(table['properties'])}.\n" if listed else ""
    said = f"## [{name}]\n\n{text} Of each number, as of `{next(iter(table['properties']))}`:\n\n"
    return said + "| key | what it is | what stands there |\n| --- | --- | --- |\n" + "\n".join(rows) + f"\n\n{names}"


def _figures(figures: Mapping[str, Any], own: bool) -> str:
    lines = [
        f"| `{figure.name}` | {_cell(_plain(figure.text))} | {' '.join(f'`{side}`' for side in figure.sides)} |"
        for figure in figures.values()
        if figure.sides
    ]
    more = " Here those of the packaged `sixbar-sley`." if own else ""
    head = f'## [limits]\n\nFigures to keep, each with its unit: `swing = {{ min = "22.9 deg" }}`.{more}\n\n'
    return head + "| figure | what it is | ends |\n| --- | --- | --- |\n" + "\n".join(lines) + "\n"


def _targets(schema: Any, tables: Mapping[str, Any], known: Mapping[str, Any]) -> str:
    parts = [f"## [targets.NAME]\n\nWithout `--target` it is `{schema.default_target}`.\n"]
    return "\n".join(
        [*parts, *(_table(f"targets.{name}", table, known, 3) for name, table in tables["properties"].items())]
    )


# Python


def function(name: str) -> str:
    """Return a public function's call and what it says of itself; of a class, its public names too."""
    found = getattr(lo, name)
    call = "" if inspect.isclass(found) else _call(found)
    lines = [f"```text\nlo.{name}{call}\n```", "", _paragraphs(inspect.getdoc(found) or "")]
    if inspect.isclass(found) and not issubclass(found, Exception):
        lines += ["", "| name | what it is |", "| --- | --- |"]
        lines += [f"| `{each}` | {_cell(_plain(text))} |" for each, text in _members(found)]
    return "\n".join(lines) + "\n"


def _call(found: Callable[..., Any]) -> str:
    """Return the arguments of a function without their types."""
    bare = [each.replace(annotation=inspect.Parameter.empty) for each in inspect.signature(found).parameters.values()]
    return str(inspect.Signature(bare))


def _paragraphs(text: str) -> str:
    return "\n\n".join(_section(part) for part in text.split("\n\n"))


def _section(part: str) -> str:
    """Return a paragraph of a docstring; of a NumPy section its title and a list of its entries, examples as code."""
    title, *rest = part.split("\n")
    if not rest or not rest[0].startswith("---"):
        return _plain(" ".join(part.split("\n")))
    if title == "Examples":
        return "**Examples**\n\n```text\n" + "\n".join(rest[1:]) + "\n```"
    entries = list[str]()
    for line in rest[1:]:
        if line.startswith(" "):
            entries[-1] += f" {line.strip()}"
        else:
            entries.append(line)
    return "\n".join([f"**{title}**", "", *(f"- {_plain(entry)}" for entry in entries)])


def _members(found: type) -> Iterator[tuple[str, str]]:
    """Yield the public methods and properties of a class, each with its first sentence."""
    for name in dir(found):
        member = inspect.getattr_static(found, name)
        asked = isinstance(member, (property, functools.cached_property))
        if not name.startswith("_") and (asked or inspect.isfunction(member)):
            text = (inspect.getdoc(member) or "").partition("\n\n")[0].replace("\n", " ")
            yield f"{name}{'' if asked else _own_call(member)}", text


def _own_call(member: Callable[..., Any]) -> str:
    return _call(member).replace("(self, ", "(").replace("(self)", "()")


# Equations


def equations(words: str) -> str:
    """Return equations of a scene by their names.

    words: PROBLEM [+EFFECT]…: NAMES, with "; " between names. Raises ValueError for a name that the scene has not.
    """
    head, _, names = words.partition(": ")
    every = _equations(head)
    wanted = names.split("; ")
    missing = [name for name in wanted if name not in {each.name for each in every}]
    if missing:
        raise ValueError(f"{head} has no equation {missing[0]!r}: it has {sorted({each.name for each in every})}")
    return _raw(mathml.page([each for each in every if each.name in wanted]))


def all_equations(problem: str) -> str:
    """Return every equation of a scene."""
    return _raw(mathml.page(_equations(problem)))


@functools.cache
def _equations(head: str) -> list[Equation]:
    problem, *on = head.split(" +")
    found = registry.load(problem)
    for name in on:
        found = found.with_effect(name)
    return list(found.equations())


def _raw(markup: str) -> str:
    return f"```{{raw}} html\n{markup}\n```\n"


def effects(job: str) -> str:
    """Return each effect of a job: what its file says of it, and its equation in a packaged scene."""
    found, parts = _scene(job), []
    for effect in found.schema.effects.values():
        text = _module(effect)
        own = _own_equations(found, effect.name)
        parts.append(f"### {effect.name}\n\n{_told(text)}\n\n{_raw(mathml.page(own)) if own else ''}")
    return "\n".join(parts)


def _own_equations(found: Scene, name: str) -> list[Equation]:
    from loomopt.base.errors import BadInput

    try:
        return [each for each in found.with_effect(name).equations() if each.name.partition(":")[0] == name]
    except BadInput:  # one without values, or which does not combine
        return []


def _module(effect: Any) -> str:
    """Return what the file of an effect says."""
    for value in (getattr(effect, "force", None), effect.own, *getattr(effect, "quantities", {}).values()):
        place = getattr(value, "__module__", "")
        if ".effects." in place and place.rpartition(".")[2] == effect.name.partition(".")[0]:
            return inspect.getdoc(importlib.import_module(place)) or effect.summary
    return str(effect.summary)


def _told(text: str) -> str:
    """Return a docstring as Markdown: lines set in from the margin are shown as they stand."""
    parts = []
    for part in text.split("\n\n"):
        lines = part.split("\n")
        if all(line.startswith("    ") for line in lines):
            parts.append("```text\n" + "\n".join(line[4:] for line in lines) + "\n```")
        elif any(line.startswith("    ") for line in lines):
            first = [line for line in lines if not line.startswith("    ")]
            rest = [line[4:] for line in lines if line.startswith("    ")]
            parts.append(_plain(" ".join(first)) + "\n\n```text\n" + "\n".join(rest) + "\n```")
        else:
            parts.append(_plain(" ".join(lines)))
    return "\n\n".join(parts)


def module(name: str) -> str:
    """Return what a module says of itself."""
    return _told(inspect.getdoc(importlib.import_module(name)) or "")


def notebooks(words: str) -> str:
    """Return the notebooks as pages below this one, in the order in which its table has them."""
    told = re.findall(r"\]\((\w+)\.ipynb\)", (run.FOLDER / "README.md").read_text(encoding="utf-8"))
    return "\n".join(["```{toctree}", ":hidden:", *told, "```", ""])


KINDS: dict[str, Callable[[str], str]] = {
    "commands": commands,
    "scene": scene,
    "function": function,
    "equations": equations,
    "allequations": all_equations,
    "effects": effects,
    "module": module,
    "notebooks": notebooks,
}


def expanded(text: str) -> str:
    """Return a page with what is generated in it."""
    return MARK.sub(lambda match: KINDS[match[1]](match[2]), text)


# Sphinx


def _read(app: Sphinx, name: str, source: list[str]) -> None:
    path = app.env.doc2path(name)
    if path.suffix == ".ipynb":
        source[0] = nbformat.writes(run.kept(Path(path)))
    else:
        source[0] = expanded(source[0])


def _run_all(app: Sphinx) -> None:
    with ThreadPoolExecutor(WORKERS) as pool:
        list(pool.map(run.kept, run.paths()))


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(_mathml(node.astext()))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(f'<div class="equation">{_mathml(node.astext(), as_block=True)}</div>')
    raise nodes.SkipNode


def _mathml(latex: str, as_block: bool = False) -> str:
    """Return LaTeX as MathML; what docutils does not know is set in rows that it does."""
    known = latex.replace("gathered", "aligned").replace(r"\\[4pt]", r"\\ ")
    return str(latex2mathml.tex2mathml(known, as_block=as_block))


def _state() -> str:
    """Return what pages depend on beside their own text."""
    return run.program() + "".join(path.read_text(encoding="utf-8") for path in (Path(__file__), Path(write.__file__)))


def _without_empty_outputs(app: Sphinx, tree: nodes.document) -> None:
    """Leave out what progress has left of itself: an empty line."""
    for block in [each for each in tree.findall(nodes.literal_block) if not each.astext().strip()]:
        block.parent.remove(block)


def setup(app: Sphinx) -> dict[str, Any]:
    """Have Sphinx take part of its pages from the program."""
    app.add_config_value("program", _state(), "env")  # another program: all pages are read again
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("builder-inited", _run_all)
    app.connect("source-read", _read)
    app.connect("doctree-read", _without_empty_outputs)
    return {"version": hashlib.sha256(_state().encode()).hexdigest()[:8], "parallel_read_safe": True}
