"""Parts of the site that come from the program: commands, keys of scenes, functions, equations, and run notebooks.

A line `<!-- generated KIND WORDS -->` of a page is replaced by the Markdown of `KINDS[KIND](WORDS)`
when Sphinx reads the page, so that the site always agrees with the program.
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
"""Number of notebooks that run at once, one kernel per notebook."""


# Commands


def commands(words: str) -> str:
    """All commands with their options, from their help."""
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
    """Text with Markdown and HTML escaped, except in backquotes."""
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(part if part.startswith("`") else re.sub(r"([\\*_<>\[\]$#{}])", r"\\\1", part) for part in parts)


# Scenes


USER_NAMES = (
    "The scene chooses the names of dimensions and parts: [parts and their keys](linkages.md). Further tables: {}."
)
EFFECTS = (
    "## [effects.NAME], [available.NAME]\n\n"
    "An effect in `[effects]` is on. An effect in `[available]` is off; `--with NAME` switches it on.\n"
)
ACCEPT = (
    "## [accept]\n\nFigure → half the band around an equality or a goal in which manufactured machines are accepted.\n"
)


NEEDED = "needed"
"""Key among the definitions of a schema under which it is stored who needs which key."""


def scene(job: str) -> str:
    """Tables of a job's scenes, key by key, from the JSON Schema for editors."""
    schema = _scene(job).schema
    free = bool(schema.tables)  # a job in which the scene chooses the names
    full = json_schema.scene(dataclasses.replace(schema, tables={}) if free else schema)
    tables, known = full["properties"], full["$defs"] | {NEEDED: _needed(schema)}
    parts = [USER_NAMES.format(_listed(schema.tables))] if free else []
    parts += [
        _table("problem", tables["problem"], known),
        _table("operation", tables["operation"], known),
        "" if free else _table("mechanism", tables["mechanism"], known),
        EFFECTS,
        *(_table(f"effects.{name}", table, known, 3) for name, table in tables["effects"]["properties"].items()),
        _ranges(
            "bounds", "Numbers that may change, with a range, or a fixed value.", tables["bounds"], known, not free
        ),
        _figures(schema.figures, free),
        _ranges("tolerances", "Scatter of a number.", tables["tolerances"], known, not free),
        ACCEPT,
        _table("display", tables["display"], known),
        *([] if free else [_targets(schema, tables["targets"], known)]),
    ]
    return "\n".join(parts)


def _needed(schema: Any) -> dict[str, str]:
    """Text that says who needs a key, by key that the job or some of its effects need."""
    names = dict.fromkeys(schema.needs, "")
    for effect in schema.effects.values():
        for key in effect.needs:
            if names.get(key) != "":
                names[key] = ", ".join(filter(None, [names.get(key), effect.name]))
    return {key: f"needed by {effects}" if effects else "" for key, effects in names.items()}


def _scene(job: str) -> Scene:
    return registry.load(write.SHOWN.get(job, job))


def _listed(names: Any) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _table(name: str, table: Mapping[str, Any], known: Mapping[str, Any], level: int = 2) -> str:
    """One table: keys, their meaning, and their allowed values."""
    if "properties" not in table and isinstance(table.get("additionalProperties"), dict):
        name, table = f"{name}.NAME", table["additionalProperties"]  # a table of tables
    rows = list(_keys(table, known, of=f"{name}."))
    head = f"{'#' * level} [{name}]\n\n{_sentence(table.get('description', ''))}\n"
    if not rows:
        return f"{head}\nNo values of its own.\n" if level > 2 else head
    lines = "\n".join(f"| `{key}` | {_cell(_plain(meaning))} | {_cell(_plain(form))} |" for key, meaning, form in rows)
    return f"{head}\n| key | what it is | allowed values |\n| --- | --- | --- |\n{lines}\n"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:].rstrip('.')}." if text else ""


def _keys(
    table: Mapping[str, Any], known: Mapping[str, Any], path: str = "", of: str = ""
) -> Iterator[tuple[str, str, str]]:
    for key, value in table.get("properties", {}).items():
        whole = {**known.get(value.get("$ref", "").rpartition("/")[2], {}), **value}
        if "properties" in whole:
            yield from _keys(whole, known, f"{path}{key}.")
            continue
        needed = "" if key in table.get("required", ()) else known[NEEDED].get(of + path + key, "optional")
        if value.get("default"):
            needed = f"default {value['default']!r}"
        form = ", ".join(filter(None, [_form(whole, known), needed]))
        description = whole.get("description", "")
        yield f"{path}{key}", "" if description == _form(whole, known) else description, form


def _form(value: Mapping[str, Any], known: Mapping[str, Any]) -> str:
    """Text on the allowed values of a key."""
    if "else" in value and "const" in value["else"]:
        return str(value["else"]["const"])
    if "$ref" in value:
        return _form(known[value["$ref"].rpartition("/")[2]], known)
    if "const" in value:
        return f'"{value["const"]}"'
    if "enum" in value:
        return " or ".join(f'"{choice}"' for choice in value["enum"])
    for several in ("anyOf", "oneOf"):
        choices = [choice for choice in value.get(several, ()) if "required" not in choice and "not" not in choice]
        forms = [_form(choice, known) for choice in choices]
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
    """Table with the same keys for every number."""
    first = next(iter(table["properties"].values()))
    rows = [
        f"| `{key}` | {_cell(_plain(meaning))} | {_cell(_plain(form.replace(', optional', '')))} |"
        for key, meaning, form in _keys(first.get("then", {}), known)
    ]
    names = f"Numbers: {_listed(table['properties'])}.\n" if listed else ""
    head = f"## [{name}]\n\n{text} Keys of each number, such as `{next(iter(table['properties']))}`:\n\n"
    return head + "| key | what it is | allowed values |\n| --- | --- | --- |\n" + "\n".join(rows) + f"\n\n{names}"


def _figures(figures: Mapping[str, Any], free: bool) -> str:
    """Table [limits]; free: whether the scene chooses the names."""
    lines = [
        f"| `{figure.name}` | {_cell(_plain(figure.text))} | {' '.join(f'`{side}`' for side in figure.sides)} |"
        for figure in figures.values()
        if figure.sides
    ]
    more = " The table has the figures of the packaged `sixbar-sley`." if free else ""
    head = f'## [limits]\n\nLimits of figures, with units: `swing = {{ min = "22.9 deg" }}`.{more}\n\n'
    return head + "| figure | what it is | ends |\n| --- | --- | --- |\n" + "\n".join(lines) + "\n"


def _targets(schema: Any, tables: Mapping[str, Any], known: Mapping[str, Any]) -> str:
    parts = [f"## [targets.NAME]\n\nThe default target is `{schema.default_target}`.\n"]
    return "\n".join(
        [*parts, *(_table(f"targets.{name}", table, known, 3) for name, table in tables["properties"].items())]
    )


# Python


def function(name: str) -> str:
    """Call and docstring of a public function; for a class also its public names."""
    public = getattr(lo, name)
    call = "" if inspect.isclass(public) else _call(public)
    lines = [f"```text\nlo.{name}{call}\n```", "", _paragraphs(inspect.getdoc(public) or "")]
    if inspect.isclass(public) and not issubclass(public, Exception):
        lines += ["", "| name | what it is |", "| --- | --- |"]
        lines += [f"| `{member}` | {_cell(_plain(text))} |" for member, text in _members(public)]
    return "\n".join(lines) + "\n"


def _call(function: Callable[..., Any]) -> str:
    """Parameters of a function without their types."""
    parameters = inspect.signature(function).parameters.values()
    return str(inspect.Signature([p.replace(annotation=inspect.Parameter.empty) for p in parameters]))


def _paragraphs(text: str) -> str:
    return "\n\n".join(_section(part) for part in text.split("\n\n"))


def _section(part: str) -> str:
    """Paragraph of a docstring; a NumPy section becomes a title with a list of its entries, examples become code."""
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


def _members(public: type) -> Iterator[tuple[str, str]]:
    """Yield the public methods and properties of a class, with the first sentence of their docstrings."""
    for name in dir(public):
        member = inspect.getattr_static(public, name)
        is_property = isinstance(member, (property, functools.cached_property))
        if not name.startswith("_") and (is_property or inspect.isfunction(member)):
            text = (inspect.getdoc(member) or "").partition("\n\n")[0].replace("\n", " ")
            call = "" if is_property else _call(member).replace("(self, ", "(").replace("(self)", "()")
            yield f"{name}{call}", text


# Equations


def equations(words: str) -> str:
    """Equations of a scene by their names.

    words: PROBLEM [+EFFECT]…: NAMES, with "; " between names. Raises ValueError for an unknown name.
    """
    head, _, names = words.partition(": ")
    all_of_scene, wanted = _equations(head), names.split("; ")
    known = {equation.name for equation in all_of_scene}
    missing = [name for name in wanted if name not in known]
    if missing:
        raise ValueError(f"{head} has no equation {missing[0]!r}: it has {sorted(known)}")
    return _raw(mathml.page([equation for equation in all_of_scene if equation.name in wanted]))


def all_equations(problem: str) -> str:
    """All equations of a scene."""
    return _raw(mathml.page(_equations(problem)))


@functools.cache
def _equations(head: str) -> list[Equation]:
    problem, *on = head.split(" +")
    scene = registry.load(problem)
    for name in on:
        scene = scene.with_effect(name)
    return list(scene.equations())


def _raw(markup: str) -> str:
    return f"```{{raw}} html\n{markup}\n```\n"


def effects(job: str) -> str:
    """Effects of a job: docstring of the module, and equation in a packaged scene."""
    scene, parts = _scene(job), []
    for effect in scene.schema.effects.values():
        text = _docstring_markdown(_module_docstring(effect))
        equations = _effect_equations(scene, effect.name)
        parts.append(f"### {effect.name}\n\n{text}\n\n{_raw(mathml.page(equations)) if equations else ''}")
    return "\n".join(parts)


def _effect_equations(scene: Scene, name: str) -> list[Equation]:
    """Equations of one effect in a scene."""
    from loomopt.base.errors import BadInput

    try:
        equations = scene.with_effect(name).equations()
        return [equation for equation in equations if equation.name.partition(":")[0] == name]
    except BadInput:  # an effect without values, or with a clash
        return []


def _module_docstring(effect: Any) -> str:
    """Docstring of the module of an effect."""
    for value in (getattr(effect, "force", None), effect.table, *getattr(effect, "quantities", {}).values()):
        place = getattr(value, "__module__", "")
        if ".effects." in place and place.rpartition(".")[2] == effect.name.partition(".")[0]:
            return inspect.getdoc(importlib.import_module(place)) or effect.summary
    return str(effect.summary)


def _docstring_markdown(text: str) -> str:
    """A docstring as Markdown; indented lines become code."""
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
    """Docstring of a module."""
    return _docstring_markdown(inspect.getdoc(importlib.import_module(name)) or "")


def notebooks(words: str) -> str:
    """Notebooks as pages below this one, in the order of the table of their README."""
    names = re.findall(r"\]\((\w+)\.ipynb\)", (run.FOLDER / "README.md").read_text(encoding="utf-8"))
    return "\n".join(["```{toctree}", ":hidden:", *names, "```", ""])


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


def expand(text: str) -> str:
    """A page with its generated parts."""
    return MARK.sub(lambda match: KINDS[match[1]](match[2]), text)


# Sphinx


def _read(app: Sphinx, name: str, source: list[str]) -> None:
    path = app.env.doc2path(name)
    if path.suffix == ".ipynb":
        source[0] = nbformat.writes(run.stored_run(Path(path)))
    else:
        source[0] = expand(source[0])


def _run_all(app: Sphinx) -> None:
    with ThreadPoolExecutor(WORKERS) as pool:
        list(pool.map(run.stored_run, run.paths()))


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(_mathml(node.astext()))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(f'<div class="equation">{_mathml(node.astext(), as_block=True)}</div>')
    raise nodes.SkipNode


def _mathml(latex: str, as_block: bool = False) -> str:
    """LaTeX as MathML; environments that docutils does not know are replaced."""
    known = latex.replace("gathered", "aligned").replace(r"\\[4pt]", r"\\ ")
    return str(latex2mathml.tex2mathml(known, as_block=as_block))


def _state() -> str:
    """Text of all that the pages depend on besides themselves."""
    return run.program() + "".join(path.read_text(encoding="utf-8") for path in (Path(__file__), Path(write.__file__)))


def _without_empty_outputs(app: Sphinx, tree: nodes.document) -> None:
    """Remove the empty outputs that progress leaves in notebooks."""
    empty = [block for block in tree.findall(nodes.literal_block) if not block.astext().strip()]
    for block in empty:
        block.parent.remove(block)


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect the generated parts with Sphinx."""
    app.add_config_value("program", _state(), "env")  # another program: all pages are read again
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    app.connect("builder-inited", _run_all)
    app.connect("source-read", _read)
    app.connect("doctree-read", _without_empty_outputs)
    return {"version": hashlib.sha256(_state().encode()).hexdigest()[:8], "parallel_read_safe": True}
