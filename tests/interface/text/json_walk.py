"""A JSON Schema applied to data by hand: what of draft 2020-12 the scenes' schemas use, and nothing else."""

import re

TYPES: dict[str, type | tuple[type, ...]] = {
    "object": dict,
    "array": list,
    "string": str,
    "integer": int,
    "boolean": bool,
    "number": (int, float),
}
KNOWN = {
    *(
        "$schema",
        "$defs",
        "$ref",
        "title",
        "description",
        "default",
        "type",
        "enum",
        "const",
        "pattern",
        "not",
        "anyOf",
    ),
    *("allOf", "if", "then", "else", "properties", "required", "additionalProperties", "items", "minItems", "maxItems"),
    *("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "minProperties", "maxProperties"),
    *("oneOf", "propertyNames", "uniqueItems"),
}


def valid(schema, data, root=None):
    """Say whether data keeps a schema. Raises ValueError for a key that is not known here."""
    root = root or schema
    if schema in (True, {}):
        return True
    if set(schema) - KNOWN:
        raise ValueError(f"not known here: {set(schema) - KNOWN}")

    def keeps(part):
        return valid(part, data, root)

    if "$ref" in schema and not keeps(root["$defs"][schema["$ref"].removeprefix("#/$defs/")]):
        return False
    if isinstance(schema.get("type"), list):
        return any(valid({**schema, "type": item}, data, root) for item in schema["type"])
    kind = TYPES.get(schema.get("type", ""), object)
    if not isinstance(data, kind) or (isinstance(data, bool) and schema.get("type") in ("integer", "number")):
        return False
    if "oneOf" in schema and sum(map(keeps, schema["oneOf"])) != 1:
        return False
    if "enum" in schema and data not in schema["enum"]:
        return False
    if "const" in schema and data != schema["const"]:
        return False
    if ("not" in schema and keeps(schema["not"])) or not all(map(keeps, schema.get("allOf", []))):
        return False
    if "anyOf" in schema and not any(map(keeps, schema["anyOf"])):
        return False
    if "if" in schema and not keeps(schema.get("then" if keeps(schema["if"]) else "else", {})):
        return False
    return _inside(schema, data, root)


def _inside(schema, data, root):
    """Say whether data of some type keeps what a schema says of that type."""
    if isinstance(data, str):
        return re.search(schema.get("pattern", ""), data) is not None
    if isinstance(data, list):
        size = schema.get("minItems", 0) <= len(data) <= schema.get("maxItems", len(data))
        size = size and not (schema.get("uniqueItems") and any(item in data[:k] for k, item in enumerate(data)))
        return size and all(valid(schema.get("items", {}), item, root) for item in data)
    if isinstance(data, dict):
        values, others = schema.get("properties", {}), schema.get("additionalProperties", {})
        rest = [value for name, value in data.items() if name not in values]
        return (
            set(schema.get("required", ())) <= set(data)
            and schema.get("minProperties", 0) <= len(data) <= schema.get("maxProperties", len(data))
            and all(valid(schema.get("propertyNames", {}), name, root) for name in data)
            and all(valid(values[name], value, root) for name, value in data.items() if name in values)
            and (not rest if others is False else all(valid(others, value, root) for value in rest))
        )
    if isinstance(data, int | float) and not isinstance(data, bool):
        high, above = schema.get("exclusiveMaximum", data + 1), schema.get("exclusiveMinimum", data - 1)
        return schema.get("minimum", data) <= data <= schema.get("maximum", data) and above < data < high
    return True
