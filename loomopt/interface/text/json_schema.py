"""The JSON Schema of a job's scenes, by which editors complete and check TOML: from the models that read a scene."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from loomopt.base.quantities import NUMBER_PATTERN, QUANTITY_PATTERN, Quantity, foreign, message_schema, quantity_of
from loomopt.base.units import DISPLAY_UNIT
from loomopt.physics.effects.kinds import Effect, Load, required
from loomopt.physics.schema import Table
from loomopt.scenes.display import KINDS
from loomopt.scenes.iso_fits import PATTERN as FIT_PATTERN
from loomopt.scenes.scene import TABLES
from loomopt.scenes.tables import FAMILY, Problem, SceneSchema
from loomopt.scenes.tolerance_classes import CLASSES
from loomopt.scenes.tolerances import FORMS, SPREADS

Json = dict[str, Any]
DIALECT = "https://json-schema.org/draft/2020-12/schema"
_NAME = r"^[^\s!-,./:-@\[-`{-~_-][^\s!-,./:-@\[-^`{-~]{0,63}$"
"""A scene's name: as its reader has it, in words that every dialect of patterns understands alike."""


_VALUE: Json = {"type": ["number", "string"]}
"""A quantity whose kind follows from the scene, in text with its unit, or a pure number."""
_TABLES: Json = {"type": "object", "additionalProperties": {"type": "object"}}
NAMED_BY_SCENE: Mapping[str, Json] = {
    "mechanism": {"type": "object", "additionalProperties": _VALUE},
    "effects": _TABLES,
    "available": _TABLES,
    "bounds": {"type": "object", "additionalProperties": {"type": ["number", "string", "object"]}},
    "limits": {"type": "object", "additionalProperties": {"type": "object", "minProperties": 1}},
    "tolerances": {"type": "object", "additionalProperties": {"type": ["number", "string", "object"]}},
    "accept": {"type": "object", "additionalProperties": {"type": ["number", "string", "object"]}},
    "steps": {"type": "object", "additionalProperties": {"type": ["number", "string", "object"]}},
    "stock": {"type": "object", "additionalProperties": {"type": ["array", "object"], "minItems": 1}},
}
"""Tables whose keys follow from the scene where its job reads further tables; those of effects may be inside others."""


def scene(schema: SceneSchema) -> Json:
    """JSON Schema (draft 2020-12) of a job's scenes."""
    makers: Mapping[str, Callable[[SceneSchema], Json]] = {
        "problem": _problem,
        "operation": lambda of: _model(of.operation),
        "mechanism": _mechanism,
        "effects": _effects,
        "available": _effects,
        "bounds": _bounds,
        "limits": _limits,
        "tolerances": _tolerances,
        "accept": _accept,
        "steps": lambda of: _by_number(of, lambda quantity: _quantity(Quantity(quantity.kind, above=0))),
        "stock": lambda of: _by_number(of, _stock),
        "display": display,
        "targets": lambda of: _closed_table(
            {name: _model(target.table, target.text) for name, target in of.targets.items()}
        ),
    }
    tables = {name: makers[name](schema) for name in TABLES}
    if schema.tables:  # numbers, figures and targets are then named by the scene
        tables |= {**NAMED_BY_SCENE, "targets": _scene_targets(schema)}
    tables |= {name: described() for name, described in schema.tables.items()}
    whole = _closed_table(tables, [name for name, table in tables.items() if table.get("required")])
    rules = [_given(need) for need in schema.needs]
    rules += [_given(key, effect) for effect in schema.effects.values() for key in effect.needs]
    document: Json = {"$schema": DIALECT, "title": f"A loomopt scene: {schema.title}", **whole}
    return _hoist_quantities(document | ({"allOf": rules} if rules else {}))


def display(schema: SceneSchema) -> Json:
    """Schema of [display]: a unit for each kind of quantity."""
    return _closed_table({key: _unit(kind) for key, kind in KINDS.items()})


def _unit(kind: str) -> Json:
    description = f'a unit of {kind} such as "{DISPLAY_UNIT[kind]}"'
    known = {"type": "string", "not": {"pattern": rf"^[ \t]*(?:{foreign(kind)})[ \t]*$"}}
    return {"description": description, **message_schema(known, description)}


def _problem(schema: SceneSchema) -> Json:
    table = _model(Problem)
    table["properties"] |= {"job": {"const": schema.name}}
    name = table["properties"]["name"]
    del name["type"]
    name |= message_schema({"type": "string", "pattern": _NAME}, "a name of letters, digits, - and _, as of a file")
    return table


def _effects(schema: SceneSchema) -> Json:
    tables = {}
    for effect in schema.effects.values():
        table = _model(effect.table, effect.summary) | _either(effect)
        tables[effect.name] = {"type": "object", "additionalProperties": table} if effect.many else table
    return _closed_table(tables)


def _bounds(schema: SceneSchema) -> Json:
    """Schema of [bounds]: every number by its name, as a range or as one value."""
    return _by_number(schema, lambda quantity: _bound(_quantity(quantity)))


def _by_number(schema: SceneSchema, made: Callable[[Quantity], Json]) -> Json:
    """A table with a key for every number; made(quantity): schema of its value."""
    kinds: dict[str, list[Quantity]] = {}
    effects = [effect for effect in schema.effects.values() if not effect.many]
    for model in (schema.mechanism, schema.operation, *(effect.table for effect in effects)):
        for name in model.model_fields:
            if quantity := quantity_of(model, name):
                kinds.setdefault(name, []).append(quantity)
    for name, kind in schema.variables.items():
        kinds[name] = kinds.get(name, [Quantity(kind)])[:1]
    table = _closed_table({name: _any([made(quantity) for quantity in of]) for name, of in kinds.items()})
    if len(effects) < len(schema.effects):  # instances are named by the scene
        table["additionalProperties"] = {"type": "object"}
    return table


def _bound(value: Json) -> Json:
    free = {
        "enum": [True, False, "true", "false"],
        "description": "false: fixed at today's value, unless --free names it",
    }
    ends = _closed_table({"min": value, "max": value, "free": free}, ["min", "max"])
    return {"if": {"type": "object"}, "then": ends, "else": value}


def _tolerances(schema: SceneSchema) -> Json:
    """Schema of [tolerances]: the tolerance of every number, by its name."""
    return _by_number(schema, _tolerance)


def _tolerance(quantity: Quantity) -> Json:
    percent = {"type": "string", "pattern": rf"^[ \t]*{NUMBER_PATTERN} *%[ \t]*$"}
    half: Json = {"anyOf": [percent, _quantity(Quantity(quantity.kind, least=0))], "description": "half the band"}
    off: Json = {"anyOf": [percent, {"enum": ["0", 0]}, _quantity(Quantity(quantity.kind))]}
    positive, share = _quantity(Quantity("number", above=0)), _quantity(Quantity("number", least=0))
    keys = {
        "plus_minus": half,
        "plus": off | {"description": "upper deviation of an uneven band"},
        "minus": off | {"description": "lower deviation of an uneven band, as a positive number"},
        "class": {"enum": list(CLASSES), "description": "tolerance class of a length"},
        "fit": {
            "type": "string",
            "pattern": FIT_PATTERN,
            "description": "ISO 286 class of a hole or a shaft, such as H7",
        },
        "sigmas": positive | {"description": "standard deviations in plus_minus; 3 by default"},
        "spread": {"enum": list(SPREADS)},
        "group": {"type": "string", "description": "name of a group of correlated numbers"},
        "correlation": share | {"description": "correlation with the others of the group"},
    }
    exactly_one_form: Json = {"oneOf": [{"required": [form]} for form in FORMS]}
    pairs = (("group", "correlation"), ("plus", "minus"))
    together = {"dependentRequired": {a: [b] for pair in pairs for a, b in (pair, pair[::-1])}}
    return {"if": {"type": "object"}, "then": _closed_table(keys) | exactly_one_form | together, "else": half}


def _accept(schema: SceneSchema) -> Json:
    """Schema of [accept]: half the acceptance band around an equality or a goal, by figure."""
    figures = schema.figures.values()
    return _closed_table({figure.name: _quantity(Quantity(figure.kind, above=0)) for figure in figures})


def _stock(quantity: Quantity) -> Json:
    return {"type": "array", "minItems": 1, "items": _quantity(Quantity(quantity.kind, above=0))}


def _limits(schema: SceneSchema) -> Json:
    """Schema of [limits]: every figure that can be limited, with the sides that can be limited."""
    figures = [figure for figure in schema.figures.values() if figure.sides]
    sides = {figure.name: dict.fromkeys(figure.sides, _quantity(Quantity(figure.kind))) for figure in figures}
    descriptions = {figure.name: figure.text for figure in figures}
    return _closed_table(
        {
            name: _closed_table(of) | {"minProperties": 1, "description": descriptions[name]}
            for name, of in sides.items()
        }
    )


def _either(effect: Effect) -> Json:
    """Rule that a load has either a table of its curve or the numbers that the table replaces."""
    curve = effect.tabulated if isinstance(effect, Load) else None
    if curve is None:
        return {}
    return _alternative(curve.key, curve.instead, [key for key in required(effect) if key in curve.instead])


def _alternative(key: str, instead: Sequence[str], needed: Sequence[str]) -> Json:
    """Rule that a table has either one key or the keys that it replaces; needed: those of them without a default."""
    others: Json = {"anyOf": [{"required": [name]} for name in instead]}
    return {"anyOf": [{"required": [key], "not": others}, {"required": list(needed), "not": {"required": [key]}}]}


def _mechanism(schema: SceneSchema) -> Json:
    """Schema of [mechanism], with the rule for keys that replace others."""
    rules = [_alternative(key, instead, instead) for key, instead in schema.instead.items()]
    return _model(schema.mechanism) | ({"allOf": rules} if rules else {})


def _given(key: str, effect: Effect | None = None) -> Json:
    """Rule that a key is given; effect: where that is on, always without one."""
    table = next(table for table in TABLES if key.startswith(f"{table}."))
    then = {"required": [table], "properties": {table: {"required": [key.removeprefix(f"{table}.")]}}}
    if not effect:
        return then
    on: Json = {"required": [effect.name]}
    if isinstance(effect, Load) and effect.tabulated and key in effect.tabulated.needless:
        on |= {"properties": {effect.name: {"not": {"required": [effect.tabulated.key]}}}}
    return {"if": {"required": ["effects"], "properties": {"effects": on}}, "then": then}


def _scene_targets(schema: SceneSchema) -> Json:
    """Schema of [targets] where the scene names them: a target follows one of the models of the job."""
    models = _any([_model(target.table) for name, target in schema.targets.items() if name != FAMILY])
    family = {FAMILY: _model(schema.targets[FAMILY].table)} if FAMILY in schema.targets else {}
    return {"type": "object", "properties": family, "additionalProperties": models}


def _closed_table(properties: Mapping[str, Json], required: list[str] | None = None) -> Json:
    """A table without further keys."""
    table: Json = {"type": "object", "additionalProperties": False, "properties": dict(properties)}
    return table | ({"required": required} if required else {})


def _any(schemas: list[Json]) -> Json:
    different = [option for place, option in enumerate(schemas) if option not in schemas[:place]]
    return different[0] if len(different) == 1 else {"anyOf": different}


def _quantity(quantity: Quantity) -> Json:
    return quantity.schema()


def _model(model: type[Table], summary: str = "") -> Json:
    """Schema of a table by its model; summary: description from its job."""
    table = _without_null(model.model_json_schema())
    return table | ({"description": summary} if summary else {})


def _map_values(part: Json, change: Callable[[Json], Json]) -> Json:
    """A schema with all schemas inside it changed."""

    def inner(value: object) -> object:
        if isinstance(value, list):
            return [inner(item) for item in value]
        return change(value) if isinstance(value, dict) else value

    return {key: inner(value) for key, value in part.items()}


def _without_null(part: Json) -> Json:
    """Part of a schema without null, which TOML does not have."""
    reduced = _map_values(
        {key: value for key, value in part.items() if key != "default" or value is not None}, _without_null
    )
    if "anyOf" in reduced:
        rest = [option for option in reduced.pop("anyOf") if option != {"type": "null"}]
        reduced = {**rest[0], **reduced} if len(rest) == 1 else {**reduced, "anyOf": rest}
    return reduced


def _hoist_quantities(whole: Json) -> Json:
    """Schema with a single definition of each kind of quantity, in $defs; the keys have their descriptions.

    Defaults are left out: they are SI numbers, and a scene has text with a unit.
    """
    kinds: dict[str, Json] = {}

    def hoist(part: Json) -> Json:
        if "$defs" in part:  # models inside a model: references name them at the root
            kinds.update({name: hoist(definition) for name, definition in part["$defs"].items()})
            part = {key: value for key, value in part.items() if key != "$defs"}
        if QUANTITY_PATTERN not in part:
            return _map_values(part, hoist)
        description: Json = {key: part[key] for key in ("description",) if key in part}
        name = re.sub(r"\W+", "_", part[QUANTITY_PATTERN])
        kinds.setdefault(
            name,
            {
                key: value
                for key, value in part.items()
                if key not in (QUANTITY_PATTERN, "title", "default", *description)
            },
        )
        return {"$ref": f"#/$defs/{name}", **description}

    return {**hoist(whole), "$defs": kinds}
