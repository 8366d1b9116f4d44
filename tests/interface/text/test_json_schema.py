"""The JSON Schema of a scene: it takes every scene that the program takes, and refuses what it refuses and can see."""

import functools
import json
import re
import tomllib
from typing import Any

import json_walk
import pytest
from support import inch
from support.jobs import scene_of

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.base.quantities import Quantity, foreign, pattern_schema, read
from loomopt.base.units import DISPLAY_UNIT, SI_UNIT, fits
from loomopt.interface.cli.app import run
from loomopt.interface.text import json_schema
from loomopt.jobs import registry
from loomopt.scenes import packaged
from loomopt.scenes.scene import TABLES

JOBS = registry.builtin_names()
SCENES = {name: tomllib.loads(path.read_text("utf-8")) for name, path in packaged.problems().items()}
TEMPLATES = {f"template of {name}": tomllib.loads(registry.template(name)) for name in JOBS}
INCHES = {f"{name} in inches": inch.scene(scene_of(name)).document for name in JOBS}
ALL = SCENES | TEMPLATES | INCHES


@functools.cache
def of(job):
    return json_schema.scene(registry.declared(job))


def is_valid(data):
    """Return what the schema says of a scene; where the package of that name is installed it must say the same."""
    result = json_walk.valid(of("beatup") if "job" not in data["problem"] else of(data["problem"]["job"]), data)
    try:
        import jsonschema
    except ImportError:
        return result
    checker = jsonschema.Draft202012Validator(of(data["problem"]["job"]))
    assert checker.is_valid(data) == result
    return result


def changed(data, key, value):
    """Return raw tables with a dotted key changed, or taken out where its value is None."""
    first, _, rest = key.partition(".")
    if rest:
        return {**data, first: changed(data.get(first, {}), rest, value)}
    return {name: item for name, item in data.items() if name != first} | ({} if value is None else {first: value})


def taken(data):
    """Say whether the program takes a scene."""
    try:
        lo.scene(data)
    except BadInput:
        return False
    return True


@pytest.mark.parametrize("name", ALL)
def test_every_packaged_scene_and_template_is_valid(name):
    assert taken(ALL[name])
    assert is_valid(json.loads(json.dumps(ALL[name])))


GOOD: dict[str, list[Any]] = {
    "mechanism.l1": ["0.5 mm", "1e-2 m", "1.22 in", "  31mm ", "0.000154 furlong", "31 mm^2/mm"],
    "operation.speed": ["600 turn/min", "62.8 rad/s", "3600 deg/s"],
    "operation.M0": ["745 N·m", "6594 lbf*in", "0.745 kN*m", "+7.45e2 N*m", "0 N*m", "745 J"],
    "bounds.l1": ["30 mm", {"min": "30 mm", "max": "35 mm", "free": False}, {"min": "1.2 in", "max": "35 mm"}],
    "bounds.J4": [{"min": "0.5 kg*m^2", "max": "0.7 kg*m²", "free": "false"}],
    "limits.swing": [{"max": "0.41 rad"}, {"min": "20 deg", "max": "0.41 rad"}],
    "targets.retrofit.weights": [{"l1": 1, "l2": "3/2", "l3": 0.5}],
    "problem.name": ["müller-2"],
}
BAD: dict[str, list[Any]] = {
    "mechanism.l1": ["31", 31, "31 kg", "31 N*m", "31 N/m", "-31 mm", "0 mm", "0e5 mm", "31,5 mm", "mm", "", None, {}],
    "mechanism.l5": ["31 mm"],
    "mechanism.m4e": ["-1 kg", "1 lbf"],
    "operation.speed": ["10 Hz", "600", "600 1/min", None],
    "operation.M0": ["745 N/m", "745 Nm", "7450 Ncm", None, ["745 N*m"]],
    "bounds.l1": [{"min": "30 mm"}, {"min": "30 mm", "max": "35 kg"}, {"min": "1 mm", "max": "2 mm", "fre": True}, 30],
    "bounds.q": ["1 mm"],
    "limits.mu_min": [{"max": "50 deg"}, {}, "50 deg", {"min": "50 mm"}],
    "limits.change": [{"max": 1}],
    "effects.gravity": [{"tilt": "1 deg"}, {"tilt": "1 deg", "offset": "0 deg", "g": "1"}],
    "effects.gravty": [{}],
    "effects.rod_inertia": [{"m2": "1 kg", "s2": "1 mm", "model": "lumpd"}],
    "targets.balanse": [{}],
    "targets.retrofit.weights": [{"l1": -1}, {"l1": "2 mm"}],
    "problem.job": ["press"],
    "problem.name": ["a b", "-a", ""],
    "problem.title": [None],
    "tolerance": [{}],
}


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in GOOD.items() for value in values])
def test_what_the_program_takes_is_valid(key, value):
    data = changed(SCENES["beatup"], key, value)
    assert taken(data)
    assert is_valid(data)


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in BAD.items() for value in values])
def test_what_the_program_refuses_and_a_schema_can_see_is_not_valid(key, value):
    data = changed(SCENES["beatup"], key, value)
    assert not taken(data)
    if key == "problem.job":
        assert not json_walk.valid(of("beatup"), data)
    else:
        assert not is_valid(data)


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in BAD.items() for value in values])
def test_what_an_editor_says_is_a_sentence(key, value):
    jsonschema = pytest.importorskip("jsonschema")
    data = changed(SCENES["beatup"], key, value)
    for error in jsonschema.Draft202012Validator(of("beatup")).iter_errors(data):
        assert len(error.message) < 600, error.message
        assert "[0-9]" not in error.message
        assert "(?:" not in error.message


def test_what_an_editor_says_of_a_quantity_names_an_example():
    jsonschema = pytest.importorskip("jsonschema")
    data = changed(SCENES["beatup"], "mechanism.l1", "31 kg")
    (error,) = jsonschema.Draft202012Validator(of("beatup")).iter_errors(data)
    assert error.message == "'a length such as \"31 mm\", more than 0 mm' was expected"


def test_an_effect_asks_for_what_it_needs():
    short = changed(SCENES["beatup"], "effects.centrifugal", {})
    assert is_valid(short)
    assert not is_valid(changed(short, "mechanism.m4", None))


@pytest.mark.parametrize("kind", [kind for kind in SI_UNIT if kind != "number"])
def test_patterns_tell_kinds_apart_by_their_usual_units_as_the_program_does(kind):
    of_kind = pattern_schema(kind, *Quantity(kind)[1:], "")
    units = {*SI_UNIT.values(), *DISPLAY_UNIT.values(), *inch.UNITS.values(), "kN/mm", "lbf/in", "kg*mm^2"} - {"1"}
    for unit in units:
        right = {key: value for key, value in of_kind.items() if not key.startswith("x-")}
        assert json_walk.valid(right, f"1.5 {unit}") == fits(unit, kind), unit
    assert re.fullmatch(foreign(kind), SI_UNIT[kind]) is None
    assert read(f"1.5 {SI_UNIT[kind]}", kind) == 1.5


@pytest.mark.parametrize("job", JOBS)
def test_the_schema_speaks_of_every_table_and_describes_every_number(job):
    result = of(job)
    assert result["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    values = registry.declared(job).tables
    assert set(result["properties"]) == {*TABLES, *values}
    for table in ("operation",) if values else ("operation", "mechanism"):
        assert all(item["description"] for item in result["properties"][table]["properties"].values())
    text = json.dumps(result)
    assert {*re.findall(r'"#/\$defs/(\w+)"', text)} == {*result["$defs"]}
    assert "null" not in text


def test_display_takes_one_unit_of_each_kind():
    result = json_schema.display(registry.declared("beatup"))
    right = {"length": "in", "speed": "rpm", "stiffness": "lbf/in", "rotary_damping": "N*m*s/rad"}
    assert json_walk.valid(result, right)
    for wrong in ({"length": "kg"}, {"length": 1}, {"lenght": "in"}, {"stiffness": "N*m"}, {"angular_speed": "rpm"}):
        assert not json_walk.valid(result, wrong)


def test_the_command_prints_it_and_an_unknown_job_is_refused(capsys):
    assert run(["schema", "rapier"]) == 0
    assert json.loads(capsys.readouterr().out) == of("rapier")
    assert run(["schema", "rapir"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "rapier" in err
